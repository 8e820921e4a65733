// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "common/allan/noise_units.h"
#include "common/core/units.h"
#include "services/zerodrift/allan_report.h"

namespace zerodrift::services {
namespace {

using allan::Identification;
using allan::NoiseTerm;

constexpr double kDegPerHour = core::kRadPerSecPerDegPerHour;

// N of 0.01 deg/sqrt(h) and B of 0.02 deg/h; known to a factor of 2 at 1 s and 10 s, not at 100 s.
allan::SeriesReport fitted(double lowest_deg_h) {
  allan::SeriesReport report;
  report.coefficients.status = allan::FitStatus::kConverged;
  report.coefficients.shortest_tau_s = 1.0;
  auto& coefficients = report.coefficients.coefficients;
  coefficients[allan::index(NoiseTerm::kAngleRandomWalk)] = {
      Identification::kInterval, 0.01 / allan::kDegPerRootHour, 0.0, 0.0};
  coefficients[allan::index(NoiseTerm::kBiasInstability)] = {Identification::kInterval,
                                                             0.02 * kDegPerHour, 0.0, 0.0};
  for (const double tau_s : {0.1, 1.0, 10.0, 100.0}) {
    allan::GappedPoint point;
    point.point.tau_s = tau_s;
    point.point.deviation_radps = lowest_deg_h * kDegPerHour;
    const double factor = tau_s < 50.0 ? 1.5 : 2.5;
    point.point.lower_radps = point.point.deviation_radps / factor;
    point.point.upper_radps = point.point.deviation_radps * factor;
    report.allan.push_back(point);
  }
  report.lowest = report.allan[2].point;
  return report;
}

AllanResult result_of(const allan::SeriesReport& raw) {
  AllanResult result;
  result.streams.push_back({core::Axis::kX, StreamKind::kRaw, raw});
  return result;
}

std::string compensated_to(double lowest_deg_h) {
  AllanResult result = result_of(fitted(1.0));
  result.streams.push_back({core::Axis::kX, StreamKind::kCompensated, fitted(lowest_deg_h)});
  return allan_advice(result);
}

TEST(AllanAdvice, SaysHowNoisyHowStableAndWhatIsTrustworthy) {
  EXPECT_EQ(allan_advice(result_of(fitted(1.0))),
            "Axis x: angle random walk 0.0100 deg/√h; bias instability 0.0200 deg/h; deviations "
            "are trustworthy to a factor of 2 from 1.00 s to 10.0 s.");
}

TEST(AllanAdvice, SaysWhatIsTooSmallOrTooShortOrNotExplained) {
  allan::SeriesReport report = fitted(1.0);
  auto& stability = report.coefficients.coefficients[allan::index(NoiseTerm::kBiasInstability)];
  stability = {Identification::kUpperBound, 0.0, 0.0, 0.05 * kDegPerHour};
  EXPECT_NE(allan_advice(result_of(report)).find("bias instability below 0.0500 deg/h, too small"),
            std::string::npos);
  EXPECT_EQ(allan_advice(result_of(allan::SeriesReport())),
            "Axis x: the record is too short for angle random walk and bias instability; no "
            "deviation is trustworthy to a factor of 2.");
  report.coefficients.status = allan::FitStatus::kUnexplained;
  report.coefficients.coefficients = {};
  const std::string advice = allan_advice(result_of(report));
  EXPECT_EQ(advice.find("Axis x: the curve follows no mixture of these noises"), 0U) << advice;
  EXPECT_EQ(advice.find("random walk"), std::string::npos) << advice;
}

TEST(AllanAdvice, SaysWhetherACompensationHelpsOnlyWhereTheIntervalsLieApart) {
  EXPECT_NE(compensated_to(0.1).find("the compensation lowers the lowest deviation from 1.00 to "
                                     "0.100 deg/h."),
            std::string::npos);
  EXPECT_NE(compensated_to(5.0).find("the compensation harms: it raises the lowest deviation"),
            std::string::npos);
  EXPECT_NE(compensated_to(0.7).find("can't be told: the intervals overlap"), std::string::npos);
}

}  // namespace
}  // namespace zerodrift::services
