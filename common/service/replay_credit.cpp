// SPDX-License-Identifier: Apache-2.0
#include "common/service/replay_credit.h"

#include <algorithm>
#include <utility>

namespace zerodrift::service {

ReplayCredit::ReplayCredit(std::vector<std::string> wait_for) : wait_for_(std::move(wait_for)) {
  std::erase(wait_for_, "");  // what an empty option leaves
}

void ReplayCredit::note(const std::string& name, const Guid& writer,
                        const std::optional<Progress>& progress) {
  auto known = std::find_if(consumers_.begin(), consumers_.end(),
                            [&](const Consumer& c) { return c.writer == writer; });
  if (known == consumers_.end()) {
    known = consumers_.insert(known, {.name = name, .writer = writer});
    join(*known);
  }
  if (!progress) return;
  if (!known->progress || known->progress->taken != progress->taken) known->is_left_behind = false;
  known->progress = progress;
}

void ReplayCredit::forget(const Guid& writer) {
  std::erase_if(consumers_, [&](const Consumer& c) { return c.writer == writer; });
}

void ReplayCredit::note_reader(const Guid& reader) {
  for (Consumer& consumer : consumers_) {
    if (consumer.writer.guidPrefix == reader.guidPrefix && !consumer.progress) join(consumer);
  }
}

void ReplayCredit::join(Consumer& joining) {
  if (!newest_sent_) return;
  joining.joined_after = newest_sent_;
  if (!is_named(joining)) return;
  for (Consumer& other : consumers_) {
    if (other.name != joining.name) other.missed = newest_sent_;
  }
}

void ReplayCredit::note_sent(std::uint64_t sequence) {
  newest_sent_ = std::max(newest_sent_.value_or(sequence), sequence);
}

bool ReplayCredit::has_announced(const std::string& name) const {
  return std::any_of(consumers_.begin(), consumers_.end(),
                     [&](const Consumer& c) { return c.name == name; });
}

std::string ReplayCredit::missing_consumers() const {
  std::string names;
  for (const auto& name : wait_for_) {
    if (!has_announced(name)) names += (names.empty() ? "" : ", ") + name;
  }
  return names;
}

bool ReplayCredit::is_named(const Consumer& consumer) const {
  return std::find(wait_for_.begin(), wait_for_.end(), consumer.name) != wait_for_.end();
}

bool ReplayCredit::has_taken(const Consumer& consumer, std::uint64_t first_sequence) {
  return consumer.progress && consumer.progress->taken >= first_sequence;
}

bool ReplayCredit::has_taken_some(const Consumer& consumer, std::uint64_t first_sequence) {
  return has_taken(consumer, first_sequence) &&
         (!consumer.missed || consumer.progress->taken > *consumer.missed);
}

bool ReplayCredit::keeps_up(const Consumer& consumer, std::uint64_t first_sequence) const {
  return anybody_to_wait_for() && !consumer.is_left_behind &&
         (is_named(consumer) || has_taken(consumer, first_sequence));
}

// A consumer that has taken no sample of this replay stands where the replay was when it joined.
// What it reports may then still be of an earlier replay.
std::uint64_t ReplayCredit::backlog(const Consumer& consumer, std::uint64_t newest,
                                    std::uint64_t first_sequence) {
  const auto beyond = [&](std::uint64_t sequence) {
    return newest > sequence ? newest - sequence : 0;
  };
  if (has_taken_some(consumer, first_sequence)) return beyond(consumer.progress->taken);
  const auto joined_after = std::max(consumer.joined_after, consumer.missed);
  if (joined_after) return beyond(*joined_after);
  return newest >= first_sequence ? newest - first_sequence + 1 : 0;
}

std::optional<std::uint64_t> ReplayCredit::least_backlog(const std::string& name,
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

std::uint64_t ReplayCredit::backlog(std::uint64_t newest, std::uint64_t first_sequence) const {
  std::uint64_t largest = 0;
  for (const auto& name : wait_for_)
    largest = std::max(largest, least_backlog(name, newest, first_sequence).value_or(0));
  for (const Consumer& consumer : consumers_) {
    if (keeps_up(consumer, first_sequence))
      largest = std::max(largest, backlog(consumer, newest, first_sequence));
  }
  return largest;
}

bool ReplayCredit::has_room(std::uint64_t first_sequence) const {
  return !newest_sent_ || backlog(*newest_sent_, first_sequence) < kWindow;
}

bool ReplayCredit::is_taken_by_all(std::uint64_t sequence, std::uint64_t first_sequence) const {
  return backlog(sequence, first_sequence) == 0;
}

bool ReplayCredit::is_needed(core::SensorTime time) const {
  return std::any_of(consumers_.begin(), consumers_.end(),
                     [&](const Consumer& c) { return c.progress && c.progress->needed >= time; });
}

std::string ReplayCredit::let_unconnected_join(std::uint64_t first_sequence) {
  const bool is_taken =
      newest_sent_ && std::any_of(consumers_.begin(), consumers_.end(), [&](const Consumer& c) {
        return is_named(c) && c.progress && c.progress->taken == *newest_sent_;
      });
  std::string names;
  if (!is_taken) return names;
  for (Consumer& c : consumers_) {
    if (!is_named(c) || has_taken_some(c, first_sequence) || c.joined_after == newest_sent_)
      continue;
    c.joined_after = newest_sent_;
    names += (names.empty() ? "" : ", ") + c.name;
  }
  return names;
}

std::string ReplayCredit::leave_behind(std::uint64_t first_sequence) {
  std::string names;
  for (Consumer& c : consumers_) {
    if (!newest_sent_ || !keeps_up(c, first_sequence)) continue;
    const std::uint64_t indispensable =
        is_named(c) ? least_backlog(c.name, *newest_sent_, first_sequence).value_or(0) : 0;
    if (backlog(c, *newest_sent_, first_sequence) <= indispensable) continue;
    c.is_left_behind = true;
    names += (names.empty() ? "" : ", ") + c.name;
  }
  return names;
}

}  // namespace zerodrift::service
