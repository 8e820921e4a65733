// SPDX-License-Identifier: Apache-2.0
// Honest judgement of a drift scheme on one axis of a record: every label is predicted before it,
// or any label that could give it away, is learned.
//
//   one ahead  labels are learned as soon as they end: the easiest horizon, where holding the last
//              value nearly ties with any model
//   delayed    a label is learned only `delay_s` after its end, as in a motion that long
//   frozen     nothing is learned from `frozen_from` on, and what comes after is judged
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/compensation/label_builder.h"
#include "common/regression/drift_scheme.h"

namespace zerodrift::comparison {

// A label of one axis with the features that were known when it was measured. SI.
struct LabelledPoint {
  core::SensorTime begin{0};
  core::SensorTime end{0};
  double drift_radps = 0.0;
  double variance = 0.0;  // of the label as a measurement
  compensation::FeatureArray features{};
  double prior_radps = 0.0;  // the prior's part of the drift
};

struct Protocol {
  std::string name;
  double delay_s = 0.0;
  core::SensorTime frozen_from = core::SensorTime::max();  // labels ending later are not learned
  core::SensorTime judged_from{0};                         // labels ending later are judged
  // Errors at labels ending earlier don't calibrate the scheme's intervals: those of a scheme that
  // has still to be trained say nothing of it.
  core::SensorTime calibrated_from{0};
};

// How old the newest label that was known is at the beginning of a judged one, in the median, in
// seconds: `delay_s` where labels follow on each other, more behind motion, in which there are
// none. NaN where nothing is judged. O(points log points).
[[nodiscard]] double median_age_s(const Protocol& protocol, std::span<const LabelledPoint> points);

// What a scheme said of a point before it knew it. Nothing where it was not judged.
struct PredictedPoint {
  double drift_radps = 0.0;
  // Of the drift: what the service sends out, or of a scheme for comparison what is calibrated on
  // its own past errors; -1: unknown.
  double variance = -1.0;
};

// One entry a point; nothing either before the scheme has learned a label. The scheme must be new,
// the points in the order of time and not overlapping. O(points * (learn + predict)).
[[nodiscard]] std::vector<std::optional<PredictedPoint>> predict_all(
    const Protocol& protocol, std::span<const LabelledPoint> points, std::size_t dimension,
    regression::DriftScheme& scheme);

// As the service does with a prior: the scheme learns what that leaves of the drift, and the
// prior's part is added to what it foretells. Without a prior as predict_all().
[[nodiscard]] std::vector<std::optional<PredictedPoint>> predict_on_prior(
    const Protocol& protocol, std::span<const LabelledPoint> points, std::size_t dimension,
    regression::DriftScheme& scheme);

// How the residual, label less prediction, is distributed over the judged points; all NaN without
// any, or if a prediction is not finite.
struct ResidualStatistics {
  std::size_t points = 0;
  double mean = std::numeric_limits<double>::quiet_NaN();
  // About the mean, of the population: root_mean_square² = mean² + standard_deviation².
  double standard_deviation = std::numeric_limits<double>::quiet_NaN();
  double mean_absolute = std::numeric_limits<double>::quiet_NaN();
  double root_mean_square = std::numeric_limits<double>::quiet_NaN();
  // Share of labels within 1.96 standard deviations of the prediction, of stated variance plus the
  // label's own; NaN where no variance was stated.
  double coverage = std::numeric_limits<double>::quiet_NaN();
};

[[nodiscard]] ResidualStatistics residual_statistics(
    std::span<const LabelledPoint> points,
    std::span<const std::optional<PredictedPoint>> predictions);

// Where the record's last leg begins, for the frozen judgement: the last turning point of a feature
// (the temperature) with at least a tenth of the points before and after it, turned by more than a
// twentieth of its range and by more than `least_turn`, in the feature's units; without one, two
// thirds of the points into the record. Needs a point.
[[nodiscard]] core::SensorTime begin_of_last_leg(std::span<const LabelledPoint> points,
                                                 std::size_t feature, double least_turn);

}  // namespace zerodrift::comparison
