// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/diagnosis.h"

#include <algorithm>
#include <span>
#include <stdexcept>

#include "common/diagnosis/candidates.h"
#include "common/diagnosis/curves.h"
#include "common/diagnosis/disagreement.h"
#include "common/diagnosis/gap.h"
#include "common/diagnosis/held_out.h"
#include "common/diagnosis/next_experiment.h"
#include "common/diagnosis/playback.h"
#include "common/diagnosis/record_faults.h"
#include "common/diagnosis/repair.h"
#include "common/diagnosis/verdict.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {
namespace {

bool has_axis(const MeasuredSeries& series, core::Axis axis) {
  return !series.rate_radps[core::index(axis)].empty();
}

bool is_record_fault(const std::string& kind) {
  const auto* definition = twin::find_effect(kind);
  return definition != nullptr && definition->family == twin::Family::kRecordFault &&
         !is_waveform(*definition);
}

// An axis's own part of one model into another.
void copy_axis(const twin::Model& from, twin::Model& to, core::Axis axis) {
  std::erase_if(to.effects, [axis](const twin::EffectSpec& e) { return e.axis == axis; });
  for (const twin::EffectSpec& effect : from.effects) {
    if (effect.axis == axis) to.effects.push_back(effect);
  }
}

class AxisExamination {
 public:
  AxisExamination(const twin::Model& model, const MeasuredSeries& series, const Playback& playback,
                  core::Axis axis, const DiagnosisOptions& options)
      : model_(model), series_(series), playback_(playback), axis_(axis), options_(options) {}

  AxisDiagnosis run(const std::vector<MeasuredSeries>& validation,
                    const std::vector<Playback>& playbacks, twin::Model& repaired) {
    const auto measured = measured_drift(series_, axis_);
    const auto before = playback_.drift(model_, axis_);
    const std::size_t a = core::index(axis_);
    const RecordFaults faults =
        find_record_faults(series_, axis_, difference(measured, before, series_.valid[a]));
    Split split = held_out_parts(validation, playbacks, faults.sound);
    Judged judged = attempt(split, {});
    AxisDiagnosis result;
    result.samples_left_out = faults.left_out;
    result.not_testable = judged.trial.not_testable;
    if (judged.trial.refusal) {
      return can_not_be_diagnosed(std::move(result), *judged.trial.refusal,
                                  what_would_decide(model_, series_, playback_, axis_));
    }
    const std::vector<std::string> refuted = refuted_by(judged);
    const bool tried_again = !refuted.empty() && try_without(refuted, split, judged);
    const bool adopted = judged.acceptance == Acceptance::kAccepted;
    if (!adopted) judged.held_out = compare_on(split.held_out, model_, model_, axis_);
    result.held_out_kind = split.kind;
    result.acceptance = judged.acceptance;
    result.held_out = judged.held_out.gap;
    const twin::Model& final_model = adopted ? judged.trial.repaired : model_;
    if (adopted) copy_axis(judged.trial.repaired, repaired, axis_);
    take(result, judged.trial, faults);
    describe(result, judged.trial, measured, before, final_model, faults.sound);
    if (split.kind != HeldOut::kNothing) result.allan_log_distance = judged.held_out.allan;
    conclude(result);
    if (tried_again) result.sentence += spoken_against(refuted);
    return result;
  }

 private:
  struct Judged {
    Trial trial;
    Comparison held_out;
    Acceptance acceptance = Acceptance::kNothingToProve;
  };

  [[nodiscard]] Judged attempt(const Split& split, std::span<const std::string> refuted) const {
    Judged judged{repair({model_, series_, playback_, axis_, split.fitted, options_, refuted}), {}};
    if (judged.trial.refusal) return judged;
    judged.held_out = compare_on(split.held_out, model_, judged.trial.repaired, axis_);
    judged.acceptance = judge(judged.trial, judged.held_out, split.kind);
    return judged;
  }

  static std::vector<std::string> refuted_by(const Judged& judged) {
    std::vector<std::string> names;
    if (judged.acceptance != Acceptance::kReverted || judged.trial.unknown) return names;
    for (const NamedEffect& effect : judged.trial.effects) {
      if (!is_noise(effect.name)) names.push_back(effect.name);
    }
    return names;
  }

  static std::string spoken_against(std::span<const std::string> refuted) {
    std::string names;
    for (const std::string& name : refuted) names += (names.empty() ? "" : " and ") + name;
    return " It looks like " + names + ", but held-out data speak against that.";
  }

  // What is significant in the record but not the effect it was taken for is another one, or none
  // that the catalogue knows.
  // True where that led to an answer, which then replaces the first one.
  bool try_without(std::span<const std::string> refuted, const Split& split, Judged& judged) const {
    Judged second = attempt(split, refuted);
    if (second.acceptance != Acceptance::kAccepted && !second.trial.unknown) return false;
    second.trial.evidence = judged.trial.evidence;
    judged = std::move(second);
    return true;
  }

  Split held_out_parts(const std::vector<MeasuredSeries>& validation,
                       const std::vector<Playback>& playbacks,
                       const std::vector<std::uint8_t>& sound) const {
    Split split{.kind = HeldOut::kRecords, .fitted = sound};
    for (std::size_t i = 0; i < validation.size(); ++i) {
      if (!has_axis(validation[i], axis_)) continue;
      const auto residual =
          difference(measured_drift(validation[i], axis_), playbacks[i].drift(model_, axis_),
                     validation[i].valid[core::index(axis_)]);
      HeldOutPart part{&validation[i], &playbacks[i],
                       find_record_faults(validation[i], axis_, residual).sound};
      if (can_judge(part)) split.held_out.push_back(std::move(part));
    }
    return split.held_out.empty() ? split_in_blocks(series_, playback_, sound) : split;
  }

  static void take(AxisDiagnosis& result, const Trial& trial, const RecordFaults& faults) {
    result.effects = trial.effects;
    result.recalibrated = trial.recalibrated;
    result.unknown = trial.unknown;
    result.could_have_seen = trial.could_have_seen;
    result.evidence = trial.evidence;
    result.effects.insert(result.effects.end(), faults.effects.begin(), faults.effects.end());
  }

  void describe(AxisDiagnosis& result, const Trial& trial, const std::vector<double>& measured,
                const std::vector<double>& before, const twin::Model& final_model,
                const std::vector<std::uint8_t>& sound) const {
    const auto after = playback_.drift(final_model, axis_);
    const std::size_t block = intervals_in(kMeanS, series_.interval_s);
    const auto residual = difference(measured, before, sound);
    result.fit = {rms_of_block_means(residual, sound, block).about_zero,
                  rms_of_block_means(difference(measured, after, sound), sound, block).about_zero,
                  expected_rms_of_block_means(trial.noise_dct_variances, block)};
    share_the_gap(result);
    const auto noise_before = model_noise(model_, axis_, series_.interval_s, series_.size);
    const auto noise_after = model_noise(final_model, axis_, series_.interval_s, series_.size);
    result.allan = allan_curves(measured, sound, series_.interval_s, {before, noise_before},
                                {after, noise_after});
    result.allan_log_distance = allan_distance(result.allan);
    const auto channels = moving_inputs(series_, axis_);
    result.where =
        locate({residual, sound, trial.noise_dct_variances, series_.interval_s}, channels);
    const auto taus =
        locate_cluster_times(result.allan, series_.interval_s * static_cast<double>(series_.size));
    result.where.insert(result.where.end(), taus.begin(), taus.end());
    result.waveforms = waveforms_of(series_, measured, sound, before, after);
    std::vector<double> explained(after.size());
    for (std::size_t i = 0; i < after.size(); ++i) explained[i] = after[i] - before[i];
    result.residual = residual_against_input(result, series_, axis_, residual, explained, sound);
  }

  // Mean squares of the effects' waveforms become shares of what they explain together.
  static void share_the_gap(AxisDiagnosis& result) {
    const double explained = result.fit.before_rms_radps * result.fit.before_rms_radps -
                             result.fit.after_rms_radps * result.fit.after_rms_radps;
    for (NamedEffect& effect : result.effects)
      effect.share_of_gap =
          explained > 0.0 ? std::clamp(effect.share_of_gap / explained, 0.0, 1.0) : 0.0;
  }

  void conclude(AxisDiagnosis& result) const {
    result.verdict = verdict_of(result);
    result.sentence = sentence_of(result);
    result.next_experiment = next_experiment(model_, axis_, result);
    const bool stands = result.acceptance == Acceptance::kNothingToProve ||
                        result.acceptance == Acceptance::kAccepted;
    if (!stands) take_back(result);
    if (result.verdict != Verdict::kConsistent || an_input_moves(series_, playback_, axis_)) return;
    result.verdict = Verdict::kUndecidable;
    result.sentence = (stands ? "" : result.sentence + " ") +
                      "No input of this record moves: beside noise and drift with time nothing "
                      "could be judged. " +
                      what_would_decide(model_, series_, playback_, axis_);
  }

  // A record's own faults need no proof by another one.
  static void take_back(AxisDiagnosis& result) {
    std::erase_if(result.effects,
                  [](const NamedEffect& effect) { return !is_record_fault(effect.name); });
    result.recalibrated.clear();
    result.verdict = verdict_of(result);
    if (!result.effects.empty())
      result.sentence += " The record has " + list_of(result.effects) + ".";
  }

  const twin::Model& model_;
  const MeasuredSeries& series_;
  const Playback& playback_;
  core::Axis axis_;
  const DiagnosisOptions& options_;
};

}  // namespace

Diagnosis diagnose(const twin::Model& model, const MeasuredSeries& series,
                   const std::vector<MeasuredSeries>& validation, const DiagnosisOptions& options) {
  if (const auto wrong = options.validate()) throw std::invalid_argument(*wrong);
  if (const auto wrong = model.validate()) throw std::invalid_argument("model: " + *wrong);
  Diagnosis diagnosis{.repaired = model};
  const Playback playback(series);
  const std::optional<std::string> too_short = why_too_short(series);
  std::vector<Playback> playbacks;
  for (const MeasuredSeries& record : validation) playbacks.emplace_back(record);
  for (const core::Axis axis : core::kAxes) {
    if (!has_axis(series, axis)) continue;
    AxisDiagnosis result =
        too_short
            ? can_not_be_diagnosed({}, *too_short, what_would_decide(model, series, playback, axis))
            : AxisExamination(model, series, playback, axis, options)
                  .run(validation, playbacks, diagnosis.repaired);
    diagnosis.verdict = std::max(diagnosis.verdict, result.verdict);
    diagnosis.axes[core::index(axis)] = std::move(result);
  }
  const bool has_any = std::any_of(diagnosis.axes.begin(), diagnosis.axes.end(),
                                   [](const auto& axis) { return axis.has_value(); });
  if (!has_any) diagnosis.verdict = Verdict::kUndecidable;
  return diagnosis;
}

}  // namespace zerodrift::diagnosis
