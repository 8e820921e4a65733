// SPDX-License-Identifier: Apache-2.0
// A fitted noise applied to time series: its variances on the full cosine grid, and a series
// divided by its covariance.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/diagnosis/noise_spectrum.h"

namespace zerodrift::diagnosis {

// Variance of every DCT-II coefficient of n samples; element 0, the mean, is 0.
[[nodiscard]] std::vector<double> dct_variances(std::span<const NoiseTerm> terms,
                                                std::span<const double> squares, std::size_t size,
                                                double interval_s);

// C^-1 x for the covariance C that the variances are the eigenvalues of; the mean is dropped. Equal
// to a filter over the series and its mirror image. O(n log n) where n has small prime factors.
[[nodiscard]] std::vector<double> divided_by_noise(std::span<const double> series,
                                                   std::span<const double> variances);

// Of what is valid; 0 where nothing is.
[[nodiscard]] double mean_of_valid(std::span<const double> values,
                                   std::span<const std::uint8_t> valid);

// Takes the mean of what is valid off, and sets the rest to 0.
void centre(std::vector<double>& values, std::span<const std::uint8_t> valid);

// x'C^-1 x about the mean, over the first variances.size() samples: by how much it falls is twice
// the log likelihood that an explanation gains.
[[nodiscard]] double weighted_square(std::vector<double> series,
                                     std::span<const std::uint8_t> valid,
                                     std::span<const double> variances);

// Of the mean over what is valid of the first variances.size() samples, whose own mean is 0.
[[nodiscard]] double variance_of_mean(std::span<const std::uint8_t> valid,
                                      std::span<const double> variances);

// How much likelier the series about its mean is under a noise `after` than under `before`, over
// the first after.size() samples, nats (Whittle 1953). 0 where one of them is no noise.
[[nodiscard]] double noise_gain_nats(std::vector<double> series,
                                     std::span<const std::uint8_t> valid,
                                     std::span<const double> before, std::span<const double> after);

// Log likelihood that a line of this frequency, of any size and phase, gains on the series about
// its mean, over the first variances.size() samples, nats.
[[nodiscard]] double line_gain_nats(std::vector<double> series, std::span<const std::uint8_t> valid,
                                    std::span<const double> variances, double frequency_hz,
                                    double interval_s);

}  // namespace zerodrift::diagnosis
