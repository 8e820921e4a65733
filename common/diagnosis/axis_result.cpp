// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/axis_result.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>

#include "common/core/units.h"
#include "common/diagnosis/curves.h"
#include "common/diagnosis/disagreement.h"
#include "common/diagnosis/gap.h"
#include "common/diagnosis/known_effects.h"
#include "common/diagnosis/noise_and_bias.h"
#include "common/diagnosis/rounded_text.h"
#include "common/diagnosis/stochastic_effects.h"
#include "common/diagnosis/verdict.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {
namespace {

bool is_record_fault(const std::string& kind) {
  const auto* definition = twin::find_effect(kind);
  return definition != nullptr && definition->family == twin::Family::kRecordFault &&
         !is_waveform(*definition);
}

// Mean squares of the effects' waveforms become shares of what they explain together.
void share_the_gap(AxisDiagnosis& result) {
  const double explained = result.fit.before_rms_radps * result.fit.before_rms_radps -
                           result.fit.after_rms_radps * result.fit.after_rms_radps;
  const auto to_share = [&](NamedEffect& effect) {
    effect.share_of_gap =
        explained > 0.0 ? std::clamp(effect.share_of_gap / explained, 0.0, 1.0) : 0.0;
  };
  std::for_each(result.effects.begin(), result.effects.end(), to_share);
  if (!result.unknown) return;
  std::for_each(result.unknown->formulas.begin(), result.unknown->formulas.end(), to_share);
}

}  // namespace

bool is_of_rounding(double rms_radps, const RecordFaults& faults) {
  constexpr double kWithin = 1.5;
  return rms_radps <= kWithin * faults.rounding_rms_radps;
}

bool tells(const std::optional<UnknownEffect>& refuted, bool an_input_moves,
           const RecordFaults& faults) {
  if (!refuted) return false;
  if (std::isnan(refuted->rms_radps)) return an_input_moves;
  return !is_of_rounding(refuted->rms_radps, faults);
}

void hand_over(Trial& trial, const TrialInput& input, twin::Model& repaired) {
  const core::Axis axis = input.axis;
  keep_what_stands(trial.recalibrated, trial.repaired, axis);
  complete_error_of_bias(trial, input);
  const std::vector<twin::EffectSpec>& effects = trial.repaired.effects;
  const std::size_t given = input.model.effects.size();
  std::erase_if(repaired.effects, [axis](const twin::EffectSpec& e) { return e.axis == axis; });
  for (std::size_t i = 0; i < effects.size(); ++i) {
    if (effects[i].axis == axis && (i < given || !happens_once(effects[i])))
      repaired.effects.push_back(effects[i]);
  }
}

void take(AxisDiagnosis& result, const Trial& trial, const RecordFaults& faults) {
  result.effects = trial.effects;
  result.effects.insert(result.effects.end(), trial.events.begin(), trial.events.end());
  result.recalibrated = trial.recalibrated;
  result.unknown = trial.unknown;
  if (result.unknown && is_of_rounding(result.unknown->rms_radps, faults)) result.unknown.reset();
  result.could_have_seen = trial.could_have_seen;
  result.evidence = trial.evidence;
  if (result.unknown) {
    constexpr double kOneAlone = 0.9;  // its probability: no other is nearly as likely
    const auto noise = std::stable_partition(
        result.effects.begin(), result.effects.end(), [](const NamedEffect& effect) {
          return !is_noise(effect.name) && !happens_once({.kind = effect.name}) &&
                 effect.probability > kOneAlone;
        });
    result.unknown->noise.assign(std::make_move_iterator(noise),
                                 std::make_move_iterator(result.effects.end()));
    result.effects.erase(noise, result.effects.end());
  }
  result.effects.insert(result.effects.end(), faults.effects.begin(), faults.effects.end());
}

void describe(AxisDiagnosis& result, const ModelsOnRecord& models, const Trial& trial) {
  const MeasuredSeries& series = *models.record.series;
  const std::vector<double>& measured = models.measured;
  const std::vector<double>& before = models.before;
  const auto after = models.record.playback->drift(models.final_one, models.axis);
  const std::size_t block = intervals_in(kMeanS, series.interval_s);
  const auto residual = difference(measured, before, models.sound);
  const auto left = difference(measured, after, models.sound);
  result.fit = {rms_of_block_means(residual, models.sound, block).about_zero,
                rms_of_block_means(left, models.sound, block).about_zero,
                expected_rms_of_block_means(trial.noise_dct_variances, block)};
  share_the_gap(result);
  const auto noise_of = [&](const twin::Model& model) {
    return model_noise(model, models.axis, series.interval_s, series.size);
  };
  result.allan =
      allan_curves(measured, models.sound, series.interval_s, {before, noise_of(models.given)},
                   {after, noise_of(models.final_one)});
  result.allan_log_distance = allan_distance(result.allan);
  const auto channels = moving_inputs(series, models.axis);
  result.where =
      locate({residual, models.sound, trial.noise_dct_variances, series.interval_s}, channels);
  const auto taus =
      locate_cluster_times(result.allan, series.interval_s * static_cast<double>(series.size));
  result.where.insert(result.where.end(), taus.begin(), taus.end());
  result.waveforms = waveforms_of(series, measured, models.sound, before, after);
  std::vector<double> explained(after.size());
  for (std::size_t i = 0; i < after.size(); ++i) explained[i] = after[i] - before[i];
  result.residual =
      residual_against_input(result, series, models.axis, residual, explained, models.sound);
}

void take_back(AxisDiagnosis& result) {
  const auto unproved =
      std::stable_partition(result.effects.begin(), result.effects.end(),
                            [](const NamedEffect& effect) { return is_record_fault(effect.name); });
  result.taken_back.assign(unproved, result.effects.end());
  result.effects.erase(unproved, result.effects.end());
  result.recalibrated.clear();
  result.verdict = verdict_of(result);
  if (!result.effects.empty())
    result.sentence += " The record has " + list_of(result.effects) + ".";
}

namespace {

std::string differ(const std::string& who, double shape_radps, double noise_radps) {
  return " But " + who + " from the twin by " + rounded(core::deg_h_from_radps(shape_radps)) +
         " deg/h rms about their mean, where its noise makes " +
         rounded(core::deg_h_from_radps(noise_radps)) + ": ";
}

}  // namespace

void doubt_consistency(AxisDiagnosis& result, double left_rms_radps, const Comparison& held_out) {
  const double noise_radps = held_out.gap.noise_floor_rms_radps;
  if (stands_out(left_rms_radps, result.fit.noise_floor_rms_radps)) {
    result.sentence += differ("the samples of this record differ", left_rms_radps,
                              result.fit.noise_floor_rms_radps) +
                       "another record of the same kind decides whether that was once.";
  } else if (result.held_out_kind == HeldOut::kRecords &&
             stands_out(held_out.shape_before_radps, noise_radps)) {
    result.sentence +=
        differ("the records for validation differ", held_out.shape_before_radps, noise_radps) +
        "a diagnosis of them (--record) decides it.";
  } else {
    return;
  }
  result.verdict = Verdict::kUndecidable;
}

void doubt_noise(AxisDiagnosis& result) {
  if (result.verdict != Verdict::kRecalibrated) return;
  const Recalibration* noise = inflated_noise(result.recalibrated);
  if (noise == nullptr || noise->from == 0.0) return;
  result.sentence += " But " + noise->name + " became " +
                     rounded(std::abs(noise->to / noise->from)) +
                     " times what the model states: if the gyro did not wander so much before, "
                     "something is missing that follows an input slowly, as no known effect does. "
                     "The same profile once more decides it: noise takes another course.";
}

}  // namespace zerodrift::diagnosis
