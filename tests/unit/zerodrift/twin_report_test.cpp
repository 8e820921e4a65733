// SPDX-License-Identifier: Apache-2.0
// What the topic twin_report carries of a diagnosis.
#include "services/zerodrift/twin_report.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "tests/unit/zerodrift/example_diagnosis.h"

namespace zerodrift::services {
namespace {

constexpr std::size_t kMostPoints = 720;  // of idl/dds/twin_report.idl

const diagnosis::AxisDiagnosis& x_of(const DiagnosisResult& result) {
  return *result.diagnosis.axes[core::index(core::Axis::kX)];
}

TEST(TwinReports, AreOneOfEachAxisThatWasDiagnosed) {
  const auto reports = twin_reports(example_diagnosis(), 7, 12, 34);
  ASSERT_EQ(reports.size(), 2U);
  EXPECT_EQ(reports[0].axis(), 0U);
  EXPECT_EQ(reports[1].axis(), 2U);
  for (const auto& report : reports) {
    EXPECT_EQ(report.gyro_id(), 7U);
    EXPECT_EQ(report.sensor_time_ns(), 12);
    EXPECT_EQ(report.wall_time_ns(), 34);
  }
}

TEST(TwinReports, SayWhatTheDiagnosisSays) {
  const auto result = example_diagnosis();
  const auto& x = x_of(result);
  const auto report = twin_reports(result, 1, 0, 0).front();
  EXPECT_EQ(report.verdict(), std::string(diagnosis::name(x.verdict)));
  ASSERT_EQ(report.effects().size(), x.effects.size());
  EXPECT_EQ(report.effects()[0].name(), x.effects[0].name);
  EXPECT_EQ(report.effects()[0].probability(), x.effects[0].probability);
  ASSERT_EQ(report.effects()[0].alternatives().size(), x.effects[0].alternatives.size());
  EXPECT_EQ(report.effects()[0].alternatives()[0].name(), x.effects[0].alternatives[0].name);
  EXPECT_EQ(report.effects()[0].alternatives()[0].probability(),
            x.effects[0].alternatives[0].probability);
  EXPECT_EQ(report.held_out(), 1U);
  EXPECT_EQ(report.before_rms_radps(), x.held_out.before_rms_radps);
  EXPECT_EQ(report.after_rms_radps(), x.held_out.after_rms_radps);
}

// Rule: the curves and the residual are means over the same spans, so that a point has both.
TEST(TwinReports, PointsCarryTheInputThatTheEffectFollows) {
  auto result = example_diagnosis();
  auto& x = *result.diagnosis.axes[core::index(core::Axis::kX)];
  auto report = twin_reports(result, 1, 0, 0).front();
  EXPECT_EQ(report.input(), x.residual->input);
  ASSERT_EQ(report.points().size(), x.residual->value.size());
  for (std::size_t i = 0; i < report.points().size(); ++i)
    EXPECT_EQ(report.points()[i].input(), x.residual->value[i]) << i;
  x.residual.reset();
  report = twin_reports(result, 1, 0, 0).front();
  EXPECT_EQ(report.input(), "");
  EXPECT_TRUE(std::isnan(report.points()[0].input()));
}

// Rule: a long record's curves are means over equal spans, so that the mean of all is kept; the
// last span may be shorter.
TEST(TwinReports, CurvesFitTheTopicAndKeepTheirMean) {
  auto result = example_diagnosis();
  auto& curves = result.diagnosis.axes[core::index(core::Axis::kX)]->waveforms;
  constexpr std::size_t kCount = 2 * kMostPoints;
  curves.time_s.resize(kCount);
  std::iota(curves.time_s.begin(), curves.time_s.end(), 0.0);
  curves.measured_radps = curves.before_radps = curves.after_radps = curves.time_s;
  const auto report = twin_reports(result, 1, 0, 0).front();
  ASSERT_EQ(report.points().size(), kMostPoints);
  double sum = 0.0;
  for (const auto& point : report.points()) sum += point.measured_radps();
  EXPECT_EQ(sum / static_cast<double>(kMostPoints), (static_cast<double>(kCount) - 1.0) / 2.0);
}

TEST(TwinReports, OfAnOddNumberOfPointsStillFit) {
  auto result = example_diagnosis();
  auto& curves = result.diagnosis.axes[core::index(core::Axis::kX)]->waveforms;
  for (const std::size_t count :
       {std::size_t{0}, std::size_t{1}, kMostPoints, kMostPoints + 1, std::size_t{9999}}) {
    curves.time_s.assign(count, 1.0);
    curves.measured_radps = curves.before_radps = curves.after_radps = curves.time_s;
    const auto report = twin_reports(result, 1, 0, 0).front();
    EXPECT_LE(report.points().size(), kMostPoints) << count;
    EXPECT_EQ(report.points().empty(), count == 0) << count;
  }
}

TEST(TwinReports, LongTextsAreCutToTheirBounds) {
  auto result = example_diagnosis();
  auto& x = *result.diagnosis.axes[core::index(core::Axis::kX)];
  x.sentence = x.next_experiment = std::string(1000, 'a') + "\nb";
  x.effects[0].name = std::string(200, 'n');
  for (int i = 0; i < 50; ++i) x.effects[0].alternatives.push_back({"another_effect", 0.01});
  x.effects.resize(40, x.effects[0]);
  result.model = "/a/b/" + std::string(300, 'm') + ".yaml";
  const auto report = twin_reports(result, 1, 0, 0).front();
  EXPECT_LE(report.text().size(), 255U);
  EXPECT_LE(report.next_experiment().size(), 255U);
  EXPECT_LE(report.model().size(), 96U);
  EXPECT_LE(report.effects().size(), 16U);
  EXPECT_LE(report.effects()[0].name().size(), 48U);
  EXPECT_EQ(report.effects()[0].alternatives().size(), 8U);
}

}  // namespace
}  // namespace zerodrift::services
