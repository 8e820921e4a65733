// SPDX-License-Identifier: Apache-2.0
#include "common/core/closest_name.h"

#include <algorithm>
#include <numeric>
#include <vector>

namespace zerodrift::core {
namespace {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substitution = diagonal + (a[i - 1] == b[j - 1] ? 0U : 1U);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substitution});
    }
  }
  return row.at(b.size());
}

std::string_view stem(std::string_view name) {
  return name.substr(0, name.find('_'));
}

}  // namespace

std::optional<std::string> closest_name(std::string_view word,
                                        std::span<const std::string> candidates,
                                        std::size_t most_edits) {
  const std::string* best = nullptr;
  std::size_t best_distance = std::min(word.size() / 2, most_edits) + 1;
  for (const std::string& candidate : candidates) {
    std::size_t distance = edit_distance(word, candidate);
    if (word.size() > 2 && stem(word) == stem(candidate)) {
      distance = std::min(distance, word.size() / 2);
    }
    if (distance < best_distance) {
      best = &candidate;
      best_distance = distance;
    }
  }
  return best != nullptr ? std::optional<std::string>(*best) : std::nullopt;
}

std::string suggestion(std::string_view word, std::span<const std::string> candidates) {
  if (const auto close = closest_name(word, candidates)) return "; did you mean '" + *close + "'?";
  std::string list;
  for (const std::string& candidate : candidates) list += (list.empty() ? "" : ", ") + candidate;
  return list.empty() ? "; none is valid here" : "; valid: " + list;
}

}  // namespace zerodrift::core
