// SPDX-License-Identifier: Apache-2.0
// The comparison as Mao et al. (2022) made it, for their tables 1 to 3: rate and temperature
// prepared by a moving minute (paper_preparation.h), temperature rate by eq. (12), targets one step
// apart. Neighbouring targets share 11 760 of 12 000 samples, so the next one is nearly given away
// by the last: figures of this procedure say little of a gyro in motion. The honest ones are those
// of test_then_train.h.
//
// The online schemes predict each point before they learn it. RBF network and SVR are trained once,
// on a sample of the whole series, and judged on the same series: what the paper's figures for them
// imply.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/comparison/paper_preparation.h"
#include "common/comparison/test_then_train.h"
#include "common/regression/drift_scheme.h"

namespace zerodrift::comparison {

// The prepared series as labels with features {temperature / 10 °C, temperature rate / (1 °C/min),
// the point before / (1 deg/h)}: the last is the paper's "pulse-related term".
// `temperature_degc`: as many as `rate_radps`; NaN anywhere ends the series there.
// `point_variance`: of a point as a measurement, (rad/s)², > 0.
[[nodiscard]] std::vector<LabelledPoint> paper_points(std::span<const double> rate_radps,
                                                      std::span<const double> temperature_degc,
                                                      double interval_s, double point_variance);

inline constexpr std::size_t kPaperFeatures = 3;
// Every so manyth point trains the batch schemes.
inline constexpr std::size_t kPaperTrainingStride = 25;
// The initial set of the online schemes: a minute. Not judged, of any scheme.
inline constexpr std::size_t kPaperInitialPoints = 50;

[[nodiscard]] bool is_batch_trained(std::string_view scheme);

// Point less prediction, from point kPaperInitialPoints on.
[[nodiscard]] std::vector<double> paper_residuals(std::string_view name,
                                                  std::span<const LabelledPoint> points,
                                                  regression::DriftScheme& scheme);

// What the paper prints; deg/h, deg/√h, deg/h^1.5, s. NaN where it prints nothing.
struct PaperFigures {
  std::string_view scheme;  // by our name
  double mean_deg_h;
  double standard_deviation_deg_h;
  double mean_absolute_deg_h;
  double root_mean_square_deg_h;
  double seconds_a_point;
  double angle_random_walk_deg_rth;
  double bias_instability_deg_h;
  double rate_random_walk_deg_h_rth;
};
[[nodiscard]] std::span<const PaperFigures> paper_figures();

}  // namespace zerodrift::comparison
