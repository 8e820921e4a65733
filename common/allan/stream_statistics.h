// SPDX-License-Identifier: Apache-2.0
// All that is said of one axis of one stream of rates: Allan deviations since start and over a
// rolling window, noise coefficients, block means, gaps, and whether the output is stuck.
//
// The object is a value. Whoever receives samples on one thread and reports on another copies it
// under the lock (assignment to a kept copy takes no memory, see memory_bytes()) and lets the copy
// report().
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/allan/allan_point.h"
#include "common/allan/block_statistics.h"
#include "common/allan/coefficients.h"
#include "common/allan/rolling_allan.h"
#include "common/allan/stuck_detector.h"

namespace zerodrift::allan {

struct StreamStatisticsOptions {
  double sample_interval_s = 0.005;
  double window_s = 3600.0;      // rolling window; at least 64 samples are taken
  double longest_tau_s = 1e4;    // at least 16 samples are taken
  double block_s = 60.0;         // block means; at least a sample
  double stuck_after_s = 1.0;    // a run of equal values shorter than this is never called stuck
  double stuck_surely_s = 60.0;  // ... longer than this always is

  // Names the first wrong key.
  [[nodiscard]] std::optional<std::string> validate() const;
};

struct StreamReport {
  std::uint64_t samples = 0;  // valid ones since start
  std::uint64_t gaps = 0;     // interruptions
  std::uint64_t missing = 0;  // samples in them, those that were no number included
  double longest_gap_s = 0.0;
  double sample_interval_s = 0.0;
  double window_s = 0.0;  // that the rolling points ask for
  std::vector<AllanPoint> since_start;
  std::vector<AllanPoint> rolling;
  CoefficientReport coefficients;  // of since_start
  double block_s = 0.0;
  BlockMoments since_start_blocks;
  BlockMoments rolling_blocks;
  StuckDetector::Output output = StuckDetector::Output::kAlive;

  // Time that was measured: samples times their interval.
  [[nodiscard]] double observed_s() const noexcept {
    return static_cast<double>(samples) * sample_interval_s;
  }
};

class StreamStatistics {
 public:
  // Throws std::invalid_argument with validate()'s sentence. All memory is taken here.
  explicit StreamStatistics(const StreamStatisticsOptions& options);

  // Next sample. A rate that is no number, or beyond RollingAllan::largest_rate_radps(), is a
  // missing one. O(1) amortised, no allocation.
  void add(double rate_radps) noexcept;
  // Time passed without that many samples.
  void gap(std::uint64_t missing_samples) noexcept;
  // Block means are taken from here on; not before the first call.
  void begin_blocks() noexcept { takes_blocks_ = true; }

  [[nodiscard]] std::uint64_t samples() const noexcept { return deviations_.samples(); }
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

  // Points at 95 % confidence; coefficients N, B, K by fit_coefficients(), short octaves left out
  // as in identify_noise(). A few milliseconds (most of it quantiles and the fit); allocates. All
  // times go by the interval that the samples turned out to have.
  [[nodiscard]] StreamReport report(double mean_interval_s) const;
  [[nodiscard]] StreamReport report() const { return report(sample_interval_s_); }

 private:
  void count_missing(std::uint64_t samples) noexcept;

  double sample_interval_s_;
  double window_s_;
  RollingAllan deviations_;
  BlockStatistics blocks_;
  StuckDetector stuck_;
  bool takes_blocks_ = false;
  std::uint64_t missing_ = 0;
  std::uint64_t missing_now_ = 0;  // in the gap that is open
  std::uint64_t longest_gap_ = 0;  // samples
};

}  // namespace zerodrift::allan
