// SPDX-License-Identifier: Apache-2.0
#include "common/comparison/compared_scheme.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "common/compensation/learner.h"
#include "common/regression/schemes/scheme_factory.h"

namespace zerodrift::comparison {
namespace {

// One axis of the compensation service: what it learns, hands over and forecasts.
class OnlineSvrScheme final : public regression::DriftScheme {
 public:
  explicit OnlineSvrScheme(const compensation::CompensationOptions& options)
      : dimension_(options.features.size()),
        learner_(options, dimension_),
        model_(dimension_, options.model.capacity) {}

  void learn(const regression::DriftLabel& label) override {
    compensation::AxisLabel own{.time = core::from_seconds(label.time_s),
                                .drift_radps = label.drift,
                                .variance = label.variance};
    own.features.emplace();
    std::copy(label.features.begin(), label.features.end(), own.features->begin());
    learner_.learn(own);
    learner_.write(model_);
  }

  [[nodiscard]] regression::DriftPrediction predict(
      double time_s, std::span<const double> features) const override {
    const compensation::DriftModel& drift = model_.drift;
    if (!drift.holds()) return {};
    const core::SensorTime time = core::from_seconds(time_s);
    if (!drift.trained)
      return {drift.held_radps, compensation::held_variance(drift, model_.trust, time)};
    compensation::FeatureArray x{};
    std::copy(features.begin(), features.end(), x.begin());
    const auto made = compensation::forecast(drift, model_.trust, x, time);
    return {made.drift_radps, made.variance};
  }

 private:
  std::size_t dimension_;
  compensation::AxisLearner learner_;
  compensation::AxisModel model_;
};

std::size_t feature_index(const compensation::CompensationOptions& options,
                          thermal::FeatureKind kind) {
  const auto found =
      std::find_if(options.features.begin(), options.features.end(),
                   [&](const thermal::FeatureSpec& feature) { return feature.kind == kind; });
  if (found == options.features.end()) {
    throw std::invalid_argument("scheme polynomial: features: found no " +
                                std::string(thermal::name(kind)) +
                                ", expected temperature and temperature_rate");
  }
  return static_cast<std::size_t>(found - options.features.begin());
}

}  // namespace

std::unique_ptr<regression::DriftScheme> make_compared_scheme(
    std::string_view name, const compensation::CompensationOptions& options,
    const regression::InitialSetOptions& initial) {
  if (name == "online-svr") return std::make_unique<OnlineSvrScheme>(options);
  for (const auto kind : regression::kAllSchemeKinds) {
    if (regression::name(kind) != name) continue;
    regression::SchemeOptions scheme;
    scheme.rbf.initial = scheme.svr.initial = initial;
    if (kind == regression::SchemeKind::kPolynomial) {
      scheme.polynomial.temperature_feature =
          feature_index(options, thermal::FeatureKind::kTemperature);
      scheme.polynomial.rate_feature =
          feature_index(options, thermal::FeatureKind::kTemperatureRate);
    }
    return regression::make_scheme(kind, scheme);
  }
  std::string known;
  for (const auto other : kSchemeNames) known += (known.empty() ? "" : ", ") + std::string(other);
  throw std::invalid_argument("scheme: found '" + std::string(name) + "', expected one of " +
                              known);
}

}  // namespace zerodrift::comparison
