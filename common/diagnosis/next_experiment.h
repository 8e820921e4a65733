// SPDX-License-Identifier: Apache-2.0
// Which experiment would settle what this record could not.
#pragma once

#include <string>

#include "common/core/axis.h"
#include "common/diagnosis/finding.h"
#include "common/twin/model.h"

namespace zerodrift::diagnosis {

// One sentence. Where names are confused: of a menu of experiments the one in which they are
// farthest apart, simulated with the model's thermal plant at the sizes found: the norm of the
// difference that is left after the rival's amplitudes are refitted, whitened by the noise that the
// given model lists. Passed over: effects and rivals that aren't waveforms, pairs that no
// experiment puts a standard error apart, any pair where the model lists no noise. Otherwise the
// experiment that makes most of the untestable effects testable. Empty where nothing is open.
[[nodiscard]] std::string next_experiment(const twin::Model& model, core::Axis axis,
                                          const AxisDiagnosis& diagnosis);

}  // namespace zerodrift::diagnosis
