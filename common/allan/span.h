// SPDX-License-Identifier: Apache-2.0
// Which part of a stream a figure speaks of.
#pragma once

#include <cstdint>

namespace zerodrift::allan {

enum class Span : std::uint8_t { kSinceStart, kRolling };

}  // namespace zerodrift::allan
