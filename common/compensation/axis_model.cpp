// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/axis_model.h"

#include <algorithm>
#include <cmath>

#include "common/core/integer_time.h"

namespace zerodrift::compensation {
namespace {

constexpr double kLargestLabelRadps = 1e6;     // no gyro measures that: the number is corrupt
constexpr double kLongestLabelS = 1e12;        // options allow any length
constexpr double kLargestForecastRadps = 1e6;  // no gyro drifts so far

}  // namespace

void AxisLabel::carry(core::StateArchive& archive) {
  archive(time, duration_s, drift_radps, variance, features, thermal);
  archive.require(core::is_usable(time) && duration_s >= 0.0 && duration_s <= kLongestLabelS &&
                  std::abs(drift_radps) <= kLargestLabelRadps && variance >= 0.0);
}

Forecast stack_forecast(const AxisModel& model, const FeatureArray& features,
                        const experts::ThermalState& thermal, core::SensorTime now) noexcept {
  Forecast out;
  std::optional<experts::SvrForecast> by_svr;
  if (model.drift.trained) {
    const Forecast svr = forecast(model.drift, model.trust, features, now);
    out.beyond_learned = svr.beyond_learned;
    by_svr = as_expert(svr);
  }
  const auto made = model.stack.predict(core::seconds(now), thermal, by_svr);
  const double held = held_variance(model.drift, model.trust, now);
  if (!(std::abs(made.drift) <= kLargestForecastRadps)) {
    out.drift_radps = model.drift.held_radps;
    out.variance = held;
    return out;
  }
  out.kind = ForecastKind::kStack;
  out.drift_radps = made.drift;
  out.variance = made.variance >= 0.0 ? made.variance : held;
  // Beyond what was learned nothing was judged: what the stack changes there may be the error.
  const double changed = made.drift - model.drift.held_radps;
  if (out.beyond_learned) out.variance += changed * changed;
  return out;
}

}  // namespace zerodrift::compensation
