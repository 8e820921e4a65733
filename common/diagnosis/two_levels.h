// SPDX-License-Identifier: Apache-2.0
// Whether a slow course wanders or switches between two levels: two processes of the same spectrum,
// which only their likelihoods tell apart.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace zerodrift::diagnosis {

// A series averaged over blocks of equal length.
struct CourseBlocks {
  std::vector<double> values{};  // rad/s; 0 where a block has no valid sample
  std::vector<double> counts{};  // valid samples in each
  double interval_s = 0.0;       // of a block
  double variance = 0.0;         // of the samples within a block
};

// Blocks of an eighth of the correlation time, 20 s at most, a sample at least.
[[nodiscard]] CourseBlocks course_blocks(std::span<const double> series_radps,
                                         std::span<const std::uint8_t> valid, double interval_s,
                                         double correlation_s);

// Each beside a bias that walks at random and white noise, both of any strength.
struct WanderingFit {  // an Ornstein-Uhlenbeck process
  // Of one strength throughout, or of one in each twelfth of the record, less what its freedom
  // costs: what wanders now more and now less isn't Gaussian, and must not look like levels.
  double log_likelihood = 0.0;
  double sigma_radps = 0.0;
  double correlation_s = 0.0;
};
struct SwitchingFit {  // two levels, dwell times exponential
  double log_likelihood = 0.0;
  double amplitude_radps = 0.0;  // between the levels
  double up_s = 0.0;             // mean dwell times
  double down_s = 0.0;
};

// Both maximise the likelihood of the block means over all their parameters from what the spectrum
// says, one logarithm after another (golden section). A Kalman filter of two states; for the levels
// two filters of one state, mixed at each block by the switching probabilities (interacting
// multiple models: Blom & Bar-Shalom, IEEE Trans. Automatic Control 33 (1988) 780). O(blocks) an
// evaluation, a few hundred evaluations.
[[nodiscard]] WanderingFit fit_wandering(const CourseBlocks& blocks, double sigma_radps,
                                         double correlation_s);
[[nodiscard]] SwitchingFit fit_switching(const CourseBlocks& blocks, double sigma_radps,
                                         double correlation_s);

}  // namespace zerodrift::diagnosis
