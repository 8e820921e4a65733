// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/refutation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/diagnosis/gap.h"
#include "common/diagnosis/verdict.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {
namespace {

// What was added to a model of so many effects, but for one name.
twin::Model without(const std::string& label, twin::Model model, std::size_t known) {
  const auto added = model.effects.begin() + static_cast<std::ptrdiff_t>(known);
  model.effects.erase(
      std::remove_if(added, model.effects.end(),
                     [&](const twin::EffectSpec& spec) { return twin::label_of(spec) == label; }),
      model.effects.end());
  return model;
}

// The repaired model of a trial without what it named, noise apart.
twin::Model without_all(const Trial& trial, std::size_t known) {
  twin::Model others = trial.repaired;
  for (const std::string& label : labels_of(drift_of(trial)))
    others = without(label, std::move(others), known);
  return others;
}

}  // namespace

std::vector<NamedEffect> drift_of(const Trial& trial) {
  std::vector<NamedEffect> effects = trial.effects;
  std::erase_if(effects, [](const NamedEffect& effect) { return is_noise(effect.name); });
  return effects;
}

std::vector<std::string> labels_of(const std::vector<NamedEffect>& effects) {
  std::vector<std::string> labels;
  for (const NamedEffect& effect : effects)
    labels.push_back(twin::label_of(effect.name, effect.formula));
  return labels;
}

std::vector<std::string> refuted_kinds(const twin::Model& given, const Calibration& calibration,
                                       const Split& split, core::Axis axis) {
  std::vector<std::string> kinds;
  const twin::Model& all = calibration.trial.repaired;
  for (std::size_t i = 0; i < given.effects.size(); ++i) {
    const twin::EffectSpec& listed = given.effects[i];
    const bool is_new = listed.axis == axis && listed.parameters.empty() &&
                        !all.effects[i].parameters.empty() && !is_noise(listed.kind);
    if (!is_new || twin::find_effect(listed.kind)->search.is_constant) continue;
    twin::Model others = all;
    others.effects[i] = listed;
    if (compare_on(split.held_out, others, all, axis).gain_nats < 0.0)
      kinds.push_back(twin::label_of(listed));
  }
  return kinds;
}

std::vector<std::string> names_spoken_against(const twin::Model& known, const Trial& trial,
                                              const Split& split, core::Axis axis) {
  std::vector<std::string> names;
  for (const std::string& label : labels_of(drift_of(trial))) {
    const twin::Model others = without(label, trial.repaired, known.effects.size());
    const Comparison with = compare_on(split.held_out, others, trial.repaired, axis);
    if (with.gain_nats < 0.0 && tells_apart(with)) names.push_back(label);
  }
  return names;
}

std::vector<std::string> refuted_names(const twin::Model& known, const Trial& trial,
                                       const Split& split, core::Axis axis) {
  std::vector<std::string> refuted = names_spoken_against(known, trial, split, axis);
  return refuted.empty() ? labels_of(drift_of(trial)) : refuted;
}

bool outweighs(const Trial& second, const Trial& first, const twin::Model& known,
               const Split& split, core::Axis axis) {
  return second.unknown ||
         second.log_evidence +
                 likelier_by_nats(split.held_out, known, second.repaired, first.repaired, axis) >=
             first.log_evidence;
}

bool each_is_clear(const twin::Model& known, const Trial& trial, const Split& split,
                   core::Axis axis) {
  const std::vector<std::string> labels = labels_of(drift_of(trial));
  return std::all_of(labels.begin(), labels.end(), [&](const std::string& label) {
    const twin::Model others = without(label, trial.repaired, known.effects.size());
    return compare_on(split.held_out, others, trial.repaired, axis).gain_nats > kClearNats;
  });
}

bool would_show(const twin::Model& known, const Trial& trial, const Split& split, core::Axis axis) {
  const twin::Model others = without_all(trial, known.effects.size());
  return others.effects.size() == trial.repaired.effects.size() ||
         tells_apart(compare_on(split.held_out, others, trial.repaired, axis));
}

Split blocks_that_show(const twin::Model& known, const Trial& trial, const PlayedRecord& record,
                       const std::vector<std::uint8_t>& sound, core::Axis axis) {
  const twin::Model others = without_all(trial, known.effects.size());
  std::vector<std::pair<double, std::size_t>> shows;
  for (std::size_t block = 1; block + 1 < kBlocks; ++block) {
    const Split one = split_in_blocks(*record.series, *record.playback, sound, {block, block});
    const double nats =
        one.held_out.empty()
            ? 0.0
            : compare_on(one.held_out, others, trial.repaired, axis).expected_gain_nats;
    shows.emplace_back(-nats, block);
  }
  std::sort(shows.begin(), shows.end());
  Split split =
      split_in_blocks(*record.series, *record.playback, sound, {shows[1].second, shows[3].second});
  if (!tells_apart(compare_on(split.held_out, others, trial.repaired, axis)))
    return {.fitted = sound};
  return split;
}

std::vector<std::string> all_drift_labels() {
  std::vector<std::string> labels;
  for (const twin::EffectDefinition& definition : twin::effect_catalogue()) {
    if (is_waveform(definition)) labels.push_back(twin::label_of(definition));
  }
  return labels;
}

bool answers(const Trial& trial) {
  return !trial.effects.empty() || !trial.events.empty() || trial.unknown ||
         std::any_of(trial.recalibrated.begin(), trial.recalibrated.end(),
                     [](const Recalibration& change) { return has_shape(change.name); });
}

std::optional<UnknownEffect> unknown_like(const Trial& trial) {
  std::vector<NamedEffect> effects = drift_of(trial);
  const bool is_noise_alone = effects.empty();
  if (is_noise_alone) effects = trial.effects;
  if (effects.empty()) return std::nullopt;
  UnknownEffect unknown{.description = "on this record it looks like " + list_of(effects) +
                                       ", which held-out data speak against"};
  double squares = 0.0;
  for (const NamedEffect& effect : effects) squares += effect.share_of_gap;
  unknown.rms_radps =
      is_noise_alone ? std::numeric_limits<double>::quiet_NaN() : std::sqrt(squares);
  return unknown;
}

std::optional<UnknownEffect> unlike_other_parameters(const Trial& trial, double left_rms_radps,
                                                     double noise_rms_radps) {
  if (!stands_out(left_rms_radps, noise_rms_radps)) return std::nullopt;
  std::vector<Recalibration> shapes = trial.recalibrated;
  std::erase_if(shapes, [](const Recalibration& change) { return !has_shape(change.name); });
  if (shapes.empty()) return std::nullopt;
  return UnknownEffect{
      .description = "on this record it looks like other parameters of " + names_of(shapes) +
                     ", which held-out data speak against",
      .rms_radps = std::sqrt(left_rms_radps * left_rms_radps - noise_rms_radps * noise_rms_radps)};
}

}  // namespace zerodrift::diagnosis
