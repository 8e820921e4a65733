// SPDX-License-Identifier: Apache-2.0
#include "common/replay/temperature_replay.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>
#include <utility>

#include "common/dds/conversions.h"
#include "common/service/receipt.h"

namespace zerodrift::replay {
namespace {

using namespace std::chrono_literals;

using service::kStopCheck;
constexpr core::SensorTime kAhead = 10s;  // of what is needed, so that rates never wait for long
constexpr core::SensorTime kLongestPause = 5s;  // of a probe, until it is said that nothing came
constexpr core::SensorTime kAfterTheEnd = 1h;   // beyond any rate sample of the record
// Readings of one stream: half the history kept for it.
template <typename Message>
constexpr std::uint64_t kInFlight = dds::TopicOf<Message>::kSpec.depth / 2;

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
  probes_announced_.emplace(host_.participant(), gyro_id_, source.probes);
  // Before anybody is asked to wait, so that who comes can know of all that will come.
  for (const auto& name : source.probes) open(probes_[name]);
  if (source.environment != 0) open(environment_);
  if (pacer_.anybody_to_wait_for()) {
    while (!stopping && !pacer_.wait_for_consumers(kStopCheck)) {
    }
  }
  core::SensorTime newest{0};
  std::optional<core::SensorTime> first;
  while (!stopping) {
    const auto reading = source.next();
    if (!reading) break;
    newest = std::visit([](const auto& sample) { return sample.time; }, *reading);
    if (!first) first = newest;
    fill_pauses(source, *first, newest, stopping);
    if (!pacer_.anybody_to_wait_for()) {
      clock_.wait_until(newest, stopping);
    } else if (newest - *first > kAhead && !wait_until_needed(newest - kAhead, stopping)) {
      return;
    }
    std::visit([&](const auto& sample) { publish(sample, stopping); }, *reading);
  }
  if (!first) probes_announced_.emplace(host_.participant(), gyro_id_, std::vector<std::string>{});
  if (!stopping && first) mark_the_end(source, newest, stopping);
}

bool TemperatureReplay::wait_until_needed(core::SensorTime time,
                                          const std::atomic<bool>& stopping) {
  while (!needs_all_ && !pacer_.wait_until_needed(time, kStopCheck)) {
    if (stopping) return false;
  }
  return true;
}

// Says for each stream that paused, or has not begun, that nothing comes until `before`: rates wait
// for what it might say, and what comes next waits for the rates.
void TemperatureReplay::fill_pauses(const ThermalSource& source, core::SensorTime first,
                                    core::SensorTime before, const std::atomic<bool>& stopping) {
  const auto has_paused = [&](const auto& stream) {
    return before - std::max(first, stream.spoken_to) > kLongestPause;
  };
  for (const auto& name : source.probes) {
    if (has_paused(probes_[name])) publish_blank(name, before - core::SensorTime{1}, stopping);
  }
  if (source.environment != 0 && has_paused(environment_))
    publish_blank(source.environment, before - core::SensorTime{1}, stopping);
}

// Says for each stream that nothing more comes, so that nobody waits for it.
void TemperatureReplay::mark_the_end(const ThermalSource& source, core::SensorTime newest,
                                     const std::atomic<bool>& stopping) {
  for (const auto& [name, probe] : probes_) publish_blank(name, newest + kAfterTheEnd, stopping);
  if (source.environment != 0) publish_blank(source.environment, newest + kAfterTheEnd, stopping);
  wait_for_receipts(stopping);
}

void TemperatureReplay::publish_blank(const std::string& name, core::SensorTime time,
                                      const std::atomic<bool>& stopping) {
  core::TemperatureSample blank;
  blank.probe = name;
  blank.sequence = probes_[name].next_sequence;
  blank.time = time;
  blank.measured = false;
  blank.clock = core::ClockSource::kReplay;
  publish(blank, stopping);
}

void TemperatureReplay::publish_blank(core::EnvironmentChannels channels, core::SensorTime time,
                                      const std::atomic<bool>& stopping) {
  publish(core::EnvironmentSample{.sequence = environment_.next_sequence,
                                  .time = time,
                                  .channels = channels,
                                  .clock = core::ClockSource::kReplay},
          stopping);
}

// What is written over before a consumer has met the writer is lost to it, too. All consumers read
// temperatures; few read the environment.
template <typename Message>
void TemperatureReplay::wait_for_receipt(Stream<Message>& stream,
                                         const std::atomic<bool>& stopping) {
  const bool is_awaited = pacer_.anybody_to_wait_for() && std::is_same_v<Message, msg::Temperature>;
  while (is_awaited && !needs_all_ && !stopping && stream.writer->matched() == 0)
    std::this_thread::sleep_for(1ms);
  service::wait_for_receipt(*stream.writer, host_, gyro_id_, stopping);
  stream.in_flight = 0;
}

void TemperatureReplay::wait_for_receipts(const std::atomic<bool>& stopping) {
  for (auto& [name, probe] : probes_) {
    if (probe.writer) wait_for_receipt(probe, stopping);
  }
  if (environment_.writer) wait_for_receipt(environment_, stopping);
}

template <typename Message>
void TemperatureReplay::open(Stream<Message>& stream) {
  if (!stream.writer)
    stream.writer = std::make_unique<dds::Writer<Message>>(host_.participant(), host_.observer());
}

template <typename Message, typename Sample>
void TemperatureReplay::send(Stream<Message>& stream, const Sample& sample,
                             const std::atomic<bool>& stopping) {
  open(stream);
  stream.next_sequence = sample.sequence + 1;
  stream.spoken_to = sample.time;
  auto message = dds::to_message(sample, gyro_id_);
  if (stream.writer->write(message)) ++published_;
  const bool is_paced = pacer_.anybody_to_wait_for() && core::is_paced_by_consumers(sample.clock);
  if (is_paced && ++stream.in_flight >= kInFlight<Message>) wait_for_receipt(stream, stopping);
}

void TemperatureReplay::publish(const core::TemperatureSample& sample,
                                const std::atomic<bool>& stopping) {
  send(probes_[sample.probe], sample, stopping);
}

void TemperatureReplay::publish(const core::EnvironmentSample& sample,
                                const std::atomic<bool>& stopping) {
  send(environment_, sample, stopping);
}

}  // namespace zerodrift::replay
