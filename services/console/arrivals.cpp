// SPDX-License-Identifier: Apache-2.0
#include "services/console/arrivals.h"

#include "common/core/samples.h"
#include "common/service/monotonic_clock.h"

namespace zerodrift::services {
namespace {

// A quarter of a second of ten gyros at 5 kHz.
constexpr std::size_t kSamplesWait = 16384;
constexpr std::size_t kReferencesWait = 16384;
constexpr std::size_t kMessagesWait = 4096;
constexpr std::size_t kStatusesWait = 8192;

}  // namespace

template <typename Message>
Arrivals::Topic<Message>::Topic(service::Host& host, std::size_t capacity)
    : waiting(capacity),
      reader(
          host.participant(),
          [this](const Message& message, const dds::SampleOrigin&) { waiting.push(message); },
          host.observer()) {}

Arrivals::Arrivals(service::Host& host)
    : samples_(kSamplesWait),
      statuses_(kStatusesWait),
      sample_reader_(
          host.participant(),
          [this](const msg::CompensatedRate& message, const dds::SampleOrigin&) {
            if (!samples_.push({message, service::monotonic_ns()}))
              sample_overflow_.fetch_add(1, std::memory_order_relaxed);
          },
          host.observer()),
      status_reader_(
          host.participant(),
          [this](const msg::ServiceStatus& message, const dds::SampleOrigin& origin) {
            statuses_.push({.writer = origin.writer, .status = message});
          },
          host.observer(),
          [this](const auto& writer, dds::Departure) {
            statuses_.push({.writer = writer, .is_gone = true});
          }),
      references_(host, kReferencesWait),
      temperatures_(host, kMessagesWait),
      allan_(host, kMessagesWait),
      navigation_(host, kMessagesWait),
      twins_(host, kMessagesWait),
      coverage_(host, kMessagesWait),
      events_(host, kMessagesWait) {}

void Arrivals::drain_into(Gateway& gateway) {
  const std::int64_t unix_ns = service::unix_time_ns();
  const std::int64_t now_ns = service::monotonic_ns();
  for (const auto& message : temperatures_.waiting.take()) gateway.take(message, unix_ns);
  for (const auto& message : references_.waiting.take()) gateway.take(message);
  while (Sample* sample = samples_.front()) {
    const std::int64_t ago_ns = now_ns - sample->monotonic_ns;
    paced_ =
        core::is_paced_by_consumers(static_cast<core::ClockSource>(sample->message.clock_source()));
    gateway.take(sample->message, {unix_ns - ago_ns, sample->monotonic_ns});
    samples_.pop();
  }
  for (const auto& message : allan_.waiting.take()) gateway.take(message, unix_ns);
  for (const auto& message : navigation_.waiting.take()) gateway.take(message, unix_ns);
  for (const auto& message : twins_.waiting.take()) gateway.take(message, unix_ns);
  for (const auto& message : coverage_.waiting.take()) gateway.take(message, unix_ns);
  for (const auto& one : statuses_.take()) {
    if (one.is_gone) {
      gateway.take_gone(one.writer, unix_ns);
    } else {
      gateway.take(one.status, one.writer, {unix_ns, now_ns});
    }
  }
  for (const auto& message : events_.waiting.take()) gateway.take(message, unix_ns);
}

std::uint64_t Arrivals::overflow() const {
  return sample_overflow_ + references_.waiting.overflow() + temperatures_.waiting.overflow() +
         allan_.waiting.overflow() + navigation_.waiting.overflow() + twins_.waiting.overflow() +
         coverage_.waiting.overflow() + statuses_.overflow() + events_.waiting.overflow();
}

}  // namespace zerodrift::services
