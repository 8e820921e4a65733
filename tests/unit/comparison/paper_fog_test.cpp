// SPDX-License-Identifier: Apache-2.0
// The shipped model has the paper's statistics "before compensation" after the paper's preparation.
#include <gtest/gtest.h>

#include <filesystem>

#include "common/allan/noise_units.h"
#include "common/comparison/paper_preparation.h"
#include "common/config/twin_config.h"
#include "common/core/units.h"
#include "common/twin/simulation.h"

namespace zerodrift::comparison {
namespace {

bool is_noise(const twin::EffectSpec& effect) {
  return effect.kind == "angle_random_walk" || effect.kind == "bias_instability" ||
         effect.kind == "rate_random_walk";
}

// config/models/paper_fog.yaml, axis x alone.
twin::Model paper_fog() {
  const std::filesystem::path config = std::filesystem::path(ZERODRIFT_SOURCE_DIR) / "config";
  twin::Model model = config::load_model(config / "models/paper_fog.yaml").model;
  std::erase_if(model.effects, [](const auto& effect) { return effect.axis != core::Axis::kX; });
  return model;
}

// In the units of the paper's tables.
struct Before {
  double mean_deg_h = 0.0;
  double deviation_deg_h = 0.0;
  double n_deg_rth = 0.0;
  double b_deg_h = 0.0;
  double k_deg_h_rth = 0.0;
};

Before before(const twin::Model& model, double rate_hz) {
  const std::filesystem::path config = std::filesystem::path(ZERODRIFT_SOURCE_DIR) / "config";
  const auto profile = config::load_profile(config / "profiles/paper_chamber.yaml");
  twin::GyroSimulation gyro(model, profile, 1, rate_hz);
  PaperPreparation preparation(1.0 / rate_hz, profile.duration_s);
  while (const auto sample = gyro.next()) preparation.add(sample->rate_radps[0]);
  EXPECT_EQ(preparation.points().size(), kPaperPoints);
  const auto m = moments(preparation.points());
  const auto c = paper_coefficients(preparation.points(), preparation.interval_s()).value();
  return {core::deg_h_from_radps(m.mean), core::deg_h_from_radps(m.standard_deviation),
          allan::angle_random_walk_deg_rth(c.angle_random_walk_rad_rts),
          core::deg_h_from_radps(c.bias_instability_radps),
          allan::rate_random_walk_deg_h_rth(c.rate_random_walk_radps_rts)};
}

// Drift alone, at 5 Hz, which is fine for what changes within minutes. Its parameters were solved
// for together with the noise's mean variance, without which B lies 1.7 % low; rounded to four
// digits (0.015 % at most, and one percent moves K by 33 %) they leave another 0.5 %.
TEST(PaperFogScenario, WithoutNoiseAllFiveFiguresAreThePapers) {
  twin::Model model = paper_fog();
  std::erase_if(model.effects, is_noise);
  const Before x = before(model, 5.0);
  EXPECT_NEAR(x.mean_deg_h, 0.3082, 0.001);
  EXPECT_NEAR(x.deviation_deg_h, 1.1204, 0.001);
  EXPECT_NEAR(x.n_deg_rth, 9.33e-4, 0.022 * 9.33e-4);
  EXPECT_NEAR(x.b_deg_h, 1.57e-2, 0.022 * 1.57e-2);
  EXPECT_NEAR(x.k_deg_h_rth, 4.49e-2, 0.022 * 4.49e-2);
}

// Over seeds 1 to 16 the standard deviations are 0.016, 0.0067 deg/h, 4.5e-5 deg/√h, 1.2e-3 deg/h
// and 7.7e-3 deg/h^1.5; 3 of each.
TEST(PaperFogScenario, TheDefaultRecordStaysWithinItsNoiseOfThePapersFigures) {
  const Before x = before(paper_fog(), 200.0);
  EXPECT_NEAR(x.mean_deg_h, 0.3082, 0.048);
  EXPECT_NEAR(x.deviation_deg_h, 1.1204, 0.020);
  EXPECT_NEAR(x.n_deg_rth, 9.33e-4, 1.35e-4);
  EXPECT_NEAR(x.b_deg_h, 1.57e-2, 3.6e-3);
  EXPECT_NEAR(x.k_deg_h_rth, 4.49e-2, 2.31e-2);
  // The model's header says so, to half a unit of its last digit.
  EXPECT_NEAR(x.mean_deg_h, 0.2849, 0.5e-4);
  EXPECT_NEAR(x.deviation_deg_h, 1.1136, 0.5e-4);
  EXPECT_NEAR(x.n_deg_rth, 8.98e-4, 0.5e-6);
  EXPECT_NEAR(x.b_deg_h, 1.49e-2, 0.5e-4);
  EXPECT_NEAR(x.k_deg_h_rth, 4.76e-2, 0.5e-4);
}

}  // namespace
}  // namespace zerodrift::comparison
