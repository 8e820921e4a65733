// SPDX-License-Identifier: Apache-2.0
// Numbers as a reader of a table wants them. Rounded to the nearest, halves as the exact binary
// value lies. The same on every machine: no locale.
#pragma once

#include <string>

namespace zerodrift::report {

// At least `digits` (1 to 17) significant digits: 0.0217, 5.00, 1234; below 0.001 and from a
// million on as 9.33e-4. "n/a" for NaN, "inf" and "-inf".
[[nodiscard]] std::string significant(double value, int digits);

// Exactly `digits` (1 to 17) significant digits with an exponent, for columns that span decades:
// 1.57e-2.
[[nodiscard]] std::string scientific(double value, int digits);

}  // namespace zerodrift::report
