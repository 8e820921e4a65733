// SPDX-License-Identifier: Apache-2.0
// What the columns of a foreign table probably are, for a line of refusal: never used unasked.
#pragma once

#include <string>
#include <vector>

namespace zerodrift::record {

// A --columns map by the columns' names ("Gyro X (deg/s)", "wx", "timestamp") and the first row's
// cells, ready to be pasted, with what it assumes: "--columns 'time=t[s],rate_x=wx[deg/s]' (...)".
// Empty where no column looks like an angular rate, or where a name can't stand in a map.
[[nodiscard]] std::string guessed_columns(const std::vector<std::string>& header,
                                          const std::vector<std::string>& first_row);

}  // namespace zerodrift::record
