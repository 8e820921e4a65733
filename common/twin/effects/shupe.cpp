// SPDX-License-Identifier: Apache-2.0
// Shupe effect: a coil whose temperature changes shows a rate proportional to the change,
//     s M_tau(dT/dt)
// of all its layers. Where T is known at the coil's faces alone, the layers between them follow by
// conduction: the mean of a slab of diffusion time tau = L²/(pi² alpha) whose two faces have T,
//     M_tau = sum over odd n of 8/(pi² n²) LP_(tau/n²)
// (Carslaw & Jaeger 1959, 3.4). tau = 0: T is the whole coil's. Default: 1 deg/h per °C/min, a
// quadrupolar-wound coil of a few hundred metres.
#include <array>
#include <numbers>

#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

// The three slowest modes; what is quicker, 7 %, follows at once.
class SlabMean {
 public:
  SlabMean(double diffusion_s, double interval_s)
      : modes_{LowPass(diffusion_s, interval_s), LowPass(diffusion_s / 9.0, interval_s),
               LowPass(diffusion_s / 25.0, interval_s)} {}

  double step(double at_faces) noexcept {
    constexpr double kFirst = 8.0 / (std::numbers::pi * std::numbers::pi);
    constexpr std::array kShares{kFirst, kFirst / 9.0, kFirst / 25.0};
    double mean = at_faces;
    for (std::size_t i = 0; i < modes_.size(); ++i)
      mean += kShares[i] * (modes_[i].step(at_faces) - at_faces);
    return mean;
  }

  void carry(core::StateArchive& archive) {
    for (LowPass& mode : modes_) archive(mode);
  }

 private:
  std::array<LowPass, 3> modes_;
};

std::unique_ptr<Effect> make_shupe(const EffectContext& context) {
  return of_temperature_rate(context,
                             SlabMean(context.parameter("diffusion_s"), context.interval_s));
}

}  // namespace

EffectDefinition shupe() {
  return {.equation = "s M_tau(dT/dt)",
          .source = "Shupe, Applied Optics 19 (1980) 654",
          .parameters = {{"coefficient_deg_h_min_per_degc", "s, deg/h per °C/min", 1.0},
                         shape("diffusion_s", "tau, of heat between the two faces that T is from",
                               0.0, {0.0, 1e5}, {0.0, 75.0, 150.0, 225.0, 300.0, 450.0, 600.0},
                               SearchRule::kBetweenFaces)},
          .inputs = {TemperaturePoint::kCoil},
          .needs = {Need::kTemperature},
          .confused_with = {"coil_lag", "gradient"},
          .search = {.lends = Lending::kBesideAnother},
          .make = make_shupe};
}

}  // namespace zerodrift::twin::effects
