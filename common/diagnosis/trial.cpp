// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/trial.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/diagnosis/noise_of_model.h"

namespace zerodrift::diagnosis {
namespace {

// Slow noise can't take what its prior forbids; one without a value has none.
void hold_slow_noise(NoisePrior& prior) {
  constexpr double kHeldSigma = 0.05;
  std::erase_if(prior.known, [](const KnownNoise& noise) {
    return is_slow(noise.term.kind) && noise.relative_sigma >= kAnyValue;
  });
  for (KnownNoise& noise : prior.known) {
    if (is_slow(noise.term.kind)) noise.relative_sigma = std::min(noise.relative_sigma, kHeldSigma);
  }
}

}  // namespace

std::vector<double> measured_drift(const MeasuredSeries& series, core::Axis axis) {
  const std::size_t a = core::index(axis);
  return difference(series.rate_radps[a], series.reference_radps[a], series.valid[a]);
}

std::vector<double> difference(std::span<const double> a, std::span<const double> b,
                               std::span<const std::uint8_t> valid) {
  std::vector<double> result(a.size(), 0.0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (valid[i] != 0) result[i] = a[i] - b[i];
  }
  return result;
}

SearchOptions search_options(const DiagnosisOptions& options) {
  SearchOptions search;
  search.false_alarm = 0.5 * options.false_names_per_record;
  search.max_effects = options.most_effects;
  return search;
}

void take_groups(Trial& trial, const SearchReport& report, const Lineup& lineup) {
  for (const GroupFinding& group : report.groups) {
    std::string name = lineup.name_of(group.group);
    if (group.kind == CandidateKind::kNamed && group.testability != Testability::kTestable) {
      trial.not_testable.push_back(
          {std::move(name), group.testability == Testability::kCollinear
                                ? "the record can't tell it from " + group.collinear_with
                                : "the record doesn't excite it"});
      continue;
    }
    trial.evidence.push_back({name, group.log_evidence, group.separation, group.rms});
    if (group.kind == CandidateKind::kNamed && std::isfinite(group.smallest_rms))
      trial.could_have_seen.push_back({std::move(name), group.smallest_rms});
  }
  std::stable_sort(
      trial.evidence.begin(), trial.evidence.end(),
      [](const Evidence& a, const Evidence& b) { return a.log_evidence > b.log_evidence; });
}

SearchProblem problem_of(std::span<const double> residual, const std::vector<KnownParameter>& known,
                         const twin::Model& model, const TrialInput& input) {
  SearchProblem problem{
      .series = residual,
      .valid = input.valid,
      .interval_s = input.series.interval_s,
      .noise = noise_prior(model, input.axis, kModelNoiseSigma, valid_share(input.valid))};
  if (input.slow_noise == SlowNoise::kAsStated) hold_slow_noise(problem.noise);
  for (const KnownParameter& parameter : known) problem.known.push_back(parameter.column);
  return problem;
}

}  // namespace zerodrift::diagnosis
