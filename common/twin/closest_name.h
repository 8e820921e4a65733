// SPDX-License-Identifier: Apache-2.0
// The valid name somebody probably meant, for error messages.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace zerodrift::twin {

// The candidate with the smallest Levenshtein distance to `word`, if that is at most half the
// word's length; names that share a unit-less stem ("duration_min", "duration_s") count as close.
// O(sum of lengths²); for error messages only.
[[nodiscard]] std::optional<std::string> closest_name(std::string_view word,
                                                      std::span<const std::string> candidates);

// "; did you mean 'x'?" or, where nothing is close, "; valid: a, b, c".
[[nodiscard]] std::string suggestion(std::string_view word,
                                     std::span<const std::string> candidates);

}  // namespace zerodrift::twin
