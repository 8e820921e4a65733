// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "common/regression/kernel.h"
#include "common/regression/sample_window.h"

namespace zerodrift::regression {

// Features, targets and k(x, x) beyond this are refused: double can't hold the KKT tolerance there.
inline constexpr double kLargestMagnitude = 1e6;

struct OnlineSvrOptions {
  std::size_t dimension = 2;   // features per sample, 1..kMaxDimension
  std::size_t capacity = 500;  // W, samples held at most, >= 2
  Kernel kernel;
  double epsilon = 0.02;         // tube half-width, unit of the targets, > kkt_bound()
  double box_constraint = 10.0;  // C, bound of |theta| of a sample of weight 1, > 0
  // Bound held on every KKT violation, relative to max(1, C); unit of the targets.
  double kkt_tolerance = 1e-9;
  // Events one call may spend. What is left is finished by the next call.
  std::size_t event_budget = 200;
  WindowPolicy window = WindowPolicy::kFifo;
  std::size_t recent_capacity = 250;  // kTwoTier only: size of the recent tier, 1..capacity-1

  // The bound on KKT violations, unit of the targets.
  [[nodiscard]] double kkt_bound() const noexcept;

  // Whether a sample may have this weight: above 0, at most 1, and weight x C a normal number.
  [[nodiscard]] bool is_weight(double weight) const noexcept;

  // The first wrong key and what would be right; empty if all is well.
  [[nodiscard]] std::optional<std::string> validate() const;

  friend bool operator==(const OnlineSvrOptions&, const OnlineSvrOptions&) = default;
};

}  // namespace zerodrift::regression
