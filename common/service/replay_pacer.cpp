// SPDX-License-Identifier: Apache-2.0
#include "common/service/replay_pacer.h"

#include <algorithm>
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
      wait_for_(std::move(wait_for)),
      reader_(
          participant,
          [this](const msg::ReplayProgress& progress, const dds::SampleOrigin& origin) {
            note(progress, origin);
          },
          {},
          [this](const eprosima::fastrtps::rtps::GUID_t& writer, dds::Departure departure) {
            if (departure == dds::Departure::kLeft) forget(writer);
          }) {
  std::erase(wait_for_, "");  // what an empty option leaves
}

void ReplayPacer::note(const msg::ReplayProgress& progress, const dds::SampleOrigin& origin) {
  if (progress.consumer().size() == 0) return;  // a publisher of temperatures
  if (progress.gyro_id() != 0 && progress.gyro_id() != gyro_id_) return;
  {
    const std::lock_guard lock(mutex_);
    auto known = std::find_if(consumers_.begin(), consumers_.end(),
                              [&](const Consumer& c) { return c.writer == origin.writer; });
    if (known == consumers_.end()) {
      known = consumers_.insert(known, {.name = progress.consumer().c_str(),
                                        .writer = origin.writer,
                                        .joined_after = newest_sent_,
                                        .taken = {},
                                        .needed = core::kNever});
    }
    if (progress.gyro_id() == gyro_id_) {
      if (known->taken != progress.sequence_number()) known->is_left_behind = false;
      known->taken = progress.sequence_number();
      known->needed = core::SensorTime{progress.needed_time_ns()};
    }
  }
  changed_.notify_all();
}

void ReplayPacer::forget(const eprosima::fastrtps::rtps::GUID_t& writer) {
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(consumers_, [&](const Consumer& c) { return c.writer == writer; });
  }
  changed_.notify_all();
}

bool ReplayPacer::has_announced(const std::string& name) const {
  return std::any_of(consumers_.begin(), consumers_.end(),
                     [&](const Consumer& c) { return c.name == name; });
}

bool ReplayPacer::is_named(const Consumer& consumer) const {
  return std::find(wait_for_.begin(), wait_for_.end(), consumer.name) != wait_for_.end();
}

bool ReplayPacer::keeps_up(const Consumer& consumer, std::uint64_t first_sequence) const {
  const bool has_taken = consumer.taken && *consumer.taken >= first_sequence;
  return anybody_to_wait_for() && !consumer.is_left_behind && (is_named(consumer) || has_taken);
}

bool ReplayPacer::all_announced() const {
  return std::all_of(wait_for_.begin(), wait_for_.end(),
                     [&](const std::string& name) { return has_announced(name); });
}

std::string ReplayPacer::missing_consumers() {
  const std::lock_guard lock(mutex_);
  std::string names;
  for (const auto& name : wait_for_) {
    if (!has_announced(name)) names += (names.empty() ? "" : ", ") + name;
  }
  return names;
}

// A consumer that has taken no sample of this replay stands where the replay was when it came. What
// it reports may then still be of an earlier replay.
std::uint64_t ReplayPacer::backlog(const Consumer& consumer, std::uint64_t newest,
                                   std::uint64_t first_sequence) const {
  const auto beyond = [&](std::uint64_t sequence) {
    return newest > sequence ? newest - sequence : 0;
  };
  if (consumer.taken && *consumer.taken >= first_sequence) return beyond(*consumer.taken);
  if (consumer.joined_after) return beyond(*consumer.joined_after);
  return newest >= first_sequence ? newest - first_sequence + 1 : 0;
}

std::optional<std::uint64_t> ReplayPacer::least_backlog(const std::string& name,
                                                        std::uint64_t newest,
                                                        std::uint64_t first_sequence) const {
  std::optional<std::uint64_t> least;
  for (const Consumer& consumer : consumers_) {
    if (consumer.name != name) continue;
    const std::uint64_t behind = backlog(consumer, newest, first_sequence);
    least = std::min(least.value_or(behind), behind);
  }
  return least;
}

std::uint64_t ReplayPacer::backlog(std::uint64_t newest, std::uint64_t first_sequence) const {
  std::uint64_t largest = 0;
  for (const auto& name : wait_for_)
    largest = std::max(largest, least_backlog(name, newest, first_sequence).value_or(0));
  for (const Consumer& consumer : consumers_) {
    if (keeps_up(consumer, first_sequence))
      largest = std::max(largest, backlog(consumer, newest, first_sequence));
  }
  return largest;
}

bool ReplayPacer::wait(std::chrono::milliseconds at_most, const std::function<bool()>& condition) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, at_most, condition);
}

bool ReplayPacer::wait_for_consumers(std::chrono::milliseconds at_most) {
  return wait(at_most, [&] { return all_announced(); });
}

bool ReplayPacer::wait_for_room(std::uint64_t sequence, std::uint64_t first_sequence,
                                std::chrono::milliseconds at_most) {
  const auto has_room = [&] {
    return !newest_sent_ || backlog(*newest_sent_, first_sequence) < kWindow;
  };
  std::unique_lock lock(mutex_);
  if (!changed_.wait_for(lock, at_most, has_room)) return false;
  newest_sent_ = std::max(newest_sent_.value_or(sequence), sequence);
  return true;
}

std::string ReplayPacer::let_unconnected_join(std::uint64_t first_sequence) {
  const std::lock_guard lock(mutex_);
  const bool is_taken =
      newest_sent_ && std::any_of(consumers_.begin(), consumers_.end(), [&](const Consumer& c) {
        return is_named(c) && c.taken && *c.taken == *newest_sent_;
      });
  std::string names;
  if (!is_taken) return names;
  for (Consumer& c : consumers_) {
    const bool took_some = c.taken && *c.taken >= first_sequence;
    if (!is_named(c) || took_some || c.joined_after == newest_sent_) continue;
    c.joined_after = newest_sent_;
    names += (names.empty() ? "" : ", ") + c.name;
  }
  if (!names.empty()) changed_.notify_all();
  return names;
}

std::string ReplayPacer::leave_behind(std::uint64_t first_sequence) {
  const std::lock_guard lock(mutex_);
  std::string names;
  for (Consumer& c : consumers_) {
    if (!newest_sent_ || !keeps_up(c, first_sequence)) continue;
    const std::uint64_t indispensable =
        is_named(c) ? least_backlog(c.name, *newest_sent_, first_sequence).value_or(0) : 0;
    if (backlog(c, *newest_sent_, first_sequence) <= indispensable) continue;
    c.is_left_behind = true;
    names += (names.empty() ? "" : ", ") + c.name;
  }
  if (!names.empty()) changed_.notify_all();
  return names;
}

bool ReplayPacer::wait_for_all(std::uint64_t sequence, std::uint64_t first_sequence,
                               std::chrono::milliseconds at_most) {
  return wait(at_most, [&] { return backlog(sequence, first_sequence) == 0; });
}

bool ReplayPacer::wait_until_needed(core::SensorTime time, std::chrono::milliseconds at_most) {
  return wait(at_most, [&] {
    return std::any_of(consumers_.begin(), consumers_.end(),
                       [&](const Consumer& c) { return c.needed >= time; });
  });
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
