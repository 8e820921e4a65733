// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/axis_drift.h"

#include <algorithm>
#include <cmath>

namespace zerodrift::compensation {
namespace {

constexpr double kReturnToSafeS =
    10.0;  // time constant of the return to the stationary bias out of domain
constexpr double kMseGain = 1.0 / 12.0;  // memory of 12 labels

// More than the last stationary minute.
bool forecasts(Scheme scheme, const AxisModel& model) {
  return scheme == Scheme::kStack ? model.stack.knows() : model.drift.trained;
}

// What the stack says that the drift has changed while the last mean is held, (rad/s)²: where the
// temperature is known but not its rate, as in the first half a minute after a power-on, it may.
// Once that mean is of labels from before the rate was known, the stack has no level until there is
// a label that it can learn, which may be at the next stop: what it knows of temperature tells how
// far the drift has moved since those labels.
double square_changed_by_temperature(Scheme scheme, const AxisInputs& inputs) {
  const AxisModel& model = *inputs.model;
  if (scheme != Scheme::kStack || core::lacks_temperature(inputs.input)) return 0.0;
  if (!model.stack.knows()) {
    return model.held_thermal ? model.stack.held_variance(*model.held_thermal, *inputs.thermal)
                              : 0.0;
  }
  if (inputs.input != core::Reason::kRateNotReady) return 0.0;
  const double drift_radps =
      model.stack.predict(model.stack_time_s(inputs.now), *inputs.thermal).drift;
  const double changed = drift_radps - model.drift.held_radps;
  return changed * changed + model.stack.doubt.variance_at(*inputs.thermal);
}

}  // namespace

void AxisDrift::note_prior(std::optional<double> drift_radps) noexcept {
  on_prior_ = drift_radps.has_value();
  context_.prior_ready = on_prior_;
  context_.prior_radps = drift_radps.value_or(0.0);
}

bool AxisDrift::follow_prior(std::optional<double> drift_radps) noexcept {
  if (on_prior_ != drift_radps.has_value()) return false;
  if (!drift_radps || !adds_prior_) return true;
  const double change = *drift_radps - context_.prior_radps;
  context_.prior_radps = *drift_radps;
  applied_radps_ = remainder_radps_ + *drift_radps;
  if (context_.applied_radps) context_.applied_radps = applied_radps_;
  if (context_.held_radps) *context_.held_radps += change;
  return true;
}

// Test-then-train: the label judges what was predicted for its time before it was known.
void AxisDrift::judge(double label_radps, std::optional<double> applied_radps,
                      std::optional<double> held_radps) noexcept {
  if (!applied_radps || !held_radps) return;
  const double applied_error = label_radps - *applied_radps;
  const double held_error = label_radps - *held_radps;
  ++record_.labels;
  const double gain = std::max(kMseGain, 1.0 / static_cast<double>(record_.labels));
  record_.applied_mse += gain * (applied_error * applied_error - record_.applied_mse);
  record_.held_mse += gain * (held_error * held_error - record_.held_mse);
}

void AxisDrift::estimate(Scheme scheme, const AxisInputs& inputs) noexcept {
  context_.features_ready = inputs.input == core::Reason::kNone;
  context_.features = *inputs.features;
  context_.applied_radps.reset();
  context_.held_radps.reset();
  if (scheme == Scheme::kNone) {
    return apply(core::Rung::kNone, core::Mode::kPassthrough, core::Reason::kSchemeNone, 0.0, -1.0);
  }
  const AxisModel* model = inputs.model;
  // What a learner knows of the remainder is no drift without the prior.
  const bool lacks_prior = inputs.prior_covers && !on_prior_;
  if (model == nullptr || lacks_prior) return apply_without_labels(inputs);
  if (forecasts(scheme, *model) && inputs.input == core::Reason::kNone) {
    apply_forecast(scheme, inputs);
  } else if (core::lacks_temperature(inputs.input) && model->in_time.knows()) {
    const Forecast made = forecast_in_time(*model, inputs.now);
    apply(core::Rung::kStack, core::Mode::kFallback, inputs.input, made.drift_radps, made.variance);
  } else {
    // The first set is never completed while somebody forbids to learn.
    const core::Reason awaits = inputs.gate == core::Reason::kCommanded ? core::Reason::kCommanded
                                                                        : core::Reason::kInitialSet;
    const core::Reason reason = inputs.input == core::Reason::kNone ? awaits : inputs.input;
    const bool is_in_order = core::passes_by_itself(reason) || reason == core::Reason::kCommanded;
    const double variance = held_variance(model->drift, model->trust, inputs.now) +
                            square_changed_by_temperature(scheme, inputs);
    apply(core::Rung::kStationaryBias, is_in_order ? core::Mode::kHolding : core::Mode::kFallback,
          reason, model->drift.held_radps, variance);
  }
  context_.applied_radps = applied_radps_;
  context_.held_radps = model->drift.held_radps;
  if (on_prior_) *context_.held_radps += context_.prior_radps;
}

void AxisDrift::apply_forecast(Scheme scheme, const AxisInputs& inputs) noexcept {
  const AxisModel& model = *inputs.model;
  const bool is_stack = scheme == Scheme::kStack;
  const Forecast made = is_stack
                            ? stack_forecast(model, context_.features, *inputs.thermal, inputs.now)
                            : forecast(model.drift, model.trust, context_.features, inputs.now);
  if (made.kind == ForecastKind::kModel || made.kind == ForecastKind::kStack) {
    const core::Rung rung = is_stack ? core::Rung::kStack : core::Rung::kOnlineSvr;
    safe_radps_ = made.drift_radps;
    safe_time_ = inputs.now;
    if (made.beyond_learned) {
      return apply(rung, core::Mode::kOutOfDomain, core::Reason::kOutsideLearned, made.drift_radps,
                   made.variance);
    }
    const core::Mode mode =
        inputs.gate == core::Reason::kNone ? core::Mode::kLearning : core::Mode::kFrozen;
    return apply(rung, mode, inputs.gate, made.drift_radps, made.variance);
  }
  // Back to the last stationary minute, without a jump.
  double drift = made.drift_radps;
  if (safe_radps_ && safe_time_ != core::kNever) {
    const double weight = std::exp(-core::seconds(inputs.now - safe_time_) / kReturnToSafeS);
    drift += weight * (*safe_radps_ - drift);
  }
  const bool beyond = made.kind == ForecastKind::kBeyond;
  apply(core::Rung::kStationaryBias, beyond ? core::Mode::kOutOfDomain : core::Mode::kHolding,
        beyond ? core::Reason::kOutsideLearned : core::Reason::kModelWorseThanBias, drift,
        made.variance);
}

void AxisDrift::apply_without_labels(const AxisInputs& inputs) noexcept {
  const bool temperature_bad = core::lacks_temperature(inputs.input);
  if (on_prior_) {
    return apply(core::Rung::kPrior, core::Mode::kFallback,
                 temperature_bad ? inputs.input : core::Reason::kNoEstimateYet, 0.0, -1.0);
  }
  if (inputs.factory_radps && !temperature_bad) {
    return apply(core::Rung::kFactoryPolynomial, core::Mode::kFallback,
                 core::Reason::kNoEstimateYet, *inputs.factory_radps, -1.0);
  }
  const core::Reason idle =
      temperature_bad || inputs.prior_covers ? inputs.input : core::Reason::kNoEstimateYet;
  const bool is_idle = inputs.gate == core::Reason::kNone || inputs.prior_covers;
  apply(core::Rung::kNone, core::Mode::kPassthrough, is_idle ? idle : inputs.gate, 0.0, -1.0);
}

// `drift_radps`: with a prior, what it leaves; except on the rungs below it.
void AxisDrift::apply(core::Rung rung, core::Mode mode, core::Reason reason, double drift_radps,
                      double variance) noexcept {
  adds_prior_ = on_prior_ && rung != core::Rung::kNone && rung != core::Rung::kFactoryPolynomial;
  rung_ = rung;
  mode_ = mode;
  reason_ = reason;
  remainder_radps_ = drift_radps;
  applied_radps_ = adds_prior_ ? drift_radps + context_.prior_radps : drift_radps;
  variance_ = variance;
}

}  // namespace zerodrift::compensation
