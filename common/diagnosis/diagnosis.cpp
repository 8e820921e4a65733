// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/diagnosis.h"

#include <algorithm>
#include <list>
#include <span>
#include <stdexcept>
#include <utility>

#include "common/diagnosis/axis_result.h"
#include "common/diagnosis/calibration.h"
#include "common/diagnosis/candidates.h"
#include "common/diagnosis/gap.h"
#include "common/diagnosis/held_out.h"
#include "common/diagnosis/known_effects.h"
#include "common/diagnosis/motion.h"
#include "common/diagnosis/next_experiment.h"
#include "common/diagnosis/playback.h"
#include "common/diagnosis/proved_formula.h"
#include "common/diagnosis/record_faults.h"
#include "common/diagnosis/records_of_axis.h"
#include "common/diagnosis/refutation.h"
#include "common/diagnosis/repair.h"
#include "common/diagnosis/split.h"
#include "common/diagnosis/verdict.h"

namespace zerodrift::diagnosis {
namespace {

// Less is not worth a second search.
constexpr double kLeastGainOfLagsNats = 5.0;

class AxisExamination {
 public:
  AxisExamination(const twin::Model& model, const MeasuredSeries& series, const Playback& playback,
                  core::Axis axis, const DiagnosisOptions& options)
      : model_(model), series_(series), playback_(playback), axis_(axis), options_(options) {}

  AxisDiagnosis run(const std::vector<PlayedRecord>& validation, twin::Model& repaired) {
    const auto measured = measured_drift(series_, axis_);
    const auto before = playback_.drift(model_, axis_);
    const std::size_t a = core::index(axis_);
    const RecordFaults faults =
        find_record_faults(series_, axis_, difference(measured, before, series_.valid[a]));
    Split split = split_records(model_, {&series_, &playback_}, validation, faults.sound, axis_);
    Calibrated calibrated = calibrated_on(split, Lags::kAtDefault);
    Judged judged = attempt(calibrated, split, {});
    AxisDiagnosis result;
    result.samples_left_out = faults.left_out;
    result.not_testable = judged.trial.not_testable;
    if (judged.trial.refusal) {
      return can_not_be_diagnosed(std::move(result), *judged.trial.refusal,
                                  what_would_decide(model_, series_, playback_, axis_));
    }
    const bool by_blocks = prefer_blocks(split, calibrated, judged, faults.sound);
    prefer_what_is_listed(calibrated, judged, split);
    prefer_lags(calibrated, judged, split);
    calibrate_beside_found(calibrated, judged, split);
    std::vector<std::string> refuted;
    std::optional<UnknownEffect> not_what_it_looks_like = unknown_like(judged.trial);
    const bool tried_again = try_without_refuted(refuted, calibrated, split, judged);
    std::string aside = tried_again ? spoken_against(refuted) : "";
    if (!tried_again || answers(judged.trial)) not_what_it_looks_like.reset();
    if (!tried_again) {
      if (judged.acceptance == Acceptance::kReverted)
        not_what_it_looks_like = refuted_finding(judged.trial, calibrated, split);
      aside += fall_back(judged, calibrated);
    }
    if (calibrated.calibration.fitted.empty() && is_all_rounding(faults, measured)) {
      take_nothing(judged);
      aside.clear();
      not_what_it_looks_like.reset();
    }
    if (judged.trial.unknown && !is_of_rounding(judged.trial.unknown->rms_radps, faults))
      close_unknown(judged, split, calibrated.calibration.fitted);
    prefer_formula(judged, calibrated, split);
    const bool adopted = judged.acceptance == Acceptance::kAccepted;
    const twin::Model final_model =
        adopted ? judged.trial.repaired : with_events_of(judged.trial, model_);
    const Comparison held_out = compare_on(split.held_out, model_, final_model, axis_);
    result.held_out_kind = split.kind;
    result.acceptance = judged.acceptance;
    result.held_out = held_out.gap;
    judged.trial.recalibrated =
        merged(calibrated.calibration.trial.recalibrated, judged.trial.recalibrated);
    if (adopted) hand_over(judged.trial, beside(model_, split, {}), repaired);
    take(result, judged.trial, faults);
    const bool moves = an_input_moves(series_, playback_, axis_);
    if (!result.unknown && tells(not_what_it_looks_like, moves, faults)) {
      result.unknown = std::move(not_what_it_looks_like);
      aside.clear();
    }
    describe(result,
             {model_, final_model, {&series_, &playback_}, axis_, faults.sound, measured, before},
             judged.trial);
    if (split.kind != HeldOut::kNothing) result.allan_log_distance = held_out.allan;
    conclude(result, moves);
    result.sentence += aside;
    result.sentence += about_events(result.effects);
    if (calibrated.calibration.fitted.empty() && result.verdict == Verdict::kConsistent) {
      const double left = left_about_mean(measured, final_model, faults.sound);
      doubt_consistency(result, is_of_rounding(left, faults) ? 0.0 : left, held_out);
    }
    if (moves) doubt_noise(result);
    result.sentence += about_reach(split.share_out_of_reach, split.kind);
    if (by_blocks) result.sentence += about_blocks();
    return result;
  }

 private:
  // What the model lists without coefficients, with those of this record.
  struct Calibrated {
    Calibration calibration;
    SlowNoise slow_noise = SlowNoise::kFree;
    Acceptance acceptance = Acceptance::kNothingToProve;

    [[nodiscard]] const twin::Model& proved(const twin::Model& given) const {
      return acceptance == Acceptance::kAccepted ? calibration.trial.repaired : given;
    }
  };

  struct Judged {
    Trial trial;
    Acceptance acceptance = Acceptance::kNothingToProve;
  };

  [[nodiscard]] Calibrated calibrated_on(const Split& split, Lags lags,
                                         std::span<const NamedEffect> beside = {},
                                         SlowNoise slow_noise = SlowNoise::kFree) const {
    Calibrated calibrated = calibrated_without({}, split, lags, beside, slow_noise);
    if (calibrated.acceptance != Acceptance::kReverted) return calibrated;
    const std::vector<std::string> refuted =
        refuted_kinds(model_, calibrated.calibration, split, axis_);
    if (refuted.empty()) return calibrated;
    Calibrated others = calibrated_without(refuted, split, lags, beside, slow_noise);
    return others.acceptance == Acceptance::kAccepted ? others : calibrated;
  }

  [[nodiscard]] Calibrated calibrated_without(std::span<const std::string> refuted,
                                              const Split& split, Lags lags,
                                              std::span<const NamedEffect> beside,
                                              SlowNoise slow_noise) const {
    TrialInput input = AxisExamination::beside(model_, split, {});
    input.refuted = refuted;
    input.slow_noise = slow_noise;
    Calibrated result{calibrate(input, lags, beside), slow_noise};
    const Trial& trial = result.calibration.trial;
    result.acceptance =
        judge(trial, compare_on(split.held_out, model_, trial.repaired, axis_), split.kind);
    return result;
  }

  // Slow noise takes any course in the record that it is fitted to: whether effects have made that
  // course, data that were kept back tell.
  [[nodiscard]] Judged attempt(const Calibrated& calibrated, const Split& split,
                               std::span<const std::string> refuted) const {
    TrialInput input =
        beside(calibrated.calibration.drift_alone, split, calibrated.calibration.fitted);
    input.refuted = refuted;
    Judged judged = judged_trial(input, calibrated, split);
    std::vector<std::string> doubtful(refuted.begin(), refuted.end());
    if (judged.acceptance == Acceptance::kReverted && !judged.trial.events.empty()) {
      // Beside what does not stand an event may be the rest of it.
      for (const NamedEffect& event : judged.trial.events) doubtful.push_back(event.name);
      input.refuted = doubtful;
      judged = judged_trial(input, calibrated, split);
    }
    if (!judged.trial.noise_could_be_effects || split.kind == HeldOut::kNothing) return judged;
    input.slow_noise = SlowNoise::kAsStated;
    Judged effects = judged_trial(input, calibrated, split);
    const bool explain =
        effects.acceptance == Acceptance::kAccepted && !effects.trial.unknown &&
        drift_of(effects.trial).size() > drift_of(judged.trial).size() &&
        is_likelier(effects.trial.repaired, judged.trial.repaired, input.model, split) &&
        each_is_clear(input.model, effects.trial, split, axis_);
    return explain ? std::move(effects) : std::move(judged);
  }

  // By data that took part in neither; both were made from `base`.
  [[nodiscard]] bool is_likelier(const twin::Model& one, const twin::Model& than,
                                 const twin::Model& base, const Split& split) const {
    return likelier_by_nats(split.held_out, base, one, than, axis_) > 0.0;
  }

  [[nodiscard]] Judged judged_trial(const TrialInput& input, const Calibrated& calibrated,
                                    const Split& split) const {
    Judged judged{repair(input)};
    if (judged.trial.refusal) return judged;
    judged.acceptance =
        judge(judged.trial,
              compare_on(split.held_out, with_events_of(judged.trial, calibrated.proved(model_)),
                         judged.trial.repaired, axis_),
              split.kind);
    // Beside a name other coefficients come out of the record, which may be what is better.
    if (judged.acceptance == Acceptance::kAccepted && !calibrated.calibration.fitted.empty() &&
        !names_spoken_against(input.model, judged.trial, split, axis_).empty())
      judged.acceptance = Acceptance::kReverted;
    const bool leaves_events = judged.acceptance == Acceptance::kReverted &&
                               judged.trial.effects.empty() && !judged.trial.unknown &&
                               !judged.trial.events.empty();
    if (leaves_events) {
      // They stand where new parameters beside them don't.
      judged.acceptance = Acceptance::kNothingToProve;
      judged.trial.recalibrated.clear();
      judged.trial.repaired = with_events_of(judged.trial, model_);
    }
    return judged;
  }

  // What happened in the record needs no proof by other data, and proves nothing else: it stands on
  // both sides of a comparison.
  [[nodiscard]] twin::Model with_events_of(const Trial& trial, twin::Model model) const {
    for (const NamedEffect& event : trial.events) model.effects.push_back(spec_of(event, axis_));
    return model;
  }

  // Data that would not show what was found speak neither for nor against it: blocks that would
  // judge in their place. Whether blocks take that of other records.
  bool prefer_blocks(Split& split, Calibrated& calibrated, Judged& judged,
                     const std::vector<std::uint8_t>& sound) const {
    const twin::Model& known = calibrated.calibration.drift_alone;
    if (judged.acceptance != Acceptance::kReverted || would_show(known, judged.trial, split, axis_))
      return false;
    Split blocks = blocks_that_show(known, judged.trial, {&series_, &playback_}, sound, axis_);
    judged.acceptance = Acceptance::kUnproven;
    if (blocks.kind == HeldOut::kNothing) return false;
    Calibrated again = calibrated_on(blocks, Lags::kAtDefault);
    Judged rival = attempt(again, blocks, {});
    if (rival.trial.refusal || !answers(rival.trial)) return false;
    calibrated = std::move(again);
    judged = std::move(rival);
    return std::exchange(split, std::move(blocks)).kind == HeldOut::kRecords;
  }

  // What was found may have moved the shapes and inputs of what was calibrated without it: then
  // both are found once more.
  void calibrate_beside_found(Calibrated& calibrated, Judged& judged, const Split& split) const {
    const std::vector<NamedEffect> found = drift_of(judged.trial);
    if (found.empty() || calibrated.calibration.fitted.empty()) return;
    const Lags lags = calibrated.calibration.lags;
    Calibrated again = calibrated_on(split, lags, found, calibrated.slow_noise);
    if (again.acceptance == Acceptance::kReverted ||
        same_shapes(again.calibration, calibrated.calibration)) {
      return;
    }
    Judged second = attempt(again, split, {});
    if (second.trial.refusal) return;
    const bool is_better =
        split.kind == HeldOut::kNothing
            ? second.trial.log_evidence > judged.trial.log_evidence
            : second.acceptance == Acceptance::kAccepted &&
                  is_likelier(second.trial.repaired, judged.trial.repaired, model_, split);
    if (!is_better) return;
    calibrated = std::move(again);
    judged = std::move(second);
  }

  // What stands in the end if nothing else is found.
  [[nodiscard]] const twin::Model& final_of(const Judged& j, const Calibrated& c) const {
    return j.acceptance == Acceptance::kAccepted ? j.trial.repaired : c.proved(model_);
  }

  // Slow noise of no stated size takes the course of what the model lists: it is looked for as if
  // nothing wandered, and stays where data that were kept back are likelier with it and no more
  // seems to be missing than without it.
  void prefer_what_is_listed(Calibrated& calibrated, Judged& judged, const Split& split) const {
    if (split.kind == HeldOut::kNothing ||
        !lists_without_coefficients(calibrated.calibration.drift_alone, axis_))
      return;
    Calibrated held = calibrated_on(split, calibrated.calibration.lags, {}, SlowNoise::kAsStated);
    if (held.acceptance != Acceptance::kAccepted ||
        held.calibration.fitted.size() <= calibrated.calibration.fitted.size())
      return;
    Judged rival = attempt(held, split, {});
    if (rival.trial.refusal || rival.acceptance == Acceptance::kReverted) return;
    const auto missing = [](const Trial& trial) {
      return drift_of(trial).size() + (trial.unknown ? 1U : 0U);
    };
    if (missing(rival.trial) > std::max<std::size_t>(1, missing(judged.trial))) return;
    if (!is_likelier(final_of(rival, held), final_of(judged, calibrated), model_, split)) return;
    calibrated = std::move(held);
    judged = std::move(rival);
  }

  // Lags of what the model lists rival what seems to be missing: they win where they explain as
  // much. As if nothing wandered any lag would explain something.
  void prefer_lags(Calibrated& calibrated, Judged& judged, const Split& split) const {
    const bool finds = !judged.trial.effects.empty() || judged.trial.unknown;
    if (!finds || !calibrated.calibration.has_free_lags) return;
    if (calibrated.slow_noise == SlowNoise::kAsStated) return;
    Calibrated lagged = calibrated_on(split, Lags::kFree);
    const double gain = lagged.calibration.score - calibrated.calibration.score;
    if (lagged.acceptance == Acceptance::kReverted || !(gain > kLeastGainOfLagsNats)) return;
    Judged rival = attempt(lagged, split, {});
    if (rival.trial.refusal || rival.trial.log_evidence + gain < judged.trial.log_evidence) return;
    calibrated = std::move(lagged);
    judged = std::move(rival);
  }

  // What a trial found and could not prove leaves the calibration as it is. The sentence about it,
  // if there was a name.
  static std::string fall_back(Judged& judged, const Calibrated& calibrated) {
    const bool unproven = judged.acceptance == Acceptance::kUnproven;
    if (judged.acceptance == Acceptance::kAccepted) return {};
    if (unproven && calibrated.acceptance != Acceptance::kAccepted) return {};
    if (judged.acceptance == Acceptance::kNothingToProve) judged.acceptance = calibrated.acceptance;
    if (calibrated.acceptance != Acceptance::kAccepted) return {};
    std::string aside;
    if (!judged.trial.effects.empty()) {
      const std::vector<std::string> names = labels_of(judged.trial.effects);
      aside = unproven ? shown_by_nothing(names) : spoken_against(names);
    }
    judged.trial.effects.clear();
    judged.trial.recalibrated.clear();
    judged.trial.log_evidence = 0.0;
    judged.trial.repaired = calibrated.calibration.trial.repaired;
    judged.acceptance = Acceptance::kAccepted;
    return aside;
  }

  // What is significant in the record but not the effect it was taken for is another one, or none
  // that the catalogue knows. True where leaving out what held-out data speak against led to an
  // answer, which then replaces the first one. Once, and then for noise alone, which wanders as any
  // of them: who asks often enough is told what he wants.
  bool try_without_refuted(std::vector<std::string>& refuted, const Calibrated& calibrated,
                           const Split& split, Judged& judged) const {
    if (judged.acceptance != Acceptance::kReverted || judged.trial.unknown) return false;
    const twin::Model& known = calibrated.calibration.drift_alone;
    refuted = refuted_names(known, judged.trial, split, axis_);
    if (refuted.empty()) return false;
    Judged second = attempt(calibrated, split, refuted);
    if (second.acceptance != Acceptance::kAccepted && !second.trial.unknown) {
      second = attempt(calibrated, split, all_drift_labels());
      const bool is_noise_alone = second.acceptance == Acceptance::kAccepted &&
                                  !second.trial.effects.empty() && !second.trial.unknown;
      if (!is_noise_alone) return false;
    } else if (!outweighs(second.trial, judged.trial, known, split, axis_)) {
      return false;
    }
    second.trial.evidence = judged.trial.evidence;
    judged = std::move(second);
    return true;
  }

  [[nodiscard]] TrialInput beside(const twin::Model& known, const Split& split,
                                  std::span<const std::size_t> calibrated) const {
    return {known, series_, playback_, axis_, split.fitted, options_, {}, calibrated, &columns_};
  }

  static void take_formula(Judged& judged, Trial trial, std::vector<NamedEffect> with) {
    std::erase_if(trial.effects, [](const NamedEffect& effect) { return !is_noise(effect.name); });
    trial.effects.insert(trial.effects.begin(), with.begin(), with.end());
    trial.could_have_seen = std::move(judged.trial.could_have_seen);
    trial.evidence = std::move(judged.trial.evidence);
    judged = {std::move(trial), Acceptance::kAccepted};
  }

  // What the catalogue doesn't know is described by a formula, else by a curve, beside what stands
  // without it, where held-out data confirm one. Else all is left as it was.
  void close_unknown(Judged& judged, const Split& split,
                     std::span<const std::size_t> calibrated) const {
    const bool stands = judged.acceptance == Acceptance::kAccepted;
    const twin::Model& without = stands ? judged.trial.repaired : model_;
    const TrialInput input = beside(without, split, calibrated);
    auto closed = proved_formula(input, split, Vocabulary::kTerms);
    if (!closed) closed = proved_formula(input, split, Vocabulary::kCurves);
    if (!closed) return;
    if (stands) {
      closed->recalibrated = merged(judged.trial.recalibrated, closed->recalibrated);
      closed->events = std::move(judged.trial.events);
    }
    take_formula(judged, *std::move(closed),
                 stands ? std::move(judged.trial.effects) : std::vector<NamedEffect>());
  }

  // A name takes in what depends on an input as no function of the lineup does, a wandering noise
  // nearly all of it. A formula stands in the place of all that was found, or of nothing, where
  // this record, which makes it pay for the whole grammar, and held-out data both speak for it.
  void prefer_formula(Judged& judged, const Calibrated& calibrated, const Split& split) const {
    if (judged.trial.unknown || judged.acceptance == Acceptance::kUnproven) return;
    const twin::Model& known = calibrated.proved(model_);
    const bool stands = judged.acceptance == Acceptance::kAccepted;
    const TrialInput input = beside(known, split, calibrated.calibration.fitted);
    auto rival = proved_formula(input, split, Vocabulary::kTerms);
    if (rival && rival->log_evidence > (stands ? judged.trial.log_evidence : 0.0) &&
        is_likelier(rival->repaired, final_of(judged, calibrated), known, split)) {
      take_formula(judged, *std::move(rival), {});
    }
  }

  // What a trial suggested and held-out data speak against is something else all the same: names,
  // or new parameters without which far more is left than the noise makes.
  [[nodiscard]] std::optional<UnknownEffect> refuted_finding(const Trial& trial,
                                                             const Calibrated& calibrated,
                                                             const Split& split) const {
    auto names = unknown_like(trial);
    if (names || trial.unknown || calibrated.acceptance == Acceptance::kReverted) return names;
    const std::size_t block = intervals_in(kMeanS, series_.interval_s);
    return unlike_other_parameters(
        trial,
        left_about_mean(measured_drift(series_, axis_), calibrated.proved(model_), split.fitted),
        expected_rms_of_block_means(trial.noise_dct_variances, block));
  }

  void take_nothing(Judged& judged) const {
    judged.acceptance = Acceptance::kNothingToProve;
    judged.trial.effects.clear();
    judged.trial.events.clear();
    judged.trial.recalibrated.clear();
    judged.trial.unknown.reset();
    judged.trial.repaired = model_;
  }

  [[nodiscard]] double left_about_mean(const std::vector<double>& measured,
                                       const twin::Model& model,
                                       const std::vector<std::uint8_t>& valid) const {
    const auto left = difference(measured, playback_.drift(model, axis_), valid);
    return rms_of_block_means(left, valid, intervals_in(kMeanS, series_.interval_s)).about_mean;
  }

  // Whether all that the twin leaves, about its mean, could be the record's rounding.
  bool is_all_rounding(const RecordFaults& faults, const std::vector<double>& measured) const {
    return faults.rounding_rms_radps > 0.0 &&
           is_of_rounding(left_about_mean(measured, model_, faults.sound), faults);
  }

  void conclude(AxisDiagnosis& result, bool an_input_moves) const {
    result.verdict = verdict_of(result);
    result.sentence = sentence_of(result);
    result.next_experiment = next_experiment(model_, axis_, result);
    const bool stands = result.acceptance == Acceptance::kNothingToProve ||
                        result.acceptance == Acceptance::kAccepted;
    if (!stands) take_back(result);
    if (result.verdict != Verdict::kConsistent || an_input_moves) return;
    result.verdict = Verdict::kUndecidable;
    result.sentence = (stands ? "" : result.sentence + " ") +
                      "No input of this record moves: beside noise and drift with time nothing "
                      "could be judged. " +
                      what_would_decide(model_, series_, playback_, axis_);
  }

  const twin::Model& model_;
  const MeasuredSeries& series_;
  const Playback& playback_;
  core::Axis axis_;
  const DiagnosisOptions& options_;
  mutable ColumnMemory columns_;  // of the searches, which come one after the other
};

AxisDiagnosis diagnose_axis(const twin::Model& model, const PlayedRecord& record,
                            const std::vector<PlayedRecord>& validation, core::Axis axis,
                            const DiagnosisOptions& options, twin::Model& repaired) {
  RecordsOfAxis records(axis);
  std::optional<UnreferencedMotion> motion;
  const auto judged = records.judged(record, motion);
  if (!judged) return moved_without_reference(*motion);
  std::vector<PlayedRecord> held_out;
  for (const PlayedRecord& other : validation) {
    std::optional<UnreferencedMotion> of_other;
    if (!other.series->has(axis)) continue;
    if (const auto part = records.judged(other, of_other)) held_out.push_back(*part);
  }
  AxisDiagnosis result = AxisExamination(model, *judged->series, *judged->playback, axis, options)
                             .run(held_out, repaired);
  if (motion) result.sentence += about_rest(*motion, *judged->series);
  return result;
}

}  // namespace

Diagnosis diagnose(const twin::Model& model, const MeasuredSeries& record,
                   const std::vector<MeasuredSeries>& validation, const DiagnosisOptions& options) {
  if (const auto wrong = options.validate()) throw std::invalid_argument(*wrong);
  if (const auto wrong = model.validate()) throw std::invalid_argument("model: " + *wrong);
  Diagnosis diagnosis{.repaired = model};
  const OwnRecord own(without_lags(record, model));
  const auto& [series, playback] = own;
  const std::optional<std::string> too_short = why_too_short(series);
  std::list<OwnRecord> others;
  std::vector<PlayedRecord> held_out;
  for (const MeasuredSeries& other : validation)
    held_out.push_back(others.emplace_back(without_lags(other, model)).played());
  for (const core::Axis axis : core::kAxes) {
    if (!series.has(axis)) continue;
    AxisDiagnosis result =
        too_short
            ? can_not_be_diagnosed({}, *too_short, what_would_decide(model, series, playback, axis))
            : diagnose_axis(model, own.played(), held_out, axis, options, diagnosis.repaired);
    diagnosis.verdict = std::max(diagnosis.verdict, result.verdict);
    diagnosis.axes[core::index(axis)] = std::move(result);
  }
  const bool has_any = std::any_of(diagnosis.axes.begin(), diagnosis.axes.end(),
                                   [](const auto& axis) { return axis.has_value(); });
  if (!has_any) diagnosis.verdict = Verdict::kUndecidable;
  return diagnosis;
}

}  // namespace zerodrift::diagnosis
