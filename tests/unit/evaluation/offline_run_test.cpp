// SPDX-License-Identifier: Apache-2.0
#include "common/evaluation/offline_run.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "common/core/units.h"
#include "tests/unit/record/record_folder.h"
#include "tests/unit/record/recording.h"

namespace zerodrift::evaluation {
namespace {

class OfflineRunOfARecording : public record::RecordFolder {};

// Before: the thermometer was lost for as long as the clock had been set back, though live it was
// there again with its next reading.
TEST_F(OfflineRunOfARecording, HasTemperaturesAgainAsSoonAsTheClockWasSetBack) {
  constexpr int kHalf = 3000;  // rates, one in 0.1 s
  constexpr int kRatesPerReading = 10;
  for (const double back_s : {0.0, 1.0, 7.0, 45.0, 100.0, 300.0, 1e6}) {
    for (const bool is_reading_first : {false, true}) {
      SCOPED_TRACE(std::to_string(back_s) + (is_reading_first ? ", reading first" : ""));
      record::Recording recording;
      for (int k = 0; k < 2 * kHalf; ++k) {
        const double time_s = 1e6 + 0.1 * k - (k < kHalf ? 0.0 : back_s);
        const auto reading = record::reading_at(time_s, "coil", 20.0 + 0.001 * k);
        const bool has_reading = k % kRatesPerReading == 0;
        if (has_reading && is_reading_first) recording.add(1, reading);
        auto rate = record::rate_at(time_s, static_cast<std::uint64_t>(k));
        rate.rate_radps = {1e-6, 2e-6, 3e-6};
        recording.add(1, rate);
        if (has_reading && !is_reading_first) recording.add(1, reading);
      }
      OfflineRun offline({.file = recording.write_to(path("a.mcap")).string()}, {});
      std::uint64_t next = 0;
      int without = 0;
      offline.run(false, [&](const core::CompensatedSample& answer) {
        EXPECT_EQ(answer.raw.sequence, next++);
        without += answer.reason[0] == core::Reason::kTemperatureMissing ? 1 : 0;
      });
      EXPECT_EQ(next, 2U * kHalf);
      EXPECT_LE(without, 2 * kRatesPerReading);
      EXPECT_EQ(offline.warnings(), std::vector<std::string>{});
    }
  }
}

// A table's angle is about one axis. Before: what the Earth's rate is about the others was learned
// as drift, though it is configured, and taken off.
TEST_F(OfflineRunOfARecording, EarthsRateIsNoDriftOfAnAxisThatHasNoReferenceColumn) {
  constexpr double kEarthDegH = 9.0;
  constexpr double kDriftDegH = 2.0;
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, 0.5);
  std::string text = "time_s,rate_x_deg_h,rate_z_deg_h,reference_z_deg_h\n";
  for (int k = 0; k < 6000; ++k) {
    text += std::to_string(0.1 * k) + "," +
            std::to_string(kEarthDegH + kDriftDegH + noise(random)) + "," +
            std::to_string(kDriftDegH + noise(random)) + ",0\n";
  }
  compensation::CompensationOptions options;
  options.earth_rate.mode = compensation::EarthRateMode::kKnown;
  options.earth_rate.rate_radps[0] = core::radps_from_deg_h(kEarthDegH);
  OfflineRun offline({.file = write("a.csv", text).string()}, options);
  core::PerAxis<double> applied_radps{};
  offline.run(true, [&](const core::CompensatedSample& answer) {
    applied_radps = answer.applied_drift_radps;
  });
  for (const std::size_t axis : {0U, 2U})
    EXPECT_NEAR(core::deg_h_from_radps(applied_radps[axis]), kDriftDegH, 0.2) << axis;
}

}  // namespace
}  // namespace zerodrift::evaluation
