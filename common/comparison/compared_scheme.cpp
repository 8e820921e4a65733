// SPDX-License-Identifier: Apache-2.0
#include "common/comparison/compared_scheme.h"

#include <algorithm>
#include <array>
#include <deque>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/compensation/learner.h"
#include "common/core/require.h"
#include "common/experts/expert.h"
#include "common/experts/kalman_bank.h"
#include "common/experts/thermal_basis.h"
#include "common/regression/schemes/scheme_factory.h"

namespace zerodrift::comparison {
namespace {

// What belonged to an instant is kept until its label is learned.
class Observations {
 public:
  // Places of the features; where one is missing it counts as constant.
  Observations(std::optional<std::size_t> temperature, std::optional<std::size_t> rate)
      : temperature_(temperature), rate_(rate) {}

  void observe(double time_s, std::span<const double> features) {
    observed_.push_back({time_s, thermal_.advance(core::from_seconds(time_s),
                                                  temperature_ ? features[*temperature_] : 0.0,
                                                  rate_ ? features[*rate_] : 0.0)});
  }
  // Of a label that is not before the one of the last call.
  [[nodiscard]] const experts::ThermalState& of(const regression::DriftLabel& label) {
    while (!observed_.empty() && observed_.front().time_s < label.time_s) observed_.pop_front();
    core::require(!observed_.empty() && observed_.front().time_s == label.time_s,
                  "a label of an instant that was not observed");
    return observed_.front().thermal;
  }
  [[nodiscard]] const experts::ThermalState& newest() const noexcept { return thermal_.state(); }

 private:
  struct Observed {
    double time_s;
    experts::ThermalState thermal;
  };
  std::optional<std::size_t> temperature_;
  std::optional<std::size_t> rate_;
  experts::ThermalMemory thermal_;
  std::deque<Observed> observed_;
};

// One axis of the compensation service, with its scheme: what it learns, hands over and forecasts.
class ServiceScheme final : public regression::DriftScheme {
 public:
  ServiceScheme(compensation::CompensationOptions options, compensation::Scheme scheme,
                const Observations& observations)
      : observations_(observations),
        learner_(with(options, scheme), options.features.size()),
        model_(options.features.size(), options.model.capacity) {}

  void observe(double time_s, std::span<const double> features) override {
    observations_.observe(time_s, features);
  }
  void learn(const regression::DriftLabel& label) override {
    compensation::AxisLabel own{.time = core::from_seconds(label.time_s),
                                .duration_s = label.duration_s,
                                .drift_radps = label.drift,
                                .variance = label.variance,
                                .features = array_of(label.features),
                                .thermal = observations_.of(label)};
    learner_.learn(own);
    learner_.write(model_);
  }
  [[nodiscard]] regression::DriftPrediction predict(
      double time_s, std::span<const double> features) const override {
    const compensation::DriftModel& drift = model_.drift;
    const core::SensorTime time = core::from_seconds(time_s);
    if (!drift.holds()) return {};
    if (model_.stack.knows()) {
      const auto made =
          compensation::stack_forecast(model_, array_of(features), observations_.newest(), time);
      return {made.drift_radps, made.variance, true};
    }
    if (!drift.trained)
      return {drift.held_radps, compensation::held_variance(drift, model_.trust, time), true};
    const auto made = compensation::forecast(drift, model_.trust, array_of(features), time);
    return {made.drift_radps, made.variance, true};
  }

 private:
  static compensation::CompensationOptions& with(compensation::CompensationOptions& options,
                                                 compensation::Scheme scheme) {
    options.scheme = scheme;
    return options;
  }
  static compensation::FeatureArray array_of(std::span<const double> features) {
    compensation::FeatureArray array{};
    std::copy(features.begin(), features.end(), array.begin());
    return array;
  }

  Observations observations_;
  compensation::AxisLearner learner_;
  compensation::AxisModel model_;
};

// One expert alone.
class BankScheme final : public regression::DriftScheme {
 public:
  BankScheme(const Observations& observations, experts::Expert expert)
      : observations_(observations), bank_(experts::bank_options(expert)) {}

  void observe(double time_s, std::span<const double> features) override {
    observations_.observe(time_s, features);
  }
  void learn(const regression::DriftLabel& label) override {
    const experts::ThermalState& thermal = observations_.of(label);
    if (!bank_.knows()) reference_temperature_ = thermal.temperature;
    bank_.learn({label.time_s, label.duration_s, label.drift, label.variance,
                 experts::basis_of(thermal, reference_temperature_)});
  }
  [[nodiscard]] regression::DriftPrediction predict(double time_s,
                                                    std::span<const double>) const override {
    if (!bank_.knows()) return {};
    return {.drift = bank_.forecast().at(
                time_s, experts::basis_of(observations_.newest(), reference_temperature_))};
  }

 private:
  Observations observations_;
  experts::KalmanBank bank_;
  double reference_temperature_ = 0.0;
};

std::optional<std::size_t> feature_index(const compensation::CompensationOptions& options,
                                         thermal::FeatureKind kind) {
  const auto found =
      std::find_if(options.features.begin(), options.features.end(),
                   [&](const thermal::FeatureSpec& feature) { return feature.kind == kind; });
  if (found == options.features.end()) return std::nullopt;
  return static_cast<std::size_t>(found - options.features.begin());
}

}  // namespace

std::unique_ptr<regression::DriftScheme> make_compared_scheme(
    std::string_view name, const compensation::CompensationOptions& options,
    const regression::InitialSetOptions& initial) {
  const auto temperature = feature_index(options, thermal::FeatureKind::kTemperature);
  const auto rate = feature_index(options, thermal::FeatureKind::kTemperatureRate);
  const auto require_temperature = [&] {
    if (temperature && rate) return;
    const auto missing =
        temperature ? thermal::FeatureKind::kTemperatureRate : thermal::FeatureKind::kTemperature;
    throw std::invalid_argument("scheme " + std::string(name) + ": features: found no " +
                                std::string(thermal::name(missing)) +
                                ", expected temperature and temperature_rate");
  };
  for (const auto& [of_service, scheme] :
       {std::pair{"online-svr", compensation::Scheme::kOnlineSvr},
        std::pair{"stack", compensation::Scheme::kStack}}) {
    if (name == of_service)
      return std::make_unique<ServiceScheme>(options, scheme, Observations(temperature, rate));
  }
  for (const auto expert : experts::kLinearExperts) {
    if (expert == experts::Expert::kHold || experts::name(expert) != name) continue;
    if (!experts::bank_options(expert).terms.empty()) require_temperature();
    return std::make_unique<BankScheme>(Observations(temperature, rate), expert);
  }
  for (const regression::Baseline& baseline : regression::baselines()) {
    if (baseline.name != name) continue;
    regression::SchemeOptions scheme;
    scheme.rbf.initial = scheme.svr.initial = initial;
    if (name == "polynomial") {
      require_temperature();
      scheme.polynomial.temperature_feature = *temperature;
      scheme.polynomial.rate_feature = *rate;
    }
    return baseline.make(scheme);
  }
  throw std::invalid_argument("scheme: found '" + std::string(name) + "', expected one of " +
                              listed_schemes());
}

std::string listed_schemes() {
  std::string listed;
  for (const auto name : kSchemeNames) listed += (listed.empty() ? "" : ", ") + std::string(name);
  return listed;
}

}  // namespace zerodrift::comparison
