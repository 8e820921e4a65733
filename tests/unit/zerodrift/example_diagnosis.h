// SPDX-License-Identifier: Apache-2.0
// Diagnoses made by hand, for what is written of them.
#pragma once

#include "services/zerodrift/diagnosis_run.h"

namespace zerodrift::services {

// Axis x: a Shupe effect of 2 deg/h rms was missing, proved on a record. Axis z: nothing is
// missing. No axis y.
[[nodiscard]] DiagnosisResult example_diagnosis();

}  // namespace zerodrift::services
