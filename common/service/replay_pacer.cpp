// SPDX-License-Identifier: Apache-2.0
#include "common/service/replay_pacer.h"

#include <optional>
#include <stdexcept>
#include <utility>

namespace zerodrift::service {
namespace {

// Eight to a lease.
constexpr std::chrono::milliseconds kAnnounceEvery{250};
static_assert(8 * kAnnounceEvery <= dds::kReplayProgress.lease);

}  // namespace

ReplayPacer::ReplayPacer(dds::Participant& participant, std::uint32_t gyro_id,
                         std::vector<std::string> wait_for)
    : gyro_id_(gyro_id),
      credit_(std::move(wait_for)),
      reader_(
          participant,
          [this](const msg::ReplayProgress& progress, const dds::SampleOrigin& origin) {
            note(progress, origin);
          },
          {},
          [this](const eprosima::fastrtps::rtps::GUID_t& writer, dds::Departure departure) {
            if (departure != dds::Departure::kLeft) return;
            change([&] { credit_.forget(writer); });
          }) {}

void ReplayPacer::note(const msg::ReplayProgress& progress, const dds::SampleOrigin& origin) {
  if (progress.consumer().size() == 0) return;  // a publisher of temperatures
  if (progress.gyro_id() != 0 && progress.gyro_id() != gyro_id_) return;
  std::optional<ReplayCredit::Progress> of_this_gyro;
  if (progress.gyro_id() == gyro_id_) {
    of_this_gyro = {.taken = progress.sequence_number(),
                    .needed = core::SensorTime{progress.needed_time_ns()}};
  }
  change([&] { credit_.note(progress.consumer().c_str(), origin.writer, of_this_gyro); });
}

void ReplayPacer::note_reader(const eprosima::fastrtps::rtps::GUID_t& reader) {
  change([&] { credit_.note_reader(reader); });
}

std::string ReplayPacer::missing_consumers() {
  const std::lock_guard lock(mutex_);
  return credit_.missing_consumers();
}

bool ReplayPacer::wait_for_consumers(std::chrono::milliseconds at_most) {
  return wait(at_most, [&] { return credit_.missing_consumers().empty(); });
}

bool ReplayPacer::wait_for_room(std::uint64_t sequence, std::uint64_t first_sequence,
                                std::chrono::milliseconds at_most) {
  return wait(at_most, [&] {
    if (!credit_.has_room(first_sequence)) return false;
    credit_.note_sent(sequence);
    return true;
  });
}

std::string ReplayPacer::let_unconnected_join(std::uint64_t first_sequence) {
  return change([&] { return credit_.let_unconnected_join(first_sequence); });
}

std::string ReplayPacer::leave_behind(std::uint64_t first_sequence) {
  return change([&] { return credit_.leave_behind(first_sequence); });
}

bool ReplayPacer::wait_for_all(std::uint64_t sequence, std::uint64_t first_sequence,
                               std::chrono::milliseconds at_most) {
  return wait(at_most, [&] { return credit_.is_taken_by_all(sequence, first_sequence); });
}

bool ReplayPacer::wait_until_needed(core::SensorTime time, std::chrono::milliseconds at_most) {
  return wait(at_most, [&] { return credit_.is_needed(time); });
}

namespace {

msg::ReplayProgress announcement_of(const std::string& consumer) {
  msg::ReplayProgress progress;
  progress.consumer(consumer.c_str());
  return progress;
}

msg::ReplayProgress announcement_of(std::uint32_t gyro_id, const std::vector<std::string>& probes) {
  msg::ReplayProgress progress;
  std::string names;
  for (const auto& name : probes) names += (names.empty() ? "" : ",") + name;
  if (names.size() > progress.probes().max_size)
    throw std::invalid_argument("the names of the probes are too long together: " + names);
  progress.gyro_id(gyro_id);
  progress.probes(names.c_str());
  return progress;
}

}  // namespace

ReplayProgressReporter::ReplayProgressReporter(dds::Participant& participant, std::string consumer)
    : ReplayProgressReporter(participant, announcement_of(consumer)) {}

ReplayProgressReporter::ReplayProgressReporter(dds::Participant& participant, std::uint32_t gyro_id,
                                               const std::vector<std::string>& probes)
    : ReplayProgressReporter(participant, announcement_of(gyro_id, probes)) {}

ReplayProgressReporter::ReplayProgressReporter(dds::Participant& participant,
                                               msg::ReplayProgress announcement)
    : announcement_(std::move(announcement)),
      writer_(participant),
      announcer_([this] { announce_until_closed(); }) {}

ReplayProgressReporter::~ReplayProgressReporter() {
  {
    const std::lock_guard lock(closing_mutex_);
    closed_ = true;
  }
  closing_.notify_all();
  announcer_.join();
}

void ReplayProgressReporter::announce_until_closed() {
  std::unique_lock lock(closing_mutex_);
  while (!closing_.wait_for(lock, kAnnounceEvery, [this] { return closed_; })) {
    lock.unlock();
    announce();
    lock.lock();
  }
}

void ReplayProgressReporter::announce() {
  msg::ReplayProgress progress = announcement_;
  write(progress);
}

void ReplayProgressReporter::report(std::uint32_t gyro_id, std::uint64_t sequence,
                                    core::SensorTime needed) {
  msg::ReplayProgress progress = announcement_;
  progress.gyro_id(gyro_id);
  progress.sequence_number(sequence);
  progress.needed_time_ns(needed.count());
  write(progress);
}

void ReplayProgressReporter::write(msg::ReplayProgress& progress) {
  const std::lock_guard lock(mutex_);
  writer_.write(progress);
}

}  // namespace zerodrift::service
