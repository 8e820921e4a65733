// SPDX-License-Identifier: Apache-2.0
// What a search and its fits are about: a series, the columns that the model has already, the noise
// that is known, and groups of candidate columns.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/diagnosis/evidence.h"
#include "common/diagnosis/noise_spectrum.h"
#include "common/twin/input_family.h"

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
  double step = 0.0;    // distance to the neighbours listed; logarithmic: their ratio
  double origin = 0.0;  // logarithmic: what the ratio is counted from
};

enum class CandidateKind : std::uint8_t { kNamed, kGeneric };

// Which group a finding is about; the caller's choice, each once a problem.
enum class GroupId : std::uint32_t {};

struct CandidateGroup {
  GroupId id{};
  std::string name;  // for people
  // What its columns are made of but for the shape, the same in all searches in one record; empty:
  // they are made anew each time.
  std::string identity{};
  CandidateKind kind = CandidateKind::kNamed;
  // Groups that a mismatch of form of each other may feign, as those of one input. None: of all.
  twin::InputFamily family = twin::InputFamily::kNone;
  // The simpler effect that this one has as a limit.
  std::optional<GroupId> parent{};
  // Stands only where it explains more than a function of any input does: the rest of a form that
  // differs, too, has edges where inputs have them.
  bool happens_once = false;
  // Its columns are growing powers: one stays wherever a higher one does.
  bool has_powers = false;
  double log_prior = 0.0;
  // What the amplitude of its only column can be.
  double least_amplitude = -std::numeric_limits<double>::infinity();
  double greatest_amplitude = std::numeric_limits<double>::infinity();
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

  // One of the groups; they have it.
  [[nodiscard]] const CandidateGroup& group(GroupId id) const;
  // Throws std::invalid_argument where the problem contradicts itself: lengths, nothing to make
  // columns with.
  void check() const;
  // Why the series says nothing, or nothing.
  [[nodiscard]] std::optional<std::string> reason_to_refuse(double least_valid_share) const;
};

struct SearchOptions {
  double false_alarm = 0.01;  // chance of a false name in a record of noise, aimed at
  std::size_t max_effects = 4;
  double credible_mass = 0.95;
  double form_mismatch_share = 0.15;  // of the explained power, not a new effect
  // Degrees of freedom of the Student likelihood for what a form leaves unexplained (posterior.h).
  double mismatch_freedom = 12.0;
  // Of what is found, the share that is none of the candidates, however well one of them fits.
  double unlisted_share = 0.07;
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

enum class Testability : std::uint8_t {
  kTestable,
  kNotExcited,  // constant over the record
  kCollinear,   // the model's columns explain it
  kUnusable,    // not finite, wrong length or no columns
};

struct CorrectionFinding {
  std::string name;
  Testability testability = Testability::kTestable;
  double value = 0.0;  // of the amplitude; joint fit
  double standard_error = 0.0;
  double log_evidence = 0.0;
  bool significant = false;
};

}  // namespace zerodrift::diagnosis
