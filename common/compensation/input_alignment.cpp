// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/input_alignment.h"

#include <algorithm>

#include "common/core/integer_time.h"
#include "common/core/sequence_gap.h"

namespace zerodrift::compensation {
namespace {

// A front stamped far ahead of the two readings that came last would hold up all that follow it.
template <typename Reading>
void drop_wild_front(core::RingBuffer<Reading>& queue) noexcept {
  while (queue.size() > 2 &&
         core::is_far_ahead(queue.front().time,
                            std::max(queue.back().time, queue[queue.size() - 2].time))) {
    queue.pop();
  }
}

}  // namespace

Admission SequenceWindow::admit(std::uint64_t sequence) noexcept {
  if (!started_) {
    started_ = true;
    first_ = newest_ = sequence;
    seen_.set(sequence % kSpan);
    return Admission::kInOrder;
  }
  if (doubted_ == sequence) return Admission::kDuplicate;
  const bool far_ahead = sequence > newest_ && sequence - newest_ >= kSpan;
  const bool far_behind = sequence < newest_ && newest_ - sequence >= kSpan;
  if (far_ahead || far_behind) {
    if (doubted_ && sequence > *doubted_ && sequence - *doubted_ < kSpan) return jump_to(sequence);
    doubted_ = sequence;
    return far_ahead ? Admission::kLate : Admission::kTooOld;
  }
  if (sequence > newest_) {
    for (std::uint64_t s = newest_ + 1; s < sequence; ++s) seen_.reset(s % kSpan);
    missing_ = core::saturating_sum(missing_, core::numbers_lost(newest_, sequence));
    newest_ = sequence;
    seen_.set(sequence % kSpan);
    return Admission::kInOrder;
  }
  if (seen_.test(sequence % kSpan)) return Admission::kDuplicate;
  seen_.set(sequence % kSpan);
  if (sequence > first_) --missing_;
  return Admission::kLate;
}

void StreamProgress::advance(core::SensorTime time) noexcept {
  const core::SensorTime said = std::max(previous_, time);
  spoken_to_ = core::is_far_ahead(spoken_to_, said) ? said : std::max(spoken_to_, time);
  previous_ = time;
}

// The stream really went on elsewhere: a second sample followed the doubted one.
Admission SequenceWindow::jump_to(std::uint64_t sequence) noexcept {
  const std::uint64_t from = *doubted_;
  if (core::is_new_count(newest_, from)) first_ = from;
  const std::uint64_t lost = core::numbers_lost(newest_, from) + core::numbers_lost(from, sequence);
  missing_ = core::saturating_sum(missing_, lost);
  seen_.reset();
  seen_.set(from % kSpan);
  seen_.set(sequence % kSpan);
  newest_ = sequence;
  doubted_.reset();
  return Admission::kInOrder;
}

TemperatureQueue::TemperatureQueue(std::size_t probes, std::size_t capacity) {
  probes_.reserve(probes);
  for (std::size_t i = 0; i < probes; ++i) {
    probes_.push_back({core::RingBuffer<PendingTemperature>(capacity), {}, false});
  }
}

bool TemperatureQueue::push(const PendingTemperature& reading) noexcept {
  Probe& probe = probes_[reading.probe];
  if (probe.ended) {
    probe.clear();
    probe.early = true;
  }
  const bool had_room = !probe.readings.full();
  probe.readings.push_overwriting(reading);
  probe.progress.advance(reading.time);
  probe.absent = false;
  return had_room;
}

bool TemperatureQueue::complete_to(core::SensorTime time) const noexcept {
  return std::all_of(probes_.begin(), probes_.end(), [&](const Probe& probe) {
    return probe.absent || probe.progress.spoken_to() > time;
  });
}

std::optional<PendingTemperature> TemperatureQueue::pop_until(core::SensorTime time) noexcept {
  Probe* first = nullptr;
  for (Probe& probe : probes_) {
    drop_wild_front(probe.readings);
    if (probe.readings.empty() || probe.readings.front().time > time) continue;
    if (first == nullptr || probe.readings.front().time < first->readings.front().time)
      first = &probe;
  }
  if (first == nullptr) return std::nullopt;
  const PendingTemperature reading = first->readings.front();
  first->readings.pop();
  return reading;
}

void TemperatureQueue::give_up_waiting(core::SensorTime time) noexcept {
  for (Probe& probe : probes_) {
    if (probe.progress.spoken_to() <= time) probe.absent = true;
  }
}

void TemperatureQueue::end(std::size_t probe) noexcept {
  probes_[probe].absent = probes_[probe].ended = true;
}

void TemperatureQueue::restart() noexcept {
  for (Probe& probe : probes_) probe.clear();
}

void TemperatureQueue::restart_ended() noexcept {
  for (Probe& probe : probes_) {
    if (probe.early) continue;
    if (probe.ended) probe.clear();
    probe.absent = false;
  }
}

void ReferenceQueue::push(const core::RateReferenceSample& reference) noexcept {
  if (ended_) restart();
  queue_.push_overwriting(reference);
  progress_.advance(reference.time);
  expected_ = reference.kind != core::ReferenceKind::kRateTable;
}

bool ReferenceQueue::complete_to(core::SensorTime time) const noexcept {
  return !expected_ || progress_.spoken_to() >= time;
}

const core::RateReferenceSample* ReferenceQueue::at(core::SensorTime time,
                                                    core::SensorTime longest_age) noexcept {
  drop_wild_front(queue_);
  while (!queue_.empty() && queue_.front().time <= time) {
    if (!newest_due_ || queue_.front().time >= newest_due_->time) newest_due_ = queue_.front();
    queue_.pop();
  }
  if (!newest_due_ || core::saturating_difference(time, newest_due_->time) > longest_age)
    return nullptr;
  return &*newest_due_;
}

void ReferenceQueue::restart() noexcept {
  queue_.clear();
  newest_due_.reset();
  progress_ = {};
  expected_ = ended_ = false;
}

// One that nobody waits for has nothing that the first rate would need.
void ReferenceQueue::restart_ended() noexcept {
  if (ended_ || !expected_) return restart();
  newest_due_.reset();
}

}  // namespace zerodrift::compensation
