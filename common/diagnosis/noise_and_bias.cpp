// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/noise_and_bias.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/units.h"
#include "common/diagnosis/gap.h"
#include "common/diagnosis/known_effects.h"
#include "common/diagnosis/noise_weight.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {
namespace {

// Listed without a value.
bool waits_for_bias(const twin::Model& model, core::Axis axis) {
  return std::any_of(model.effects.begin(), model.effects.end(), [axis](const auto& spec) {
    const auto* definition = twin::find_effect(spec.kind);
    return spec.axis == axis && spec.parameters.empty() && definition != nullptr &&
           definition->search.is_constant;
  });
}

double mean_left_by(const twin::Model& model, const TrialInput& input) {
  return mean_of_valid(difference(measured_drift(input.series, input.axis),
                                  input.playback.drift(model, input.axis), input.valid),
                       input.valid);
}

}  // namespace

NoiseFindings noise_of(std::span<const double> remainder, const TrialInput& input,
                       const SearchProblem& problem, const twin::Model& model) {
  const SearchProblem of_noise{.series = remainder,
                               .valid = problem.valid,
                               .interval_s = problem.interval_s,
                               .known = problem.known};
  return examine_noise({of_noise, model, input.axis, 0.5 * input.options.false_names_per_record},
                       search_options(input.options));
}

void take_noise(Trial& trial, const TrialInput& input, const NoiseFindings& noise) {
  trial.noise_dct_variances =
      dct_variances(noise.terms, noise.squares, input.series.size, input.series.interval_s);
  adopt_noise(trial.repaired, input.axis, noise,
              {.by = "diagnose",
               .record = input.options.record,
               .date = input.options.date,
               .evidence = "noise spectrum"});
  trial.effects.insert(trial.effects.end(), noise.effects.begin(), noise.effects.end());
  trial.recalibrated.insert(trial.recalibrated.end(), noise.recalibrated.begin(),
                            noise.recalibrated.end());
}

void keep_mean(Trial& trial, const TrialInput& input) {
  const double before_radps = mean_left_by(input.model, input);
  const double mean_radps = mean_left_by(trial.repaired, input);
  if (std::abs(mean_radps) <= std::abs(before_radps)) return;
  trial.recalibrated.push_back(shift_bias(trial.repaired, input.axis, mean_radps - before_radps));
}

void recalibrate_bias(Trial& trial, const TrialInput& input) {
  constexpr double kSigmas = 3.0;
  constexpr double kMeanS = 60.0;
  const double mean_radps = mean_left_by(trial.repaired, input);
  const auto block = static_cast<std::size_t>(std::max(1.0, kMeanS / input.series.interval_s));
  const double slow = expected_rms_of_block_means(trial.noise_dct_variances, block);
  const bool waits = waits_for_bias(trial.repaired, input.axis);
  if (!waits && std::abs(mean_radps) <= kSigmas * slow) return;
  Recalibration change = shift_bias(trial.repaired, input.axis, mean_radps);
  change.standard_error = core::deg_h_from_radps(slow);
  trial.recalibrated.push_back(std::move(change));
}

}  // namespace zerodrift::diagnosis
