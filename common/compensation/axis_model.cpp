// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/axis_model.h"

#include <cmath>
#include <limits>

#include "common/core/integer_time.h"

namespace zerodrift::compensation {
namespace {

constexpr double kLargestLabelRadps = 1e6;     // no gyro measures that: the number is corrupt
constexpr double kLongestLabelS = 1e12;        // options allow any length
constexpr double kLargestForecastRadps = 1e6;  // no gyro drifts so far

// What a stack predicted, or the last minute's mean where that is no drift of a gyro.
Forecast taken(const experts::StackForecast::Prediction& made, const AxisModel& model,
               core::SensorTime now) {
  const double held = held_variance(model.drift, model.trust, now);
  if (!(std::abs(made.drift) <= kLargestForecastRadps))
    return {.drift_radps = model.drift.held_radps, .variance = held};
  return {.kind = ForecastKind::kStack,
          .drift_radps = made.drift,
          .variance = made.variance >= 0.0 ? made.variance : held};
}

}  // namespace

double AxisModel::stack_time_s(core::SensorTime now) const noexcept {
  return drift.is_of_unknown_age(now) ? -std::numeric_limits<double>::infinity()
                                      : core::seconds(now);
}

void AxisLabel::carry(core::StateArchive& archive) {
  archive(time, duration_s, drift_radps, variance, features, thermal);
  archive.require(core::is_usable(time) && duration_s >= 0.0 && duration_s <= kLongestLabelS &&
                  std::abs(drift_radps) <= kLargestLabelRadps && variance >= 0.0);
}

Forecast stack_forecast(const AxisModel& model, const FeatureArray& features,
                        const experts::ThermalState& thermal, core::SensorTime now) noexcept {
  bool is_beyond = false;
  std::optional<experts::SvrForecast> by_svr;
  if (model.drift.trained) {
    const Forecast svr = forecast(model.drift, model.trust, features, now);
    is_beyond = svr.beyond_learned;
    by_svr = as_expert(svr);
  }
  Forecast out = taken(model.stack.predict(model.stack_time_s(now), thermal, by_svr), model, now);
  out.beyond_learned = is_beyond;
  // Beyond what was learned nothing was judged: what the stack changes there may be the error.
  const double changed = out.drift_radps - model.drift.held_radps;
  if (is_beyond) out.variance += changed * changed;
  return out;
}

Forecast forecast_in_time(const AxisModel& model, core::SensorTime now) noexcept {
  return taken(model.in_time.predict(model.stack_time_s(now), {}), model, now);
}

}  // namespace zerodrift::compensation
