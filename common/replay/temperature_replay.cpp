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

constexpr auto kStopCheck = 100ms;
constexpr core::SensorTime kAhead = 10s;  // of what is needed, so that rates never wait for long
constexpr core::SensorTime kLongestPause = 5s;  // of a probe, until it is said that nothing came
constexpr core::SensorTime kAfterTheEnd = 1h;   // beyond any rate sample of the record
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
  probes_announced_.emplace(host_.participant(), gyro_id_, source.probes);
  if (pacer_.anybody_to_wait_for()) {
    while (!stopping && !pacer_.wait_for_consumers(kStopCheck)) {
    }
  }
  core::SensorTime newest{0};
  std::optional<core::SensorTime> first;
  while (!stopping) {
    const auto sample = source.next();
    if (!sample) break;
    if (!first) first = sample->time;
    newest = sample->time;
    fill_pauses(source, *first, newest, stopping);
    if (!pacer_.anybody_to_wait_for()) {
      clock_.wait_until(sample->time, stopping);
    } else if (sample->time - *first > kAhead &&
               !wait_until_needed(sample->time - kAhead, stopping)) {
      return;
    }
    publish(*sample, stopping);
  }
  if (!first) probes_announced_.emplace(host_.participant(), gyro_id_, std::vector<std::string>{});
  if (!stopping && first) mark_the_end(newest, stopping);
}

bool TemperatureReplay::wait_until_needed(core::SensorTime time,
                                          const std::atomic<bool>& stopping) {
  while (!pacer_.wait_until_needed(time, kStopCheck)) {
    if (stopping) return false;
  }
  return true;
}

// Says for each probe that paused, or has not begun, that nothing comes until `before`: rates wait
// for what it might say, and what comes next waits for the rates.
void TemperatureReplay::fill_pauses(const ThermalSource& source, core::SensorTime first,
                                    core::SensorTime before, const std::atomic<bool>& stopping) {
  for (const auto& name : source.probes) {
    if (before - std::max(first, probes_[name].spoken_to) > kLongestPause)
      publish_blank(name, before - core::SensorTime{1}, stopping);
  }
}

// Says for each probe that nothing more comes, so that nobody waits for it.
void TemperatureReplay::mark_the_end(core::SensorTime newest, const std::atomic<bool>& stopping) {
  for (const auto& [name, probe] : probes_) publish_blank(name, newest + kAfterTheEnd, stopping);
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

// What is written over before a consumer has met the writer is lost to it, too.
void TemperatureReplay::wait_for_receipt(Probe& probe, const std::atomic<bool>& stopping) {
  const bool is_awaited = pacer_.anybody_to_wait_for();
  while (is_awaited && !stopping && probe.writer->matched() == 0) std::this_thread::sleep_for(1ms);
  service::wait_for_receipt(*probe.writer, stopping);
  probe.in_flight = 0;
}

void TemperatureReplay::wait_for_receipts(const std::atomic<bool>& stopping) {
  for (auto& [name, probe] : probes_) {
    if (probe.writer) wait_for_receipt(probe, stopping);
  }
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
  source.spoken_to = sample.time;
  auto message = dds::to_message(sample, gyro_id_);
  if (source.writer->write(message)) ++published_;
  const bool is_paced = pacer_.anybody_to_wait_for() && core::is_paced_by_consumers(sample.clock);
  if (is_paced && ++source.in_flight >= kInFlight) wait_for_receipt(source, stopping);
}

}  // namespace zerodrift::replay
