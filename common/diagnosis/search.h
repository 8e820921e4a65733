// SPDX-License-Identifier: Apache-2.0
// Which effects are missing in a model: greedy search with swaps and removals over groups of
// candidate columns, judged by Bayes factors in which the noise is fitted anew under every
// hypothesis.
//
//   evidence of a group: its variants' (evidence.h) average by their priors; noise: the best of a
//     few spectra for all variants, its own restricted optimum for the leading ones
//   add the group of largest evidence while it exceeds log(groups / false_alarm); then try to
//     replace or drop each one chosen; at most max_effects
//   alternatives of one chosen: the groups' evidences in its place, tempered by how much of what
//     any group explains each of them leaves (a Student likelihood for the remainder in place of a
//     normal one: forms are never exact), those that sum to the credible mass
//   generic groups (splines, pairs of inputs) are never named. Where one of them explains clearly
//     more than the chosen ones, or stays significant beside them with more than a remainder of
//     form, the outcome is kUnknown
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/diagnosis/evidence.h"
#include "common/diagnosis/noise_spectrum.h"

namespace zerodrift::diagnosis {

// Inner parameters that enter the columns other than as a factor: lags, exponents, which probe.
struct CandidateVariant {
  std::vector<double> shape{};
  // Within the group. The variants' sum counts up to 1: of many, the few best may be listed.
  double log_prior = 0.0;
};

enum class ShapeScale : std::uint8_t { kFixed, kLinear, kLogarithmic };

// How a shape parameter is refined between the variants listed.
struct ShapeRange {
  ShapeScale scale = ShapeScale::kFixed;
  double lowest = 0.0;
  double highest = 0.0;
  double step = 0.0;  // distance to the neighbours listed; logarithmic: their ratio
};

enum class CandidateKind : std::uint8_t { kNamed, kGeneric };

struct CandidateGroup {
  std::string name;
  CandidateKind kind = CandidateKind::kNamed;
  // Groups that a mismatch of form of each other may feign, as those of one input. Empty: of all.
  std::string family{};
  // The simpler effect that this one has as a limit; empty: none.
  std::string parent{};
  double log_prior = 0.0;
  std::vector<CandidateVariant> variants{};
  std::vector<ShapeRange> ranges{};  // one a shape parameter; empty: nothing is refined
  // The columns of a shape, each as long as the series. Called once a variant and for refinement.
  std::function<std::vector<std::vector<double>>(const std::vector<double>& shape)> columns{};
};

// Something the model has already: always refitted beside every candidate.
struct KnownColumn {
  std::string name;
  std::vector<double> values{};
  // Of the correction to its amplitude, prior mean 0; infinity: any value.
  double prior_sd = std::numeric_limits<double>::infinity();
};

struct SearchProblem {
  std::span<const double> series;       // measured minus twin, uniform grid
  std::span<const std::uint8_t> valid;  // 0: missing; as long as the series
  double interval_s = 1.0;
  std::vector<KnownColumn> known{};
  NoisePrior noise{};
  std::vector<CandidateGroup> groups{};
};

struct SearchOptions {
  double false_alarm = 0.01;  // chance of a false name in a record of noise, aimed at
  std::size_t max_effects = 4;
  double credible_mass = 0.95;
  double form_mismatch_share = 0.15;  // of the explained power, not a new effect
  // Degrees of freedom of the Student likelihood for what a form leaves unexplained.
  double mismatch_freedom = 12.0;
  double nested_margin_nats = 2.0;  // an effect that beats its parent by less is its parent
  double swap_margin_nats = 1.0;    // a replacement must be better by this
  double power_separation = 8.0;    // d of the power statement
  std::size_t single_coefficients = 900;
  std::size_t refits = 12;         // groups with noise of their own, a search step
  std::size_t refined_groups = 3;  // groups whose shapes are refined before one is chosen
  double least_valid_share = 0.5;
  EvidenceOptions evidence{};
  NoiseFitOptions noise_fit{};

  // Names the first wrong key.
  [[nodiscard]] std::optional<std::string> validate() const;
};

enum class SearchOutcome : std::uint8_t {
  kRefused,         // the series says nothing; `reason` says why
  kNothingMissing,  // nothing significant
  kNamed,
  kUnknown,  // a generic group explains what no named one does; `effects` may hold others
};

[[nodiscard]] std::string_view name(SearchOutcome outcome) noexcept;

enum class Testability : std::uint8_t {
  kTestable,
  kNotExcited,  // constant over the record
  kCollinear,   // the model's columns explain it
  kUnusable,    // not finite, wrong length or no columns
};

struct RankedName {
  std::string name;
  double probability = 0.0;
  std::vector<std::string> nested{};  // groups that have this one as a limit and say the same
};

struct FoundEffect {
  std::string name;
  std::vector<double> shape{};
  // Unit of the series over that of the column; joint fit. 0 of a column that is constant or that
  // the others explain.
  std::vector<double> amplitudes{};
  Eigen::MatrixXd covariance{};            // of the amplitudes
  std::vector<double> waveform{};          // amplitudes times columns, mean taken off
  double log_evidence = 0.0;               // against the model without it
  double separation = 0.0;                 // d
  double rms = 0.0;                        // of the waveform
  double probability = 0.0;                // that it is this one, given that something is there
  std::vector<RankedName> credible_set{};  // most probable first, this one among them
};

struct CorrectionFinding {
  std::string name;
  Testability testability = Testability::kTestable;
  double value = 0.0;  // of the amplitude; joint fit
  double standard_error = 0.0;
  double log_evidence = 0.0;
  bool significant = false;
};

struct GroupFinding {
  std::string name;
  CandidateKind kind = CandidateKind::kNamed;
  Testability testability = Testability::kTestable;
  std::string collinear_with{};  // the known column nearest to it
  std::vector<double> shape{};   // of the best variant
  double log_evidence = 0.0;     // beside the known columns alone
  double separation = 0.0;       // d of the best variant there
  double rms = 0.0;
  double remaining_log_evidence = 0.0;  // beside all that was found; 0 for what was found
  // RMS of the waveform that would show with d = power_separation, under the final noise: median
  // of the variants, mean direction of several columns.
  double smallest_rms = std::numeric_limits<double>::infinity();
  // The same as an amplitude of the median variant where it has one column.
  std::optional<double> smallest_amplitude{};
};

struct SearchReport {
  SearchOutcome outcome = SearchOutcome::kRefused;
  std::string reason;  // of a refusal, or of kUnknown: which rule
  std::vector<FoundEffect> effects{};
  std::optional<FoundEffect> unknown{};          // the generic group, named by its group
  std::vector<CorrectionFinding> corrections{};  // one a known column, unless refused
  std::vector<GroupFinding> groups{};
  double threshold_nats = 0.0;
  std::vector<NoiseTerm> noise_terms{};
  std::vector<double> noise_squares{};  // of the final model
  NoiseFitStatus noise_status = NoiseFitStatus::kNoPower;
  // Of the residual of the final model, against the known noise where there is one, else against
  // the fitted noise.
  std::vector<OctavePower> octaves{};
  double missing_share = 0.0;
};

// Throws std::invalid_argument with the sentence of validate() or of a problem that contradicts
// itself (lengths, nothing to make columns with). Data that can't answer is a report, not an
// exception. About 1 s for 18000 points and 800 columns on one core; memory 4 bytes a point and
// column.
[[nodiscard]] SearchReport search(const SearchProblem& problem, const SearchOptions& options = {});

}  // namespace zerodrift::diagnosis
