// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/coarse_readings.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace zerodrift::diagnosis {
namespace {

// Readings that are the same, by their places; holes in between belong to it.
struct Stay {
  std::size_t first = 0;
  std::size_t last = 0;

  [[nodiscard]] double middle() const {
    return 0.5 * static_cast<double>(first) + 0.5 * static_cast<double>(last);
  }
};

// Longer than `longest` places.
std::vector<Stay> long_stays(const std::vector<double>& readings, std::size_t longest) {
  std::vector<Stay> stays;
  std::optional<Stay> now;
  const auto keep = [&] {
    if (now && now->last - now->first > longest) stays.push_back(*now);
  };
  for (std::size_t i = 0; i < readings.size(); ++i) {
    if (std::isnan(readings[i])) continue;
    if (now && readings[now->last] == readings[i]) {
      now->last = i;
      continue;
    }
    keep();
    now = Stay{.first = i, .last = i};
  }
  keep();
  return stays;
}

// From one step to the next: quick, or back and forth between the two by the reading's noise while
// the temperature passes, for a shorter time than it stays at either.
bool is_change(const std::vector<double>& readings, const Stay& before, const Stay& after,
               std::size_t longest) {
  const std::size_t lasts = after.first - before.last;
  if (readings[before.last] == readings[after.first]) return false;
  if (lasts <= longest) return true;
  if (lasts >= std::min(before.last - before.first, after.last - after.first)) return false;
  bool any = false;
  for (std::size_t i = before.last + 1; i < after.first; ++i) {
    if (std::isnan(readings[i])) continue;
    any = true;
    if (readings[i] != readings[before.last] && readings[i] != readings[after.first]) return false;
  }
  return any;
}

struct Anchor {
  double place = 0.0;
  double degc = 0.0;
};

}  // namespace

std::vector<double> without_steps(std::vector<double> readings, std::size_t longest_stay) {
  const std::vector<Stay> stays = long_stays(readings, longest_stay);
  const std::vector<double> as_read = readings;
  const auto draw = [&](const Anchor& from, const Anchor& to) {
    const double slope = (to.degc - from.degc) / (to.place - from.place);
    for (auto i = static_cast<std::size_t>(std::ceil(from.place));
         static_cast<double>(i) <= to.place; ++i) {
      if (!std::isnan(as_read[i]))
        readings[i] = from.degc + slope * (static_cast<double>(i) - from.place);
    }
  };
  for (std::size_t s = 1; s < stays.size(); ++s) {
    const Stay& before = stays[s - 1];
    const Stay& after = stays[s];
    const Anchor from{before.middle(), as_read[before.first]};
    const Anchor to{after.middle(), as_read[after.first]};
    if (!is_change(as_read, before, after, longest_stay)) continue;
    const Anchor change{0.5 * static_cast<double>(before.last + after.first),
                        0.5 * (from.degc + to.degc)};
    draw(from, change);
    draw(change, to);
  }
  return readings;
}

}  // namespace zerodrift::diagnosis
