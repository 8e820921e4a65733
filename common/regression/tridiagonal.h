// SPDX-License-Identifier: Apache-2.0
// T + ridge, T symmetric and tridiagonal, for several ridges side by side: bit-identical on every
// processor (vector_clones.h).
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace zerodrift::regression {

inline constexpr std::size_t kRidgesAtOnce = 8;
using ByRidge = std::array<double, kRidgesAtOnce>;

struct Tridiagonal {
  std::span<const double> diagonal;     // at least one
  std::span<const double> subdiagonal;  // one less
};

struct RidgeFigures {
  ByRidge log_determinant{};  // log |T + ridge|; not a number unless that is positive definite
  ByRidge squared_norm{};     // y' (T + ridge)^-1 y
};

// By L D L'. `y` is as long as the diagonal. O(its length) for all ridges together.
[[nodiscard]] RidgeFigures figures_of(const Tridiagonal& matrix, std::span<const double> y,
                                      const ByRidge& ridges) noexcept;

}  // namespace zerodrift::regression
