// SPDX-License-Identifier: Apache-2.0
// What a Compensator makes of each sample beside its answer: blocks at rest, labels, checks.
#include <algorithm>
#include <cmath>

#include "common/compensation/compensator.h"
#include "common/core/plausible.h"

namespace zerodrift::compensation {

using core::index;
using core::kAxes;

namespace {

constexpr std::size_t kManyShortRests = 3;  // fewer may be chance: a vehicle stops as it must

}  // namespace

bool Compensator::is_usable(const core::AngularRateSample& sample, std::size_t axis) noexcept {
  return sample.valid[axis] &&
         std::abs(sample.rate_radps[axis]) <= core::kLargestRateRadps;  // false for NaN
}

EarthRateMode Compensator::earth_rate_mode(core::ClockSource clock) const noexcept {
  if (options_.earth_rate.mode != EarthRateMode::kAuto) return options_.earth_rate.mode;
  return core::is_paced_by_consumers(clock) ? EarthRateMode::kIncluded : EarthRateMode::kUnknown;
}

void Compensator::observe(const core::AngularRateSample& sample) noexcept {
  const auto closed = blocks_.advance(sample.time, sample.interval_s);
  if (closed) {
    estimate_outdated_ = true;  // ages grow even when no temperature comes
    polarity_.close(sample.time);
    own_output_.close({gate_.known_sigma(core::Axis::kX), gate_.known_sigma(core::Axis::kY),
                       gate_.known_sigma(core::Axis::kZ)});
    if (options_.learning.scale_factor) close_scale_block(sample.time);
    close_block(*closed);
  }
  const EarthRateMode earth_rate = earth_rate_mode(sample.clock);
  references_.begin(sample);
  const core::RateReferenceSample* reference = references_.true_rate(sample.time);
  const bool is_true_rate = reference != nullptr;
  // Who declares rest may be wrong, so the level is looked at; a true rate explains any level.
  if (reference != nullptr) blocks_.mark_reference();
  if (is_true_rate && options_.learning.scale_factor) take_true_rate(sample, *reference);
  if (reference == nullptr) reference = references_.rest(sample.time, earth_rate);
  const auto temperature_degc = scale_temperature_degc();
  referenced_ = {};
  bool is_faulty = false;
  bool any_usable = false;
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    referenced_[i] = reference != nullptr && reference->valid[i];
    if (!is_usable(sample, i)) {
      if (sample.valid[i] || measured_[i]) {
        ++counts_.invalid_axes[i];
        is_faulty = true;
      }
      continue;
    }
    measured_[i] = any_usable = true;
    uncovered_[i] = uncovered_[i] || !referenced_[i];
    if (sample.clipped[i]) {
      blocks_.mark_turning();  // a saturated axis says nothing of its drift
      continue;
    }
    own_output_.add(axis, sample.rate_radps[i], axes_[i].applied_radps());
    double known_radps = 0.0;
    double variance = 0.0;
    if (referenced_[i]) {
      known_radps = reference->rate_radps[i];
      variance = reference->variance[i];
      if (std::abs(known_radps) > kLeastMotionRadps) blocks_.mark_turning();
    } else if (earth_rate == EarthRateMode::kKnown) {
      known_radps = options_.earth_rate.rate_radps[i];
    }
    if (referenced_[i] ? is_true_rate : earth_rate == EarthRateMode::kKnown) {
      polarity_.add(
          axis, sample.rate_radps[i], known_radps,
          referenced_[i] ? PolarityCheck::Source::kTrueRate : PolarityCheck::Source::kEarth);
    }
    const double shown_radps = scale_.as_measured(axis, known_radps, temperature_degc);
    blocks_.add(axis, sample.rate_radps[i] - shown_radps, variance);
  }
  if (is_faulty || !any_usable) ++counts_.invalid;
}

void Compensator::take_true_rate(const core::AngularRateSample& sample,
                                 const core::RateReferenceSample& reference) noexcept {
  const bool has_interval = sample.interval_s > 0.0 && sample.interval_s <= kSlowestSpacingS;
  const core::SensorTime interval = core::from_seconds(has_interval ? sample.interval_s : 0.0);
  // One from before its interval speaks of another motion.
  if (reference.time != sample.time && sample.time - reference.time >= interval) return;
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    if (!reference.valid[i] || !is_usable(sample, i) || sample.clipped[i]) continue;
    scale_.add(axis, sample.rate_radps[i], reference.rate_radps[i], reference.variance[i]);
  }
}

void Compensator::close_scale_block(core::SensorTime now) noexcept {
  core::PerAxis<ScaleFactor::Noise> noise{};
  for (const auto axis : kAxes) {
    if (polarity_.is_reversed(axis)) continue;
    noise[index(axis)] = {gate_.known_sigma(axis), gate_.sample_variance(axis)};
  }
  const auto temperature_degc = scale_temperature_degc();
  scale_.close(now, temperature_degc, noise,
               !commanded_freeze_ && !(temperature_degc && temperatures_.is_stale(now)));
}

void Compensator::take_residual(core::SensorTime now) noexcept {
  core::PerAxis<OwnForecast> forecast;
  for (std::size_t i = 0; i < forecast.size(); ++i)
    forecast[i] = {axes_[i].applied_radps(), axes_[i].variance()};
  references_.correct(now, models_.epoch(), gate_.state() == RestState::kRest, forecast);
}

// Where the rates of a gyro at rest are, by the models in force: held, or what is taken off. Of
// axes whose level isn't known yet.
ExpectedLevels Compensator::expected_levels() const noexcept {
  ExpectedLevels expected;
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    if (gate_.knows(axis)) continue;
    const AxisModel* model = active_model(axis);
    const AxisContext& context = axes_[i].context();
    if (model == nullptr || !context.held_radps || !context.applied_radps) continue;
    expected[i] = {
        .lowest_radps = std::min(*context.held_radps, *context.applied_radps),
        .highest_radps = std::max(*context.held_radps, *context.applied_radps),
        .sigma_radps = std::sqrt(std::max(
            {0.0, longest_held_variance(model->drift, model->trust), axes_[i].variance()}))};
  }
  return expected;
}

void Compensator::close_block(DriftBlock block) noexcept {
  const core::PerAxis<bool> uncovered = uncovered_;
  uncovered_ = {};
  const bool measured = block.count != core::PerAxis<std::size_t>{};
  if (!measured && !blocks_.turning()) return;
  core::PerAxis<bool> is_reversed{};
  for (const auto axis : kAxes) is_reversed[index(axis)] = polarity_.is_reversed(axis);
  const RestState state =
      blocks_.turning() ? gate_.motion() : gate_.add(block, expected_levels(), is_reversed);
  if (state != RestState::kRest || gate_reason() != core::Reason::kNone) {
    end_of_rest();
    return;
  }
  if (earth_rate_matters()) {
    for (const auto axis : kAxes) {
      if (uncovered[index(axis)]) block.count[index(axis)] = 0;
    }
    if (block.count == core::PerAxis<std::size_t>{}) {
      labels_.discard();
      return;
    }
  }
  core::PerAxis<AxisContext> context;
  core::PerAxis<double> variance;
  for (const auto axis : kAxes) {
    const double sigma = gate_.block_sigma(axis);
    context[index(axis)] = axes_[index(axis)].context();
    variance[index(axis)] = sigma * sigma;
    // Its motion would go unnoticed, or the wrong way round.
    if (!gate_.knows(axis) || is_reversed[index(axis)]) block.count[index(axis)] = 0;
    // What the prior leaves can't be known without it.
    if (prior_covers(axis) && !context[index(axis)].prior_ready) block.count[index(axis)] = 0;
  }
  if (const auto label = labels_.add(block, context, temperatures_.thermal_state(), variance))
    learn_from(*label);
}

void Compensator::end_of_rest() noexcept {
  const std::size_t before = labels_.fruitless_stretches();
  labels_.discard();
  const std::size_t now = labels_.fruitless_stretches();
  if (now > before && now >= kManyShortRests) ++counts_.short_rests;
}

void Compensator::learn_from(const Label& label) noexcept {
  ++counts_.labels;
  confirmed_label_ = label;
  label_confirmed_ = true;
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    if (!label.valid[i]) continue;
    axes_[i].judge(label.drift_radps[i], label.applied_radps[i], label.held_radps[i]);
    prior_check_.add(axis, label.drift_radps[i], label.prior_radps[i], label.variance_radps2[i]);
  }
  if (options_.scheme == Scheme::kNone || changes_due_ > 0) return;
  if (!models_.submit({.kind = TrainingJob::Kind::kLabel, .label = label}, newest_ + handover_))
    ++counts_.labels_skipped;
}

}  // namespace zerodrift::compensation
