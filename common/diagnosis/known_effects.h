// SPDX-License-Identifier: Apache-2.0
// The effects a model has already: the columns along which their parameters may be wrong, and the
// model with corrected parameters.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/finding.h"
#include "common/diagnosis/playback.h"
#include "common/diagnosis/search_problem.h"
#include "common/twin/model.h"

namespace zerodrift::diagnosis {

struct KnownParameter {
  std::size_t effect = 0;  // in Model::effects
  std::string parameter;
  double value = 0.0;
  bool is_amplitude = true;
  KnownColumn column{};  // what one unit more of it adds, to first order, rad/s
};

// Parameters of the axis's deterministic effects that have any in the file. Amplitudes, those too
// that the file leaves to the catalogue: exact columns. Shapes that it gives (lags, decay times):
// difference columns. A correction is expected within
// max(5 standard errors, half the value); that of a shape within max(5 standard errors, 0.3 of it).
[[nodiscard]] std::vector<KnownParameter> known_parameters(const twin::Model& model,
                                                           core::Axis axis,
                                                           const Playback& playback);

// Adds the significant corrections to the model's parameters, kept within their limits, with
// standard errors, and tells them.
[[nodiscard]] std::vector<Recalibration> recalibrate(
    twin::Model& model, const std::vector<KnownParameter>& known,
    const std::vector<CorrectionFinding>& corrections);

// Adds to the axis's constant effect, which is added to the list where the model has none; tells
// from what to what, with the standard error that it had.
Recalibration shift_bias(twin::Model& model, core::Axis axis, double by_radps);

// Of a parameter that was found twice the later value counts.
[[nodiscard]] std::vector<Recalibration> merged(std::vector<Recalibration> first,
                                                const std::vector<Recalibration>& later);

// Of what was changed on the way only what the model has in the end, with its value there: a noise
// that wandered in the place of what was found later may be gone.
void keep_what_stands(std::vector<Recalibration>& changes, const twin::Model& model,
                      core::Axis axis);

}  // namespace zerodrift::diagnosis
