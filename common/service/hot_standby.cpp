// SPDX-License-Identifier: Apache-2.0
#include "common/service/hot_standby.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "common/core/samples.h"

namespace zerodrift::service {
namespace {

// A sequence number this far behind is that of a source that started anew, not of a late sample.
constexpr std::uint64_t kAnew = 4096;

template <typename Array>
bool same_bits(const Array& a, const Array& b) noexcept {
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::bit_cast<std::uint64_t>(a[i]) != std::bit_cast<std::uint64_t>(b[i])) return false;
  }
  return true;
}

// All that was computed; not who answered, nor when.
bool same_answer(const msg::CompensatedRate& a, const msg::CompensatedRate& b) noexcept {
  return a.sensor_time_ns() == b.sensor_time_ns() && a.model_epoch() == b.model_epoch() &&
         a.mode() == b.mode() && a.reason() == b.reason() && a.rung() == b.rung() &&
         same_bits(a.rate_radps(), b.rate_radps()) &&
         same_bits(a.applied_drift_radps(), b.applied_drift_radps()) &&
         same_bits(a.drift_variance_radps2(), b.drift_variance_radps2()) &&
         same_bits(a.rate_covariance_radps2(), b.rate_covariance_radps2());
}

}  // namespace

std::uint32_t first_strength(std::int64_t unix_time_ns, std::uint32_t rank) noexcept {
  constexpr std::int64_t kBegin = 1767225600;  // 2026-01-01
  const std::int64_t seconds = std::max<std::int64_t>(0, unix_time_ns / 1'000'000'000 - kBegin);
  return static_cast<std::uint32_t>(static_cast<std::uint64_t>(seconds) * kMostInstances) +
         rank % kMostInstances;
}

HotStandby::HotStandby(std::uint32_t instance, std::uint32_t strength, std::int64_t now_ns)
    : instance_(instance),
      strength_(strength),
      role_(Role::kStandby),
      standby_since_ns_(now_ns),
      held_(kHeld),
      early_(kEarly) {}

bool HotStandby::take(const msg::CompensatedRate& answer, std::int64_t now_ns) noexcept {
  if (is_alone()) return true;
  note_arrival(answer, now_ns);
  newest_ = answer.sequence_number();
  if (role_ == Role::kActive) {
    held_.push_overwriting({answer, now_ns});
    return true;
  }
  paced_ = core::is_paced_by_consumers(static_cast<core::ClockSource>(answer.clock_source()));
  while (!early_.empty() && early_.front().sequence_number() <= answer.sequence_number()) {
    if (early_.front().sequence_number() == answer.sequence_number())
      compare(answer, early_.front());
    early_.pop();
  }
  if (held_.full()) {
    if (!was_heard(held_.front().answer)) ++unheard_;
    held_.pop();
  }
  held_.push({answer, now_ns});
  return false;
}

void HotStandby::note_arrival(const msg::CompensatedRate& answer, std::int64_t now_ns) noexcept {
  if (answer.publish_time_ns() == 0) return;
  const std::int64_t age_ns = now_ns - answer.publish_time_ns();
  const bool anew = answer.sequence_number() + kAnew < newest_;  // perhaps by another clock
  if (!least_age_ns_ || anew || age_ns < *least_age_ns_) least_age_ns_ = age_ns;
  *least_age_ns_ += (age_ns - *least_age_ns_) / kAgeMemory;
  if (age_ns - *least_age_ns_ > kSilenceLongest.count())
    late_until_ns_ = now_ns + kSilenceLate.count();
}

void HotStandby::hear(const msg::CompensatedRate& other, std::int64_t now_ns) noexcept {
  if (is_alone()) return;
  heard_strength_ = std::max(heard_strength_, other.ownership_strength());
  const std::uint64_t sequence = other.sequence_number();
  if (role_ == Role::kActive) {
    if (other.ownership_strength() <= strength_) return hear_weaker(sequence, now_ns);
    step_back(now_ns);
  }
  heard_ns_ = now_ns;
  const bool anew = begins_anew(other);
  if (anew) drop_run_before(other);
  if (!heard_to_ || sequence > *heard_to_ || anew) heard_to_ = sequence;
  heard_publish_ns_ = std::max(heard_publish_ns_, other.publish_time_ns());
  for (std::size_t i = held_.size(); i > 0; --i) {
    const msg::CompensatedRate& mine = held_[i - 1].answer;
    if (mine.sequence_number() == sequence) {
      note_lag(sequence, now_ns - held_[i - 1].since_ns, now_ns);
      return compare(mine, other);
    }
    if (mine.sequence_number() < sequence) break;
  }
  const bool still_to_come = held_.empty() || held_.back().answer.sequence_number() < sequence;
  if (still_to_come) early_.push_overwriting(other);
}

// The active one answers a publisher that began anew: published later than all before, with a
// smaller number, and no late sample.
bool HotStandby::begins_anew(const msg::CompensatedRate& other) const noexcept {
  if (!heard_to_ || other.sequence_number() >= *heard_to_) return false;
  const bool is_later = heard_publish_ns_ != 0 && other.publish_time_ns() > heard_publish_ns_;
  return other.sequence_number() + kAnew < *heard_to_ || (is_later && other.order() == 0);
}

// The active one is through with the run before: nothing of it is missed any more.
void HotStandby::drop_run_before(const msg::CompensatedRate& other) noexcept {
  const auto is_before = [&](const msg::CompensatedRate& answer) {
    const std::int64_t published_ns = answer.publish_time_ns();
    return (answer.sequence_number() > other.sequence_number() &&
            published_ns <= other.publish_time_ns()) ||
           (heard_publish_ns_ != 0 && published_ns <= heard_publish_ns_);
  };
  while (!held_.empty() && is_before(held_.front().answer)) held_.pop();
  while (!early_.empty() && is_before(early_.front())) early_.pop();
}

// The one that was relieved is there after all, or was when it wrote this.
void HotStandby::hear_weaker(std::uint64_t sequence, std::int64_t now_ns) noexcept {
  if (!doubted_ || sequence < doubted_->sequence) return;
  const Doubt doubt = *std::exchange(doubted_, std::nullopt);
  if (sequence == doubt.sequence) note_lag(sequence, now_ns - doubt.since_ns, now_ns);
}

// One that was stopped or cut off comes later than any patience: what it wrote meanwhile arrives at
// once.
void HotStandby::note_lag(std::uint64_t sequence, std::int64_t lag_ns,
                          std::int64_t now_ns) noexcept {
  if (lag_ns > kSilenceLongest.count()) {
    late_until_ns_ = now_ns + kSilenceLate.count();
    return;
  }
  const bool waited = sequence <= lag_from_ && sequence + kAnew >= lag_from_;
  if (waited) return;
  lag_ns_ = std::max(lag_ns, lag_ns_ - lag_ns_ / kLagMemory);
}

void HotStandby::compare(const msg::CompensatedRate& mine,
                         const msg::CompensatedRate& other) noexcept {
  ++compared_;
  if (same_answer(mine, other)) {
    differing_run_ = 0;
    return;
  }
  ++differing_;
  ++differing_run_;
}

// Published later than anything heard, it is of a run that the other hasn't begun.
bool HotStandby::was_heard(const msg::CompensatedRate& answer) const noexcept {
  return heard_to_ && answer.sequence_number() <= *heard_to_ &&
         (heard_publish_ns_ == 0 || answer.publish_time_ns() <= heard_publish_ns_);
}

HotStandby::Duration HotStandby::patience(std::int64_t now_ns) const noexcept {
  if (!heard_to_) return kDiscovery;
  if (paced_) return kSilencePaced;
  const Health health = this->health();
  if (now_ns < late_until_ns_)
    return health == Health::kUnwell ? kSilenceLate + kSilenceUnwell : kSilenceLate;
  if (health == Health::kUnwell) return kSilenceUnwell;
  if (health == Health::kBehind) return std::max(kSilenceBehind, 2 * usual_patience());
  return usual_patience();
}

HotStandby::Duration HotStandby::usual_patience() const noexcept {
  return std::clamp(Duration{kLagFactor * lag_ns_}, kSilence, kSilenceLongest);
}

std::size_t HotStandby::first_unheard() const noexcept {
  std::size_t first = held_.size();
  while (first > 0 && !was_heard(held_[first - 1].answer)) --first;
  return first;
}

bool HotStandby::must_take_over(std::int64_t now_ns) const noexcept {
  if (role_ == Role::kActive || held_.empty()) return false;
  if (!heard_to_) return now_ns - standby_since_ns_ >= patience(now_ns).count();
  const std::size_t first = first_unheard();
  return first < held_.size() && now_ns - held_[first].since_ns >= patience(now_ns).count() &&
         is_silent(now_ns) && now_ns - listening_since_ns_ >= usual_patience().count();
}

// Late answers are worth waiting for as long as they go on coming: the one that answers late is on
// its way through what it got late.
bool HotStandby::is_silent(std::int64_t now_ns) const noexcept {
  return now_ns - heard_ns_ >= patience(now_ns).count();
}

std::size_t HotStandby::first_to_write(std::int64_t now_ns) const noexcept {
  const Duration repeated = patience(now_ns) + std::max(kRepeated, Duration{kRepairs * lag_ns_});
  std::size_t first = held_.size();
  while (first > 0) {
    const Held& held = held_[first - 1];
    if (was_heard(held.answer) && now_ns - held.since_ns > repeated.count()) break;
    --first;
  }
  return first;
}

void HotStandby::step_back(std::int64_t now_ns) noexcept {
  ++step_backs_;
  role_ = Role::kStandby;
  in_sync_ = false;
  standby_since_ns_ = now_ns;
  lag_from_ = newest_;
  doubted_.reset();
  heard_to_.reset();
  heard_publish_ns_ = 0;
  differing_run_ = 0;
  early_.clear();
}

void HotStandby::set_unwell(bool unwell, std::int64_t now_ns) noexcept {
  if (is_alone() || unwell == unwell_) return;
  unwell_ = unwell;
  if (unwell && role_ == Role::kActive) {
    step_back(now_ns);
    held_.clear();
    heard_to_ = 0;  // another is there, and will be heard soon or never
  }
}

bool HotStandby::needs_state() const noexcept {
  return role_ == Role::kStandby && !unwell_ && heard_to_ &&
         (!in_sync_ || differing_run_ >= kDifferingRun);
}

std::uint32_t HotStandby::wanted_strength() const noexcept {
  const bool is_weaker = role_ == Role::kStandby && heard_strength_ >= strength_ && heard_to_;
  return is_weaker ? stronger_than(heard_strength_, *instance_) : strength_;
}

void HotStandby::caught_up(std::int64_t now_ns) noexcept {
  if (role_ == Role::kActive) return;
  in_sync_ = true;
  late_until_ns_ = 0;
  standby_since_ns_ = now_ns;
  differing_run_ = 0;
  held_.clear();
  early_.clear();
}

}  // namespace zerodrift::service
