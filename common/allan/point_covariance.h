// SPDX-License-Identifier: Apache-2.0
// How the overlapping Allan variances at the taus of one curve scatter together when the noise is a
// given mixture. Inner part of the coefficient fit.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/allan/allan_point.h"
#include "common/allan/noise_model.h"

namespace zerodrift::allan {

struct PointCovariance {
  Eigen::VectorXd degrees_of_freedom;  // 2 mean² / variance of each estimated variance
  Eigen::VectorXd deviation;           // its standard deviation, (rad/s)²
  Eigen::MatrixXd correlation;
};

// For a Gaussian mixture the covariance of two estimated variances is the integral of the squared
// cross-covariance of their second differences, which is a sum over the noises; so with the share
// s_j of noise j in the variance
//   correlation(a, b) = c(a, b) / sqrt(c(a, a) c(b, b)),
//   c(a, b) = sum over j, k of sqrt(s_j(a) s_j(b) s_k(a) s_k(b)) n_jk(b/a),
//   degrees of freedom = r / c(a, a) for r = M/S >> 1
// with tabulated n_jk. The points' own degrees of freedom, which are those of one pure noise, are
// carried over to the mixture by the ratio of the two; they stay as they are where
// AllanPoint::clusters is not known. Markov noise counts as random walk below its peak and as white
// above, white angle is uncorrelated with everything.
//
// Sinusoid and ramp do not scatter by themselves. A is measured against the noise S(f) at its
// frequency, var(A) = 2 S(f)/T, R against the noise of the record's halves, var(R) = 8
// sigma²(T/2)/T²; each moves all taus together. kCautious adds a doubt of half an ordinary standard
// deviation to each point, in proportion to their share: for weights, since no real tone or drift
// keeps the exact shape, and so that a fit can find its way to the frequency. O(points²).
enum class ShapeTrust : std::uint8_t { kFull, kCautious };

[[nodiscard]] PointCovariance point_covariance(const std::vector<AllanPoint>& points,
                                               const NoiseModel& model,
                                               ShapeTrust trust = ShapeTrust::kFull);

}  // namespace zerodrift::allan
