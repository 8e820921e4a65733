// SPDX-License-Identifier: Apache-2.0
// What the tables, the verdict and the JSON of a comparison share.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "common/core/units.h"
#include "common/evaluation/comparison_run.h"

namespace zerodrift::evaluation {

inline constexpr std::string_view kOurs = "stack";         // what the service runs by default
inline constexpr std::string_view kPapers = "online-svr";  // what the paper's figures are of
inline constexpr std::string_view kHolding = "persistence";
inline constexpr std::string_view kNothingTakenOff = "none";
inline constexpr std::string_view kPaperProcedure = "the paper's procedure";
// Curves of the pictures: a reader tells so many apart.
inline constexpr std::size_t kMostDrawn = 3;
inline constexpr std::array<std::string_view, kMostDrawn> kDrawn{kHolding, kOurs, kPapers};

// Places in the palette: one for each scheme in whatever picture. The first one is of what was
// measured; schemes that are drawn only where none of those above was compared share the rest.
[[nodiscard]] inline std::size_t colour_of(std::string_view scheme) {
  const auto* drawn = std::find(kDrawn.begin(), kDrawn.end(), scheme);
  if (drawn != kDrawn.end()) return 1 + static_cast<std::size_t>(drawn - kDrawn.begin());
  const auto& names = comparison::kSchemeNames;
  const auto place = std::find(names.begin(), names.end(), scheme) - names.begin();
  return 1 + kMostDrawn + static_cast<std::size_t>(place) % kMostDrawn;
}

// Those above that were compared; without any of them the first ones.
[[nodiscard]] inline bool is_drawn(const ProtocolOutcome& protocol, const SchemeOutcome& scheme) {
  const auto is_one = [](const SchemeOutcome& other) {
    return std::find(kDrawn.begin(), kDrawn.end(), other.name) != kDrawn.end();
  };
  if (std::any_of(protocol.schemes.begin(), protocol.schemes.end(), is_one)) return is_one(scheme);
  return &scheme < protocol.schemes.data() + kMostDrawn;
}

[[nodiscard]] inline std::string axis_name(const AxisComparison& axis) {
  return "axis " + std::string(core::name(axis.axis));
}

[[nodiscard]] inline double b_unit() {
  return 1.0 / core::kRadPerSecPerDegPerHour;
}

// A spread of fewer is known to worse than a quarter: 1 / sqrt(2 (n - 1)).
inline constexpr std::uint64_t kFewestMinutes = 10;

[[nodiscard]] inline double deg_h_or_nothing(const allan::BlockMoments& minutes) {
  return minutes.blocks >= kFewestMinutes ? core::deg_h_from_radps(minutes.standard_deviation)
                                          : std::numeric_limits<double>::quiet_NaN();
}

[[nodiscard]] inline const SchemeOutcome* find(const ProtocolOutcome& protocol,
                                               std::string_view name) {
  const auto found = std::find_if(protocol.schemes.begin(), protocol.schemes.end(),
                                  [&](const SchemeOutcome& s) { return s.name == name; });
  return found == protocol.schemes.end() ? nullptr : &*found;
}

// Mean length of a label: longer than asked for where samples are rarer.
[[nodiscard]] inline double label_s(const AxisComparison& axis) {
  double sum_s = 0.0;
  for (const auto& point : axis.points) sum_s += core::seconds(point.end - point.begin);
  return sum_s / static_cast<double>(axis.points.size());
}

[[nodiscard]] inline bool is_frozen(const comparison::Protocol& protocol) {
  return protocol.frozen_from != core::SensorTime::max();
}

// The median age of the newest label where the delay and a label's length don't make it, s: behind
// motion. Nothing where they do, and for a last leg, which gets as old as it is long.
[[nodiscard]] inline std::optional<double> age_behind_motion_s(
    const AxisComparison& axis, const comparison::Protocol& protocol) {
  if (is_frozen(protocol)) return std::nullopt;
  const double age_s = comparison::median_age_s(protocol, axis.points);
  if (age_s > protocol.delay_s + 2.0 * label_s(axis)) return age_s;
  return std::nullopt;
}

}  // namespace zerodrift::evaluation
