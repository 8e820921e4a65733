// SPDX-License-Identifier: Apache-2.0
// What every expert but the support-vector regression says of the drift to come: a number that is
// linear in the thermal basis, plus slopes that die away with time. Forecasts of several experts
// with weights are again such a forecast, so a stack of any number of them costs one dot product.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace zerodrift::experts {

// Entries of a thermal basis: see thermal_basis.h.
inline constexpr std::size_t kBasisTerms = 9;
using Basis = std::array<double, kBasisTerms>;

// Times in which a slope dies away to 1/e, s: a start-up transient and a warm-up.
inline constexpr std::array<double, 2> kSlopeTimesS{300.0, 3000.0};

// drift(t) = level + sum_i slope_i T_i (1 - exp(-(t - t0) / T_i)) + sum_j coefficient_j basis_j(t)
// in the labels' unit, t0 the time of the newest label that is in it.
struct LinearForecast {
  double time_s = 0.0;
  double level = 0.0;
  std::array<double, kSlopeTimesS.size()> slope{};  // per second
  Basis coefficient{};

  // O(terms); no allocation.
  [[nodiscard]] double at(double now_s, const Basis& basis) const noexcept {
    double sum = level;
    for (std::size_t i = 0; i < slope.size(); ++i) {
      if (slope[i] == 0.0) continue;  // of all experts but one
      sum -= slope[i] * kSlopeTimesS[i] * std::expm1(-(now_s - time_s) / kSlopeTimesS[i]);
    }
    for (std::size_t j = 0; j < kBasisTerms; ++j) sum += coefficient[j] * basis[j];
    return sum;
  }
  // Adds `weight` of another forecast of the same time.
  void add(double weight, const LinearForecast& other) noexcept {
    level += weight * other.level;
    for (std::size_t i = 0; i < slope.size(); ++i) slope[i] += weight * other.slope[i];
    for (std::size_t j = 0; j < kBasisTerms; ++j) coefficient[j] += weight * other.coefficient[j];
  }

  template <typename Archive>
  void carry(Archive& archive) {
    archive(time_s, level, slope, coefficient);
  }
};

}  // namespace zerodrift::experts
