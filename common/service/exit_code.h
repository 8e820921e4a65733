// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace zerodrift::service {

inline constexpr int kExitDone = 0;
inline constexpr int kExitNo = 1;        // ran, and the answer is no
inline constexpr int kExitBadInput = 2;  // wrong usage or bad input

}  // namespace zerodrift::service
