// SPDX-License-Identifier: Apache-2.0
#include "common/replay/temperature_replay.h"

#include <chrono>
#include <optional>
#include <utility>

#include "common/dds/conversions.h"
#include "common/service/receipt.h"

namespace zerodrift::replay {
namespace {

using namespace std::chrono_literals;

constexpr auto kStopCheck = 100ms;
constexpr auto kReceiveWithin = 2000ms;
constexpr core::SensorTime kAhead = 10s;  // of what is needed, so that rates never wait for long
constexpr core::SensorTime kAfterTheEnd = 1h;  // beyond any rate sample of the record
constexpr std::uint64_t kInFlight = 256;  // readings of one probe; half the history kept for it

}  // namespace

TemperatureReplay::TemperatureReplay(service::Host& host, std::uint32_t gyro_id,
                                     const std::string& speed, std::vector<std::string> wait_for)
    : host_(host),
      gyro_id_(gyro_id),
      pacer_(host.participant(), gyro_id, std::move(wait_for)),
      clock_(service::parse_speed(speed)) {}

void TemperatureReplay::publish(const ThermalSource& source, const std::atomic<bool>& stopping) {
  try {
    publish_all(source, stopping);
  } catch (...) {
    // What was published before is still good.
    wait_for_receipts(stopping);
    throw;
  }
}

void TemperatureReplay::publish_all(const ThermalSource& source,
                                    const std::atomic<bool>& stopping) {
  if (pacer_.anybody_to_wait_for()) {
    while (!stopping && !pacer_.wait_for_consumers(kStopCheck)) {
    }
  }
  core::SensorTime newest{0};
  std::optional<core::SensorTime> first;
  while (!stopping) {
    const auto sample = source();
    if (!sample) break;
    if (!first) first = sample->time;
    newest = sample->time;
    if (!pacer_.anybody_to_wait_for()) {
      clock_.wait_until(sample->time, stopping);
    } else if (sample->time - *first > kAhead &&
               !wait_until_needed(sample->time - kAhead, stopping)) {
      return;
    }
    publish(*sample, stopping);
  }
  if (!stopping && first) mark_the_end(newest, stopping);
}

bool TemperatureReplay::wait_until_needed(core::SensorTime time,
                                          const std::atomic<bool>& stopping) {
  while (!pacer_.wait_until_needed(time, kStopCheck)) {
    if (stopping) return false;
  }
  return true;
}

// Says for each probe that nothing more comes, so that nobody waits for it.
void TemperatureReplay::mark_the_end(core::SensorTime newest, const std::atomic<bool>& stopping) {
  for (const auto& [name, probe] : probes_) {
    core::TemperatureSample last;
    last.probe = name;
    last.sequence = probe.next_sequence;
    last.time = newest + kAfterTheEnd;
    last.measured = false;
    last.clock = core::ClockSource::kReplay;
    publish(last, stopping);
  }
  wait_for_receipts(stopping);
}

void TemperatureReplay::wait_for_receipts(const std::atomic<bool>& stopping) {
  for (const auto& [name, probe] : probes_)
    service::wait_for_receipt(*probe.writer, kReceiveWithin, stopping);
}

// A writer a probe (topics.h says why); late matches get what was written before.
TemperatureReplay::Probe& TemperatureReplay::probe(const std::string& name) {
  Probe& known = probes_[name];
  if (!known.writer) {
    known.writer =
        std::make_unique<dds::Writer<msg::Temperature>>(host_.participant(), host_.observer());
  }
  return known;
}

void TemperatureReplay::publish(const core::TemperatureSample& sample,
                                const std::atomic<bool>& stopping) {
  Probe& source = probe(sample.probe);
  source.next_sequence = sample.sequence + 1;
  auto message = dds::to_message(sample, gyro_id_);
  if (source.writer->write(message)) ++published_;
  if (!pacer_.anybody_to_wait_for() || ++source.in_flight < kInFlight) return;
  service::wait_for_receipt(*source.writer, kReceiveWithin, stopping);
  source.in_flight = 0;
}

}  // namespace zerodrift::replay
