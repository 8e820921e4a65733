// SPDX-License-Identifier: Apache-2.0
#include "common/replay/rate_replay.h"

#include <chrono>
#include <thread>
#include <utility>

#include "common/dds/conversions.h"
#include "common/service/monotonic_clock.h"
#include "common/service/receipt.h"

namespace zerodrift::replay {
namespace {

using namespace std::chrono_literals;

using service::kPatience;
using service::kStopCheck;

}  // namespace

RateReplay::RateReplay(service::Host& host, std::uint32_t gyro_id, const std::string& speed,
                       std::vector<std::string> wait_for)
    : host_(host),
      gyro_id_(gyro_id),
      pacer_(host.participant(), gyro_id, std::move(wait_for)),
      clock_(service::parse_speed(speed)),
      writer_(host.participant(), host.observer(), {},
              [this](const auto& reader) { pacer_.note_reader(reader); }),
      reference_writer_(host.participant(), host.observer()) {}

void RateReplay::publish(const GyroSource& source, const std::atomic<bool>& stopping,
                         const Filter& filter) {
  try {
    publish_all(source, stopping, filter);
  } catch (...) {
    // What was published before is still good.
    service::wait_for_receipt(writer_, host_, gyro_id_, stopping);
    throw;
  }
}

void RateReplay::publish_all(const GyroSource& source, const std::atomic<bool>& stopping,
                             const Filter& filter) {
  if (!wait_for_consumers(stopping)) return;
  bool is_first_rate = true;
  bool is_first_reference = true;
  while (!stopping) {
    auto reading = source();
    if (!reading) return finish(stopping);
    if (reading->rate) {
      if (is_first_rate) first_sequence_ = reading->rate->sequence;
      is_first_rate = false;
      clock_.wait_until(reading->rate->time, stopping);
      if (filter && filter(*reading->rate) == Delivery::kDrop) continue;
      if (!wait_for_room(reading->rate->sequence, stopping)) return;
    }
    if (reading->reference) {
      // A consumer must know that references come before it meets the first rate.
      if (is_first_reference) wait_for_reference_readers(stopping);
      publish(*reading->reference);
      if (is_first_reference)
        service::wait_for_receipt(reference_writer_, host_, gyro_id_, stopping);
      is_first_reference = false;
    }
    if (reading->rate) publish(*reading->rate);
  }
}

void RateReplay::publish(const core::AngularRateSample& sample,
                         const service::ClockDiscipline& discipline) {
  auto message = dds::to_message(sample, gyro_id_, service::monotonic_ns());
  message.clock_locked(static_cast<std::uint32_t>(discipline.lock));
  message.clock_offset_ns(discipline.offset_ns);
  newest_sequence_ = sample.sequence;
  if (writer_.write(message)) {
    ++published_;
  } else {
    ++refused_;
  }
}

void RateReplay::publish(const core::RateReferenceSample& reference) {
  auto message = dds::to_message(reference, gyro_id_);
  reference_writer_.write(message);
}

bool RateReplay::wait_for_consumers(const std::atomic<bool>& stopping) {
  if (!pacer_.anybody_to_wait_for()) return true;
  bool reported = false;
  for (auto waited = 0ms; !stopping; waited += kStopCheck) {
    // A consumer announces itself before its reader may be known here: no sample goes out into the
    // void.
    if (pacer_.wait_for_consumers(kStopCheck) && writer_.matched() > 0 && writer_.met_all())
      return true;
    if (pacer_.missing_consumers().empty()) std::this_thread::sleep_for(1ms);
    if (waited < kPatience || reported) continue;
    reported = true;
    host_.raise({.code = "waiting_for_consumers",
                 .severity = service::Severity::kInformation,
                 .text = "waiting for " + pacer_.missing_consumers() + " (--wait-for)",
                 .gyro_id = gyro_id_,
                 .sensor_time_ns = 0});
  }
  return false;
}

// Consumers read rates and references, or neither: who has met the one soon meets the other.
void RateReplay::wait_for_reference_readers(const std::atomic<bool>& stopping) {
  const bool is_awaited = pacer_.anybody_to_wait_for();
  while (is_awaited && !stopping &&
         (reference_writer_.matched() == 0 || !reference_writer_.met_all()))
    std::this_thread::sleep_for(1ms);
}

bool RateReplay::wait_for_room(std::uint64_t sequence, const std::atomic<bool>& stopping) {
  return wait_for_all_until(
      stopping, [&] { return pacer_.wait_for_room(sequence, first_sequence_, kStopCheck); });
}

// The end is reached when every consumer has taken everything.
void RateReplay::finish(const std::atomic<bool>& stopping) {
  service::wait_for_receipt(writer_, host_, gyro_id_, stopping);
  wait_for_all_until(
      stopping, [&] { return pacer_.wait_for_all(newest_sequence_, first_sequence_, kStopCheck); });
  finished_ = true;
}

// One that was not connected yet when the first samples went out would be waited for for good.
bool RateReplay::wait_for_all_until(const std::atomic<bool>& stopping,
                                    const std::function<bool()>& is_there) {
  for (auto waited = 0ms; !is_there(); waited += kStopCheck) {
    if (stopping) return false;
    if (waited < kPatience) continue;
    if (const std::string behind = pacer_.leave_behind(first_sequence_); !behind.empty()) {
      host_.raise({.code = "consumer_left_behind",
                   .text = behind + " did not get on for 5 s; the replay goes on without it",
                   .gyro_id = gyro_id_,
                   .sensor_time_ns = 0});
    }
    const std::string names = pacer_.let_unconnected_join(first_sequence_);
    if (names.empty()) continue;
    host_.raise({.code = "consumer_joined_late",
                 .text = names + " took none of the samples up to " +
                         std::to_string(newest_sequence_) +
                         ", which others took: not connected yet; the replay goes on",
                 .gyro_id = gyro_id_,
                 .sensor_time_ns = 0});
  }
  return true;
}

}  // namespace zerodrift::replay
