// SPDX-License-Identifier: Apache-2.0
#include "common/comparison/paper_procedure.h"

#include <array>
#include <cmath>

#include "common/core/not_known.h"
#include "common/core/units.h"

namespace zerodrift::comparison {
namespace {

constexpr double kTemperatureScaleDegc = 10.0;
constexpr double kMinuteS = 60.0;
using core::kNaN;

constexpr std::array<PaperFigures, 4> kPaperFigures{
    PaperFigures{"none", 0.3082, 1.1204, kNaN, kNaN, kNaN, 9.33e-4, 1.57e-2, 4.49e-2},
    PaperFigures{"rbf", 0.0897, 0.1888, 0.1744, 0.2091, 3.9e-3, 1.61e-3, 4.46e-3, 4.41e-2},
    PaperFigures{"svr", -0.0643, 0.0235, 0.0643, 0.0685, 1.1e-3, 1.83e-4, 2.90e-3, 1.71e-2},
    PaperFigures{"online-svr", -0.0173, 0.0217, 0.0253, 0.0278, 4.13e-4, 2.21e-4, 1.81e-3,
                 1.57e-2}};

regression::DriftLabel label_of(const LabelledPoint& point) {
  return {.time_s = core::seconds(point.end),
          .duration_s = core::seconds(point.end - point.begin),
          .features = {point.features.data(), kPaperFeatures},
          .drift = point.drift_radps,
          .variance = point.variance};
}

}  // namespace

std::vector<LabelledPoint> paper_points(std::span<const double> rate_radps,
                                        std::span<const double> temperature_degc, double interval_s,
                                        double point_variance) {
  std::vector<LabelledPoint> points;
  for (std::size_t i = 1; i < rate_radps.size() && i < temperature_degc.size(); ++i) {
    // Eq. (12): the difference of two moving means, one step apart.
    const double rate_degc_per_s = (temperature_degc[i] - temperature_degc[i - 1]) / interval_s;
    if (!std::isfinite(rate_degc_per_s) || !std::isfinite(rate_radps[i])) break;
    LabelledPoint point;
    point.begin = core::from_seconds(static_cast<double>(i) * interval_s);
    point.end = core::from_seconds(static_cast<double>(i + 1) * interval_s);
    point.drift_radps = rate_radps[i];
    point.variance = point_variance;
    point.features[0] = temperature_degc[i] / kTemperatureScaleDegc;
    point.features[1] = rate_degc_per_s * kMinuteS;
    point.features[2] = core::deg_h_from_radps(rate_radps[i - 1]);
    points.push_back(point);
  }
  return points;
}

bool is_batch_trained(std::string_view scheme) {
  return scheme == "rbf" || scheme == "svr";
}

std::vector<double> paper_residuals(std::string_view name, std::span<const LabelledPoint> points,
                                    regression::DriftScheme& scheme) {
  std::vector<double> residuals;
  residuals.reserve(points.size());
  const bool batch = is_batch_trained(name);
  for (std::size_t i = 0; batch && i < points.size(); i += kPaperTrainingStride)
    scheme.learn(label_of(points[i]));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const LabelledPoint& point = points[i];
    scheme.observe(core::seconds(point.end), {point.features.data(), kPaperFeatures});
    const auto made =
        scheme.predict(core::seconds(point.end), {point.features.data(), kPaperFeatures});
    if (i >= kPaperInitialPoints) residuals.push_back(point.drift_radps - made.drift);
    if (!batch) scheme.learn(label_of(point));
  }
  return residuals;
}

std::span<const PaperFigures> paper_figures() {
  return kPaperFigures;
}

}  // namespace zerodrift::comparison
