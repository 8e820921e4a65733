// SPDX-License-Identifier: Apache-2.0
// Bias that remembers where the temperature came from: relays of many widths at many temperatures
// (Preisach). Where a relay sits and how wide it is are independent of each other here, so that the
// relays are play operators in front of a function (a generalized Prandtl-Ishlinskii operator):
//     sum over i of w_i g(P_i) - (1 - s) g(D),  g(x) = k1 x + k2 x² + k3 x³,  D = LP_lag(T) - T_ref
//     P_i = D - E_i,  E_i(k) = clamp(E_i(k-1) + D(k) - D(k-1), -r_i, r_i),  0 at the first sample
// with thresholds r_i = r 2^(i/2), i from -4 to 4, and weights of an exponential density of
// thresholds, w_i ~ r_i exp(-r_i/r), of sum 1. k2 and k3 say how relays thicken and thin out along
// the temperature. s = 1: the relays' own output; s = 0: what of it depends on the way there, as
// friction has it (Dahl, Bouc-Wen); the rest is bias_temperature. With k1 > 0 the bias is behind
// the temperature. The loop doesn't depend on the rate of the temperature. Default: a loop of about
// 2 * 0.05 deg/h.
#include <algorithm>
#include <array>
#include <cmath>

#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

constexpr std::size_t kOperators = 9;
constexpr int kBelowTypical = 4;  // thresholds, half an octave each

class Hysteresis final : public Effect {
 public:
  explicit Hysteresis(const EffectContext& context)
      : temperature_(context),
        k1_(context.radps("k1_deg_h_per_degc")),
        k2_(context.radps("k2_deg_h_per_degc2")),
        k3_(context.radps("k3_deg_h_per_degc3")),
        share_(context.parameter("anhysteretic_share")) {
    const double typical_degc = context.parameter("typical_threshold_degc");
    double sum = 0.0;
    for (std::size_t i = 0; i < kOperators; ++i) {
      const double ratio = std::exp2(0.5 * (static_cast<double>(i) - kBelowTypical));
      operators_[i] = {typical_degc * ratio, ratio * std::exp(-ratio), 0.0};
      sum += operators_[i].weight;
    }
    for (Stop& stop : operators_) stop.weight /= sum;
  }

  double step(const EffectInputs& inputs) noexcept override {
    const double difference = temperature_.step(inputs);
    if (std::isfinite(difference)) {
      move(started_ ? difference - previous_degc_ : 0.0);
      previous_degc_ = difference;
      started_ = true;
    }
    // Sums of w E, w E² and w E³: g(D) - g(D - E) is made of them.
    double first = 0.0;
    double second = 0.0;
    double third = 0.0;
    for (const Stop& stop : operators_) {
      const double weighted = stop.weight * stop.stress_degc;
      first += weighted;
      second += weighted * stop.stress_degc;
      third += weighted * stop.stress_degc * stop.stress_degc;
    }
    const double d = previous_degc_;
    return k1_ * (share_ * d - first) + k2_ * (share_ * d * d - 2.0 * d * first + second) +
           k3_ * (share_ * d * d * d - 3.0 * d * d * first + 3.0 * d * second - third);
  }

  void carry(core::StateArchive& archive) override {
    archive(temperature_, previous_degc_, started_);
    for (Stop& stop : operators_) archive(stop.stress_degc);
  }

 private:
  struct Stop {
    double threshold_degc = 0.0;
    double weight = 0.0;
    double stress_degc = 0.0;  // within -threshold and threshold
  };

  void move(double by_degc) noexcept {
    for (Stop& stop : operators_) {
      stop.stress_degc =
          std::clamp(stop.stress_degc + by_degc, -stop.threshold_degc, stop.threshold_degc);
    }
  }

  LaggedTemperature temperature_;
  double k1_, k2_, k3_;
  double share_;
  std::array<Stop, kOperators> operators_{};
  double previous_degc_ = 0.0;
  bool started_ = false;
};

}  // namespace

EffectDefinition hysteresis() {
  return {
      .equation =
          "sum of w_i g(P_i) - (1 - s) g(D), g(x) = k1 x + k2 x^2 + k3 x^3, P_i play operators of "
          "D with thresholds r_i, w_i ~ r_i exp(-r_i/r), D = LP_lag(T) - T_ref",
      .source =
          "Brokate & Sprekels, Hysteresis and Phase Transitions (1996), "
          "Prandtl-Ishlinskii; Kuhnen, Eur. J. Control 9 (2003) 407",
      .parameters = {reference_parameter(),
                     {"k1_deg_h_per_degc", "of relays at any temperature", 0.0125},
                     {"k2_deg_h_per_degc2", "how they thicken with temperature", 0.0},
                     {"k3_deg_h_per_degc3", "how they thin out on either side", 0.0},
                     shape("typical_threshold_degc", "r", 4.0, {1e-3, 100.0}, {1.5, 4.0, 10.0},
                           SearchRule::kHalfWidth),
                     shape("anhysteretic_share", "s, of what depends on the temperature alone", 0.0,
                           {0.0, 1.0}, {0.0, 1.0}),
                     lag_parameter()},
      .inputs = {TemperaturePoint::kCoil},
      .needs = {Need::kTemperature, Need::kTemperatureCycles},
      .confused_with = {"shupe", "coil_lag", "warm_up"},
      .make = make<Hysteresis>};
}

}  // namespace zerodrift::twin::effects
