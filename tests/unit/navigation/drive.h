// SPDX-License-Identifier: Apache-2.0
// The shipped drive through the twin, the compensator and the navigation filters, all in one
// thread: what the services do, without the services.
#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "common/compensation/compensator.h"
#include "common/config/twin_config.h"
#include "common/core/units.h"
#include "common/navigation/gyro_navigation.h"
#include "common/navigation/navigation_input.h"
#include "common/twin/simulation.h"

namespace zerodrift::navigation::testing {

struct Drive {
  double rate_hz = 50.0;
  double duration_s = 0.0;  // 0: the profile's
  std::uint64_t seed = 1;
  twin::Model model;
  twin::Profile profile;
  compensation::CompensationOptions compensation;
  GyroNavigationOptions navigation;
  bool feeds_back = true;
};

inline std::filesystem::path shipped(const char* file) {
  return std::filesystem::path(ZERODRIFT_SOURCE_DIR) / "config" / file;
}

// As a vehicle's service would be configured: Earth rate from the filter alone.
inline Drive shipped_drive() {
  Drive drive;
  drive.model = config::load_model(shipped("models/paper_fog.yaml")).model;
  drive.profile = config::load_profile(shipped("profiles/drive_with_stops.yaml"));
  drive.compensation.earth_rate.mode = compensation::EarthRateMode::kUnknown;
  drive.compensation.reference.await_feedback = true;
  const auto& earth = *drive.profile.earth_rate;
  drive.navigation.filter.latitude_rad = earth.latitude_rad;
  drive.navigation.attitude = {earth.roll_rad, earth.pitch_rad, earth.heading_rad};
  drive.navigation.alignment_s = 240.0;
  return drive;
}

// What a test may want of each sample, beside the truth.
struct DrivenSample {
  const core::CompensatedSample& answer;
  const core::PerAxis<double>& true_drift_radps;
  const GyroNavigation& navigation;
};

using Look = std::function<void(const DrivenSample&)>;
// Feedback of another kind than ours; `references` of the sample just answered.
using Feedback = std::function<void(const DrivenSample&, compensation::Compensator&)>;

inline void answer_ready(compensation::Compensator& compensator,
                         const std::function<void(const core::CompensatedSample&)>& take) {
  for (;;) {
    const compensation::Readiness readiness = compensator.readiness();
    if (readiness == compensation::Readiness::kAwaitsModel) {
      if (!compensator.learner().run_one()) return;
      continue;
    }
    if (readiness != compensation::Readiness::kReady) return;
    take(compensator.answer_next());
  }
}

// Runs the drive; the navigation at its end is `navigation`.
inline void run(const Drive& drive, GyroNavigation& navigation,
                compensation::Compensator& compensator, const Look& look = {},
                const Feedback& feedback = {}) {
  twin::Profile profile = drive.profile;
  if (drive.duration_s > 0.0) profile.duration_s = drive.duration_s;
  twin::GyroSimulation gyro(drive.model, profile, drive.seed, drive.rate_hz);
  twin::ThermometerSimulation thermometer(drive.model, profile, drive.seed, "coil");
  std::vector<core::PerAxis<double>> drifts;
  std::vector<core::PerAxis<double>> rates;
  std::size_t answered = 0;
  const auto take = [&](const core::CompensatedSample& answer) {
    const std::size_t k = answered++;
    if (answer.raw.valid != core::PerAxis<bool>{}) navigation.push_truth(answer.raw.time, rates[k]);
    navigation.push(navigation::to_navigation(answer));
    const DrivenSample driven{answer, drifts[k], navigation};
    while (const auto reference = navigation.take_reference()) {
      if (drive.feeds_back) compensator.push(*reference);
    }
    if (feedback) feedback(driven, compensator);
    if (look) look(driven);
  };
  auto reading = thermometer.next();
  while (const auto sample = gyro.next()) {
    drifts.push_back(gyro.true_drift_radps());
    rates.push_back(gyro.true_rate_radps());
    for (; reading && reading->time <= sample->time; reading = thermometer.next())
      compensator.push(*reading);
    auto simulated = *sample;
    simulated.clock = core::ClockSource::kSimulation;
    compensator.push(simulated);
    answer_ready(compensator, take);
  }
  compensator.give_up_waiting();
  answer_ready(compensator, take);
}

}  // namespace zerodrift::navigation::testing
