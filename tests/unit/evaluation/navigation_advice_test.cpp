// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>
#include <variant>

#include "common/core/units.h"
#include "common/evaluation/navigation_report.h"

namespace zerodrift::evaluation {
namespace {

using core::kRadPerDeg;

// Two headings that are off by so much all the time, of filters that know them to 0.1 deg.
NavigationResult judged(double raw_deg, double compensated_deg) {
  NavigationResult result;
  result.truth_known = true;
  const double errors_deg[] = {raw_deg, compensated_deg};
  for (std::size_t i = 0; i < 2; ++i) {
    const double error = errors_deg[i] * kRadPerDeg;
    result.errors[i].samples = 100;
    result.errors[i].heading_now = -error;
    result.errors[i].heading_square_sum = 100.0 * error * error;
    result.errors[i].heading_largest = error;
    result.errors[i].heading_sigma_now = result.heading_sigma_rad[i] = 0.1 * kRadPerDeg;
  }
  return result;
}

TEST(NavigationAdvice, SaysByWhatCompensationHelpedOrHarmed) {
  EXPECT_EQ(navigation_advice(judged(0.8, 0.05)),
            "Compensation helped: the heading error falls from 0.800 to 0.0500 deg rms, at its "
            "largest from 0.800 to 0.0500 deg.");
  EXPECT_EQ(navigation_advice(judged(0.3, 0.6)),
            "Compensation harmed: the heading error rises from 0.300 to 0.600 deg rms, at its "
            "largest from 0.300 to 0.600 deg.");
}

TEST(NavigationAdvice, CallsNoDifferenceWhatIsNone) {
  EXPECT_EQ(navigation_advice(judged(0.5, 0.51)),
            "Compensation made no difference to the heading: its error is 0.500 deg rms raw and "
            "0.510 compensated.");
  EXPECT_TRUE(navigation_advice(judged(0.0, 0.0)).starts_with("Compensation made no difference"));
}

TEST(NavigationAdvice, SaysThatNoiseAloneMayEndThere) {
  EXPECT_NE(navigation_advice(judged(0.15, 0.05)).find("another run may say otherwise"),
            std::string::npos);
  EXPECT_EQ(navigation_advice(judged(0.21, 0.05)).find("another run may say otherwise"),
            std::string::npos);
}

// Rule: an error is held against what the filters expected when it was made. Before: against the
// sigma at the end of the record, however long ago the truth had ended.
TEST(NavigationAdvice, HoldsAnErrorAgainstTheSigmaOfItsOwnTime) {
  NavigationResult result = judged(0.8, 0.3);
  result.truth_lost = true;
  for (double& sigma : result.heading_sigma_rad) sigma = 5.0 * kRadPerDeg;
  EXPECT_EQ(navigation_advice(result).find("another run may say otherwise"), std::string::npos);
  const auto table = navigation_table(result);
  EXPECT_EQ(table.rows.front().cells.front(), "error when last known, deg");
  result.truth_lost = false;
  EXPECT_EQ(navigation_table(result).rows.front().cells.front(), "error at the end, deg");
}

TEST(NavigationAdvice, JsonAndPageHaveTheWarningsAndWhatTheTableHas) {
  NavigationResult result = judged(0.8, 0.05);
  result.truth_lost = true;
  result.truth_note = "true rates are missing before 13.0 s";
  result.warnings = {result.truth_note};
  result.streams[1].nis_sum = 3.0;
  result.streams[1].nis_degrees = 2;
  const auto json = navigation_json(result);
  EXPECT_EQ(json.at("warnings").at(0), result.truth_note);
  EXPECT_EQ(json.at("truth_lost"), true);
  EXPECT_EQ(json.at("compensated").at("nis"), 1.5);
  EXPECT_NEAR(json.at("raw").at("heading_error_end_sigma_deg").get<double>(), 0.1, 1e-9);
  bool found = false;
  for (const auto& block : navigation_page({}, result).blocks) {
    const auto* paragraph = std::get_if<report::Paragraph>(&block);
    found =
        found || (paragraph != nullptr && paragraph->text == "Note: " + result.truth_note + ".");
  }
  EXPECT_TRUE(found);
}

TEST(NavigationAdvice, SaysWhyItCannotBeTold) {
  NavigationResult result = judged(0.8, 0.05);
  result.errors[1].samples = 0;
  EXPECT_NE(navigation_advice(result).find("the record is too short"), std::string::npos);
  result.truth_known = false;
  result.truth_note = "the record has no reference columns, there is no truth to judge by";
  EXPECT_NE(navigation_advice(result).find("can't be said: " + result.truth_note + "."),
            std::string::npos);
}

}  // namespace
}  // namespace zerodrift::evaluation
