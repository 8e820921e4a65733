// SPDX-License-Identifier: Apache-2.0
// The event of a diagnosis: one line that says gyro, axis, effects and gap.
#include "services/zerodrift/diagnosis_event.h"

#include <gtest/gtest.h>

#include "common/core/units.h"

namespace zerodrift::services {
namespace {

DiagnosisResult with_axis_x(const diagnosis::AxisDiagnosis& x) {
  DiagnosisResult result;
  result.diagnosis.verdict = x.verdict;
  result.diagnosis.axes[core::index(core::Axis::kX)] = x;
  result.diagnosis.axes[core::index(core::Axis::kZ)] = diagnosis::AxisDiagnosis{};
  return result;
}

diagnosis::NamedEffect effect(const std::string& name) {
  diagnosis::NamedEffect named;
  named.name = name;
  return named;
}

TEST(DiagnosisEvent, SaysGyroAxisEffectsAndGapInOneLine) {
  diagnosis::AxisDiagnosis x;
  x.verdict = diagnosis::Verdict::kAmbiguous;
  x.effects = {effect("shupe"), effect("magnetic")};
  x.effects[0].alternatives = {{"coil_lag", 0.2}};
  x.acceptance = diagnosis::Acceptance::kAccepted;
  x.held_out_kind = diagnosis::HeldOut::kBlocks;
  x.held_out = {.before_rms_radps = core::radps_from_deg_h(0.5),
                .after_rms_radps = core::radps_from_deg_h(0.02)};
  const auto event = diagnosis_event(with_axis_x(x), 7, 12);
  EXPECT_EQ(event.code, "diagnosis_ambiguous");
  EXPECT_EQ(event.severity, service::Severity::kWarning);
  EXPECT_EQ(event.text,
            "gyro 7; axis x: missing shupe (or coil_lag) + magnetic, gap 0.50 -> 0.020 deg/h; "
            "axis z: nothing missing");
  EXPECT_EQ(event.gyro_id, 7U);
  EXPECT_EQ(event.sensor_time_ns, 12);
}

TEST(DiagnosisEvent, OfAConsistentTwinIsInformation) {
  const auto event = diagnosis_event(with_axis_x({}), 1, 0);
  EXPECT_EQ(event.code, "diagnosis_consistent");
  EXPECT_EQ(event.severity, service::Severity::kInformation);
}

TEST(DiagnosisEvent, OfWhatCanNotBeDecidedIsAWarning) {
  diagnosis::AxisDiagnosis x;
  x.verdict = diagnosis::Verdict::kUndecidable;
  const auto event = diagnosis_event(with_axis_x(x), 1, 0);
  EXPECT_EQ(event.code, "diagnosis_undecidable");
  EXPECT_EQ(event.severity, service::Severity::kWarning);
  EXPECT_EQ(event.text, "gyro 1; axis x: undecidable; axis z: nothing missing");
}

TEST(DiagnosisEvent, FitsTheTopic) {
  diagnosis::AxisDiagnosis x;
  x.verdict = diagnosis::Verdict::kUnknownEffect;
  x.unknown = diagnosis::UnknownEffect{.description = std::string(400, 'a') + "\nb"};
  const auto event = diagnosis_event(with_axis_x(x), 1, 0);
  EXPECT_LE(event.text.size(), 255U);
  EXPECT_EQ(event.text.find('\n'), std::string::npos);
  EXPECT_LE(event.code.size(), 48U);
}

}  // namespace
}  // namespace zerodrift::services
