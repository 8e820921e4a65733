// SPDX-License-Identifier: Apache-2.0
// What a metrologist would see in a plot of a series before trusting its statistics: single samples
// far off, and values that don't move. Nothing is removed; it is counted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace zerodrift::allan {

// Robust standard deviations (the median deviation from the median over that of a normal
// distribution) off the median of the 4096 samples around it: a spike, or true rotation.
inline constexpr double kOutlierSigmas = 30.0;

// A run of equal samples that noise as coarse as this series' would show in one record of a
// million.
inline constexpr double kStuckProbability = 1e-6;

struct SeriesFindings {
  std::uint64_t samples = 0;  // measured ones
  std::uint64_t outliers = 0;
  std::uint64_t first_outlier = 0;  // its place, missing samples counted; from 0
  double largest_outlier_sigmas = 0.0;
  std::uint64_t longest_run = 0;        // of equal samples
  std::uint64_t longest_run_begin = 0;  // its place
  bool is_stuck = false;                // that run is longer than noise explains
  bool is_constant = false;             // no two samples differ
};

class SeriesCheck {
 public:
  SeriesCheck();

  // The next measured sample and its place in the series. O(1) amortised.
  void add(double value, std::uint64_t place);

  [[nodiscard]] std::uint64_t samples() const noexcept { return samples_; }

  // Of all samples so far. O(block).
  [[nodiscard]] SeriesFindings findings() const;

 private:
  struct Outliers {
    std::uint64_t count = 0;
    std::uint64_t first = 0;
    double largest_sigmas = 0.0;

    void operator+=(const Outliers& later);
  };

  void follow_run(double value, std::uint64_t place);
  [[nodiscard]] Outliers outliers_of_block() const;

  std::vector<double> block_;
  std::vector<std::uint64_t> places_;
  Outliers outliers_;  // of the blocks before this one
  std::uint64_t samples_ = 0;
  std::uint64_t equal_pairs_ = 0;  // neighbours that are equal
  double last_ = 0.0;
  std::uint64_t run_ = 0;
  std::uint64_t run_begin_ = 0;
  std::uint64_t longest_run_ = 0;
  std::uint64_t longest_run_begin_ = 0;
};

}  // namespace zerodrift::allan
