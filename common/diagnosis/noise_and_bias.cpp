// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/noise_and_bias.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "common/core/units.h"
#include "common/diagnosis/candidates.h"
#include "common/diagnosis/cosine_transform.h"
#include "common/diagnosis/gap.h"
#include "common/diagnosis/known_effects.h"
#include "common/diagnosis/noise_weight.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {
namespace {

bool is_bias(const std::string& kind) {
  const auto* definition = twin::find_effect(kind);
  return definition != nullptr && definition->search.is_constant;
}

// Listed without a value.
bool waits_for_bias(const twin::Model& model, core::Axis axis) {
  return std::any_of(model.effects.begin(), model.effects.end(), [axis](const auto& spec) {
    return spec.axis == axis && spec.parameters.empty() && is_bias(spec.kind);
  });
}

// Its standard error; NaN where the model states none.
double stated_error(const twin::Model& model, core::Axis axis, const std::string& parameter) {
  for (const twin::EffectSpec& spec : model.effects) {
    if (spec.axis != axis || !is_bias(spec.kind)) continue;
    const auto error = spec.standard_errors.find(parameter);
    if (error != spec.standard_errors.end()) return error->second;
  }
  return core::kNaN;
}

void state_error(twin::Model& model, core::Axis axis, const Recalibration& bias) {
  for (twin::EffectSpec& spec : model.effects) {
    if (spec.axis == axis && spec.kind == bias.name)
      spec.standard_errors[bias.parameter] = bias.standard_error;
  }
}

// Of the mean of a record, rad/s: the noise's density at 0 is that at the lowest frequency there
// is. 0 where there is no noise.
double error_of_mean(const std::vector<double>& dct_variances,
                     std::span<const std::uint8_t> valid) {
  const auto missing = std::count(valid.begin(), valid.end(), 0);
  const auto count = static_cast<double>(valid.size()) - static_cast<double>(missing);
  return dct_variances.size() < 2 || count == 0.0 ? 0.0 : std::sqrt(dct_variances[1] / count);
}

bool is_fitted(const KnownParameter& known, const Trial& trial, std::size_t given) {
  if (known.effect >= given) return true;
  const std::string label = label_of(trial.repaired.effects[known.effect]);
  return std::any_of(trial.recalibrated.begin(), trial.recalibrated.end(), [&](const auto& change) {
    return change.name == label && change.parameter == known.parameter;
  });
}

// What the errors of the other coefficients make of the mean, rad/s: sqrt(m' A^-1 m), m their
// columns' means and A the precision that this record gives them beside the trial's noise, those
// that it did not fit with the one that the model states. All in their stated errors.
double error_carried_into_mean(const Trial& trial, const TrialInput& input) {
  constexpr double kFree = 1e-4;  // precision of what the record alone tells: a hundred errors
  const std::vector<double>& variances = trial.noise_dct_variances;
  if (variances.size() < 2 || !(variances[1] > 0.0)) return 0.0;
  std::vector<Eigen::VectorXd> columns;
  std::vector<double> means, precisions;
  CosineTransform transform(variances.size());
  for (KnownParameter& known : known_parameters(trial.repaired, input.axis, input.playback)) {
    const auto& errors = trial.repaired.effects[known.effect].standard_errors;
    const auto error = errors.find(known.parameter);
    if (error == errors.end() || !(error->second > 0.0)) continue;
    means.push_back(error->second * mean_of_valid(known.column.values, input.valid));
    centre(known.column.values, input.valid);
    columns.push_back(error->second * transform.forward(known.column.values));
    precisions.push_back(is_fitted(known, trial, input.model.effects.size()) ? kFree : 1.0);
  }
  const auto p = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd whitened(static_cast<Eigen::Index>(variances.size()) - 1, p);
  const Eigen::VectorXd deviations =
      Eigen::Map<const Eigen::VectorXd>(variances.data() + 1, whitened.rows()).cwiseSqrt();
  for (Eigen::Index i = 0; i < p; ++i)
    whitened.col(i) =
        columns[static_cast<std::size_t>(i)].tail(whitened.rows()).cwiseQuotient(deviations);
  Eigen::MatrixXd a = whitened.transpose() * whitened;
  a.diagonal() += Eigen::Map<const Eigen::VectorXd>(precisions.data(), p);
  const Eigen::Map<const Eigen::VectorXd> m(means.data(), p);
  return std::sqrt(std::fmax(0.0, m.dot(a.llt().solve(m))));
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
  change.standard_error =
      core::deg_h_from_radps(error_of_mean(trial.noise_dct_variances, input.valid));
  state_error(trial.repaired, input.axis, change);
  trial.recalibrated.push_back(std::move(change));
}

void complete_error_of_bias(Trial& trial, const TrialInput& input) {
  for (Recalibration& change : trial.recalibrated) {
    if (!is_bias(change.name) || !std::isfinite(change.standard_error) ||
        change.standard_error == stated_error(input.model, input.axis, change.parameter))
      continue;
    const double carried = core::deg_h_from_radps(error_carried_into_mean(trial, input));
    change.standard_error = std::hypot(change.standard_error, carried);
    state_error(trial.repaired, input.axis, change);
  }
}

}  // namespace zerodrift::diagnosis
