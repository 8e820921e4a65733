// SPDX-License-Identifier: Apache-2.0
#include "common/comparison/compared_scheme.h"

#include <algorithm>
#include <array>
#include <deque>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "common/compensation/learner.h"
#include "common/core/require.h"
#include "common/experts/expert_stack.h"
#include "common/experts/thermal_basis.h"
#include "common/regression/schemes/scheme_factory.h"

namespace zerodrift::comparison {
namespace {

regression::DriftPrediction forecast_of(const compensation::AxisModel& model, double time_s,
                                        std::span<const double> features) {
  const compensation::DriftModel& drift = model.drift;
  if (!drift.holds()) return {};
  const core::SensorTime time = core::from_seconds(time_s);
  if (!drift.trained)
    return {drift.held_radps, compensation::held_variance(drift, model.trust, time)};
  compensation::FeatureArray x{};
  std::copy(features.begin(), features.end(), x.begin());
  const auto made = compensation::forecast(drift, model.trust, x, time);
  return {made.drift_radps, made.variance};
}

std::optional<double> svr_forecast(const compensation::AxisModel& model, double time_s,
                                   std::span<const double> features) {
  if (!model.drift.trained) return std::nullopt;
  return forecast_of(model, time_s, features).drift;
}

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
    return forecast_of(model_, time_s, features);
  }
  [[nodiscard]] const compensation::AxisModel& model() const noexcept { return model_; }

 private:
  std::size_t dimension_;
  compensation::AxisLearner learner_;
  compensation::AxisModel model_;
};

// What belonged to an instant is kept until its label is learned.
class Observations {
 public:
  // Places of the features; where one is missing it counts as constant.
  Observations(std::optional<std::size_t> temperature, std::optional<std::size_t> rate)
      : temperature_(temperature), rate_(rate) {}

  void observe(double time_s, std::span<const double> features) {
    newest_ = thermal_.advance(time_s, temperature_ ? features[*temperature_] : 0.0,
                               rate_ ? features[*rate_] : 0.0);
    observed_.push_back({time_s, newest_});
  }
  // Of a label that is not before the one of the last call.
  [[nodiscard]] experts::Labelled with_basis(const regression::DriftLabel& label) {
    while (!observed_.empty() && observed_.front().time_s < label.time_s) observed_.pop_front();
    core::require(!observed_.empty() && observed_.front().time_s == label.time_s,
                  "a label of an instant that was not observed");
    return {label.time_s, label.duration_s, label.drift, label.variance, observed_.front().basis};
  }
  [[nodiscard]] const experts::Basis& newest() const noexcept { return newest_; }

 private:
  struct Observed {
    double time_s;
    experts::Basis basis;
  };
  std::optional<std::size_t> temperature_;
  std::optional<std::size_t> rate_;
  experts::ThermalBasis thermal_;
  experts::Basis newest_{};
  std::deque<Observed> observed_;
};

class BankScheme final : public regression::DriftScheme {
 public:
  BankScheme(const Observations& observations, experts::Expert expert)
      : observations_(observations), bank_(experts::bank_options(expert)) {}

  void observe(double time_s, std::span<const double> features) override {
    observations_.observe(time_s, features);
  }
  void learn(const regression::DriftLabel& label) override {
    bank_.learn(observations_.with_basis(label));
  }
  [[nodiscard]] regression::DriftPrediction predict(double time_s,
                                                    std::span<const double>) const override {
    if (!bank_.knows()) return {};
    return {.drift = bank_.forecast().at(time_s, observations_.newest())};
  }

 private:
  Observations observations_;
  experts::KalmanBank bank_;
};

// All experts, the online SVR among them.
class StackScheme final : public regression::DriftScheme {
 public:
  StackScheme(const compensation::CompensationOptions& options, const Observations& observations)
      : observations_(observations), svr_(options) {}

  void observe(double time_s, std::span<const double> features) override {
    observations_.observe(time_s, features);
  }
  void learn(const regression::DriftLabel& label) override {
    experts::Foretold foretold;
    for (std::size_t h = 0; h < experts::kHorizons; ++h) {
      auto& past = past_[h];
      while (past.size() > 1 && label.time_s - past[1].time_s >= experts::kHorizonsS[h])
        past.pop_front();
      if (!past.empty() && label.time_s - past.front().time_s >= experts::kHorizonsS[h])
        foretold[h] = svr_forecast(*past.front().model, label.time_s, label.features);
    }
    stack_.learn(observations_.with_basis(label), foretold);
    label_variance_ = label.variance;
    svr_.learn(label);
    std::shared_ptr<const compensation::AxisModel> now;
    for (std::size_t h = 0; h < experts::kHorizons; ++h) {
      auto& past = past_[h];
      if (!past.empty() && label.time_s - past.back().time_s < experts::kHorizonsS[h] / kModelsKept)
        continue;
      if (!now) now = std::make_shared<const compensation::AxisModel>(svr_.model());
      past.push_back({label.time_s, now});
    }
  }
  [[nodiscard]] regression::DriftPrediction predict(
      double time_s, std::span<const double> features) const override {
    if (!stack_.knows()) return {};
    const auto made = stack_.predict(time_s, observations_.newest(),
                                     svr_forecast(svr_.model(), time_s, features));
    if (made.variance < 0.0) return {.drift = made.drift};
    return {made.drift, std::max(made.variance - label_variance_, 0.0)};
  }

 private:
  static constexpr double kModelsKept = 4.0;  // over a horizon
  struct Past {
    double time_s;
    std::shared_ptr<const compensation::AxisModel> model;
  };
  Observations observations_;
  OnlineSvrScheme svr_;
  experts::ExpertStack stack_;
  std::array<std::deque<Past>, experts::kHorizons> past_;
  double label_variance_ = 0.0;
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
  if (name == "online-svr") return std::make_unique<OnlineSvrScheme>(options);
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
  if (name == "stack")
    return std::make_unique<StackScheme>(options, Observations(temperature, rate));
  for (const auto expert : experts::kLinearExperts) {
    if (expert == experts::Expert::kHold || experts::name(expert) != name) continue;
    if (!experts::bank_options(expert).terms.empty()) require_temperature();
    return std::make_unique<BankScheme>(Observations(temperature, rate), expert);
  }
  for (const auto kind : regression::kAllSchemeKinds) {
    if (regression::name(kind) != name) continue;
    regression::SchemeOptions scheme;
    scheme.rbf.initial = scheme.svr.initial = initial;
    if (kind == regression::SchemeKind::kPolynomial) {
      require_temperature();
      scheme.polynomial.temperature_feature = *temperature;
      scheme.polynomial.rate_feature = *rate;
    }
    return regression::make_scheme(kind, scheme);
  }
  std::string known;
  for (const auto other : kSchemeNames) known += (known.empty() ? "" : ", ") + std::string(other);
  throw std::invalid_argument("scheme: found '" + std::string(name) + "', expected one of " +
                              known);
}

}  // namespace zerodrift::comparison
