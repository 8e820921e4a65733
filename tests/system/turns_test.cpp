// SPDX-License-Identifier: Apache-2.0
// True rotation passes untouched through the live system and nothing of it is learned.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "common/config/twin_config.h"
#include "common/core/units.h"
#include "common/twin/simulation.h"
#include "tests/system/files.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

using core::deg_h_from_radps;

constexpr int kDurationS = 900;
constexpr int kRateHz = 100;

struct Turn {
  core::Axis axis;
  double start_s;
  double end_s;
};
constexpr Turn kFast{core::Axis::kZ, 420.0, 480.0};  // 10 deg/s
constexpr Turn kSlow{core::Axis::kX, 600.0, 660.0};  // 0.1 deg/s
constexpr const char* kTurns =
    "turns:\n"
    "  - {start_s: 420, duration_s: 60, axis: z, rate_deg_s: 10, ramp_s: 2}\n"
    "  - {start_s: 600, duration_s: 60, axis: x, rate_deg_s: 0.1, ramp_s: 2}\n";

// A live sample beside what only the twin knows.
struct Sample {
  double time_s = 0.0;
  std::uint64_t epoch = 0;
  core::PerAxis<double> raw{};
  core::PerAxis<double> true_rate{};
  core::PerAxis<double> true_drift{};
  core::PerAxis<double> compensated{};
  core::PerAxis<double> applied{};
};

std::vector<Sample> beside_the_truth(const std::filesystem::path& live,
                                     const Simulation& simulation) {
  const Table table = read_table(live);
  twin::GyroSimulation gyro(config::load_model(simulation.model).model,
                            config::load_profile(simulation.profile),
                            static_cast<std::uint64_t>(simulation.seed), kRateHz);
  std::vector<Sample> samples;
  for (const auto& row : table.rows) {
    const auto raw = gyro.next();
    Sample sample;
    sample.time_s = std::stod(row[0]);
    sample.epoch = std::stoull(row[table.column("model_epoch")]);
    sample.raw = raw.value().rate_radps;
    sample.true_rate = gyro.true_rate_radps();
    sample.true_drift = gyro.true_drift_radps();
    for (const auto axis : core::kAxes) {
      const std::string name(core::name(axis));
      sample.compensated[core::index(axis)] =
          std::stod(row[table.column("rate_" + name + "_rad_s")]);
      sample.applied[core::index(axis)] =
          std::stod(row[table.column("applied_drift_" + name + "_rad_s")]);
    }
    samples.push_back(sample);
  }
  return samples;
}

// compensated - true rate = noise + (drift - applied drift), to rounding: rates up to 0.18 rad/s,
// three roundings of at most 1.4e-17 each on either side.
void expect_pass_untouched(const std::vector<Sample>& samples) {
  for (const Sample& s : samples) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double noise = s.raw[i] - s.true_rate[i] - s.true_drift[i];
      ASSERT_NEAR(s.compensated[i] - s.true_rate[i], noise + (s.true_drift[i] - s.applied[i]),
                  1e-15);
    }
  }
}

// The estimate's error in a turn is what it was in the minute before, plus what the drift itself
// does while nobody may look: twice its motion, because a model may follow its slope at most as
// wrongly as not at all, plus 5 sigma of the mean of a 5 s label (9.33e-4 deg/√h / √5 s: 0.025
// deg/h) for labels that come into force within it. A turn that was learned would show as 36 deg/h
// and more.
void expect_estimate_stays_put(const std::vector<Sample>& samples, const Turn& turn) {
  for (const auto axis : core::kAxes) {
    const std::size_t i = core::index(axis);
    double error_before = 0.0;
    double error = 0.0;
    double lowest = 1e9;
    double highest = -1e9;
    for (const Sample& s : samples) {
      const double difference = std::abs(s.applied[i] - s.true_drift[i]);
      if (s.time_s >= turn.start_s - 60.0 && s.time_s < turn.start_s)
        error_before = std::max(error_before, difference);
      if (s.time_s < turn.start_s - 60.0 || s.time_s > turn.end_s + 15.0) continue;
      lowest = std::min(lowest, s.true_drift[i]);
      highest = std::max(highest, s.true_drift[i]);
      if (s.time_s >= turn.start_s) error = std::max(error, difference);
    }
    const double bound =
        error_before + 2.0 * (highest - lowest) + core::radps_from_deg_h(5.0 * 0.025);
    std::printf(
        "axis %s, turn at %.0f s: largest error %.4f deg/h before, %.4f in it, bound %.4f\n",
        std::string(core::name(axis)).c_str(), turn.start_s, deg_h_from_radps(error_before),
        deg_h_from_radps(error), deg_h_from_radps(bound));
    EXPECT_LT(bound, core::radps_from_deg_h(3.0)) << "the bound must tell a learned turn";
    EXPECT_LT(error, bound);
  }
}

// The model's epoch counts every label that was learned. A label confirmed before the turn may come
// into force up to the hand-over (1 s) and a block after its start; the first one after it needs
// the dwell, itself, its confirmation and the hand-over: 5 + 5 + 5 + 1 s.
void expect_nothing_learned(const std::vector<Sample>& samples, const Turn& turn) {
  const auto epoch_at = [&](double time_s) {
    return samples.at(static_cast<std::size_t>(time_s * kRateHz)).epoch;
  };
  EXPECT_GT(epoch_at(turn.start_s), epoch_at(turn.start_s - 60.0))
      << "there must be learning to stop";
  EXPECT_EQ(epoch_at(turn.end_s + 14.0), epoch_at(turn.start_s + 2.0));
  EXPECT_GT(epoch_at(turn.end_s + 60.0), epoch_at(turn.end_s))
      << "learning must go on after the turn";
}

std::vector<Sample> live_turns(Domain domain, const Arguments& simulate_options) {
  SystemUnderTest system(domain);
  const Simulation simulation{.profile = write_ramp_profile(system, kDurationS, kTurns),
                              .rate_hz = kRateHz};
  const auto record = system.path("record.csv");
  simulate(system, simulation, record, simulate_options);
  run_offline(system, record, system.path("offline.csv"));
  run_live(system, {.source = {"--source", "record", "--record", record},
                    .samples = kDurationS * kRateHz,
                    .out = system.path("live.csv")});
  EXPECT_EQ(first_difference(system.path("live.csv"), system.path("offline.csv")), "");
  return beside_the_truth(system.path("live.csv"), simulation);
}

TEST(Turns, PassUntouchedAndUnlearnedWithoutAReference) {
  const auto samples = live_turns(Domain::kTurnsWithoutReference, {});
  expect_pass_untouched(samples);
  for (const Turn& turn : {kFast, kSlow}) {
    expect_nothing_learned(samples, turn);
    expect_estimate_stays_put(samples, turn);
  }
}

// Against reference columns a slow turn is no hindrance to learning, so only its estimate must
// stay; a fast one is, for the scale-factor error that comes with it.
TEST(Turns, PassUntouchedAndUnlearnedWithReferenceColumns) {
  const auto samples = live_turns(Domain::kTurnsWithReference, {"--reference"});
  expect_pass_untouched(samples);
  expect_nothing_learned(samples, kFast);
  expect_estimate_stays_put(samples, kFast);
  expect_estimate_stays_put(samples, kSlow);
}

}  // namespace
}  // namespace zerodrift::system_test
