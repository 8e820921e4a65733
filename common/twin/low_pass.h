// SPDX-License-Identifier: Apache-2.0
// First-order low pass, the lag of every thermal effect.
#pragma once

#include <cmath>

#include "common/core/state_archive.h"

namespace zerodrift::twin {

// tau dy/dt = u - y at a fixed step, exact for an input that is constant over the step. The first
// step returns its input (steady state); tau_s = 0 passes everything through. An input that isn't
// finite is returned and forgotten. O(1).
class LowPass {
 public:
  LowPass(double tau_s, double interval_s) noexcept : LowPass(tau_s, tau_s, interval_s) {}
  // Of fall_s while the input is below the output, else of rise_s.
  LowPass(double rise_s, double fall_s, double interval_s) noexcept
      : rise_(gain_of(rise_s, interval_s)), fall_(gain_of(fall_s, interval_s)) {}

  double step(double input) noexcept {
    if (!std::isfinite(input)) return input;
    const double gain = input < output_ ? fall_ : rise_;
    output_ = started_ ? output_ + gain * (input - output_) : input;
    started_ = true;
    return output_;
  }

  void carry(core::StateArchive& archive) { archive(output_, started_); }

 private:
  static double gain_of(double tau_s, double interval_s) noexcept {
    return tau_s > 0.0 ? -std::expm1(-interval_s / tau_s) : 1.0;
  }

  double rise_;
  double fall_;
  double output_ = 0.0;
  bool started_ = false;
};

}  // namespace zerodrift::twin
