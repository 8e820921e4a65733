// SPDX-License-Identifier: Apache-2.0
#include "common/allan/noise_model.h"

#include <cmath>

namespace zerodrift::allan {

double NoiseModel::unit_variance(Shape shape, double tau_s) const noexcept {
  switch (shape) {
    case Shape::kSinusoid: return sinusoid_unit_variance(frequency_hz, tau_s);
    case Shape::kMarkov: return markov_unit_variance(time_constant_s, tau_s);
    default: return zerodrift::allan::unit_variance(static_cast<NoiseTerm>(index(shape)), tau_s);
  }
}

double NoiseModel::variance(double tau_s) const noexcept {
  double sum = 0.0;
  for (const Shape shape : kShapes) {
    if (squares[index(shape)] > 0.0) sum += squares[index(shape)] * unit_variance(shape, tau_s);
  }
  return sum;
}

double NoiseModel::variance_by_log_parameter(Shape shape, double tau_s) const noexcept {
  constexpr double kStep = 1e-4;
  if (shape != Shape::kSinusoid && shape != Shape::kMarkov) return 0.0;
  const auto moved = [&](double factor) {
    NoiseModel m = *this;
    m.frequency_hz *= factor;
    m.time_constant_s *= factor;
    return m.unit_variance(shape, tau_s);
  };
  return squares[index(shape)] * (moved(std::exp(kStep)) - moved(std::exp(-kStep))) / (2.0 * kStep);
}

}  // namespace zerodrift::allan
