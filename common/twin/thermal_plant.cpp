// SPDX-License-Identifier: Apache-2.0
#include "common/twin/thermal_plant.h"

#include <algorithm>
#include <cmath>

namespace zerodrift::twin {
namespace {

constexpr double kStepS = 0.1;
static_assert(ThermalPlant::kStep.count() == 100'000'000);

enum Node : std::size_t { kCaseNode, kCoilOuterNode, kCoilInnerNode, kBoardNode };

template <typename Nodes>
Nodes moved(const Nodes& from, const Nodes& rate, double dt_s) noexcept {
  Nodes to{};
  for (std::size_t i = 0; i < to.size(); ++i) to[i] = from[i] + dt_s * rate[i];
  return to;
}

// Chamber first, then the nodes, then the coil's mean.
template <typename Nodes>
PerPoint<double> per_point(double chamber, const Nodes& n) noexcept {
  const double coil = 0.5 * (n[kCoilOuterNode] + n[kCoilInnerNode]);
  return {chamber, n[kCaseNode], n[kCoilOuterNode], n[kCoilInnerNode], n[kBoardNode], coil};
}

}  // namespace

ThermalPlant::ThermalPlant(const ThermalParameters& parameters, const Profile& profile)
    : parameters_(parameters),
      profile_(profile),
      power_on_step_(std::llround(profile.power_on_s / kStepS)),
      step_(std::min<std::int64_t>(0, power_on_step_)) {
  Nodes soaked{};
  soaked.fill(profile.initial_temperature_degc);
  before_ = grid_point(soaked, step_);
  after_ = grid_point(integrate(soaked, step_), step_ + 1);
}

ThermalState ThermalPlant::at(core::SensorTime time) noexcept {
  while (time >= (step_ + 1) * kStep) advance();
  const double share =
      static_cast<double>((time - step_ * kStep).count()) / static_cast<double>(kStep.count());
  const auto between = [share](double a, double b) { return a + share * (b - a); };
  Nodes temperature{};
  Nodes rate{};
  for (std::size_t i = 0; i < kNodeCount; ++i) {
    temperature[i] = between(before_.temperature_degc[i], after_.temperature_degc[i]);
    rate[i] = between(before_.rate_degc_per_s[i], after_.rate_degc_per_s[i]);
  }
  const double chamber_rate = (after_.chamber_degc - before_.chamber_degc) / kStepS;
  return {per_point(between(before_.chamber_degc, after_.chamber_degc), temperature),
          per_point(chamber_rate, rate)};
}

void ThermalPlant::advance() noexcept {
  ++step_;
  before_ = after_;
  after_ = grid_point(integrate(before_.temperature_degc, step_), step_ + 1);
}

ThermalPlant::GridPoint ThermalPlant::grid_point(const Nodes& temperature_degc,
                                                 std::int64_t step) const noexcept {
  const double chamber = chamber_temperature_degc(profile_, grid_time_s(step));
  return {temperature_degc, derivative(temperature_degc, chamber, power_w(step)), chamber};
}

ThermalPlant::Nodes ThermalPlant::integrate(const Nodes& from, std::int64_t step) const noexcept {
  const double time_s = grid_time_s(step);
  const double power = power_w(step);
  const double start_degc = chamber_temperature_degc(profile_, time_s);
  const double middle_degc = chamber_temperature_degc(profile_, time_s + kStepS / 2.0);
  const double end_degc = chamber_temperature_degc(profile_, grid_time_s(step + 1));
  const Nodes k1 = derivative(from, start_degc, power);
  const Nodes k2 = derivative(moved(from, k1, kStepS / 2.0), middle_degc, power);
  const Nodes k3 = derivative(moved(from, k2, kStepS / 2.0), middle_degc, power);
  const Nodes k4 = derivative(moved(from, k3, kStepS), end_degc, power);
  Nodes mean_rate{};
  for (std::size_t i = 0; i < kNodeCount; ++i) {
    mean_rate[i] = (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]) / 6.0;
  }
  return moved(from, mean_rate, kStepS);
}

ThermalPlant::Nodes ThermalPlant::derivative(const Nodes& t, double chamber_degc,
                                             double power_w) const noexcept {
  const ThermalParameters& p = parameters_;
  const double into_case_w = p.chamber_case_w_per_k * (chamber_degc - t[kCaseNode]);
  const double into_coil_w = p.case_coil_outer_w_per_k * (t[kCaseNode] - t[kCoilOuterNode]);
  const double into_inner_w = p.coil_outer_inner_w_per_k * (t[kCoilOuterNode] - t[kCoilInnerNode]);
  const double out_of_board_w = p.case_board_w_per_k * (t[kBoardNode] - t[kCaseNode]);
  Nodes rate{};
  rate[kCaseNode] = (into_case_w - into_coil_w + out_of_board_w) / p.case_capacity_j_per_k;
  rate[kCoilOuterNode] = (into_coil_w - into_inner_w) / p.coil_outer_capacity_j_per_k;
  rate[kCoilInnerNode] = into_inner_w / p.coil_inner_capacity_j_per_k;
  rate[kBoardNode] = (power_w - out_of_board_w) / p.board_capacity_j_per_k;
  return rate;
}

// Step times divided from one integer, so that the grid doesn't depend on where it started.
double ThermalPlant::grid_time_s(std::int64_t step) const noexcept {
  return static_cast<double>(step) / 10.0;
}

double ThermalPlant::power_w(std::int64_t step) const noexcept {
  if (step < power_on_step_) return 0.0;
  for (const PowerCycle& cycle : profile_.power_cycles) {
    if (step < std::llround(cycle.off_s / kStepS)) break;
    if (step < std::llround(cycle.on_s / kStepS)) return 0.0;
  }
  return parameters_.board_power_w;
}

}  // namespace zerodrift::twin
