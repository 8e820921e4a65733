// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/twin/effect.h"

namespace zerodrift::twin::effects {

// c1 D + c2 D² + c3 D³ + c4 D⁴, of effects with parameters of these names.
class BiasPolynomial {
 public:
  explicit BiasPolynomial(const EffectContext& context)
      : c1_(context.radps("c1_deg_h_per_degc")),
        c2_(context.radps("c2_deg_h_per_degc2")),
        c3_(context.radps("c3_deg_h_per_degc3")),
        c4_(context.radps("c4_deg_h_per_degc4")) {}

  [[nodiscard]] double radps(double d) const noexcept {
    return d * (c1_ + d * (c2_ + d * (c3_ + d * c4_)));
  }
  // Its derivative with respect to D.
  [[nodiscard]] double radps_per_degc(double d) const noexcept {
    return c1_ + d * (2.0 * c2_ + d * (3.0 * c3_ + d * 4.0 * c4_));
  }

 private:
  double c1_, c2_, c3_, c4_;  // rad/s per °C, °C², °C³, °C⁴
};

}  // namespace zerodrift::twin::effects
