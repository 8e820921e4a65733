// SPDX-License-Identifier: Apache-2.0
#include "common/record/elapsed_time.h"

#include <algorithm>

#include "common/core/integer_time.h"

namespace zerodrift::record {
namespace {

constexpr double kUsualSteps = 100.0;
// One long step is not what makes the next one usual; many of them are.
constexpr double kMostOfAStepS = 600.0;

double seconds(core::SensorTime later, core::SensorTime earlier) {
  return 1e-9 * static_cast<double>(core::saturating_difference(later, earlier).count());
}

}  // namespace

double ElapsedTime::add(core::SensorTime stamp, Stream& stream) {
  if (!newest_) began_ = stamp;
  if (newest_ && is_step(stamp, stream)) begin_anew(stamp);
  if (newest_ && stamp > *newest_) {
    forward_s_ += std::min(seconds(stamp, *newest_), kMostOfAStepS);
    ++forward_;
  }
  newest_ = std::max(newest_.value_or(stamp), stamp);
  if (stream.step != step_count_ || !stream.newest) stream = {stamp, step_count_};
  stream.newest = std::max(*stream.newest, stamp);
  return elapsed_s(stamp);
}

double ElapsedTime::elapsed_s(core::SensorTime stamp) const {
  return before_s_ + seconds(stamp, began_);
}

// Streams of a file need not be in order among each other: what is earlier than another stream's
// newest alone is no step.
bool ElapsedTime::is_step(core::SensorTime stamp, const Stream& stream) const {
  const auto is_back = [stamp](core::SensorTime newest) {
    return core::saturating_difference(newest, stamp) > core::kLargestStepBack;
  };
  if (stream.newest && is_back(*stream.newest) && is_back(*newest_)) return true;
  if (forward_ == 0 || !core::is_far_ahead(stamp, *newest_)) return false;
  return seconds(stamp, *newest_) > kUsualSteps * forward_s_ / static_cast<double>(forward_);
}

void ElapsedTime::begin_anew(core::SensorTime stamp) {
  const double by_s = seconds(stamp, *newest_);
  before_s_ = elapsed_s(*newest_);
  if (steps_.size() < kStepsKept) steps_.push_back({before_s_, by_s});
  ++step_count_;
  if (by_s > 0.0) {
    forward_s_ += std::min(by_s, kMostOfAStepS);
    ++forward_;
  }
  began_ = stamp;
  newest_ = stamp;
}

}  // namespace zerodrift::record
