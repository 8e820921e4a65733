// SPDX-License-Identifier: Apache-2.0
// What can hardly be right about a record, before any result of it.
#pragma once

#include <vector>

#include "common/measurement/plausibility.h"

namespace zerodrift::services {

// On standard output, a line each.
void print_doubts(const std::vector<measurement::Doubt>& doubts);

}  // namespace zerodrift::services
