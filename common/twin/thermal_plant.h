// SPDX-License-Identifier: Apache-2.0
// The gyro's thermal world as a lumped network, heat flowing chamber -> case -> coil_outer ->
// coil_inner and case <- board (self-heating):
//     C_i dT_i/dt = sum_j G_ij (T_j - T_i) + P_i
// Every process that simulates the same (parameters, profile) sees identical temperatures to the
// bit, whatever times it asks for: the network is integrated on one fixed grid of time (classic
// Runge-Kutta, step 0.1 s; error below 1e-9 K for time constants of minutes) and read by linear
// interpolation.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/core/time.h"
#include "common/twin/model.h"
#include "common/twin/profile.h"
#include "common/twin/temperature_point.h"

namespace zerodrift::twin {

struct ThermalState {
  PerPoint<double> temperature_degc{};
  PerPoint<double> temperature_rate_degc_per_s{};
};

class ThermalPlant {
 public:
  static constexpr core::SensorTime kStep{100'000'000};

  // Starts at the earlier of time 0 and power-on, everything at the initial temperature.
  ThermalPlant(const ThermalParameters& parameters, const Profile& profile);

  // State at a time; times must not decrease from call to call. O(steps passed), O(1) in steady
  // use.
  [[nodiscard]] ThermalState at(core::SensorTime time) noexcept;

 private:
  static constexpr std::size_t kNodeCount = 4;  // case, coil_outer, coil_inner, board
  using Nodes = std::array<double, kNodeCount>;

  struct GridPoint {
    Nodes temperature_degc{};
    Nodes rate_degc_per_s{};
    double chamber_degc = 0.0;
  };

  [[nodiscard]] Nodes derivative(const Nodes& temperature_degc, double chamber_degc,
                                 double power_w) const noexcept;
  [[nodiscard]] double grid_time_s(std::int64_t step) const noexcept;
  [[nodiscard]] double power_w(std::int64_t step) const noexcept;
  [[nodiscard]] GridPoint grid_point(const Nodes& temperature_degc,
                                     std::int64_t step) const noexcept;
  [[nodiscard]] Nodes integrate(const Nodes& from, std::int64_t step) const noexcept;
  void advance() noexcept;

  ThermalParameters parameters_;
  Profile profile_;
  std::int64_t power_on_step_ = 0;
  std::int64_t step_ = 0;  // grid index of before_; grid time = index times kStep
  GridPoint before_;
  GridPoint after_;
};

}  // namespace zerodrift::twin
