// SPDX-License-Identifier: Apache-2.0
// The shipped model and profiles are what their comments say.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "common/config/compensation_config.h"
#include "common/config/twin_config.h"
#include "common/core/units.h"
#include "common/twin/effect_catalogue.h"
#include "common/twin/simulation.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::config {
namespace {

std::filesystem::path shipped(const std::string& name) {
  return std::filesystem::path(ZERODRIFT_SOURCE_DIR) / "config" / name;
}

struct Statistics {
  double mean = 0.0;
  double deviation = 0.0;
};

// Of the moving average over `window` values.
Statistics smoothed_statistics(const std::vector<double>& values, std::size_t window) {
  double sum = 0.0;
  double total = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    sum += values[i] - (i >= window ? values[i - window] : 0.0);
    if (i + 1 < window) continue;
    const double mean = sum / static_cast<double>(window);
    total += mean;
    squares += mean * mean;
  }
  const auto n = static_cast<double>(values.size() - window + 1);
  return {total / n, std::sqrt(squares / n - std::pow(total / n, 2.0))};
}

std::vector<double> axis_x_deg_h(const twin::Model& model, std::uint64_t seed, double rate_hz) {
  const auto profile = load_profile(shipped("profiles/paper_chamber.yaml"));
  twin::GyroSimulation gyro(model, profile, seed, rate_hz);
  std::vector<double> rates;
  while (const auto sample = gyro.next()) {
    rates.push_back(core::deg_h_from_radps(sample->rate_radps[0]));
  }
  return rates;
}

TEST(PaperFogScenario, DeterministicDriftOfAxisXHasThePapersMeanAndDeviation) {
  twin::Model model = load_model(shipped("models/paper_fog.yaml")).model;
  std::erase_if(model.effects, [](const twin::EffectSpec& effect) {
    return effect.kind == "angle_random_walk" || effect.kind == "bias_instability" ||
           effect.kind == "rate_random_walk";
  });
  const auto x = smoothed_statistics(axis_x_deg_h(model, 1, 10.0), 600);
  // Table 1: mean 0.3082, standard deviation 1.1204 deg/h. The parameters have four digits, which
  // moves either by less than 0.001.
  EXPECT_NEAR(x.mean, 0.3082, 0.001);
  EXPECT_NEAR(x.deviation, 1.1204, 0.001);
}

TEST(PaperFogScenario, WithNoiseEverySeedStaysCloseToThePapersTable) {
  const twin::Model model = load_model(shipped("models/paper_fog.yaml")).model;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const auto x = smoothed_statistics(axis_x_deg_h(model, seed, 10.0), 600);
    // Standard deviation of a record's mean: random walk K √(T/3) = 0.0157 √(5/3) = 0.0203, slow
    // flicker about 0.004, together 0.0207 deg/h; 4 sigma. Of its deviation: K √T/√6 correlated
    // with the drift's shape, below 0.0144; 3 sigma.
    EXPECT_NEAR(x.mean, 0.3082, 0.083) << "seed " << seed;
    EXPECT_NEAR(x.deviation, 1.1204, 0.043) << "seed " << seed;
  }
}

// Table 3, row "Online-SVR": what the paper's best compensation leaves.
TEST(PaperFogScenario, NoiseOfAxisXIsWhatThePapersCompensationLeaves) {
  const twin::Model model = load_model(shipped("models/paper_fog.yaml")).model;
  const auto parameter = [&model](const std::string& kind, const std::string& name) {
    const auto found =
        std::find_if(model.effects.begin(), model.effects.end(), [&kind](const auto& effect) {
          return effect.kind == kind && effect.axis == core::Axis::kX;
        });
    return found->parameters.at(name);
  };
  EXPECT_EQ(parameter("angle_random_walk", "coefficient_deg_per_sqrt_h"), 2.21e-4);
  EXPECT_EQ(parameter("bias_instability", "coefficient_deg_h"), 1.81e-3);
  EXPECT_EQ(parameter("rate_random_walk", "coefficient_deg_per_h_1_5"), 1.57e-2);
}

TEST(PaperFogScenario, EveryProbeReads) {
  const twin::Model model = load_model(shipped("models/paper_fog.yaml")).model;
  const auto profile = load_profile(shipped("profiles/paper_chamber.yaml"));
  for (const char* name : {"coil", "coil_inner", "coil_outer", "case", "board"}) {
    twin::ThermometerSimulation thermometer(model, profile, 1, name);
    // Soaked at -15 °C; 5 sigma of the noisiest probe and half its step.
    EXPECT_NEAR(thermometer.next()->temperature_degc, -15.0, 0.14) << name;
  }
}

TEST(TurnsScenario, TheProfileIsThePapersWithTwoTurns) {
  const auto paper = load_profile(shipped("profiles/paper_chamber.yaml"));
  const auto turns = load_profile(shipped("profiles/turns.yaml"));
  EXPECT_EQ(turns.duration_s, paper.duration_s);
  for (double t = 0.0; t < paper.duration_s; t += 100.0) {
    EXPECT_EQ(chamber_temperature_degc(turns, t), chamber_temperature_degc(paper, t));
  }
  ASSERT_EQ(turns.turns.size(), 2U);
  EXPECT_DOUBLE_EQ(turns.turns[0].rate_radps, 10.0 * core::kRadPerDeg);
  EXPECT_DOUBLE_EQ(turns.turns[1].rate_radps, 0.1 * core::kRadPerDeg);
}

// In the second from that time on, whichever way.
double turned_rad(const twin::Profile& profile, double time_s) {
  double angle_rad = 0.0;
  for (const twin::Turn& turn : profile.turns) {
    angle_rad +=
        std::abs(twin::turned_angle_rad(turn, time_s + 1.0) - twin::turned_angle_rad(turn, time_s));
  }
  return angle_rad;
}

// Rule: a profile of stops has them as often and as long as its name and comment say, after five
// minutes at rest, and between two of them no second goes straight on.
TEST(DriveWithStops, EachProfileStopsAsItsNameSays) {
  struct Case {
    const char* name;
    double every_s;
    double stop_s;
    double duration_s;
  };
  constexpr double kStandsFirstS = 300.0;
  for (const Case& c : {Case{"drive_stops_5min", 300.0, 30.0, 3.0 * 3600.0},
                        Case{"drive_stops_10min", 600.0, 60.0, 3.0 * 3600.0},
                        Case{"drive_stops_30min", 1800.0, 60.0, 5.0 * 3600.0}}) {
    SCOPED_TRACE(c.name);
    const auto profile = load_profile(shipped("profiles/" + std::string(c.name) + ".yaml"));
    EXPECT_EQ(profile.name, c.name);
    EXPECT_EQ(profile.duration_s, c.duration_s);
    EXPECT_FALSE(profile.earth_rate.has_value());
    const double legs = std::floor((c.duration_s - kStandsFirstS) / c.every_s);
    for (double leg = 0.0; leg < legs; leg += 1.0) {
      const double begin_s = kStandsFirstS + leg * c.every_s;
      for (double t = begin_s; t < begin_s + c.every_s; t += 1.0) {
        if (t < begin_s + c.every_s - c.stop_s) {
          EXPECT_GT(turned_rad(profile, t), 0.1 * core::kRadPerDeg) << t;
        } else {
          EXPECT_EQ(turned_rad(profile, t), 0.0) << t;
        }
      }
    }
    for (double t = 0.0; t < kStandsFirstS; t += 1.0) EXPECT_EQ(turned_rad(profile, t), 0.0) << t;
    EXPECT_NEAR(chamber_temperature_degc(profile, 3600.0), 40.0, 1e-9);
  }
}

std::vector<core::AngularRateSample> diagnosis_record(const twin::Model& model) {
  const auto profile = load_profile(shipped("profiles/diagnosis_chamber.yaml"));
  twin::GyroSimulation gyro(model, profile, 1, 1.0);
  std::vector<core::AngularRateSample> samples;
  while (const auto sample = gyro.next()) samples.push_back(*sample);
  return samples;
}

// Rule: the experiment moves what every effect depends on, on each axis, so that none is
// untestable. A gyro that saturates at 500 deg/s would need another rate table.
TEST(DiagnosisChamberScenario, ExcitesEveryEffectOfTheCatalogue) {
  twin::Model model = load_model(shipped("models/lab_fog.yaml")).model;
  const auto nothing_hidden = diagnosis_record(model);
  EXPECT_EQ(nothing_hidden.size(), 18'000U);
  for (const twin::EffectDefinition& definition : twin::effect_catalogue()) {
    if (definition.kind == "saturation") continue;
    twin::Model hidden = model;
    for (const core::Axis axis : core::kAxes) {
      hidden.effects.push_back({.kind = definition.kind,
                                .axis = axis,
                                .parameters = twin::complete_parameters(definition, {})});
    }
    const auto samples = diagnosis_record(hidden);
    for (std::size_t axis = 0; axis < core::kAxisCount; ++axis) {
      std::size_t different = 0;
      for (std::size_t i = 0; i < samples.size(); ++i) {
        const bool valid = samples[i].valid[axis];
        if (valid != nothing_hidden[i].valid[axis]) ++different;
        if (valid && samples[i].rate_radps[axis] != nothing_hidden[i].rate_radps[axis]) ++different;
      }
      EXPECT_GT(different, 0U) << definition.kind << " on axis " << axis;
    }
  }
}

TEST(DiagnosisChamberScenario, PassesTheSameTemperaturesUpAndDownAtSeveralRates) {
  const auto profile = load_profile(shipped("profiles/diagnosis_chamber.yaml"));
  ASSERT_EQ(profile.power_cycles.size(), 1U);
  EXPECT_EQ(chamber_temperature_degc(profile, profile.power_cycles[0].off_s - 600.0),
            chamber_temperature_degc(profile, profile.duration_s));
  std::vector<double> rates_degc_per_min;
  for (double t = 0.0; t + 60.0 < profile.duration_s; t += 60.0) {
    const double from = chamber_temperature_degc(profile, t);
    const double to = chamber_temperature_degc(profile, t + 60.0);
    if ((from - 30.0) * (to - 30.0) <= 0.0 && from != 30.0) rates_degc_per_min.push_back(to - from);
  }
  ASSERT_EQ(rates_degc_per_min.size(), 5U);
  const double expected[] = {2.0, -0.5, 1.0, -2.0, 0.5};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(rates_degc_per_min[i], expected[i], 1e-9) << i;
}

// Rule: a shipped configuration says what its comment says.
TEST(ShippedCompensation, ThePapersFileUsesItsRateEstimatorAndPulseTerms) {
  const auto options = load_compensation(shipped("paper.yaml"));
  EXPECT_EQ(options.track.rate_method, thermal::RateMethod::kSlidingMean);
  EXPECT_EQ(options.track.sliding_mean.window_samples, 12000U);
  EXPECT_EQ(options.features.back().kind, thermal::FeatureKind::kPulseMean);
  EXPECT_EQ(options.probes(), std::vector<std::string>{"coil"});
}

// Rule: the stack is what every other file asks for, as the default does; the paper's file has the
// paper's learner alone.
TEST(ShippedCompensation, TheStackIsTheSchemeButInThePapersFile) {
  EXPECT_EQ(compensation::CompensationOptions{}.scheme, compensation::Scheme::kStack);
  EXPECT_EQ(load_compensation(shipped("vehicle.yaml")).scheme, compensation::Scheme::kStack);
  EXPECT_EQ(load_compensation(shipped("navigation.yaml")).scheme, compensation::Scheme::kStack);
  EXPECT_EQ(load_compensation(shipped("paper.yaml")).scheme, compensation::Scheme::kOnlineSvr);
}

// Rule: a vehicle's attitude is nobody's but its owner's to say: as shipped Earth rate isn't known,
// and as its comment says it, it is. An implausible level is not learned. 100 deg/h = 4.848e-4
// rad/s; at latitude 48 deg, level and heading north, Earth rate lies in the plane of x and z.
using VehiclesFile = ScratchFolder;

TEST_F(VehiclesFile, AsksForTheAttitude) {
  const auto options = load_compensation(shipped("vehicle.yaml"));
  EXPECT_EQ(options.earth_rate.mode, compensation::EarthRateMode::kUnknown);
  EXPECT_NEAR(options.learning.rest.max_level_radps, core::radps_from_deg_h(100.0), 1e-12);
  std::ifstream file(shipped("vehicle.yaml"));
  std::string told;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("#   earth_rate:")) told = line.substr(4) + "\n";
  }
  write("known.yaml", told);
  const auto known = load_compensation(folder_ / "known.yaml");
  const auto& rate = known.earth_rate.rate_radps;
  EXPECT_EQ(known.earth_rate.mode, compensation::EarthRateMode::kKnown);
  EXPECT_NEAR(std::hypot(rate[0], rate[2]), core::kEarthRateRadps, 1e-12);
}

}  // namespace
}  // namespace zerodrift::config
