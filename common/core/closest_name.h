// SPDX-License-Identifier: Apache-2.0
// The valid name somebody probably meant, for error messages.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace zerodrift::core {

inline constexpr std::size_t kAnyEdits = std::numeric_limits<std::size_t>::max();

// The candidate with the smallest Levenshtein distance to `word`, if that is at most half the
// word's length and at most `most_edits`; names that share a unit-less stem ("duration_min",
// "duration_s") count as close. O(sum of lengths²); for error messages only.
[[nodiscard]] std::optional<std::string> closest_name(std::string_view word,
                                                      std::span<const std::string> candidates,
                                                      std::size_t most_edits = kAnyEdits);

// "; did you mean 'x'?" or, where nothing is close, "; valid: a, b, c".
[[nodiscard]] std::string suggestion(std::string_view word,
                                     std::span<const std::string> candidates);

}  // namespace zerodrift::core
