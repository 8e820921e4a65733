// SPDX-License-Identifier: Apache-2.0
// What of a record counts as the truth that navigation is judged by.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>
#include <sstream>
#include <string>

#include "common/core/units.h"
#include "common/evaluation/navigation_report.h"
#include "common/evaluation/navigation_run.h"
#include "common/navigation/earth_rate.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::evaluation {
namespace {

constexpr int kRateHz = 20;
constexpr int kStandS = 60;
constexpr int kTurnS = 20;
constexpr double kTurnRadps = 0.05;
constexpr double kDriftRadps = 2e-6;
constexpr double kLatitudeRad = 48.0 * core::kRadPerDeg;
constexpr double kHeadingRad = 30.0 * core::kRadPerDeg;

enum class Reference { kAgainstStars, kAgainstEarth, kOtherFrame };

struct Columns {
  std::string rates = "xyz";
  std::string references = "xyz";
};

// A vehicle that stands, turns left and stands, at 48 degrees north; each axis drifts.
std::string record(Reference kind, const Columns& columns = {}) {
  std::ostringstream text;
  text.precision(12);
  text << "time_s";
  for (const char axis : columns.rates) text << ",rate_" << axis << "_rad_s";
  for (const char axis : columns.references) text << ",reference_" << axis << "_rad_s";
  text << '\n';
  double heading_rad = kHeadingRad;
  for (int k = 0; k < (2 * kStandS + kTurnS) * kRateHz; ++k) {
    const double t = static_cast<double>(k) / kRateHz;
    const double turn = t >= kStandS && t < kStandS + kTurnS ? kTurnRadps : 0.0;
    heading_rad -= turn / kRateHz;
    const auto earth = navigation::earth_rate_radps_b(kLatitudeRad, {.heading_rad = heading_rad});
    const double motion[] = {0.0, 0.0, turn};
    text << t;
    for (const char axis : columns.rates) {
      const auto i = static_cast<std::size_t>(axis - 'x');
      text << ',' << motion[i] + earth[i] + kDriftRadps + 1e-6 * std::sin(17.0 * k + axis);
    }
    for (const char axis : columns.references) {
      const auto i = static_cast<std::size_t>(axis - 'x');
      const double against_stars = motion[i] + earth[i];
      const double sign = axis == 'x' ? 1.0 : -1.0;
      text << ','
           << (kind == Reference::kAgainstStars   ? against_stars
               : kind == Reference::kAgainstEarth ? motion[i]
                                                  : sign * against_stars);
    }
    text << '\n';
  }
  return text.str();
}

class NavigationTruth : public ScratchFolder {
 protected:
  NavigationResult navigate(const std::string& text, bool latitude_known = true) {
    NavigationRequest request;
    request.record.file = write("record.csv", text).string();
    request.compensation.reference.await_feedback = true;
    request.compensation.reference.truth = compensation::ReferencePolicy::kRefuse;
    if (latitude_known) {
      request.compensation.earth_rate.mode = compensation::EarthRateMode::kUnknown;
      request.navigation.filter.latitude_rad = kLatitudeRad;
    }
    request.navigation.attitude.heading_rad = kHeadingRad;
    request.navigation.alignment_s = 40.0;
    request.navigation.updates = navigation::Updates::kNone;
    return run_navigation(request, [](const std::string&, double) {});
  }
};

// Rule: an axis that is measured and has no reference column has no truth. Before: the rate that
// the record does not have counted as a true rate of 0.
TEST_F(NavigationTruth, EveryMeasuredAxisNeedsItsReferenceColumn) {
  const auto result = navigate(record(Reference::kAgainstStars, {.references = "z"}));
  EXPECT_FALSE(result.truth_known);
  EXPECT_EQ(navigation_advice(result),
            "Whether compensation helped the heading can't be said: the record has no reference "
            "column of x, y, there is no truth to judge by.");
}

// Rule: an axis that is not measured is taken not to turn against the Earth, in the truth as in the
// filters. The heading error is then that of the drift alone, over the 100 s behind the alignment;
// a truth that tilts for want of Earth's horizontal rate gives as much again.
TEST_F(NavigationTruth, OfAGyroOfOneAxisItsReferenceIsEnough) {
  const auto result = navigate(record(Reference::kAgainstStars, {.rates = "z", .references = "z"}));
  ASSERT_TRUE(result.truth_known) << result.truth_note;
  const double drifted_rad = kDriftRadps * (kStandS + kTurnS + kStandS - 40.0);
  EXPECT_NEAR(std::abs(result.errors[0].heading_now), drifted_rad, 0.1 * drifted_rad);
}

// Rule: with a latitude, a reference that is against the Earth, or in another frame, is no truth.
// Before: the errors against it were stated as results.
TEST_F(NavigationTruth, AReferenceHasToHoldEarthsRate) {
  const auto against_stars = navigate(record(Reference::kAgainstStars));
  EXPECT_TRUE(against_stars.truth_known) << against_stars.truth_note;
  const auto against_earth = navigate(record(Reference::kAgainstEarth));
  EXPECT_FALSE(against_earth.truth_known);
  EXPECT_EQ(navigation_advice(against_earth),
            "Whether compensation helped the heading can't be said: the reference at rest is 0.0 "
            "deg/h, not Earth's rate of 15.0: it is against the Earth, a gyro's truth is against "
            "the stars (docs/records.md).");
  EXPECT_TRUE(std::isnan(
      navigation_json(against_earth).at("raw").at("heading_error_rms_deg").get<double>()));
  const auto other_frame = navigate(record(Reference::kOtherFrame));
  EXPECT_FALSE(other_frame.truth_known);
  EXPECT_NE(other_frame.truth_note.find(
                "the reference at rest is x 8.7, y -5.0, z -11.2 deg/h, Earth's rate as given is "
                "x 8.7, y 5.0, z 11.2 deg/h: its frame or unit, or --latitude, --heading"),
            std::string::npos)
      << other_frame.truth_note;
}

// Rule: without a latitude Earth's rate stays in the truth and in the raw rates, and a compensation
// that takes it off as drift can't be judged by them. Before: "harmed".
TEST_F(NavigationTruth, WithoutALatitudeEarthsRateMustNotBeTakenForDrift) {
  const auto unknown = navigate(record(Reference::kAgainstStars), false);
  EXPECT_FALSE(unknown.truth_known);
  EXPECT_EQ(navigation_advice(unknown),
            "Whether compensation helped the heading can't be said: the reference contains "
            "Earth's rate (15.0 deg/h at rest), which the compensation takes off as drift: give "
            "--latitude.");
  EXPECT_TRUE(navigate(record(Reference::kAgainstEarth), false).truth_known);
}

}  // namespace
}  // namespace zerodrift::evaluation
