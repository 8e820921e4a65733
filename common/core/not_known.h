// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

namespace zerodrift::core {

// Stands for a figure that nobody knows; JSON has null for it, a table a dash.
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace zerodrift::core
