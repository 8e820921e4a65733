// SPDX-License-Identifier: Apache-2.0
// How far twin and measurement are apart: root mean square of block means, and Allan deviations.
//
// A stationary (or random-walk-like) noise is given by the variances lambda_k of its orthonormal
// DCT-II coefficients, k = 0 .. n - 1, at the frequencies f_k = k / (2 n dt). Element 0 is the mean
// and is never used.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/finding.h"
#include "common/twin/model.h"

namespace zerodrift::diagnosis {

// Means over consecutive blocks of `block` values; a block with less than half its values valid is
// left out. `centre` is the block's middle, in intervals.
struct BlockMeans {
  std::vector<double> centre{};
  std::vector<double> mean{};
};
[[nodiscard]] BlockMeans block_means(std::span<const double> values,
                                     std::span<const std::uint8_t> valid, std::size_t block);

// Root mean square of the block means, and about their mean; 0 without two blocks.
struct BlockRms {
  double about_zero = 0.0;
  double about_mean = 0.0;
};
[[nodiscard]] BlockRms rms_of_block_means(std::span<const double> values,
                                          std::span<const std::uint8_t> valid, std::size_t block);

// About the mean, expected of a noise: sqrt(sum_k lambda_k (sin(pi f_k m dt) / (m sin(pi f_k dt)))²
// / n).
[[nodiscard]] double expected_rms_of_block_means(std::span<const double> dct_variances,
                                                 std::size_t block);

// More than twice what the noise alone makes: then something is missing, whatever it is. Never
// where there is no noise to judge by.
[[nodiscard]] bool stands_out(double rms_radps, double noise_rms_radps);

// Allan variance of a noise at cluster size m: 2/n sum_k lambda_k sin⁴(pi f_k m dt) / (m sin(pi f_k
// dt))². O(n).
[[nodiscard]] double allan_variance_of_noise(std::span<const double> dct_variances,
                                             std::size_t cluster_size);

// DCT variances of the stochastic effects that a model lists for one axis.
[[nodiscard]] std::vector<double> model_noise(const twin::Model& model, core::Axis axis,
                                              double interval_s, std::size_t size);

// Allan curves of the measured drift and of a twin that makes `drift` plus `noise`, at octaves up
// to a tenth of the record. Gaps as RollingAllan has them.
struct TwinWaveform {
  std::span<const double> drift_radps;
  std::span<const double> noise_dct_variances;
};
[[nodiscard]] AllanCurves allan_curves(std::span<const double> measured_radps,
                                       std::span<const std::uint8_t> valid, double interval_s,
                                       const TwinWaveform& before, const TwinWaveform& after);
[[nodiscard]] AllanDistance allan_distance(const AllanCurves& curves);

}  // namespace zerodrift::diagnosis
