// SPDX-License-Identifier: Apache-2.0
// A sum of noises as a function of the cluster time: the five power laws of coefficients.h, a
// sinusoid and a first-order Markov noise. Inner part of the coefficient fit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/allan/coefficients.h"

namespace zerodrift::allan {

// Power laws first, in the order of NoiseTerm.
enum class Shape : std::uint8_t {
  kQuantization,
  kAngleRandomWalk,
  kBiasInstability,
  kRateRandomWalk,
  kRateRamp,
  kSinusoid,
  kMarkov,
};

inline constexpr std::size_t kShapeCount = 7;
inline constexpr std::array<Shape, kShapeCount> kShapes{
    Shape::kQuantization, Shape::kAngleRandomWalk, Shape::kBiasInstability, Shape::kRateRandomWalk,
    Shape::kRateRamp,     Shape::kSinusoid,        Shape::kMarkov};

constexpr std::size_t index(Shape shape) {
  return static_cast<std::size_t>(shape);
}

constexpr Shape shape_of(NoiseTerm term) {
  return static_cast<Shape>(index(term));
}

using ShapeSet = unsigned;  // bit index(shape)

constexpr ShapeSet only(Shape shape) {
  return 1u << index(shape);
}

constexpr bool contains(ShapeSet set, Shape shape) {
  return (set & only(shape)) != 0;
}

constexpr std::size_t size(ShapeSet set) {
  std::size_t count = 0;
  for (const Shape shape : kShapes) count += contains(set, shape) ? 1u : 0u;
  return count;
}

template <typename T>
using PerShape = std::array<T, kShapeCount>;

struct NoiseModel {
  PerShape<double> squares{};    // squared coefficients: Q², N², B², K², R², A², q²
  double frequency_hz = 1.0;     // of the sinusoid
  double time_constant_s = 1.0;  // of the Markov noise

  // What a coefficient of 1 adds to the Allan variance at tau, with this model's frequency and time
  // constant.
  [[nodiscard]] double unit_variance(Shape shape, double tau_s) const noexcept;

  [[nodiscard]] double variance(double tau_s) const noexcept;

  // d variance / d ln(frequency or time constant) for the shape's own part; 0 for a power law.
  [[nodiscard]] double variance_by_log_parameter(Shape shape, double tau_s) const noexcept;
};

}  // namespace zerodrift::allan
