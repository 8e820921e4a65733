// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/diagnosis.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/core/units.h"
#include "common/diagnosis/candidates.h"
#include "common/diagnosis/disagreement.h"
#include "common/diagnosis/gap.h"
#include "common/diagnosis/next_experiment.h"
#include "common/diagnosis/noise_weight.h"
#include "common/diagnosis/playback.h"
#include "common/diagnosis/record_faults.h"
#include "common/diagnosis/rounded_text.h"
#include "common/diagnosis/trial.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {
namespace {

constexpr double kMeanS = 60.0;  // RMS figures are of means over this
constexpr double kShortestRecordS = 600.0;
constexpr std::size_t kFewestIntervals = 60;
// Two of so many blocks are kept back, with a guard at each of their ends: a quarter of the block,
// so that half of it is judged, but no more than this.
constexpr std::size_t kBlocks = 10;
constexpr double kLongestGuardS = 300.0;
// Nor less than twice the half window that temperatures are smoothed over, so that no reading takes
// part on both sides. In a shorter record than this nothing can be kept back.
constexpr double kShortestGuardS = 90.0;
constexpr double kShortestForBlocksS = 4.0 * kShortestGuardS * kBlocks;
// Held-out figures may be worse by this and still count as equal.
constexpr double kNoWorse = 1.02;
constexpr double kMeanNoWorse = 1.05;  // with the mean, of which two records say little
constexpr double kAllanTolerance = 0.02;
constexpr double kClearNats = 10.0;  // a likelihood that outweighs the few points of an Allan curve
constexpr double kNatsOfALine = 3.0;     // that noise alone gains by a free size and phase
constexpr std::size_t kMostRanges = 10;  // of disagreement that are told

struct HeldOutPart {
  const MeasuredSeries* series;
  const Playback* playback;
  std::vector<std::uint8_t> valid;
};

struct Split {
  HeldOut kind = HeldOut::kNothing;
  std::vector<std::uint8_t> fitted{};
  std::vector<HeldOutPart> held_out{};
};

std::size_t intervals_in(double duration_s, double interval_s) {
  return static_cast<std::size_t>(std::max(1.0, std::round(duration_s / interval_s)));
}

double duration_of(const MeasuredSeries& series) {
  return series.interval_s * static_cast<double>(series.size);
}

// An RMS of means needs two of them.
bool can_judge(const HeldOutPart& part) {
  const std::vector<double> any(part.valid.size(), 0.0);
  return block_means(any, part.valid, intervals_in(kMeanS, part.series->interval_s)).mean.size() >=
         2;
}

// The blocks that are kept back are not at the ends.
Split split_in_blocks(const MeasuredSeries& series, const Playback& playback,
                      const std::vector<std::uint8_t>& sound) {
  const double duration_s = duration_of(series);
  if (duration_s < kShortestForBlocksS) return {.fitted = sound};
  Split split{.kind = HeldOut::kBlocks, .fitted = sound};
  std::vector<std::uint8_t> kept(series.size, 0);
  const double guard_s = std::min(duration_s / (4.0 * kBlocks), kLongestGuardS);
  const std::size_t guard = intervals_in(guard_s, series.interval_s);
  for (const std::size_t block : {3U, 7U}) {
    const std::size_t begin = series.size * block / kBlocks;
    const std::size_t end = series.size * (block + 1) / kBlocks;
    for (std::size_t i = begin; i < end; ++i) {
      split.fitted[i] = 0;
      const bool guarded = i < begin + guard || i + guard >= end;
      if (!guarded) kept[i] = sound[i];
    }
  }
  split.held_out.push_back({&series, &playback, std::move(kept)});
  return can_judge(split.held_out.front()) ? split : Split{.fitted = sound};
}

bool has_axis(const MeasuredSeries& series, core::Axis axis) {
  return !series.rate_radps[core::index(axis)].empty();
}

bool is_record_fault(const std::string& kind) {
  const auto* definition = twin::find_effect(kind);
  return definition != nullptr && definition->family == twin::Family::kRecordFault &&
         !is_waveform(*definition);
}

bool is_noise(const std::string& kind) {
  const auto* definition = twin::find_effect(kind);
  return definition != nullptr && definition->family == twin::Family::kStochastic;
}

// Nobody can tell the phase that a line has in another record: its frequency has to be there.
twin::Model without_lines(twin::Model model) {
  std::erase_if(model.effects, [](const twin::EffectSpec& e) { return e.kind == "line"; });
  return model;
}

std::vector<double> added_lines_hz(const twin::Model& before, const twin::Model& after,
                                   core::Axis axis) {
  std::vector<double> frequencies;
  for (const twin::EffectSpec& effect : after.effects) {
    if (effect.kind != "line" || effect.axis != axis || effect.parameters.empty()) continue;
    const bool is_old =
        std::any_of(before.effects.begin(), before.effects.end(), [&](const twin::EffectSpec& old) {
          return old.kind == "line" && old.axis == axis && old.parameters == effect.parameters;
        });
    const auto complete = twin::complete_parameters(*twin::find_effect("line"), effect.parameters);
    if (!is_old) frequencies.push_back(complete.at("frequency_hz"));
  }
  return frequencies;
}

struct Comparison {
  Gap gap;
  // About the mean: what is judged, since the bias of a switch-on is anyone's.
  double shape_before_radps = 0.0;
  double shape_after_radps = 0.0;
  // How much likelier the drift afterwards makes the data about their mean, nats; 0 where the model
  // has no noise to judge by.
  double gain_nats = 0.0;
  double noise_gain_nats = 0.0;  // of the noise afterwards, on what the drift afterwards leaves
  AllanDistance allan;
};

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
    const auto drift_before = part.playback->drift(before, axis);
    const auto drift_after = part.playback->drift(after, axis);
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
    const auto quiet_before = part.playback->drift(without_lines(before), axis);
    const auto quiet_after = part.playback->drift(without_lines(after), axis);
    const BlockRms rms_before = rms(quiet_before);
    const BlockRms rms_after = rms(quiet_after);
    add(result.gap.before_rms_radps, rms_before.about_zero);
    add(result.gap.after_rms_radps, rms_after.about_zero);
    add(result.shape_before_radps, rms_before.about_mean);
    add(result.shape_after_radps, rms_after.about_mean);
    add(result.gap.noise_floor_rms_radps, expected_rms_of_block_means(noise_after, block));
    const auto variances = model_noise(after, axis, series.interval_s, quick_length(series.size));
    const auto misfit = [&](const std::vector<double>& drift) {
      return weighted_square(difference(measured, drift, part.valid), part.valid, variances);
    };
    result.gain_nats += 0.5 * (misfit(quiet_before) - misfit(quiet_after));
    const auto variances_before =
        model_noise(before, axis, series.interval_s, quick_length(series.size));
    result.noise_gain_nats += noise_gain_nats(difference(measured, quiet_after, part.valid),
                                              part.valid, variances_before, variances);
    for (const double frequency_hz : added_lines_hz(before, after, axis)) {
      result.gain_nats -= kNatsOfALine;
      result.gain_nats += line_gain_nats(difference(measured, quiet_after, part.valid), part.valid,
                                         variances, frequency_hz, series.interval_s);
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

// Another bias moves the drift without changing its shape.
template <typename Changes>
bool changes_shape(const Changes& changes) {
  return std::any_of(changes.begin(), changes.end(), [](const auto& change) {
    return !is_noise(change.name) && change.name != "bias";
  });
}

bool changes_noise(const Trial& trial) {
  const auto is_of_noise = [](const auto& change) { return is_noise(change.name); };
  return std::any_of(trial.effects.begin(), trial.effects.end(), is_of_noise) ||
         std::any_of(trial.recalibrated.begin(), trial.recalibrated.end(), is_of_noise);
}

// What changes the drift's shape has to make the data likelier, which tells more than their RMS
// where noise is red; what is noise, too, or bring the Allan curve closer; a bias, the mean.
// Neither may make the others worse. Of a twin without any noise the Allan curve is no figure to
// judge by, and any noise is likelier than none.
Acceptance judge(const Trial& trial, const Comparison& held_out, HeldOut kind) {
  if (trial.effects.empty() && trial.recalibrated.empty()) return Acceptance::kNothingToProve;
  if (kind == HeldOut::kNothing) return Acceptance::kUnproven;
  const bool shape = changes_shape(trial.effects) || changes_shape(trial.recalibrated);
  const Gap& gap = held_out.gap;
  const AllanDistance& allan = held_out.allan;
  const bool comparable = std::isfinite(allan.before) && std::isfinite(allan.after);
  const bool noise_is_new = changes_noise(trial) && !std::isfinite(allan.before);
  const bool no_worse = held_out.shape_after_radps <= kNoWorse * held_out.shape_before_radps &&
                        gap.after_rms_radps <= kMeanNoWorse * gap.before_rms_radps &&
                        (!comparable || allan.after <= allan.before + kAllanTolerance ||
                         held_out.noise_gain_nats > kClearNats);
  const bool likelier = held_out.gain_nats != 0.0
                            ? held_out.gain_nats > 0.0
                            : held_out.shape_after_radps < held_out.shape_before_radps;
  const bool closer = shape ? likelier
                            : held_out.noise_gain_nats > 0.0 || noise_is_new ||
                                  (comparable && allan.after < allan.before) ||
                                  held_out.gap.after_rms_radps < held_out.gap.before_rms_radps;
  return closer && no_worse ? Acceptance::kAccepted : Acceptance::kReverted;
}

Verdict verdict_of(const AxisDiagnosis& axis) {
  if (axis.unknown) return Verdict::kUnknownEffect;
  if (!axis.examined || axis.acceptance == Acceptance::kUnproven) return Verdict::kUndecidable;
  if (!axis.effects.empty()) {
    const bool certain =
        std::all_of(axis.effects.begin(), axis.effects.end(),
                    [](const NamedEffect& effect) { return effect.alternatives.empty(); });
    return certain ? Verdict::kEffectNamed : Verdict::kAmbiguous;
  }
  return axis.recalibrated.empty() ? Verdict::kConsistent : Verdict::kRecalibrated;
}

std::string list_of(const std::vector<NamedEffect>& effects) {
  std::string text;
  for (const NamedEffect& effect : effects) {
    if (!text.empty()) text += " and ";
    text += effect.name;
    if (effect.alternatives.empty()) continue;
    text += " (or";
    for (std::size_t i = 0; i < effect.alternatives.size(); ++i)
      text += (i > 0 ? ", " : " ") + effect.alternatives[i].name;
    text += ")";
  }
  return text;
}

std::string sentence_of(const AxisDiagnosis& axis) {
  const Gap& gap = axis.held_out_kind == HeldOut::kNothing ? axis.fit : axis.held_out;
  const std::string figures =
      " The gap on " +
      std::string(axis.held_out_kind == HeldOut::kNothing ? "the record" : "held-out data") +
      " falls from " + rounded(core::deg_h_from_radps(gap.before_rms_radps)) + " to " +
      rounded(core::deg_h_from_radps(gap.after_rms_radps)) + " deg/h rms.";
  std::string text;
  const std::string suggested =
      "The record suggests " +
      (axis.effects.empty() ? std::string("other parameters") : list_of(axis.effects));
  if (axis.acceptance == Acceptance::kReverted && !axis.unknown)
    return suggested + ", but held-out data don't confirm it: the model is left as it was.";
  switch (axis.verdict) {
    case Verdict::kConsistent:
      return "Nothing is missing that this record could have shown.";
    case Verdict::kUndecidable:
      return suggested +
             ", but nothing could be kept back to prove it on: the model is left as it was. A "
             "second record, or one of " +
             rounded(kShortestForBlocksS / 60.0) +
             " min or more in which this axis has valid rates, decides it.";
    case Verdict::kRecalibrated:
      text = "No effect is missing, but parameters of the model were wrong.";
      break;
    case Verdict::kEffectNamed:
    case Verdict::kAmbiguous:
      text = "Missing: " + list_of(axis.effects) + ".";
      break;
    case Verdict::kUnknownEffect:
      text = "Something is missing that the catalogue doesn't know: " + axis.unknown->description +
             ".";
      if (!axis.effects.empty()) text += " Also missing: " + list_of(axis.effects) + ".";
      break;
  }
  if (axis.acceptance == Acceptance::kAccepted) text += figures;
  return text;
}

std::optional<std::string> why_too_short(const MeasuredSeries& series) {
  const double duration_s = duration_of(series);
  if (duration_s >= kShortestRecordS && series.size >= kFewestIntervals) return std::nullopt;
  return "the record is too short, " + rounded(duration_s / 60.0) + " min in " +
         std::to_string(series.size) + " intervals where a diagnosis needs " +
         rounded(kShortestRecordS / 60.0) + " min in " + std::to_string(kFewestIntervals);
}

// What a record that could decide has: the length that something can be kept back of, and what the
// listed effects need and this record lacks.
std::string what_would_decide(const twin::Model& model, const MeasuredSeries& series,
                              const Playback& playback, core::Axis axis) {
  std::vector<std::string> needs;
  const auto add = [&](twin::Need need) {
    const std::string what(wanted(need));
    const bool is_new = !what.empty() && std::find(needs.begin(), needs.end(), what) == needs.end();
    if (is_new && why_unmet(need, series, playback, axis)) needs.push_back(what);
  };
  for (const twin::EffectSpec& spec : model.effects) {
    const auto* definition = twin::find_effect(spec.kind);
    if (definition == nullptr || spec.axis != axis) continue;
    for (const twin::Need need : definition->needs) add(need);
  }
  if (needs.empty() && !an_input_moves(series, playback, axis)) add(twin::Need::kTemperature);
  std::string text = "A record of " + rounded(kShortestForBlocksS / 60.0) + " min or more";
  for (std::size_t i = 0; i < needs.size(); ++i)
    text += (i == 0 ? " with " : i + 1 == needs.size() ? " and " : ", ") + needs[i];
  const bool is_long = duration_of(series) >= kShortestForBlocksS;
  if (is_long && needs.empty()) text += " in which this axis has valid rates throughout";
  return text + " decides it.";
}

AxisDiagnosis can_not_be_diagnosed(AxisDiagnosis result, const std::string& why,
                                   const std::string& what_would) {
  result.examined = false;
  result.verdict = Verdict::kUndecidable;
  result.sentence = "This axis can't be diagnosed: " + why + ". " + what_would;
  return result;
}

std::vector<double> means_on(const std::vector<double>& centres, const std::vector<double>& values,
                             std::size_t block) {
  std::vector<double> means;
  for (const double centre : centres) {
    const auto begin = static_cast<std::size_t>(centre - 0.5 * static_cast<double>(block));
    double sum = 0.0;
    for (std::size_t i = begin; i < begin + block; ++i) sum += values[i];
    means.push_back(sum / static_cast<double>(block));
  }
  return means;
}

Waveforms waveforms_of(const MeasuredSeries& series, const std::vector<double>& measured,
                       const std::vector<std::uint8_t>& valid, const std::vector<double>& before,
                       const std::vector<double>& after) {
  const std::size_t block = intervals_in(kMeanS, series.interval_s);
  const BlockMeans means = block_means(measured, valid, block);
  Waveforms curves;
  for (const double centre : means.centre)
    curves.time_s.push_back(series.start_s + centre * series.interval_s);
  curves.measured_radps = means.mean;
  curves.before_radps = means_on(means.centre, before, block);
  curves.after_radps = means_on(means.centre, after, block);
  return curves;
}

// The input that the first named effect reads, or that the unknown one depends on.
std::optional<ResidualAgainstInput> residual_against_input(const AxisDiagnosis& axis,
                                                           const MeasuredSeries& series,
                                                           core::Axis which,
                                                           const std::vector<double>& residual,
                                                           const std::vector<double>& explained,
                                                           const std::vector<std::uint8_t>& valid) {
  const auto channels = moving_inputs(series, which);
  std::string wanted;
  if (axis.unknown && !axis.unknown->depends_on.empty()) {
    wanted = axis.unknown->depends_on.front();
  } else if (!axis.effects.empty() && !axis.effects.front().inputs.empty()) {
    wanted = "temperature_" + axis.effects.front().inputs.front();
  } else if (!axis.where.empty()) {
    wanted = axis.where.front().kind;
  }
  if (channels.empty() || wanted.empty()) return std::nullopt;
  const InputChannel* channel = &channels.front();
  for (const InputChannel& candidate : channels) {
    if (candidate.name == wanted) channel = &candidate;
  }
  const std::size_t block = intervals_in(kMeanS, series.interval_s);
  const BlockMeans means = block_means(residual, valid, block);
  return ResidualAgainstInput{channel->name + " (" + channel->unit + ")",
                              means_on(means.centre, channel->values, block), means.mean,
                              means_on(means.centre, explained, block)};
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
    settle(result);
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

  void settle(AxisDiagnosis& result) const {
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

std::string_view name(Verdict verdict) {
  switch (verdict) {
    case Verdict::kConsistent:
      return "consistent";
    case Verdict::kUndecidable:
      return "undecidable";
    case Verdict::kRecalibrated:
      return "recalibrated";
    case Verdict::kEffectNamed:
      return "effect_named";
    case Verdict::kAmbiguous:
      return "ambiguous";
    case Verdict::kUnknownEffect:
      return "unknown_effect";
  }
  return "unknown";
}

std::optional<std::string> DiagnosisOptions::validate() const {
  if (!(false_names_per_record > 0.0 && false_names_per_record < 0.5)) {
    return "false_names_per_record is " + std::to_string(false_names_per_record) +
           ", must be inside (0, 0.5)";
  }
  if (most_effects < 1 || most_effects > 8)
    return "most_effects is " + std::to_string(most_effects) + ", must be 1 to 8";
  return std::nullopt;
}

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
