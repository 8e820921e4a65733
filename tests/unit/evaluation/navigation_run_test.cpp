// SPDX-License-Identifier: Apache-2.0
#include "common/evaluation/navigation_run.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <sstream>
#include <string>

#include "common/core/units.h"
#include "common/recording/record_export.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::evaluation {
namespace {

using navigation::Stream;

constexpr int kRateHz = 20;
constexpr int kStandS = 60;
constexpr int kTurnS = 20;
constexpr double kTurnRadps = 0.05;

// What a row of a record has beside its time; nothing: the row isn't there.
struct Cells {
  bool rates = true;
  bool is_there = true;
};
using CellsAt = std::function<Cells(double time_s)>;

// A vehicle that stands, turns and stands, without Earth's rate; with the true rates, and a
// temperature each second in a row of its own `temperature_after_s` behind a rate's, or, for 0, in
// that row.
std::string record(const CellsAt& cells_at, double temperature_after_s = 0.0) {
  std::ostringstream text;
  text.precision(12);
  text << "time_s,rate_x_rad_s,rate_y_rad_s,rate_z_rad_s,reference_x_rad_s,"
          "reference_y_rad_s,reference_z_rad_s,temperature_coil_degC,sequence\n";
  std::uint64_t number = 0;
  for (int k = 0; k < (2 * kStandS + kTurnS) * kRateHz; ++k) {
    const double t = static_cast<double>(k) / kRateHz;
    const double turn = t >= kStandS && t < kStandS + kTurnS ? kTurnRadps : 0.0;
    const double noise = 1e-6 * std::sin(17.0 * k);
    const bool has_temperature = k % kRateHz == 0;
    const Cells cells = cells_at(t);
    if (cells.is_there) {
      text << t << ',';
      if (cells.rates) {
        text << noise << ',' << -noise << ',' << turn + noise;
      } else {
        text << ",,";
      }
      text << ",0,0," << turn << ',' << (has_temperature && temperature_after_s == 0.0 ? "20" : "")
           << ',' << number++ << '\n';
    }
    if (has_temperature && temperature_after_s > 0.0)
      text << t + temperature_after_s << ",,,,,,,20,\n";
  }
  return text.str();
}

class NavigationRuns : public ScratchFolder {
 protected:
  static NavigationResult navigate(const std::filesystem::path& file) {
    NavigationRequest request;
    request.record.file = file.string();
    request.compensation.reference.await_feedback = true;
    request.compensation.reference.truth = compensation::ReferencePolicy::kRefuse;
    request.navigation.alignment_s = 40.0;
    return run_navigation(request, [](const std::string&, double) {});
  }
  static double heading_deg(const NavigationResult& result) {
    return result.attitudes[1].heading_rad / core::kRadPerDeg;
  }
  static constexpr std::uint64_t kSamples = (2 * kStandS + kTurnS) * kRateHz;
  // About up, seen from above against the clock.
  static constexpr double kTurnedDeg = -kTurnRadps * kTurnS * 180.0 / 3.14159265358979;
};

Cells all(double) {
  return {};
}

// Rule: however long the gap, all rows behind it are navigated through, and a loss is counted where
// it is longer than is bridged. Before: behind half a second without rates nothing was answered any
// more.
TEST_F(NavigationRuns, BehindAGapTheRecordGoesOn) {
  for (const bool as_blanks : {false, true}) {
    for (const double gap_s : {0.1, 0.3, 0.5, 0.6, 1.0, 5.0}) {
      const auto cells = [&](double t) -> Cells {
        const bool is_gap = t > 50.0 && t <= 50.0 + gap_s;
        return {.rates = !is_gap, .is_there = as_blanks || !is_gap};
      };
      const auto result = navigate(write("gap.csv", record(cells)));
      const auto missing = static_cast<std::uint64_t>(std::lround(gap_s * kRateHz));
      EXPECT_EQ(result.counts.samples, kSamples - missing) << gap_s << as_blanks;
      EXPECT_NEAR(heading_deg(result), kTurnedDeg, 0.01) << gap_s << as_blanks;
      EXPECT_EQ(result.counts.losses, gap_s > 0.25 ? 1U : 0U) << gap_s << as_blanks;
      EXPECT_EQ(result.truth_note.empty(), as_blanks || gap_s < 0.25) << result.truth_note;
    }
  }
}

// Rule: the rate behind a gap isn't that of the gap. Before: eight seconds were turned through at
// it, and the truth with them, without a word.
TEST_F(NavigationRuns, AGapIsNotTurnedThroughAtTheRateBehindIt) {
  const auto cells = [](double t) -> Cells { return {.is_there = t <= 75.0 || t > 83.0}; };
  const auto result = navigate(write("hole.csv", record(cells)));
  EXPECT_EQ(result.counts.losses, 1U);
  EXPECT_GT(result.heading_sigma_rad[1], 1.0);
  EXPECT_FALSE(result.truth_note.empty());
  EXPECT_NEAR(heading_deg(result), 0.75 * kTurnedDeg, 1.0);
}

// Rule: temperatures in rows of their own change nothing, in a text file or an MCAP file. Before:
// each counted as a rate that wasn't measured.
TEST_F(NavigationRuns, TemperaturesBetweenTheRatesAreNoRates) {
  const auto in_rows = navigate(write("in.csv", record(all)));
  const auto between = navigate(write("between.csv", record(all, 0.007)));
  recording::ExportRequest request;
  request.from.file = path("between.csv").string();
  request.to = path("between.mcap");
  EXPECT_TRUE(recording::import_record(request, [](double, std::uint64_t) {}).warnings.empty());
  const auto of_mcap = navigate(request.to.string());
  for (const NavigationResult* other : {&between, &of_mcap}) {
    EXPECT_EQ(other->counts.samples, kSamples);
    EXPECT_EQ(heading_deg(*other), heading_deg(between));
    EXPECT_NEAR(heading_deg(*other), heading_deg(in_rows), 1e-5) << "temperatures come 7 ms later";
    EXPECT_EQ(other->errors[0].samples, in_rows.errors[0].samples);
    EXPECT_EQ(other->counts.gaps + other->counts.losses, 0U);
    EXPECT_TRUE(other->truth_note.empty()) << other->truth_note;
  }
}

}  // namespace
}  // namespace zerodrift::evaluation
