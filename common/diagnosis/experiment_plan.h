// SPDX-License-Identifier: Apache-2.0
// An experiment in blocks, as a search composes it: switched on at its start, ramps and soaks of a
// chamber one after the other, and beside them levels of every other channel, each held for one
// block of time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "common/core/axis.h"
#include "common/twin/chamber_limits.h"
#include "common/twin/effect.h"
#include "common/twin/profile.h"

namespace zerodrift::diagnosis {

// What can be moved beside temperature and power.
enum class Channel : std::size_t {
  kRateX,
  kRateY,
  kRateZ,  // clang-format off
  kMagneticX, kMagneticY, kMagneticZ,
  kTiltX, kTiltY,
  kVibration,
  kSourceCurrent,
  kSupply,  // clang-format on
};
inline constexpr std::size_t kChannels = 11;
template <typename T>
using PerChannel = std::array<T, kChannels>;

// To a temperature at a rate, and held there.
struct ThermalBlock {
  double temperature_degc = 0.0;
  double ramp_degc_per_s = 0.0;
  double soak_s = 0.0;

  bool operator==(const ThermalBlock&) const = default;
};

struct ExperimentPlan {
  std::string_view what{};  // of the fixed menu; empty of one that was composed
  double duration_s = 0.0;
  double initial_temperature_degc = 20.0;
  std::optional<double> off_at_s{};     // switched off for ChamberLimits::off_s
  std::vector<ThermalBlock> thermal{};  // one after the other from time 0; what comes after the end
                                        // has no effect
  // One a block of kLevelBlockS, in shares of the channel's limit, -1 to 1; empty: not moved.
  PerChannel<std::vector<double>> levels{};
};

// As long as those of the shipped profile: a tilt table or a shaker is set by hand in less.
inline constexpr double kLevelBlockS = 300.0;

// Whether the limits allow the channel to be moved.
[[nodiscard]] bool is_movable(const twin::ChamberLimits& limits, Channel channel);

// The limits without the channels that none of these needs of effects is about. Temperature and
// power stay: nothing is at one temperature only.
[[nodiscard]] twin::ChamberLimits limited_to(const twin::ChamberLimits& limits,
                                             const std::vector<twin::Need>& needs);

// Levels that a search tries, for vibration those of them that aren't negative.
[[nodiscard]] std::vector<double> levels_of(Channel channel);

// A level for each block: all choices equally often, shuffled; channels of different `order` are
// hardly correlated.
[[nodiscard]] std::vector<double> shuffled_levels(std::span<const double> choices,
                                                  std::size_t blocks, std::uint64_t order);

// The plan as an experiment that fits the limits: gravity along z for its whole length, the gyro
// tilted in it. O(blocks).
[[nodiscard]] twin::Profile profile_of(const ExperimentPlan& plan,
                                       const twin::ChamberLimits& limits);

// What is done without a question in mind: those of the usual experiments that the limits allow,
// the last one with everything moved at once.
[[nodiscard]] std::vector<ExperimentPlan> experiment_menu(const twin::ChamberLimits& limits);

}  // namespace zerodrift::diagnosis
