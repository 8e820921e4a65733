// SPDX-License-Identifier: Apache-2.0
// One attempt to repair a model: what it is about, what comes of it, and what its steps share.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/column_memory.h"
#include "common/diagnosis/diagnosis_options.h"
#include "common/diagnosis/find_missing.h"
#include "common/diagnosis/finding.h"
#include "common/diagnosis/known_effects.h"
#include "common/diagnosis/lineup.h"
#include "common/diagnosis/measured_series.h"
#include "common/diagnosis/playback.h"
#include "common/diagnosis/search_problem.h"
#include "common/twin/model.h"

namespace zerodrift::diagnosis {

// Noise that wanders while effects are searched. One coefficient makes it follow any slow drift.
enum class SlowNoise : std::uint8_t {
  kFree,  // as large as the record has it; of a kind that the model lacks, in the place of effects
  kAsStated,  // as large as the model says; the rest of it stands beside the effects that were
              // found
};

struct TrialInput {
  const twin::Model& model;
  const MeasuredSeries& series;
  const Playback& playback;
  core::Axis axis = core::Axis::kX;
  std::span<const std::uint8_t> valid;  // samples that may be looked at
  const DiagnosisOptions& options;
  std::span<const std::string> refuted{};  // labels of what held-out data spoke against
  // Effects of the model, by their place, whose coefficients come from this very record: what is
  // found beside them changes them.
  std::span<const std::size_t> calibrated{};
  ColumnMemory* memory = nullptr;  // of this record and axis; none: columns are made anew
  SlowNoise slow_noise = SlowNoise::kFree;
};

struct Trial {
  twin::Model repaired;
  std::vector<NamedEffect> effects{};
  // What happened once, in this record: in `repaired`, but nothing that other data could prove.
  std::vector<NamedEffect> events{};
  std::vector<Recalibration> recalibrated{};
  std::optional<UnknownEffect> unknown{};
  std::vector<NotTestable> not_testable{};
  std::vector<SmallestVisible> could_have_seen{};
  std::vector<Evidence> evidence{};
  double log_evidence = 0.0;                  // of all that was found missing, the unknown too
  std::vector<double> noise_dct_variances{};  // of the whole series' length
  std::optional<std::string> refusal{};       // the record says nothing about this axis
  // Slow noise stands in the place of effects, or is far beyond what the model states.
  bool noise_could_be_effects = false;
};

// Rate minus true rate; 0 where the axis has no sample.
[[nodiscard]] std::vector<double> measured_drift(const MeasuredSeries& series, core::Axis axis);
// a - b where valid, else 0.
[[nodiscard]] std::vector<double> difference(std::span<const double> a, std::span<const double> b,
                                             std::span<const std::uint8_t> valid);

[[nodiscard]] SearchOptions search_options(const DiagnosisOptions& options);
// Of a residual beside what is known of the model, noise included; no groups yet.
[[nodiscard]] SearchProblem problem_of(std::span<const double> residual,
                                       const std::vector<KnownParameter>& known,
                                       const twin::Model& model, const TrialInput& input);
// What a search says of its groups: evidence, what it could have seen, what it could not test.
void take_groups(Trial& trial, const SearchReport& report, const Lineup& lineup);

}  // namespace zerodrift::diagnosis
