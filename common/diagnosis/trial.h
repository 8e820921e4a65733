// SPDX-License-Identifier: Apache-2.0
// One attempt to repair a model with one record, or with the part of it that a mask leaves: known
// effects refitted, missing ones named, noise examined.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/diagnosis.h"
#include "common/diagnosis/measured_series.h"
#include "common/diagnosis/playback.h"
#include "common/diagnosis/search.h"
#include "common/twin/model.h"

namespace zerodrift::diagnosis {

struct TrialInput {
  const twin::Model& model;
  const MeasuredSeries& series;
  const Playback& playback;
  core::Axis axis = core::Axis::kX;
  std::span<const std::uint8_t> valid;  // samples that may be looked at
  const DiagnosisOptions& options;
  std::span<const std::string> refuted{};  // effects that held-out data spoke against
};

struct Trial {
  twin::Model repaired;
  std::vector<NamedEffect> effects{};
  std::vector<Recalibration> recalibrated{};
  std::optional<UnknownEffect> unknown{};
  std::vector<NotTestable> not_testable{};
  std::vector<SmallestVisible> could_have_seen{};
  std::vector<Evidence> evidence{};
  std::vector<double> noise_dct_variances{};  // of the whole series' length
  std::optional<std::string> refusal{};       // the record says nothing about this axis
};

[[nodiscard]] Trial repair(const TrialInput& input);

// Rate minus true rate; 0 where the axis has no sample.
[[nodiscard]] std::vector<double> measured_drift(const MeasuredSeries& series, core::Axis axis);
// a - b where valid, else 0.
[[nodiscard]] std::vector<double> difference(std::span<const double> a, std::span<const double> b,
                                             std::span<const std::uint8_t> valid);

}  // namespace zerodrift::diagnosis
