// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "common/core/units.h"
#include "common/twin/effect_catalogue.h"
#include "common/twin/flicker_noise.h"
#include "common/twin/simulation.h"
#include "tests/unit/twin/examples.h"

namespace zerodrift::twin {
namespace {

using examples::effect;
using examples::model_of;
using examples::still;

// Rates of axis x in deg/h.
std::vector<double> simulate(const std::vector<EffectSpec>& effects, const Profile& profile,
                             double rate_hz, std::uint64_t seed = 7) {
  GyroSimulation gyro(model_of(effects), profile, seed, rate_hz);
  std::vector<double> rates_deg_h;
  while (const auto sample = gyro.next()) {
    rates_deg_h.push_back(core::deg_h_from_radps(sample->rate_radps[0]));
  }
  return rates_deg_h;
}

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double variance_of(const std::vector<double>& values) {
  const double mean = mean_of(values);
  double sum = 0.0;
  for (const double value : values) sum += (value - mean) * (value - mean);
  return sum / static_cast<double>(values.size());
}

// Non-overlapping Allan variance at a cluster of m samples.
double allan_variance(const std::vector<double>& rates, std::size_t m) {
  std::vector<double> clusters;
  for (std::size_t i = 0; i + m <= rates.size(); i += m) {
    const auto begin = rates.begin() + static_cast<std::ptrdiff_t>(i);
    clusters.push_back(std::accumulate(begin, begin + static_cast<std::ptrdiff_t>(m), 0.0) /
                       static_cast<double>(m));
  }
  double sum = 0.0;
  for (std::size_t i = 1; i < clusters.size(); ++i) {
    sum += std::pow(clusters[i] - clusters[i - 1], 2.0);
  }
  return sum / (2.0 * static_cast<double>(clusters.size() - 1));
}

TEST(EffectLaws, AnEffectWithoutParametersWaitsToBeFittedAndContributesNothing) {
  for (const double rate : simulate({effect("bias", {})}, still(10.0), 10.0)) EXPECT_EQ(rate, 0.0);
}

TEST(EffectLaws, EffectsAddUpAndLeaveEachOthersRandomNumbersAlone) {
  const auto white = effect("angle_random_walk", {{"coefficient_deg_per_sqrt_h", 1e-3}});
  const auto walk = effect("rate_random_walk", {{"coefficient_deg_per_h_1_5", 0.05}});
  const auto markov = effect("markov", {{"sigma_deg_h", 0.1}, {"tau_s", 10.0}});
  const auto one = simulate({white}, still(60.0), 100.0);
  const auto others = simulate({walk, markov}, still(60.0), 100.0);
  const auto all = simulate({markov, white, walk}, still(60.0), 100.0);
  for (std::size_t i = 0; i < all.size(); ++i) {
    // Three additions of numbers of about 1 deg/h: rounding only.
    EXPECT_NEAR(all[i], one[i] + others[i], 1e-14);
  }
}

TEST(ShupeLaws, SignFlipsBetweenHeatingAndCooling) {
  const auto rates = simulate({effect("shupe", {{"coefficient_deg_h_min_per_degc", 1.0}})},
                              examples::heating_and_cooling(), 1.0);
  EXPECT_GT(rates[3000], 0.5);    // the coil heats by more than 0.5 °C/min
  EXPECT_LT(rates[11000], -0.5);  // and cools by more than that
}

TEST(CoilLagLaws, WithoutLagItIsShupeAndWithLagItComesLater) {
  const Profile profile = examples::heating_and_cooling();
  const auto shupe =
      simulate({effect("shupe", {{"coefficient_deg_h_min_per_degc", 1.0}})}, profile, 1.0);
  const auto none =
      simulate({effect("coil_lag", {{"coefficient_deg_h_min_per_degc", 1.0}, {"tau_s", 0.0}})},
               profile, 1.0);
  const auto lagged =
      simulate({effect("coil_lag", {{"coefficient_deg_h_min_per_degc", 1.0}, {"tau_s", 900.0}})},
               profile, 1.0);
  EXPECT_EQ(shupe, none);
  EXPECT_LT(lagged[1500], 0.7 * shupe[1500]);  // rising: behind
  EXPECT_GT(lagged[6000], 1.2 * shupe[6000]);  // falling: still there
}

// Against the heat equation in 200 layers between two faces of the chamber's temperature: the three
// modes kept leave 7 % of a sudden change at once, and less than 1 % a tenth of tau later.
TEST(Shupe, BetweenItsFacesACoilFollowsByConduction) {
  constexpr double kDiffusionS = 300.0;
  constexpr std::size_t kLayers = 200;
  const auto definition = *find_effect("shupe");
  EffectContext context{
      .parameters = complete_parameters(
          definition, {{"coefficient_deg_h_min_per_degc", 1.0}, {"diffusion_s", kDiffusionS}}),
      .inputs = definition.inputs,
      .axis = core::Axis::kX,
      .interval_s = 1.0,
      .noise = NoiseStream(0, "none")};
  const auto shupe = definition.make(context);
  const double unit = core::radps_from_deg_h(60.0);  // of 1 °C/s
  std::vector<double> layers(kLayers, 0.0);
  // Spacing 1/n, diffusivity 1/(pi² tau); stable below a half.
  constexpr double kStepS = 0.02;
  const double share =
      kStepS * kLayers * kLayers / (std::numbers::pi * std::numbers::pi * kDiffusionS);
  ASSERT_LT(share, 0.5);
  EffectInputs inputs;
  const auto index = static_cast<std::size_t>(definition.inputs.front());
  double faces = 0.0;
  EXPECT_EQ(shupe->step(inputs), 0.0);
  double before = 0.0;
  for (int second = 0; second < 1200; ++second) {
    const double rate = second < 600 ? 0.02 : 0.0;  // °C/s: a ramp, then a soak
    for (int step = 0; step < 50; ++step) {
      faces += rate * kStepS;
      std::vector<double> next = layers;
      for (std::size_t i = 0; i < kLayers; ++i) {
        // The faces are half a layer away from the first and the last one.
        const double left = i == 0 ? 2.0 * (faces - layers[i]) : layers[i - 1] - layers[i];
        const double right =
            i + 1 == kLayers ? 2.0 * (faces - layers[i]) : layers[i + 1] - layers[i];
        next[i] += share * (left + right);
      }
      layers = std::move(next);
    }
    const double now = mean_of(layers);
    inputs.thermal.temperature_degc[index] = faces;
    inputs.thermal.temperature_rate_degc_per_s[index] = rate;
    const double added = shupe->step(inputs) / unit;
    const int since_change = second % 600;
    const double tolerance = since_change < 30 ? 0.08 * 0.02 : 0.012 * 0.02;
    EXPECT_NEAR(added, now - before, tolerance) << second;
    before = now;
  }
}

TEST(TemperatureEffectLaws, PolynomialGradientAndProductFollowTheirEquations) {
  const Profile profile = examples::heating_and_cooling();
  const Model model =
      model_of({effect("bias_temperature",
                       {{"reference_degc", 10.0},
                        {"c1_deg_h_per_degc", 0.02},
                        {"c2_deg_h_per_degc2", 1e-3},
                        {"c3_deg_h_per_degc3", 1e-5},
                        {"c4_deg_h_per_degc4", 1e-7}},
                       core::Axis::kX),
                effect("gradient", {{"coefficient_deg_h_per_degc", 0.2}}, core::Axis::kY),
                effect("shupe_temperature",
                       {{"reference_degc", 5.0}, {"coefficient_deg_h_min_per_degc2", 0.01}},
                       core::Axis::kZ)});
  GyroSimulation gyro(model, profile, 1, 1.0);
  while (const auto sample = gyro.next()) {
    const auto& t = gyro.thermal_state().temperature_degc;
    const double coil = t[index(TemperaturePoint::kCoil)];
    const double coil_rate =
        gyro.thermal_state().temperature_rate_degc_per_s[index(TemperaturePoint::kCoil)];
    const double d = coil - 10.0;
    const double gradient =
        t[index(TemperaturePoint::kCoilOuter)] - t[index(TemperaturePoint::kCoilInner)];
    // Rounding of a few operations on values of about 1 deg/h.
    ASSERT_NEAR(core::deg_h_from_radps(sample->rate_radps[0]),
                0.02 * d + 1e-3 * d * d + 1e-5 * d * d * d + 1e-7 * d * d * d * d, 1e-13);
    ASSERT_NEAR(core::deg_h_from_radps(sample->rate_radps[1]), 0.2 * gradient, 1e-13);
    ASSERT_NEAR(core::deg_h_from_radps(sample->rate_radps[2]),
                0.01 * (coil - 5.0) * coil_rate * 60.0, 1e-13);
  }
}

TEST(EffectLaws, ANamedInputReplacesTheDefaultTemperature) {
  EffectSpec of_board = effect("shupe", {{"coefficient_deg_h_min_per_degc", 1.0}});
  of_board.inputs = {"board"};
  GyroSimulation gyro(model_of({of_board}), examples::heating_and_cooling(), 1, 1.0);
  for (int i = 0; i < 3000; ++i) {
    const auto sample = gyro.next();
    ASSERT_TRUE(sample);
    const double rate =
        gyro.thermal_state().temperature_rate_degc_per_s[index(TemperaturePoint::kBoard)];
    ASSERT_NEAR(core::deg_h_from_radps(sample->rate_radps[0]), rate * 60.0, 1e-13);
  }
}

TEST(WarmUpLaws, DecaysFromItsAmplitudeSincePowerOn) {
  Profile profile = still(2000.0);
  profile.power_on_s = 100.0;
  const auto rates =
      simulate({effect("warm_up", {{"amplitude_deg_h", 0.5}, {"tau_s", 300.0}, {"exponent", 0.7}})},
               profile, 1.0);
  EXPECT_TRUE(std::isnan(rates[99]));
  EXPECT_NEAR(rates[100], 0.5, 1e-14);
  EXPECT_NEAR(rates[400], 0.5 * std::exp(-1.0), 1e-14);
  EXPECT_NEAR(rates[1300], 0.5 * std::exp(-std::pow(4.0, 0.7)), 1e-14);
}

TEST(ScaleFactorLaws, IsProportionalToTheTrueRateOfItsAxis) {
  Profile profile = still(30.0);
  profile.turns = {
      {.start_s = 10.0, .duration_s = 10.0, .axis = core::Axis::kX, .rate_radps = 0.5}};
  GyroSimulation gyro(model_of({effect("scale_factor", {{"error_ppm", 200.0}})}), profile, 1, 10.0);
  while (const auto sample = gyro.next()) {
    EXPECT_DOUBLE_EQ(sample->rate_radps[0], gyro.true_rate_radps()[0] * (1.0 + 200e-6));
  }
}

TEST(AngleRandomWalkLaws, ItsCoefficientComesBackFromTheVariance) {
  constexpr double kN = 9.33e-4;  // deg/√h
  const auto rates = simulate({effect("angle_random_walk", {{"coefficient_deg_per_sqrt_h", kN}})},
                              still(2000.0), 100.0);
  const double recovered = std::sqrt(variance_of(rates) * 0.01) / 60.0;
  // n = 2e5: relative sampling error of a standard deviation 1/√(2n) = 0.16 %; 5 sigma.
  EXPECT_NEAR(recovered / kN, 1.0, 0.008);
  // White: slope -1/2 in the Allan deviation; 2000 clusters: 1/√(2000) 2.2 % of the variance.
  EXPECT_NEAR(allan_variance(rates, 100) / (variance_of(rates) / 100.0), 1.0, 5.0 * 0.03);
}

TEST(RateRandomWalkLaws, ItsCoefficientComesBackFromTheIncrements) {
  constexpr double kK = 4.49e-2;  // deg/h^1.5
  const auto walk = effect("rate_random_walk", {{"coefficient_deg_per_h_1_5", kK}});
  const auto rates = simulate({walk}, still(20000.0), 10.0);
  EXPECT_EQ(rates.front(), 0.0);
  double squares = 0.0;
  for (std::size_t i = 1; i < rates.size(); ++i) squares += std::pow(rates[i] - rates[i - 1], 2.0);
  // The whole walk's squared increments: K² T, T = 20000 s less one sample. n = 2e5, 5 sigma.
  const double hours = 19999.9 / 3600.0;
  EXPECT_NEAR(std::sqrt(squares / hours) / kK, 1.0, 0.008);
  // The Allan variance at 50 s is K² tau/3 for independent increments: 400 clusters, 5 sigma of
  // √(2 * 1.5/400).
  const double expected = kK * kK * (50.0 / 3600.0) / 3.0;
  EXPECT_NEAR(allan_variance(rates, 500) / expected, 1.0, 5.0 * 0.087);
}

TEST(BiasInstabilityLaws, TheAllanDeviationIsFlatWithinTwoPercentOverTheStatedRange) {
  const FlickerNoiseOptions options{.bias_instability = 1.0};
  const FlickerNoise flicker(options, 0.005, NoiseStream(1, "flicker"));
  const double flat = std::sqrt(2.0 * std::numbers::ln2 / std::numbers::pi);
  for (double tau_s = 32.0 * options.shortest_correlation_s;
       tau_s <= options.longest_correlation_s / 16.0; tau_s *= 1.3) {
    EXPECT_NEAR(std::sqrt(flicker.allan_variance(tau_s)) / flat, 1.0, 0.02) << tau_s << " s";
  }
}

TEST(BiasInstabilityLaws, SimulatedAllanVarianceIsTheClosedForm) {
  FlickerNoise flicker({.bias_instability = 1.0}, 0.1, NoiseStream(3, "flicker"));
  std::vector<double> values;
  for (std::uint64_t i = 0; i < 400'000; ++i) values.push_back(flicker.step(i));
  // Clusters of 2 s, 10 s, 50 s: 20000, 4000, 800 of them. Relative sampling error of the variance
  // about √(2.3/n); 5 sigma. Holding each process for 1/16 of its correlation time costs less.
  for (const std::size_t m : {20U, 100U, 500U}) {
    const double n = 400'000.0 / static_cast<double>(m);
    const double expected = flicker.allan_variance(static_cast<double>(m) * 0.1);
    EXPECT_NEAR(allan_variance(values, m) / expected, 1.0, 5.0 * std::sqrt(2.3 / n)) << m;
  }
}

TEST(MarkovLaws, IsStationaryWithItsVarianceAndCorrelation) {
  const auto values =
      simulate({effect("markov", {{"sigma_deg_h", 0.3}, {"tau_s", 5.0}})}, still(100'000.0), 2.0);
  // 100000 s hold T/(2 tau) = 1e4 independent values: √(2/1e4) = 1.4 % on the variance; 5 sigma.
  EXPECT_NEAR(variance_of(values) / 0.09, 1.0, 0.07);
  double lagged = 0.0;
  for (std::size_t i = 10; i < values.size(); ++i) lagged += values[i] * values[i - 10];
  const double correlation = lagged / static_cast<double>(values.size() - 10) / 0.09;
  EXPECT_NEAR(correlation, std::exp(-1.0), 0.07);
}

TEST(QuantizationLaws, CountsWholeStepsAndLosesNoAngle) {
  const auto bias = effect("bias", {{"bias_deg_h", 1.7}});
  const auto counts = effect("quantization", {{"step_arcsec", 0.5}});
  const auto rates = simulate({counts, bias}, still(1000.0), 10.0);
  double angle_arcsec = 0.0;  // 1 deg/h is 1 arcsec/s
  for (const double rate_deg_h : rates) {
    const double steps = rate_deg_h * 0.1 / 0.5;
    ASSERT_NEAR(steps, std::round(steps), 1e-9);
    angle_arcsec += rate_deg_h * 0.1;
  }
  // 1000 s at 1.7 arcsec/s, at most half a step waits.
  EXPECT_NEAR(angle_arcsec, 1700.0, 0.25 + 1e-6);
}

TEST(RateRampLaws, IsLinearPlusLogarithmicSincePowerOn) {
  const auto rates = simulate(
      {effect("rate_ramp",
              {{"ramp_deg_per_h2", 0.36}, {"logarithm_deg_h", 0.1}, {"logarithm_tau_s", 100.0}})},
      still(1000.0), 1.0);
  EXPECT_NEAR(rates[500], 0.05 + 0.1 * std::log(6.0), 1e-14);
}

TEST(LineLaws, HasItsAmplitudeAveragedOverTheInterval) {
  const auto rates = simulate({effect("line", {{"amplitude_deg_h", 0.2}, {"frequency_hz", 1.0}})},
                              still(100.0), 8.0);
  const double attenuation = std::sin(std::numbers::pi / 8.0) / (std::numbers::pi / 8.0);
  // Whole periods: the mean square is half the squared amplitude up to rounding.
  EXPECT_NEAR(variance_of(rates), std::pow(0.2 * attenuation, 2.0) / 2.0, 1e-13);
}

}  // namespace
}  // namespace zerodrift::twin
