// SPDX-License-Identifier: Apache-2.0
// What a search for missing effects does that takes drift noise for white: regression of measured
// minus twin on the candidates of the diagnosis. The same columns, the same known effects; only the
// choice differs. For the benchmark's table; nothing of it is installed.
//
//   stepwise BIC: n ln(RSS / n) + k ln n, k = columns + shape parameters of what was chosen. Add
//     what lowers it most, then drop what it is lower without (Schwarz 1978).
//   STLSQ: of each candidate the variant that explains most by itself; least squares with all, drop
//     those that contribute less than a threshold, repeat (Brunton, Proctor, Kutz 2016).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/diagnosis/diagnosis.h"
#include "common/diagnosis/measured_series.h"
#include "common/twin/model.h"

namespace zerodrift::blind {

enum class Method : std::uint8_t { kStepwiseBic, kStlsq };

struct BaselineOptions {
  Method method = Method::kStepwiseBic;
  // Of STLSQ: standard deviation of a contribution over that of what least squares can't explain.
  // 0.05 in 18 000 samples of white noise is d = 6.7.
  double threshold = 0.05;
  std::size_t most_effects = 8;  // of stepwise BIC
  std::string record{};          // for the origin of what is added
  std::string date{};

  // Names the first wrong key.
  [[nodiscard]] std::optional<std::string> validate() const;
};

// Every axis of the record; what was chosen is always taken, the gap on the validation records is
// told. Effects of noise and faults of the record are no regressors: never named. O(samples *
// columns * effects), memory 8 bytes a sample and column. Throws std::invalid_argument.
[[nodiscard]] diagnosis::Diagnosis diagnose_by(
    const BaselineOptions& options, const twin::Model& model,
    const diagnosis::MeasuredSeries& series,
    const std::vector<diagnosis::MeasuredSeries>& validation);

}  // namespace zerodrift::blind
