// SPDX-License-Identifier: Apache-2.0
// Repairs a model with one record, or with the part of it that a mask leaves: known effects
// refitted, missing ones named, noise examined.
#pragma once

#include "common/diagnosis/trial.h"

namespace zerodrift::diagnosis {

[[nodiscard]] Trial repair(const TrialInput& input);

}  // namespace zerodrift::diagnosis
