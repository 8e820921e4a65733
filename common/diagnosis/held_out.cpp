// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/held_out.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/diagnosis/cosine_transform.h"
#include "common/diagnosis/gap.h"
#include "common/diagnosis/noise_weight.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {
namespace {

// Held-out figures may be worse by this and still count as equal.
constexpr double kNoWorse = 1.02;
constexpr double kMeanNoWorse = 1.05;  // with the mean, of which two records say little
constexpr double kAllanTolerance = 0.02;
constexpr double kNatsOfALine = 3.0;  // that noise alone gains by a free size and phase

bool has_free_phase(const twin::EffectSpec& effect) {
  const auto* definition = twin::find_effect(effect.kind);
  return definition != nullptr && definition->search.has_free_phase;
}

// What a model says of the part's record.
twin::Model in_record_of(const HeldOutPart& part, twin::Model model) {
  if (!part.is_of_fitted_record) std::erase_if(model.effects, happens_once);
  return model;
}

// Nobody can tell the phase that a line has in another record: its frequency has to be there.
twin::Model without_free_phases(twin::Model model) {
  std::erase_if(model.effects, has_free_phase);
  return model;
}

std::vector<double> quiet_drift(const HeldOutPart& part, const twin::Model& model,
                                core::Axis axis) {
  return part.playback->drift(without_free_phases(in_record_of(part, model)), axis);
}

std::vector<double> added_lines_hz(const twin::Model& before, const twin::Model& after,
                                   core::Axis axis) {
  std::vector<double> frequencies;
  for (const twin::EffectSpec& effect : after.effects) {
    if (!has_free_phase(effect) || effect.axis != axis || effect.parameters.empty()) continue;
    const bool is_old =
        std::any_of(before.effects.begin(), before.effects.end(), [&](const twin::EffectSpec& old) {
          return old.kind == effect.kind && old.axis == axis && old.parameters == effect.parameters;
        });
    if (is_old) continue;
    const twin::EffectDefinition& definition = *twin::find_effect(effect.kind);
    const auto complete = twin::complete_parameters(definition, effect.parameters);
    for (const twin::ParameterDefinition& parameter : definition.parameters) {
      if (parameter.rule == twin::SearchRule::kFrequency ||
          parameter.rule == twin::SearchRule::kCycleFrequency)
        frequencies.push_back(complete.at(parameter.name));
    }
  }
  return frequencies;
}

template <typename Changes>
bool changes_shape(const Changes& changes) {
  return std::any_of(changes.begin(), changes.end(),
                     [](const auto& change) { return has_shape(change.name); });
}

bool changes_noise(const Trial& trial) {
  const auto is_of_noise = [](const auto& change) { return is_noise(change.name); };
  return std::any_of(trial.effects.begin(), trial.effects.end(), is_of_noise) ||
         std::any_of(trial.recalibrated.begin(), trial.recalibrated.end(), is_of_noise);
}

// What one part says of a change of the drift, by the noise of the model after it.
struct NatsOfPart {
  double gain = 0.0;
  double expected_gain = 0.0;
};

// What the mean of a block of the fitted record says of two courses of what is left.
double mean_gain_nats(const std::vector<double>& left_before, const std::vector<double>& left_after,
                      std::span<const std::uint8_t> valid, std::span<const double> variances) {
  const double variance = variance_of_mean(valid, variances);
  if (!(variance > 0.0)) return 0.0;
  const double before = mean_of_valid(left_before, valid);
  const double after = mean_of_valid(left_after, valid);
  return 0.5 * (before * before - after * after) / variance;
}

NatsOfPart nats_of(const HeldOutPart& part, const twin::Model& before, const twin::Model& after,
                   core::Axis axis) {
  const MeasuredSeries& series = *part.series;
  const auto measured = measured_drift(series, axis);
  const auto variances =
      model_noise(after, axis, series.interval_s, smooth_length_up_to(series.size));
  const auto quiet_before = quiet_drift(part, before, axis);
  const auto quiet_after = quiet_drift(part, after, axis);
  const auto square = [&](const std::vector<double>& one, const std::vector<double>& other) {
    return weighted_square(difference(one, other, part.valid), part.valid, variances);
  };
  NatsOfPart nats{0.5 * (square(measured, quiet_before) - square(measured, quiet_after)),
                  0.5 * square(quiet_after, quiet_before)};
  for (const double frequency_hz : added_lines_hz(before, after, axis)) {
    nats.expected_gain = std::numeric_limits<double>::infinity();  // in any record
    nats.gain -= kNatsOfALine;
    nats.gain += line_gain_nats(difference(measured, quiet_after, part.valid), part.valid,
                                variances, frequency_hz, series.interval_s);
  }
  return nats;
}

}  // namespace

bool happens_once(const twin::EffectSpec& effect) {
  const auto* definition = twin::find_effect(effect.kind);
  return definition != nullptr && definition->search.happens_once;
}

bool is_noise(const std::string& kind) {
  const auto* definition = twin::find_effect(kind);
  return definition != nullptr && definition->family == twin::Family::kStochastic;
}

// Another bias moves the drift without changing its shape.
bool has_shape(const std::string& kind) {
  const auto* definition = twin::find_effect(kind);  // null: a formula's label
  return !is_noise(kind) && !(definition != nullptr && definition->search.is_constant);
}

std::size_t intervals_in(double duration_s, double interval_s) {
  return static_cast<std::size_t>(std::max(1.0, std::round(duration_s / interval_s)));
}

double duration_of(const MeasuredSeries& series) {
  return series.interval_s * static_cast<double>(series.size);
}

bool can_judge(const HeldOutPart& part) {
  const std::vector<double> any(part.valid.size(), 0.0);
  return block_means(any, part.valid, intervals_in(kMeanS, part.series->interval_s)).mean.size() >=
         2;
}

std::size_t keep_in_reach(HeldOutPart& part, const MeasuredSeries& fitted,
                          std::span<const std::uint8_t> valid) {
  constexpr double kBeyond = 0.1;  // of the range
  std::vector<std::uint8_t> kept = part.valid;
  for (const ProbeSeries& reached : fitted.probes) {
    const auto same = std::find_if(part.series->probes.begin(), part.series->probes.end(),
                                   [&](const ProbeSeries& p) { return p.name == reached.name; });
    if (same == part.series->probes.end()) continue;
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (std::size_t i = 0; i < valid.size(); ++i) {
      if (valid[i] == 0) continue;
      low = std::min(low, reached.temperature_degc[i]);
      high = std::max(high, reached.temperature_degc[i]);
    }
    const double beyond = kBeyond * (high - low);
    for (std::size_t i = 0; i < kept.size(); ++i) {
      const double here = same->temperature_degc[i];
      if (!(here >= low - beyond && here <= high + beyond)) kept[i] = 0;
    }
  }
  const auto count = [](const std::vector<std::uint8_t>& mask) {
    return static_cast<std::size_t>(std::count(mask.begin(), mask.end(), std::uint8_t{1}));
  };
  const std::size_t left_out = count(part.valid) - count(kept);
  part.valid = std::move(kept);
  return left_out;
}

Split split_in_blocks(const MeasuredSeries& series, const Playback& playback,
                      const std::vector<std::uint8_t>& sound,
                      const std::array<std::size_t, 2>& blocks) {
  const double duration_s = duration_of(series);
  if (duration_s < kShortestForBlocksS) return {.fitted = sound};
  Split split{.kind = HeldOut::kBlocks, .fitted = sound};
  std::vector<std::uint8_t> kept(series.size, 0);
  const double guard_s = std::min(duration_s / (4.0 * kBlocks), kLongestGuardS);
  const std::size_t guard = intervals_in(guard_s, series.interval_s);
  for (const std::size_t block : blocks) {
    const std::size_t begin = series.size * block / kBlocks;
    const std::size_t end = series.size * (block + 1) / kBlocks;
    for (std::size_t i = begin; i < end; ++i) {
      split.fitted[i] = 0;
      const bool guarded = i < begin + guard || i + guard >= end;
      if (!guarded) kept[i] = sound[i];
    }
  }
  split.held_out.push_back({&series, &playback, std::move(kept), true});
  return can_judge(split.held_out.front()) ? split : Split{.fitted = sound};
}

Comparison compare_on(const std::vector<HeldOutPart>& parts, const twin::Model& before,
                      const twin::Model& after, core::Axis axis) {
  Comparison result;
  double weight = 0.0;
  double weight_before = 0.0;
  double weight_after = 0.0;
  const auto add_distance = [](double& sum, double& weights, double distance, double w) {
    if (!std::isfinite(distance)) return;
    sum += w * distance;
    weights += w;
  };
  for (const HeldOutPart& part : parts) {
    const MeasuredSeries& series = *part.series;
    const auto measured = measured_drift(series, axis);
    const auto drift_before = part.playback->drift(in_record_of(part, before), axis);
    const auto drift_after = part.playback->drift(in_record_of(part, after), axis);
    const std::size_t block = intervals_in(kMeanS, series.interval_s);
    const auto rms = [&](const std::vector<double>& drift) {
      return rms_of_block_means(difference(measured, drift, part.valid), part.valid, block);
    };
    const auto noise_before = model_noise(before, axis, series.interval_s, series.size);
    const auto noise_after = model_noise(after, axis, series.interval_s, series.size);
    const auto curves = allan_curves(measured, part.valid, series.interval_s,
                                     {drift_before, noise_before}, {drift_after, noise_after});
    const AllanDistance distance = allan_distance(curves);
    const double w = static_cast<double>(series.size);
    const auto add = [w](double& sum, double value) { sum += w * value * value; };
    const auto quiet_before = quiet_drift(part, before, axis);
    const auto quiet_after = quiet_drift(part, after, axis);
    const BlockRms rms_before = rms(quiet_before);
    const BlockRms rms_after = rms(quiet_after);
    add(result.gap.before_rms_radps, rms_before.about_zero);
    add(result.gap.after_rms_radps, rms_after.about_zero);
    add(result.shape_before_radps, rms_before.about_mean);
    add(result.shape_after_radps, rms_after.about_mean);
    add(result.gap.noise_floor_rms_radps, expected_rms_of_block_means(noise_after, block));
    const NatsOfPart nats = nats_of(part, before, after, axis);
    result.gain_nats += nats.gain;
    result.expected_gain_nats += nats.expected_gain;
    const auto noise_nats_of = [&](const twin::Model& model) {
      return model_noise(model, axis, series.interval_s, smooth_length_up_to(series.size));
    };
    const auto left_after = difference(measured, quiet_after, part.valid);
    const auto variances = noise_nats_of(after);
    result.noise_gain_nats +=
        noise_gain_nats(left_after, part.valid, noise_nats_of(before), variances);
    if (part.is_of_fitted_record) {
      result.mean_gain_nats += mean_gain_nats(difference(measured, quiet_before, part.valid),
                                              left_after, part.valid, variances);
    }
    add_distance(result.allan.before, weight_before, distance.before, w);
    add_distance(result.allan.after, weight_after, distance.after, w);
    weight += w;
  }
  if (weight == 0.0) return result;
  for (double* square :
       {&result.gap.before_rms_radps, &result.gap.after_rms_radps,
        &result.gap.noise_floor_rms_radps, &result.shape_before_radps, &result.shape_after_radps})
    *square = std::sqrt(*square / weight);
  result.allan.before /= weight_before;
  result.allan.after /= weight_after;
  return result;
}

double likelier_by_nats(const std::vector<HeldOutPart>& parts, const twin::Model& base,
                        const twin::Model& one, const twin::Model& other, core::Axis axis) {
  double nats = 0.0;
  for (const HeldOutPart& part : parts) {
    nats += nats_of(part, base, one, axis).gain - nats_of(part, base, other, axis).gain;
    const MeasuredSeries& series = *part.series;
    const auto left =
        difference(measured_drift(series, axis), quiet_drift(part, base, axis), part.valid);
    const auto noise_of = [&](const twin::Model& model) {
      return model_noise(model, axis, series.interval_s, smooth_length_up_to(series.size));
    };
    nats += noise_gain_nats(left, part.valid, noise_of(other), noise_of(one));
  }
  return nats;
}

bool tells_apart(const Comparison& comparison) {
  constexpr double kTwoStandardErrorsNats = 2.0;
  return comparison.expected_gain_nats >= kTwoStandardErrorsNats;
}

Acceptance judge(const Trial& trial, const Comparison& held_out, HeldOut kind) {
  if (trial.effects.empty() && trial.recalibrated.empty()) return Acceptance::kNothingToProve;
  if (kind == HeldOut::kNothing) return Acceptance::kUnproven;
  const bool shape = changes_shape(trial.effects) || changes_shape(trial.recalibrated);
  const Gap& gap = held_out.gap;
  const AllanDistance& allan = held_out.allan;
  const bool comparable = std::isfinite(allan.before) && std::isfinite(allan.after);
  const bool noise_is_new = changes_noise(trial) && !std::isfinite(allan.before);
  const bool clear_shape = shape && held_out.gain_nats > kClearNats &&
                           held_out.shape_after_radps < held_out.shape_before_radps;
  const double gain_with_mean_nats = held_out.gain_nats + held_out.mean_gain_nats;
  const bool mean_no_worse = (clear_shape && gain_with_mean_nats > 0.0) ||
                             gap.after_rms_radps <= kMeanNoWorse * gap.before_rms_radps;
  const bool allan_no_worse = !comparable || allan.after <= allan.before + kAllanTolerance ||
                              held_out.noise_gain_nats > kClearNats ||
                              (clear_shape && !changes_noise(trial));
  const bool no_worse = held_out.shape_after_radps <= kNoWorse * held_out.shape_before_radps &&
                        mean_no_worse && allan_no_worse;
  const bool likelier = held_out.gain_nats != 0.0
                            ? held_out.gain_nats > 0.0 || gain_with_mean_nats > kClearNats
                            : held_out.shape_after_radps < held_out.shape_before_radps;
  const bool closer = shape ? likelier
                            : held_out.noise_gain_nats > 0.0 || noise_is_new ||
                                  (comparable && allan.after < allan.before) ||
                                  held_out.gap.after_rms_radps < held_out.gap.before_rms_radps;
  return closer && no_worse ? Acceptance::kAccepted : Acceptance::kReverted;
}

}  // namespace zerodrift::diagnosis
