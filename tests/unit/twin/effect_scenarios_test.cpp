// SPDX-License-Identifier: Apache-2.0
// Single effects on inputs for which what they add is known in closed form. Rates in deg/h.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "common/core/units.h"
#include "tests/support/relays.h"
#include "tests/unit/twin/examples.h"
#include "tests/unit/twin/excited_inputs.h"

namespace zerodrift::twin {
namespace {

using examples::effect;
using examples::excited_record;
using std::numbers::pi;

std::vector<double> run_deg_h(const EffectSpec& spec, const std::vector<EffectInputs>& record,
                              double interval_s) {
  std::vector<double> added = examples::run(spec, record, interval_s);
  for (double& rate : added) rate = core::deg_h_from_radps(rate);
  return added;
}

// A record in which all points have these temperatures, straight between samples.
std::vector<EffectInputs> at_temperatures(const std::vector<double>& temperatures_degc) {
  std::vector<EffectInputs> record(temperatures_degc.size());
  for (std::size_t i = 0; i < record.size(); ++i) {
    record[i].sample = i;
    record[i].thermal.temperature_degc.fill(temperatures_degc[i]);
  }
  return record;
}

// A record of rates about x, one a second, switched on at its start.
std::vector<EffectInputs> at_rates(const std::vector<double>& rates_radps) {
  std::vector<EffectInputs> record(rates_radps.size());
  for (std::size_t i = 0; i < record.size(); ++i) {
    record[i].sample = i;
    record[i].since_power_on_s = static_cast<double>(i + 1);
    record[i].true_rate_radps[0] = rates_radps[i];
    record[i].rate_radps = rates_radps[i];
  }
  return record;
}

double temperature(const EffectInputs& inputs, TemperaturePoint point) {
  return inputs.thermal.temperature_degc[index(point)];
}

double temperature_rate(const EffectInputs& inputs, TemperaturePoint point) {
  return inputs.thermal.temperature_rate_degc_per_s[index(point)];
}

// Effects without memory: what each adds is a formula in the inputs of the same sample.
struct Memoryless {
  EffectSpec spec;
  std::function<double(const EffectInputs&)> expected_deg_h;
};

std::vector<Memoryless> memoryless_effects() {
  const auto rate_deg_h = [](const EffectInputs& i, std::size_t axis) {
    return core::deg_h_from_radps(i.true_rate_radps[axis]);
  };
  const auto coil = [](const EffectInputs& i) { return temperature(i, TemperaturePoint::kCoil); };
  return {
      {effect("scale_factor_temperature", {{"error_ppm_per_degc", 3.0}, {"reference_degc", 20.0}}),
       [=](const EffectInputs& i) { return 3e-6 * rate_deg_h(i, 0) * (coil(i) - 20.0); }},
      {effect("scale_factor_nonlinearity", {{"error_ppm", 40.0}, {"at_deg_s", 180.0 / pi}}),
       [=](const EffectInputs& i) {
         return 40e-6 * rate_deg_h(i, 0) * std::pow(i.true_rate_radps[0], 2.0);
       }},
      {effect("scale_factor_asymmetry", {{"error_ppm", 5.0}}, core::Axis::kY),
       [=](const EffectInputs& i) { return 5e-6 * std::abs(rate_deg_h(i, 1)); }},
      {effect("misalignment", {{"next_axis_urad", 30.0}, {"last_axis_urad", -70.0}},
              core::Axis::kY),
       [=](const EffectInputs& i) { return 30e-6 * rate_deg_h(i, 2) - 70e-6 * rate_deg_h(i, 0); }},
      {effect("dead_band", {{"half_width_deg_h", 0.1}}),
       [=](const EffectInputs& i) {
         return std::abs(rate_deg_h(i, 0)) < 0.1 ? -rate_deg_h(i, 0) : 0.0;
       }},
      {effect("vibration_rectification", {{"coefficient_deg_h_per_g2", 0.02}}),
       [](const EffectInputs& i) { return 0.02 * i.vibration_g * i.vibration_g; }},
      {effect("acceleration_sensitivity",
              {{"x_deg_h_per_g", 0.1}, {"y_deg_h_per_g", -0.2}, {"z_deg_h_per_g", 0.3}}),
       [](const EffectInputs& i) {
         const auto& a = i.acceleration_mps2;
         return (0.1 * a[0] - 0.2 * a[1] + 0.3 * a[2]) / 9.80665;
       }},
      {effect("magnetic",
              {{"x_deg_h_per_ut", 1e-3}, {"y_deg_h_per_ut", 2e-3}, {"z_deg_h_per_ut", -3e-3}}),
       [](const EffectInputs& i) {
         return 1e-3 * i.magnetic_ut[0] + 2e-3 * i.magnetic_ut[1] - 3e-3 * i.magnetic_ut[2];
       }},
      {effect("source_intensity", {{"coefficient_deg_h_per_ma", 0.03}, {"reference_ma", 90.0}}),
       [](const EffectInputs& i) { return 0.03 * (i.source_current_ma - 90.0); }},
      {effect("etalon_fringe", {{"sine_deg_h", 0.02},
                                {"cosine_deg_h", 0.01},
                                {"period_degc", 4.0},
                                {"reference_degc", 10.0}}),
       [=](const EffectInputs& i) {
         const double phase = 2.0 * pi * (coil(i) - 10.0) / 4.0;
         return 0.02 * std::sin(phase) + 0.01 * std::cos(phase);
       }},
      {effect("sensor_lag", {{"delay_s", 8.0},
                             {"reference_degc", 15.0},
                             {"c1_deg_h_per_degc", 0.02},
                             {"c2_deg_h_per_degc2", 1e-3},
                             {"c3_deg_h_per_degc3", 1e-5},
                             {"c4_deg_h_per_degc4", 1e-7}}),
       [=](const EffectInputs& i) {
         const double d = coil(i) - 15.0;
         return 8.0 * (0.02 + 2e-3 * d + 3e-5 * d * d + 4e-7 * d * d * d) *
                temperature_rate(i, TemperaturePoint::kCoil);
       }},
  };
}

// Law: what a late thermometer makes of a bias and of a Shupe effect that read it is sensor_lag of
// both, to first order. Of the bias alone less than half of it would be there.
TEST(SensorLagScenario, IsWhatBiasAndShupeMissOfALateThermometer) {
  constexpr std::size_t kDelayS = 8;
  const std::map<std::string, double> bias{
      {"reference_degc", 15.0}, {"c1_deg_h_per_degc", 0.02}, {"c2_deg_h_per_degc2", 2e-4}};
  const std::map<std::string, double> of_shupe{{"coefficient_deg_h_min_per_degc", 0.5}};
  std::map<std::string, double> lag{{"delay_s", kDelayS}, {"lag_s", 20.0}};
  lag.insert(bias.begin(), bias.end());
  const auto alone = effect("sensor_lag", lag);
  lag.insert(of_shupe.begin(), of_shupe.end());
  const auto record = excited_record(6000, 1.0);
  std::vector<double> missed = run_deg_h(effect("bias_temperature", bias), record, 1.0);
  const auto rates = run_deg_h(effect("shupe", of_shupe), record, 1.0);
  for (std::size_t i = 0; i < missed.size(); ++i) missed[i] += rates[i];
  const auto added = run_deg_h(effect("sensor_lag", lag), record, 1.0);
  const auto of_bias = run_deg_h(alone, record, 1.0);
  double largest = 0.0;
  double error = 0.0;
  double without = 0.0;
  for (std::size_t i = 200; i < record.size(); ++i) {
    const double late = missed[i] - missed[i - kDelayS];
    largest = std::max(largest, std::abs(late));
    error = std::max(error, std::abs(added[i] - late));
    without = std::max(without, std::abs(of_bias[i] - late));
  }
  EXPECT_LT(error, 0.06 * largest);
  EXPECT_GT(without, 0.5 * largest);
  lag["lag_s"] = 0.0;  // a second derivative of what a thermometer says is noise
  const auto at_once = run_deg_h(effect("sensor_lag", lag), record, 1.0);
  lag.erase("coefficient_deg_h_min_per_degc");
  EXPECT_EQ(at_once, run_deg_h(effect("sensor_lag", lag), record, 1.0));
}

TEST(MemorylessEffectScenario, EachFollowsItsEquation) {
  const auto record = excited_record(1000, 1.0);
  for (const Memoryless& one : memoryless_effects()) {
    const auto added = run_deg_h(one.spec, record, 1.0);
    double largest = 0.0;
    for (const double value : added) largest = std::max(largest, std::abs(value));
    ASSERT_GT(largest, 0.0) << one.spec.kind;
    for (std::size_t i = 0; i < record.size(); ++i) {
      // Rounding of about ten operations, and of a phase of up to 60 rad for the fringe.
      ASSERT_NEAR(added[i], one.expected_deg_h(record[i]), 1e-13 * largest)
          << one.spec.kind << ", sample " << i;
    }
  }
}

TEST(LagScenario, AHeldInputGivesTheSameAtAnyInterval) {
  const EffectSpec spec =
      effect("coil_lag", {{"coefficient_deg_h_min_per_degc", 1.0}, {"tau_s", 40.0}});
  std::vector<EffectInputs> coarse = excited_record(300, 1.0);
  std::vector<EffectInputs> fine;
  for (const EffectInputs& inputs : coarse) fine.insert(fine.end(), 10, inputs);
  const auto at_1_s = run_deg_h(spec, coarse, 1.0);
  const auto at_100_ms = run_deg_h(spec, fine, 0.1);
  for (std::size_t i = 0; i < at_1_s.size(); ++i) {
    // Ten exact steps of 0.1 s are one of 1 s: rounding only.
    ASSERT_NEAR(at_1_s[i], at_100_ms[10 * i + 9], 1e-13) << i;
  }
}

TEST(GradientRateScenario, GivesTheRateOfTheGradientAndTheChangeOfTheTemperatureRate) {
  constexpr double kInterval = 1.0;
  constexpr double kAcceleration = 1e-5;  // °C/s²
  std::vector<EffectInputs> record(1000);
  for (std::size_t i = 0; i < record.size(); ++i) {
    const double rate = kAcceleration * static_cast<double>(i) * kInterval;
    record[i].thermal.temperature_rate_degc_per_s[index(TemperaturePoint::kCoilOuter)] =
        rate + 0.002;
    record[i].thermal.temperature_rate_degc_per_s[index(TemperaturePoint::kCoilInner)] =
        rate - 0.001;
  }
  const auto gradient =
      run_deg_h(effect("gradient_rate", {{"gradient_deg_h_min_per_degc", 2.0}}), record, kInterval);
  const auto curvature = run_deg_h(effect("gradient_rate", {{"gradient_deg_h_min_per_degc", 0.0},
                                                            {"curvature_deg_h_min2_per_degc", 5.0},
                                                            {"smoothing_s", 30.0}}),
                                   record, kInterval);
  for (const double value : gradient) ASSERT_NEAR(value, 2.0 * 0.003 * 60.0, 1e-13);
  EXPECT_EQ(curvature.front(), 0.0);
  // 970 s are 32 smoothing times: what is left of the start is exp(-32) of it. Differences of
  // rates of 0.01 with 16 digits: 1e-18 a sample, 2e-14 in deg/h.
  EXPECT_NEAR(curvature.back(), 5.0 * kAcceleration * 3600.0, 1e-12);
}

// Nine play operators of thresholds 4 °C * 2^(i/2), i from -4 to 4, one after the other.
TEST(HysteresisScenario, IsTheSumOfItsOperatorsOverTheTwoBranches) {
  const auto g = [](double x) { return 0.02 * x - 0.003 * x * x + 0.0004 * x * x * x; };
  // From 10 °C up to 50 °C every operator is drawn along; on the way from there down to 30 °C the
  // wide ones stand still.
  double up = 0.0;
  double down = 0.0;
  double weights = 0.0;
  for (int i = -4; i <= 4; ++i) {
    const double r = 4.0 * std::pow(2.0, 0.5 * i);
    const double weight = r * std::exp(-r / 4.0);
    weights += weight;
    up += weight * g(35.0 - r);
    down += weight * g(std::min(35.0 - r, 15.0 + r));
  }
  for (const double share : {0.0, 1.0}) {
    const auto added = run_deg_h(effect("hysteresis", {{"k1_deg_h_per_degc", 0.02},
                                                       {"k2_deg_h_per_degc2", -0.003},
                                                       {"k3_deg_h_per_degc3", 0.0004},
                                                       {"reference_degc", 15.0},
                                                       {"typical_threshold_degc", 4.0},
                                                       {"anhysteretic_share", share}}),
                                 at_temperatures({10.0, 50.0, 30.0}), 1.0);
    EXPECT_NEAR(added[0], share * g(-5.0), 1e-15);
    EXPECT_NEAR(added[1], up / weights - (1.0 - share) * g(35.0), 1e-12);
    EXPECT_NEAR(added[2], down / weights - (1.0 - share) * g(15.0), 1e-12);
  }
}

TEST(HysteresisScenario, TheLoopIsOpenAndDoesNotDependOnTheRate) {
  const EffectSpec spec = effect("hysteresis", {{"k1_deg_h_per_degc", 0.01},
                                                {"k2_deg_h_per_degc2", 0.001},
                                                {"k3_deg_h_per_degc3", -0.0001}});
  const auto cycle = [](int steps) {  // two cycles between 0 and 20 °C, `steps` a leg
    std::vector<double> temperatures;
    for (int i = 0; i <= 4 * steps; ++i) {
      const double leg = static_cast<double>(i % (2 * steps)) / steps;
      temperatures.push_back(20.0 * (leg <= 1.0 ? leg : 2.0 - leg));
    }
    return temperatures;
  };
  const auto fast = run_deg_h(spec, at_temperatures(cycle(40)), 1.0);
  const auto slow = run_deg_h(spec, at_temperatures(cycle(160)), 1.0);
  for (std::size_t i = 0; i < fast.size(); ++i) ASSERT_NEAR(fast[i], slow[4 * i], 1e-13) << i;
  EXPECT_GT(std::abs(fast[100] - fast[140]), 0.01);  // 10 °C, up against down
  EXPECT_NEAR(fast[80], fast[160], 1e-13);           // 0 °C again: closed
}

// What the powers are for: relays at temperatures that only a part of the range has. With k1 alone
// the operators are the same at all temperatures.
TEST(HysteresisScenario, FollowsRelaysOfOnePartOfTheRange) {
  std::vector<double> temperatures;
  for (const double level : {20.0, 55.0, -5.0, 40.0, 10.0, 50.0, 25.0, 0.0, 30.0}) {
    const double from = temperatures.empty() ? level : temperatures.back();
    for (int i = 1; i <= 100; ++i) temperatures.push_back(from + (level - from) * i / 100.0);
  }
  const auto vector_of = [](const std::vector<double>& values) {
    return Eigen::VectorXd(
        Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size())));
  };
  const Eigen::VectorXd wave = vector_of(test::relays(400, temperatures, 22.0, 8.0, 7.0, 7));
  const auto column = [&](const std::string& amplitude) {
    twin::Parameters parameters{{"k1_deg_h_per_degc", 0.0}, {"typical_threshold_degc", 6.0}};
    parameters[amplitude] = 1.0;
    return vector_of(
        run_deg_h(effect("hysteresis", parameters), at_temperatures(temperatures), 1.0));
  };
  const auto left_by = [&](std::initializer_list<std::string> amplitudes) {
    Eigen::MatrixXd columns(wave.size(), 4);
    for (Eigen::Index k = 0; k < wave.size(); ++k) {
      const double d = (temperatures[static_cast<std::size_t>(k)] - 25.0) / 30.0;
      columns.row(k) << 1.0, d, d * d, d * d * d;
    }
    const double without =
        (wave - columns * columns.colPivHouseholderQr().solve(wave)).squaredNorm();
    for (const std::string& amplitude : amplitudes) {
      columns.conservativeResize(Eigen::NoChange, columns.cols() + 1);
      columns.rightCols(1) = column(amplitude).normalized();
    }
    return (wave - columns * columns.colPivHouseholderQr().solve(wave)).squaredNorm() / without;
  };
  EXPECT_GT(left_by({"k1_deg_h_per_degc"}), 0.15);
  EXPECT_LT(left_by({"k1_deg_h_per_degc", "k2_deg_h_per_degc2", "k3_deg_h_per_degc3"}), 0.05);
}

TEST(TemperatureStepScenario, SwitchesAboveAndBelowWithItsWidth) {
  const EffectSpec spec =
      effect("temperature_step",
             {{"amplitude_deg_h", 0.2}, {"threshold_degc", 24.0}, {"width_degc", 1.0}});
  const auto added =
      run_deg_h(spec, at_temperatures({20.0, 24.4, 24.6, 24.0, 23.6, 23.4, 24.0, 24.4, 24.6}), 1.0);
  const std::vector<double> expected{0.0, 0.0, 0.2, 0.2, 0.2, 0.0, 0.0, 0.0, 0.2};
  for (std::size_t i = 0; i < added.size(); ++i) EXPECT_NEAR(added[i], expected[i], 1e-15) << i;
  // Within the width it starts on the side of the threshold it is on.
  EXPECT_NEAR(run_deg_h(spec, at_temperatures({24.1}), 1.0)[0], 0.2, 1e-15);
  EXPECT_EQ(run_deg_h(spec, at_temperatures({23.9}), 1.0)[0], 0.0);
}

TEST(BiasStepScenario, ShiftsOnceAndStaysWithTheMeanOfItsInterval) {
  const EffectSpec spec = effect("bias_step", {{"amplitude_deg_h", -0.3}, {"at_s", 2.25}});
  std::vector<EffectInputs> record(5);
  for (std::size_t i = 0; i < record.size(); ++i) {
    record[i].sample = i;
    record[i].time_s = static_cast<double>(i + 1);
  }
  const auto added = run_deg_h(spec, record, 1.0);
  const std::vector<double> expected{0.0, 0.0, 0.75 * -0.3, -0.3, -0.3};
  for (std::size_t i = 0; i < added.size(); ++i) EXPECT_NEAR(added[i], expected[i], 1e-15) << i;
}

TEST(ModulatorResetScenario, AveragesTheFringeOverEachInterval) {
  const double reset_rad = 5.0 * core::kRadPerDeg / 3600.0;
  const EffectSpec spec = effect(
      "modulator_reset",
      {{"error_ppm", 30.0}, {"sine_deg_h", 0.04}, {"cosine_deg_h", 0.03}, {"angle_arcsec", 5.0}});
  const std::vector<double> rates{0.3 * reset_rad, 1.7 * reset_rad, -0.9 * reset_rad, 0.0};
  const auto added = run_deg_h(spec, at_rates(rates), 1.0);
  double phase = 0.0;
  for (std::size_t i = 0; i < rates.size(); ++i) {
    constexpr int kParts = 10'000;
    double mean = 0.0;
    for (int part = 0; part < kParts; ++part) {
      const double angle = phase + 2.0 * pi * rates[i] / reset_rad * (part + 0.5) / kParts;
      mean += (0.04 * std::sin(angle) + 0.03 * std::cos(angle)) / kParts;
    }
    phase += 2.0 * pi * rates[i] / reset_rad;
    // Midpoint rule: (10.7 rad/1e4)²/24 = 5e-8 of 0.05 deg/h.
    EXPECT_NEAR(added[i], 30e-6 * core::deg_h_from_radps(rates[i]) + mean, 1e-8) << i;
  }
  // The ramp starts anew at each power-on.
  auto twice = at_rates(rates);
  const auto again = at_rates(rates);
  twice.push_back(at_rates({0.4 * reset_rad}).front());
  twice.back().since_power_on_s = 0.0;
  twice.insert(twice.end(), again.begin(), again.end());
  const auto second = run_deg_h(spec, twice, 1.0);
  for (std::size_t i = 0; i < rates.size(); ++i)
    EXPECT_NEAR(second[rates.size() + 1 + i], added[i], 1e-12) << i;
  // Whole resets within an interval average out.
  const auto whole = run_deg_h(spec, at_rates({3.0 * reset_rad}), 1.0);
  EXPECT_NEAR(whole[0], 30e-6 * 15.0, 1e-12);
}

TEST(TelegraphScenario, KnowsTwoLevelsAndStaysAsLongAsItsDwellTimesSay) {
  const EffectSpec spec =
      effect("telegraph", {{"amplitude_deg_h", 0.4}, {"up_s", 30.0}, {"down_s", 10.0}});
  const auto added = run_deg_h(spec, at_rates(std::vector<double>(400'000, 0.0)), 1.0);
  double up = 0.0;
  double leaves = 0.0;
  for (std::size_t i = 0; i < added.size(); ++i) {
    ASSERT_NEAR(std::abs(added[i]), 0.2, 1e-14);
    if (added[i] > 0.0) up += 1.0;
    if (i > 0 && added[i] < 0.0 && added[i - 1] > 0.0) leaves += 1.0;
  }
  // 400 000 s hold T/(2 * 7.5 s) = 27 000 independent values: √(3/16/27000) = 0.0026; 5 sigma.
  EXPECT_NEAR(up / 400'000.0, 0.75, 0.013);
  // Left with probability (1/4) (1 - exp(-1/7.5)) a second up; 9360 times expected, counted to
  // about 1/√9360 = 1 %; 5 sigma.
  EXPECT_NEAR(leaves / up / (0.25 * -std::expm1(-1.0 / 7.5)), 1.0, 0.05);
}

TEST(SpikesScenario, ComeAsOftenAndAsHighAsTheyShould) {
  const EffectSpec spec = effect("spikes", {{"deviation_deg_h", 10.0}, {"spikes_per_h", 36.0}});
  const auto added = run_deg_h(spec, at_rates(std::vector<double>(400'000, 0.0)), 1.0);
  double count = 0.0;
  double squares = 0.0;
  for (const double value : added) {
    count += value != 0.0 ? 1.0 : 0.0;
    squares += value * value;
  }
  // 1 - exp(-0.01) = 0.00995 a sample: 3980 expected, ± 63; 5 sigma.
  EXPECT_NEAR(count, 3980.0, 5.0 * 63.0);
  EXPECT_NEAR(std::sqrt(squares / count), 10.0, 5.0 * 10.0 / std::sqrt(2.0 * 3980.0));
}

TEST(SaturationScenario, CutsTheTotalAndSaysSo) {
  const auto saturation =
      make_effect(effect("saturation", {{"limit_deg_s", 180.0 / pi}}), 1.0, NoiseStream(1, ""));
  EffectInputs inputs;
  const auto total = [&](double rate) {
    inputs.rate_radps = rate;
    return rate + saturation->step(inputs);
  };
  EXPECT_EQ(total(0.5), 0.5);
  EXPECT_EQ(saturation->status(), SampleStatus::kMeasured);
  EXPECT_DOUBLE_EQ(total(-7.0), -1.0);
  EXPECT_EQ(saturation->status(), SampleStatus::kClipped);
  EXPECT_EQ(total(-0.9), -0.9);
  EXPECT_EQ(saturation->status(), SampleStatus::kMeasured);
}

TEST(DroppedSamplesScenario, LosesItsShareInBurstsOfItsLength) {
  const auto dropped =
      make_effect(effect("dropped_samples", {{"share", 0.1}, {"mean_burst_s", 4.0}}), 0.5,
                  NoiseStream(1, "dropped"));
  double lost = 0.0;
  double bursts = 0.0;
  SampleStatus previous = SampleStatus::kMeasured;
  EffectInputs inputs;
  for (; inputs.sample < 400'000; ++inputs.sample) {
    EXPECT_EQ(dropped->step(inputs), 0.0);
    const SampleStatus status = dropped->status();
    lost += status == SampleStatus::kLost ? 1.0 : 0.0;
    bursts += status == SampleStatus::kLost && previous != status ? 1.0 : 0.0;
    previous = status;
  }
  // 400 000 samples of share 0.1 correlated over about 8: √(0.09 * 15/4e5) = 0.0018; 5 sigma.
  EXPECT_NEAR(lost / 400'000.0, 0.1, 0.009);
  // Geometric bursts of mean 8, deviation 7.5, about 5000 of them: 0.11; 5 sigma.
  EXPECT_NEAR(lost / bursts, 8.0, 0.55);
}

TEST(ClockOffsetScenario, ShowsTheRateOfEarlier) {
  constexpr double kInterval = 0.5;
  constexpr double kSlope = 0.01;  // rad/s²
  std::vector<double> rates;
  for (int i = 0; i < 100; ++i) rates.push_back(kSlope * kInterval * i);
  // Within an interval, over several intervals, none, and stamped early: -delta dW/dt on a ramp.
  for (const double delay_s : {0.2, 0.5, 3.7, 0.0, -0.3}) {
    const auto added =
        examples::run(effect("clock_offset", {{"delay_s", delay_s}}), at_rates(rates), kInterval);
    EXPECT_EQ(added[0], 0.0) << delay_s;
    for (std::size_t i = 10; i < added.size(); ++i) {
      ASSERT_NEAR(added[i], -kSlope * delay_s, 1e-15) << delay_s << " s, sample " << i;
    }
  }
}

TEST(LineScenario, InPhaseAndQuadratureReplaceThePhase) {
  const auto record = excited_record(500, 1.0);
  const auto phase = run_deg_h(
      effect("line", {{"amplitude_deg_h", 0.2}, {"frequency_hz", 0.03}, {"phase_rad", 0.8}}),
      record, 1.0);
  const auto quadrature = run_deg_h(effect("line", {{"amplitude_deg_h", 0.2 * std::cos(0.8)},
                                                    {"quadrature_deg_h", 0.2 * std::sin(0.8)},
                                                    {"frequency_hz", 0.03}}),
                                    record, 1.0);
  for (std::size_t i = 0; i < phase.size(); ++i) ASSERT_NEAR(phase[i], quadrature[i], 1e-15);
}

}  // namespace
}  // namespace zerodrift::twin
