// SPDX-License-Identifier: Apache-2.0
#include "common/comparison/test_then_train.h"

#include <algorithm>
#include <cmath>

#include "common/comparison/paper_preparation.h"
#include "common/core/median.h"
#include "common/core/not_known.h"
#include "common/regression/interval_calibrator.h"

namespace zerodrift::comparison {
namespace {

constexpr double kHysteresis = 0.05;  // of the temperature's range
constexpr double kShortestLeg = 0.1;  // of the points

regression::DriftLabel label_of(const LabelledPoint& point, std::size_t dimension) {
  return {.time_s = core::seconds(point.end),
          .duration_s = core::seconds(point.end - point.begin),
          .features = {point.features.data(), dimension},
          .drift = point.drift_radps,
          .variance = point.variance};
}

// Of what ended `delay` before the judged label began.
bool is_known(const LabelledPoint& label, core::SensorTime delay, const Protocol& protocol,
              const LabelledPoint& judged) {
  return label.end + delay <= judged.begin && label.end <= protocol.frozen_from;
}

// A prediction that waits for its label.
struct Pending {
  bool knew_something = false;  // the scheme had learned a label
  double drift = 0.0;
  regression::StatedVariance stated;
};

}  // namespace

double median_age_s(const Protocol& protocol, std::span<const LabelledPoint> points) {
  const core::SensorTime delay = core::from_seconds(protocol.delay_s);
  std::vector<double> ages_s;
  std::size_t known = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const LabelledPoint& point = points[i];
    while (known < i && is_known(points[known], delay, protocol, point)) ++known;
    if (known > 0 && point.end > protocol.judged_from)
      ages_s.push_back(core::seconds(point.begin - points[known - 1].end));
  }
  return ages_s.empty() ? core::kNaN : core::median_of(std::move(ages_s));
}

std::vector<std::optional<PredictedPoint>> predict_all(const Protocol& protocol,
                                                       std::span<const LabelledPoint> points,
                                                       std::size_t dimension,
                                                       regression::DriftScheme& scheme) {
  std::vector<std::optional<PredictedPoint>> predictions(points.size());
  std::vector<Pending> pending(points.size());
  regression::IntervalCalibrator calibrator;
  const core::SensorTime delay = core::from_seconds(protocol.delay_s);
  std::size_t learned = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const LabelledPoint& point = points[i];
    while (learned < i && is_known(points[learned], delay, protocol, point)) {
      const LabelledPoint& known = points[learned];
      const Pending& said = pending[learned];
      if (said.knew_something && known.end > protocol.calibrated_from)
        calibrator.observe(known.drift_radps - said.drift, said.stated, known.variance);
      scheme.learn(label_of(known, dimension));
      ++learned;
    }
    scheme.observe(core::seconds(point.end), {point.features.data(), dimension});
    const auto made = scheme.predict(core::seconds(point.end), {point.features.data(), dimension});
    pending[i] = {learned > 0, made.drift, calibrator.calibrate(made.variance)};
    if (learned > 0 && point.end > protocol.judged_from)
      predictions[i] = {made.drift,
                        made.is_sent_out ? made.variance : pending[i].stated.calibrated};
  }
  return predictions;
}

std::vector<std::optional<PredictedPoint>> predict_on_prior(const Protocol& protocol,
                                                            std::span<const LabelledPoint> points,
                                                            std::size_t dimension,
                                                            regression::DriftScheme& scheme) {
  std::vector<LabelledPoint> rest(points.begin(), points.end());
  for (LabelledPoint& point : rest) point.drift_radps -= point.prior_radps;
  auto predictions = predict_all(protocol, rest, dimension, scheme);
  for (std::size_t i = 0; i < rest.size(); ++i) {
    if (predictions[i]) predictions[i]->drift_radps += rest[i].prior_radps;
  }
  return predictions;
}

ResidualStatistics residual_statistics(std::span<const LabelledPoint> points,
                                       std::span<const std::optional<PredictedPoint>> predictions) {
  ResidualStatistics out;
  std::vector<double> residuals;
  residuals.reserve(points.size());
  std::size_t stated = 0;
  std::size_t covered = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!predictions[i]) continue;
    const double residual = points[i].drift_radps - predictions[i]->drift_radps;
    residuals.push_back(residual);
    if (predictions[i]->variance < 0.0) continue;
    ++stated;
    const double variance = predictions[i]->variance + points[i].variance;
    const double bound = regression::kIntervalHalfWidth;
    if (residual * residual <= bound * bound * variance) ++covered;
  }
  out.points = residuals.size();
  const Moments m = moments(residuals);
  // moments() leaves out what is not finite; here a prediction that is no number may not vanish.
  if (m.points == 0 || m.points < residuals.size()) return out;
  out.mean = m.mean;
  out.standard_deviation = m.standard_deviation;
  out.mean_absolute = m.mean_absolute_error;
  out.root_mean_square = m.root_mean_square;
  if (stated > 0) out.coverage = static_cast<double>(covered) / static_cast<double>(stated);
  return out;
}

core::SensorTime begin_of_last_leg(std::span<const LabelledPoint> points, std::size_t feature,
                                   double least_turn) {
  const auto temperature = [&](std::size_t i) { return points[i].features[feature]; };
  double low = temperature(0);
  double high = temperature(0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    low = std::min(low, temperature(i));
    high = std::max(high, temperature(i));
  }
  const double turned = std::max(kHysteresis * (high - low), least_turn);
  const auto n = static_cast<double>(points.size());
  const auto first = static_cast<std::size_t>(kShortestLeg * n);
  const auto last = static_cast<std::size_t>((1.0 - kShortestLeg) * n);

  std::size_t leg = static_cast<std::size_t>(2.0 * n / 3.0);
  std::size_t extreme = 0;  // of the present leg
  int direction = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double moved = temperature(i) - temperature(extreme);
    if (direction == 0 && std::abs(moved) > turned) direction = moved > 0.0 ? 1 : -1;
    if (moved * direction >= 0.0 && direction != 0) extreme = i;
    if (moved * direction < -turned) {
      if (extreme >= first && extreme <= last) leg = extreme;
      direction = -direction;
      extreme = i;
    }
  }
  return points[leg].end;
}

}  // namespace zerodrift::comparison
