// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/experiment_plan.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <utility>

#include "common/core/units.h"
#include "common/twin/random.h"

namespace zerodrift::diagnosis {
namespace {

using core::Axis;
using twin::ChamberLimits;
using twin::ExcitedQuantity;

constexpr double kTurnRampS = 5.0;
constexpr double kLevelRampS = 5.0;

struct ChannelTraits {
  std::optional<double> ChamberLimits::*limit;
  Axis axis;
  std::optional<ExcitedQuantity> quantity;  // none: a turn, or a tilt
};

const ChannelTraits& traits(Channel channel) {
  using enum ExcitedQuantity;
  static const PerChannel<ChannelTraits> kTraits{{
      {&ChamberLimits::rate_radps, Axis::kX, {}},
      {&ChamberLimits::rate_radps, Axis::kY, {}},
      {&ChamberLimits::rate_radps, Axis::kZ, {}},
      {&ChamberLimits::magnetic_ut, Axis::kX, kMagneticUt},
      {&ChamberLimits::magnetic_ut, Axis::kY, kMagneticUt},
      {&ChamberLimits::magnetic_ut, Axis::kZ, kMagneticUt},
      {&ChamberLimits::tilt_rad, Axis::kX, {}},
      {&ChamberLimits::tilt_rad, Axis::kY, {}},
      {&ChamberLimits::vibration_g, Axis::kX, kVibrationG},
      {&ChamberLimits::source_current_ma, Axis::kX, kSourceCurrentMa},
      {&ChamberLimits::supply_v, Axis::kX, kSupplyV},
  }};
  return kTraits[static_cast<std::size_t>(channel)];
}

bool is_rate(Channel channel) {
  return channel <= Channel::kRateZ;
}

std::size_t blocks_of(double duration_s) {
  return static_cast<std::size_t>(std::ceil(duration_s / kLevelBlockS));
}

void add_chamber(const ExperimentPlan& plan, twin::Profile& profile) {
  double time_s = 0.0;
  double at_degc = plan.initial_temperature_degc;
  for (const ThermalBlock& block : plan.thermal) {
    if (time_s >= plan.duration_s) return;
    if (block.temperature_degc != at_degc) {
      if (time_s > 0.0 && (profile.chamber.empty() || profile.chamber.back().time_s < time_s))
        profile.chamber.push_back({time_s, at_degc});  // held until now
      const double change_degc = block.temperature_degc - at_degc;
      const double ramp_s = std::abs(change_degc) / block.ramp_degc_per_s;
      const double left_s = plan.duration_s - time_s;
      if (ramp_s > left_s) {  // the experiment ends on the ramp
        profile.chamber.push_back({plan.duration_s, at_degc + change_degc * left_s / ramp_s});
        return;
      }
      time_s += ramp_s;
      at_degc = block.temperature_degc;
      profile.chamber.push_back({time_s, at_degc});
    }
    time_s += block.soak_s;
  }
}

// Blocks of one level are one stretch.
template <typename Add>
void for_each_stretch(const std::vector<double>& levels, double duration_s, const Add& add) {
  for (std::size_t begin = 0; begin < levels.size();) {
    std::size_t end = begin + 1;
    while (end < levels.size() && levels[end] == levels[begin]) ++end;
    const double start_s = static_cast<double>(begin) * kLevelBlockS;
    const double end_s = std::min(static_cast<double>(end) * kLevelBlockS, duration_s);
    if (end_s - start_s > 2.0 * kTurnRampS) add(start_s, end_s - start_s, begin);
    begin = end;
  }
}

void add_levels(const ExperimentPlan& plan, const ChamberLimits& limits, twin::Profile& profile) {
  for (std::size_t c = 0; c < kChannels; ++c) {
    const ChannelTraits& of = traits(static_cast<Channel>(c));
    if (!(limits.*of.limit)) continue;
    const double limit = *(limits.*of.limit);
    const auto& levels = plan.levels[c];
    for_each_stretch(levels, plan.duration_s, [&](double start_s, double length_s, std::size_t b) {
      const double value = levels[b] * limit;
      if (value == 0.0) return;
      if (is_rate(static_cast<Channel>(c))) {
        profile.turns.push_back({start_s, length_s, of.axis, value, kTurnRampS});
      } else if (of.quantity) {
        profile.excitations.push_back(
            {start_s, length_s, *of.quantity, of.axis, value, kLevelRampS});
      }
    });
  }
}

// Of a body tilted about x and about y: what it feels of gravity along each axis, in g.
core::PerAxis<double> gravity_in_body(double about_x_rad, double about_y_rad) {
  core::PerAxis<double> g{std::sin(about_y_rad), std::sin(about_x_rad), 0.0};
  const double across = g[0] * g[0] + g[1] * g[1];
  if (across > 1.0) {
    for (double& component : g) component /= std::sqrt(across);
  }
  g[2] = std::sqrt(std::max(0.0, 1.0 - across));
  return g;
}

void add_gravity(const ExperimentPlan& plan, const ChamberLimits& limits, twin::Profile& profile) {
  const auto add = [&](double start_s, double length_s, Axis axis, double g, double ramp_s) {
    if (g == 0.0) return;
    profile.excitations.push_back({start_s, length_s, ExcitedQuantity::kAccelerationMps2, axis,
                                   g * core::kStandardGravityMps2, ramp_s});
  };
  add(0.0, plan.duration_s, Axis::kZ, 1.0, 0.0);
  const auto& about_x = plan.levels[static_cast<std::size_t>(Channel::kTiltX)];
  const auto& about_y = plan.levels[static_cast<std::size_t>(Channel::kTiltY)];
  if (!limits.tilt_rad) return;
  for (std::size_t b = 0; b < std::max(about_x.size(), about_y.size()); ++b) {
    const double start_s = static_cast<double>(b) * kLevelBlockS;
    const double length_s = std::min(kLevelBlockS, plan.duration_s - start_s);
    if (length_s <= 2.0 * kLevelRampS) break;
    const auto angle = [&](const std::vector<double>& levels) {
      return b < levels.size() ? levels[b] * *limits.tilt_rad : 0.0;
    };
    const auto g = gravity_in_body(angle(about_x), angle(about_y));
    add(start_s, length_s, Axis::kX, g[0], kLevelRampS);
    add(start_s, length_s, Axis::kY, g[1], kLevelRampS);
    add(start_s, length_s, Axis::kZ, g[2] - 1.0, kLevelRampS);
  }
}

// Up and down over the same temperatures until the time is over.
std::vector<ThermalBlock> cycles(double low, double high, const std::vector<double>& ramps,
                                 double soak_s, double duration_s) {
  std::vector<ThermalBlock> blocks;
  double time_s = 0.0;
  for (std::size_t i = 0; time_s < duration_s; ++i) {
    const double ramp = ramps[i / 2 % ramps.size()];
    blocks.push_back({i % 2 == 0 ? high : low, ramp, soak_s});
    time_s += (high - low) / ramp + soak_s;
  }
  return blocks;
}

void move(ExperimentPlan& plan, const ChamberLimits& limits, Channel from, Channel to) {
  for (std::size_t c = static_cast<std::size_t>(from); c <= static_cast<std::size_t>(to); ++c) {
    const auto channel = static_cast<Channel>(c);
    if (is_movable(limits, channel))
      plan.levels[c] = shuffled_levels(levels_of(channel), blocks_of(plan.duration_s), c);
  }
}

}  // namespace

bool is_movable(const ChamberLimits& limits, Channel channel) {
  return (limits.*traits(channel).limit).has_value();
}

ChamberLimits limited_to(const ChamberLimits& limits, const std::vector<twin::Need>& needs) {
  using twin::Need;
  const auto has = [&](std::initializer_list<Need> any) {
    return std::find_first_of(needs.begin(), needs.end(), any.begin(), any.end()) != needs.end();
  };
  ChamberLimits result = limits;
  if (!has({Need::kReferenceRate, Need::kSlowReferenceRate, Need::kCrossAxisRate}))
    result.rate_radps.reset();
  if (!has({Need::kMagnetic})) result.magnetic_ut.reset();
  if (!has({Need::kAcceleration})) result.tilt_rad.reset();
  if (!has({Need::kVibration})) result.vibration_g.reset();
  if (!has({Need::kSourceCurrent})) result.source_current_ma.reset();
  if (!has({Need::kSupply})) result.supply_v.reset();
  return result;
}

std::vector<double> levels_of(Channel channel) {
  // The slowest rates are below the Earth's rate, where a gyro may not answer at all.
  if (is_rate(channel))
    return {0.0, 1.0, -1.0, 0.4, -0.4, 0.15, -0.15, 0.05, -0.05, 1.5e-5, -1.5e-5, 5e-6, -5e-6};
  if (channel == Channel::kVibration) return {0.0, 1.0, 0.5, 0.25};
  return {0.0, 1.0, -1.0, 0.5, -0.5};
}

std::vector<double> shuffled_levels(std::span<const double> choices, std::size_t blocks,
                                    std::uint64_t order) {
  std::vector<double> levels;
  for (std::size_t b = 0; b < blocks; ++b) levels.push_back(choices[b % choices.size()]);
  const twin::NoiseStream random(order, "levels");
  for (std::size_t b = blocks; b-- > 1;) {
    const double place = random.uniform(b) * static_cast<double>(b + 1);
    std::swap(levels[b], levels[static_cast<std::size_t>(place)]);
  }
  return levels;
}

twin::Profile profile_of(const ExperimentPlan& plan, const ChamberLimits& limits) {
  twin::Profile profile;
  profile.duration_s = plan.duration_s;
  profile.initial_temperature_degc = plan.initial_temperature_degc;
  if (plan.off_at_s && limits.off_s)
    profile.power_cycles.push_back({*plan.off_at_s, *plan.off_at_s + *limits.off_s});
  add_chamber(plan, profile);
  add_levels(plan, limits, profile);
  add_gravity(plan, limits, profile);
  return profile;
}

std::vector<ExperimentPlan> experiment_menu(const ChamberLimits& limits) {
  const ExperimentPlan still{.duration_s = limits.duration_s,
                             .initial_temperature_degc = limits.ambient_degc};
  std::vector<ExperimentPlan> menu;
  const auto add = [&](std::string_view what, ExperimentPlan plan) {
    plan.what = what;
    menu.push_back(std::move(plan));
  };
  add("switching on at constant temperature", still);
  ExperimentPlan turning = still;
  move(turning, limits, Channel::kRateX, Channel::kRateZ);
  ExperimentPlan surroundings = still;
  move(surroundings, limits, Channel::kMagneticX, Channel::kSupply);
  if (limits.rate_radps) add("a rate table at constant temperature", turning);
  if (surroundings.levels != still.levels)
    add("blocks of what surrounds the gyro at constant temperature", surroundings);
  if (!limits.moves_temperature()) return menu;

  const double low = *limits.low_degc;
  const double high = *limits.high_degc;
  const double fastest = *limits.ramp_degc_per_s;
  const auto heated = [&](const ExperimentPlan& plan, const std::vector<ThermalBlock>& blocks) {
    ExperimentPlan result = plan;
    result.initial_temperature_degc = low;
    result.thermal = blocks;
    return result;
  };
  const double whole_s = limits.duration_s;
  const auto fast = cycles(low, high, {fastest}, limits.soak_s, whole_s);
  add("slow ramps up and down",
      heated(still, cycles(low, high, {fastest / 4.0}, limits.soak_s, whole_s)));
  add("fast ramps up and down with soaks", heated(still, fast));
  const double middle = 0.5 * (low + high);
  ExperimentPlan small = still;
  small.initial_temperature_degc = middle;
  small.thermal =
      cycles(middle, middle + 0.1 * (high - low), {fastest / 4.0}, limits.soak_s, whole_s);
  add("small temperature cycles", small);
  if (limits.rate_radps) add("a rate table while the temperature ramps", heated(turning, fast));
  ExperimentPlan everything =
      heated(surroundings,
             cycles(low, high, {fastest, fastest / 2.0, fastest / 4.0}, limits.soak_s, whole_s));
  move(everything, limits, Channel::kRateX, Channel::kRateZ);
  if (limits.off_s && whole_s > 4.0 * *limits.off_s)
    everything.off_at_s = 0.5 * (whole_s - *limits.off_s);
  add("everything at once, in blocks at random", everything);
  return menu;
}

}  // namespace zerodrift::diagnosis
