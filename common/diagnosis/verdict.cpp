// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/verdict.h"

#include <algorithm>

#include "common/core/units.h"
#include "common/diagnosis/held_out.h"
#include "common/diagnosis/rounded_text.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {
namespace {

constexpr double kShortestRecordS = 600.0;
constexpr std::size_t kFewestIntervals = 60;

// What makes the gap smaller beside the effects that were missing is not credited to them. Noise,
// what begins anew with another phase in each record and what means of a minute don't show leave it
// as it was.
std::string about_the_gap(const AxisDiagnosis& axis) {
  const bool on_record = axis.held_out_kind == HeldOut::kNothing;
  const Gap& gap = on_record ? axis.fit : axis.held_out;
  const std::string before = rounded(core::deg_h_from_radps(gap.before_rms_radps));
  const std::string after = rounded(core::deg_h_from_radps(gap.after_rms_radps));
  const std::string where = on_record ? "the record" : "held-out data";
  if (before == after) {
    return " The gap on " + where + " stays at " + after +
           " deg/h rms: what was found takes another course in each record, or is too fast for "
           "means of a minute.";
  }
  if (gap.after_rms_radps > gap.before_rms_radps) {
    return " About its mean, which is another one in each record, the gap on " + where +
           " got no larger; with it, it is " + after + " deg/h rms after " + before + ".";
  }
  const bool also = !axis.effects.empty() && !axis.recalibrated.empty();
  return (also ? " With that, and with new parameters of " + names_of(axis.recalibrated) +
                     ", the gap"
               : std::string(" The gap")) +
         " on " + where + " falls from " + before + " to " + after + " deg/h rms.";
}

std::string in_percent(double share) {
  return rounded(100.0 * share) + " %";
}

std::string what_would_prove(const AxisDiagnosis& axis) {
  if (axis.held_out_kind != HeldOut::kNothing)
    return "Another record in which it would show decides it.";
  return "A second record, or one of " + rounded(kShortestForBlocksS / 60.0) +
         " min or more in which this axis has valid rates, decides it.";
}

}  // namespace

std::string_view name(Verdict verdict) {
  switch (verdict) {
    case Verdict::kConsistent: return "consistent";
    case Verdict::kUndecidable: return "undecidable";
    case Verdict::kRecalibrated: return "recalibrated";
    case Verdict::kEffectNamed: return "effect_named";
    case Verdict::kAmbiguous: return "ambiguous";
    case Verdict::kUnknownEffect: return "unknown_effect";
  }
  return "unknown";
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

std::string names_of(const std::vector<Recalibration>& recalibrated) {
  std::vector<std::string> names;
  for (const Recalibration& change : recalibrated) {
    if (std::find(names.begin(), names.end(), change.name) == names.end())
      names.push_back(change.name);
  }
  return joined(names);
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

std::string spoken_against(std::span<const std::string> refuted) {
  return " It looks like " + joined(refuted) + ", but held-out data speak against that.";
}

std::string shown_by_nothing(std::span<const std::string> unproven) {
  return " It looks like " + joined(unproven) + ", which nothing that could be kept back shows.";
}

std::string about_events(const std::vector<NamedEffect>& effects) {
  std::string text;
  for (const NamedEffect& effect : effects) {
    if (happens_once({.kind = effect.name}))
      text += " " + effect.name + " happened once, in this record: no repaired model has it.";
  }
  return text;
}

std::string about_reach(double share_out_of_reach, HeldOut judge) {
  constexpr double kNearlyNone = 0.01;
  if (share_out_of_reach < kNearlyNone) return {};
  if (judge == HeldOut::kBlocks) {
    return " The coefficients come from this record, and those for validation are at temperatures "
           "that it did not reach: they judge nothing, and parts of this record were kept back in "
           "their place.";
  }
  return " The coefficients come from this record: " + in_percent(share_out_of_reach) +
         " of the records for validation, at temperatures that it did not reach, judge nothing.";
}

std::string about_blocks() {
  return " The other records would not show what is found here: blocks of this one were kept back "
         "in their place.";
}

std::string sentence_of(const AxisDiagnosis& axis) {
  std::string text;
  const std::string suggested =
      "The record suggests " +
      (axis.effects.empty() ? std::string("other parameters") : list_of(axis.effects));
  if (axis.acceptance == Acceptance::kReverted && !axis.unknown)
    return suggested + ", but held-out data don't confirm it: the model is left as it was.";
  switch (axis.verdict) {
    case Verdict::kConsistent: return "Nothing is missing that this record could have shown.";
    case Verdict::kUndecidable:
      return suggested +
             ", but nothing could be kept back to prove it on: the model is left as "
             "it was. " +
             what_would_prove(axis);
    case Verdict::kRecalibrated:
      text = "No effect that is known is missing, but parameters of the model were wrong.";
      break;
    case Verdict::kEffectNamed:
    case Verdict::kAmbiguous: text = "Missing: " + list_of(axis.effects) + "."; break;
    case Verdict::kUnknownEffect:
      text = "Something is missing that the catalogue doesn't know: " + axis.unknown->description +
             ".";
      if (!axis.unknown->formulas.empty()) text += " The repaired model has it as a formula.";
      if (!axis.unknown->noise.empty())
        text += " What it leaves looks like " + list_of(axis.unknown->noise) + ".";
      if (!axis.effects.empty() && axis.acceptance != Acceptance::kReverted)
        text += " Also missing: " + list_of(axis.effects) + ".";
      break;
  }
  if (axis.acceptance == Acceptance::kAccepted) text += about_the_gap(axis);
  return text;
}

std::optional<std::string> why_too_short(const MeasuredSeries& series) {
  const double duration_s = duration_of(series);
  if (duration_s >= kShortestRecordS && series.size >= kFewestIntervals) return std::nullopt;
  return "the record is too short, " + rounded(duration_s / 60.0) + " min in " +
         std::to_string(series.size) + " intervals where a diagnosis needs " +
         rounded(kShortestRecordS / 60.0) + " min in " + std::to_string(kFewestIntervals);
}

std::string what_would_decide(const twin::Model& model, const MeasuredSeries& series,
                              const Playback& playback, core::Axis axis) {
  std::vector<std::string> needs;
  const auto add = [&](twin::Need need) {
    const std::string what(wanted(need));
    const bool is_new = !what.empty() && std::find(needs.begin(), needs.end(), what) == needs.end();
    if (is_new && why_unmet(need, series, playback, axis)) needs.push_back(what);
  };
  for (const twin::EffectSpec& spec : model.effects) {
    const auto definition = twin::definition_of(spec);
    if (definition == nullptr || spec.axis != axis) continue;
    for (const twin::Need need : definition->needs) add(need);
  }
  if (needs.empty() && !an_input_moves(series, playback, axis)) add(twin::Need::kTemperature);
  std::string text = "A record of " + rounded(kShortestForBlocksS / 60.0) + " min or more";
  if (!needs.empty()) text += " with " + joined(needs);
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

AxisDiagnosis moved_without_reference(const UnreferencedMotion& motion) {
  return can_not_be_diagnosed(
      {},
      "the gyro turns in " + in_percent(motion.moving_share) +
          " of the record and its true rate is not given, so that what it measures is no drift",
      "A record with the true rate (rate_reference), or one of " +
          rounded(kShortestForBlocksS / 60.0) +
          " min or more in which the gyro stands still, decides it.");
}

std::string about_rest(const UnreferencedMotion& motion, const MeasuredSeries& part) {
  return " The gyro turns in " + in_percent(motion.moving_share) +
         " of the record and its true rate is not given: only the longest stretch at rest was "
         "judged, " +
         rounded(duration_of(part) / 60.0) + " min.";
}

}  // namespace zerodrift::diagnosis
