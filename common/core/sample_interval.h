// SPDX-License-Identifier: Apache-2.0
// Over which time a sample was measured, where nobody says so: since the one before it, or, where
// samples are missing between the two, as long as is usual. What is missing is no part of what the
// sample measured: a rate that counts for a gap turns whoever integrates it through the gap.
#pragma once

namespace zerodrift::core {

// One stream, one thread. O(1) a sample, no allocation.
class SampleInterval {
 public:
  // `usual_s`: where it is known beforehand, else the first step is taken for it.
  explicit SampleInterval(double usual_s = 0.0) noexcept : usual_s_(usual_s) {}

  // Of a sample `step_s` > 0 after the one before. A longer step than is usual is a gap, several in
  // a row are another rate.
  [[nodiscard]] double after(double step_s) noexcept {
    const bool is_longer = usual_s_ > 0.0 && step_s > kLongestStep * usual_s_;
    longer_ = is_longer ? longer_ + 1 : 0;
    if (is_longer && longer_ < kAnotherRate) return usual_s_;
    usual_s_ = is_longer || usual_s_ <= 0.0 ? step_s : usual_s_ + kGain * (step_s - usual_s_);
    return step_s;
  }

 private:
  static constexpr double kLongestStep = 1.5;  // of the usual one
  static constexpr int kAnotherRate = 4;
  static constexpr double kGain = 0.125;

  double usual_s_;
  int longer_ = 0;
};

}  // namespace zerodrift::core
