// SPDX-License-Identifier: Apache-2.0
// Which of several publishers of a stream is followed, so that two streams are never mixed:
// the first, until it is gone or silent. What another one sends waits meanwhile: it is refused when
// the one that is followed goes on, and taken when that one is over. So GyroPipeline does it for
// rates, which come much faster, and of which instances have to follow the same.
//
// Time is nanoseconds of the host's monotonic clock. One thread. Allocates nothing once it is made.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "common/core/integer_time.h"
#include "common/core/ring_buffer.h"
#include "common/core/samples.h"

namespace zerodrift::service {

inline constexpr std::int64_t kSilentPublisherNs = 1'000'000'000;  // may be replaced

// A `Sample` has its sensor's `time`, and may say by `measured` that it is no end of the stream.
template <typename Writer, typename Sample = core::TemperatureSample>
class FollowedWriter {
 public:
  static constexpr std::size_t kWaiting = 512;  // as many as a writer keeps

  // `stale_after`: who sends nothing for so long may be replaced, however slow it is. `waiting`: of
  // more samples that wait the oldest are refused.
  explicit FollowedWriter(core::SensorTime stale_after, std::size_t waiting = kWaiting)
      : stale_after_(stale_after), waiting_(waiting) {}

  // Gives `take` what is to be used now, in order of arrival.
  template <typename Take>
  void push(const Sample& sample, const Writer& writer, std::int64_t now_ns, const Take& take) {
    if (!followed_) followed_ = writer;
    if (*followed_ == writer) {
      rejected_ += waiting_.size();
      waiting_.clear();
      use(sample, now_ns, take);
      return;
    }
    if (waiting_.full()) ++rejected_;
    waiting_.push_overwriting({sample, writer});
    follow_who_waits(now_ns, take);
  }
  // The writer is gone for good. True: it was followed, and nobody waits.
  template <typename Take>
  bool leave(const Writer& writer, std::int64_t now_ns, const Take& take) {
    if (followed_ != writer) {
      refuse(writer);
      return false;
    }
    if (is_gone_) return false;
    is_gone_ = true;
    follow_who_waits(now_ns, take);
    return is_gone_;
  }
  // From time to time: one that waits may have sent all it has for now.
  template <typename Take>
  void follow_who_waits(std::int64_t now_ns, const Take& take) {
    if (waiting_.empty() || (!is_gone_ && !is_silent(now_ns))) return;
    followed_ = waiting_.front().writer;
    newest_.reset();
    for (std::size_t left = waiting_.size(); left > 0; --left) {
      const Waiting first = waiting_.front();
      waiting_.pop();
      if (first.writer == followed_) {
        use(first.sample, now_ns, take);
      } else {
        ++rejected_;
      }
    }
  }

  [[nodiscard]] bool follows(const Writer& writer) const noexcept { return followed_ == writer; }
  // The one that was followed is gone, and nobody has sent since.
  [[nodiscard]] bool is_gone() const noexcept { return is_gone_; }
  // What was used last is a measurement, not that nothing more comes.
  [[nodiscard]] bool is_in_mid_run() const noexcept { return is_in_mid_run_; }
  [[nodiscard]] std::uint64_t rejected() const noexcept { return rejected_; }

 private:
  struct Waiting {
    Sample sample{};
    Writer writer{};
  };

  template <typename Take>
  void use(const Sample& sample, std::int64_t now_ns, const Take& take) {
    interval_.reset();
    if (newest_ && sample.time > *newest_)
      interval_ = core::saturating_difference(sample.time, *newest_);
    newest_ = sample.time;
    received_ns_ = now_ns;
    is_gone_ = false;
    if constexpr (requires { sample.measured; }) is_in_mid_run_ = sample.measured;
    take(sample);
  }
  // It has left out a reading, by the spacing of its last two.
  [[nodiscard]] bool is_silent(std::int64_t now_ns) const noexcept {
    std::int64_t limit_ns = stale_after_.count();
    if (interval_ && interval_->count() < limit_ns / 2)
      limit_ns = std::min(limit_ns, std::max(kSilentPublisherNs, 2 * interval_->count()));
    return now_ns - received_ns_ > limit_ns;
  }
  void refuse(const Writer& writer) {
    for (std::size_t left = waiting_.size(); left > 0; --left) {
      Waiting first = std::move(waiting_.front());
      waiting_.pop();
      if (first.writer == writer) {
        ++rejected_;
      } else {
        waiting_.push(std::move(first));
      }
    }
  }

  core::SensorTime stale_after_;
  core::RingBuffer<Waiting> waiting_;  // since the newest of the one that is followed
  std::optional<Writer> followed_{};
  std::optional<core::SensorTime> newest_{};    // of the one that is followed
  std::optional<core::SensorTime> interval_{};  // between its last two
  std::int64_t received_ns_ = 0;
  bool is_gone_ = false;
  bool is_in_mid_run_ = false;
  std::uint64_t rejected_ = 0;
};

}  // namespace zerodrift::service
