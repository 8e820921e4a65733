// SPDX-License-Identifier: Apache-2.0
#include "common/allan/series_check.h"

#include <algorithm>
#include <cmath>

#include "common/core/median.h"

namespace zerodrift::allan {
namespace {

constexpr std::size_t kBlock = 4096;
constexpr std::size_t kFewestOfABlock = 16;       // to speak of their spread
constexpr double kSigmaOfMeanDeviation = 1.2533;  // of a normal distribution: sqrt(pi / 2)

// The median deviation; where more than half of the samples are equal, as counts may be, the mean
// one. 0 for a constant.
double robust_sigma(const std::vector<double>& values, double centre) {
  std::vector<double> deviations;
  deviations.reserve(values.size());
  double sum = 0.0;
  for (const double value : values) {
    deviations.push_back(std::abs(value - centre));
    sum += deviations.back();
  }
  const double mean = sum / static_cast<double>(values.size());
  const double middle = core::median_of(std::move(deviations));
  return middle > 0.0 ? middle / core::kMedianOfNormal : kSigmaOfMeanDeviation * mean;
}

// Expected number of runs that long in n samples of which a share of the neighbours is equal.
bool is_stuck(std::uint64_t run, std::uint64_t samples, std::uint64_t equal_pairs) {
  if (run < 3) return false;
  const double others = static_cast<double>(equal_pairs - (run - 1));
  const double pairs = static_cast<double>(samples) - static_cast<double>(run);
  // The run itself is not evidence of how often neighbours are equal.
  const double share = (others + 1.0) / (pairs + 2.0);
  const double log_expected =
      std::log(static_cast<double>(samples)) + static_cast<double>(run - 1) * std::log(share);
  return log_expected < std::log(kStuckProbability);
}

}  // namespace

SeriesCheck::SeriesCheck() {
  block_.reserve(kBlock);
  places_.reserve(kBlock);
}

void SeriesCheck::Outliers::operator+=(const Outliers& later) {
  if (count == 0) first = later.first;
  count += later.count;
  largest_sigmas = std::max(largest_sigmas, later.largest_sigmas);
}

void SeriesCheck::add(double value, std::uint64_t place) {
  follow_run(value, place);
  block_.push_back(value);
  places_.push_back(place);
  if (block_.size() < kBlock) return;
  outliers_ += outliers_of_block();
  block_.clear();
  places_.clear();
}

void SeriesCheck::follow_run(double value, std::uint64_t place) {
  const bool goes_on = samples_ > 0 && value == last_;
  ++samples_;
  last_ = value;
  if (goes_on) {
    ++equal_pairs_;
    ++run_;
  } else {
    run_ = 1;
    run_begin_ = place;
  }
  if (run_ <= longest_run_) return;
  longest_run_ = run_;
  longest_run_begin_ = run_begin_;
}

SeriesCheck::Outliers SeriesCheck::outliers_of_block() const {
  Outliers found;
  if (block_.size() < kFewestOfABlock) return found;
  const double centre = core::median_of(block_);
  const double sigma = robust_sigma(block_, centre);
  if (!(sigma > 0.0)) return found;
  for (std::size_t i = 0; i < block_.size(); ++i) {
    const double sigmas = std::abs(block_[i] - centre) / sigma;
    if (sigmas > kOutlierSigmas) found += Outliers{1, places_[i], sigmas};
  }
  return found;
}

SeriesFindings SeriesCheck::findings() const {
  Outliers outliers = outliers_;
  outliers += outliers_of_block();
  return {.samples = samples_,
          .outliers = outliers.count,
          .first_outlier = outliers.first,
          .largest_outlier_sigmas = outliers.largest_sigmas,
          .longest_run = longest_run_,
          .longest_run_begin = longest_run_begin_,
          .is_stuck = is_stuck(longest_run_, samples_, equal_pairs_),
          .is_constant = samples_ > 0 && equal_pairs_ == samples_ - 1};
}

}  // namespace zerodrift::allan
