// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/diagnosis_event.h"

#include <string>

#include "common/core/units.h"
#include "common/report/numbers.h"
#include "common/report/plain_text.h"

namespace zerodrift::services {
namespace {

using diagnosis::AxisDiagnosis;
using diagnosis::Verdict;

constexpr std::size_t kLongestText = 240;  // an event holds 255 bytes
constexpr int kDigits = 2;

std::string deg_h(double radps) {
  return report::significant(core::deg_h_from_radps(radps), kDigits);
}

std::string names_of(const AxisDiagnosis& axis) {
  std::string names;
  for (const auto& effect : axis.effects) {
    (names += names.empty() ? "" : " + ") += effect.name;
    for (std::size_t i = 0; i < effect.alternatives.size(); ++i)
      (names += i == 0 ? " (or " : ", ") += effect.alternatives[i].name;
    if (!effect.alternatives.empty()) names += ")";
  }
  return names;
}

std::string finding_of(const AxisDiagnosis& axis) {
  switch (axis.verdict) {
    case Verdict::kConsistent:
      return axis.acceptance == diagnosis::Acceptance::kReverted
                 ? "a suggestion that held-out data did not confirm"
                 : "nothing missing";
    case Verdict::kUndecidable: return "undecidable";
    case Verdict::kRecalibrated: return "recalibrated";
    case Verdict::kEffectNamed:
    case Verdict::kAmbiguous: return "missing " + names_of(axis);
    case Verdict::kUnknownEffect: break;
  }
  const std::string unknown =
      "unknown" + (axis.unknown ? ", " + axis.unknown->description : std::string());
  return axis.effects.empty() ? unknown : unknown + "; missing " + names_of(axis);
}

std::string gap_of(const AxisDiagnosis& axis) {
  if (axis.acceptance != diagnosis::Acceptance::kAccepted) return {};
  const bool held_out = axis.held_out_kind != diagnosis::HeldOut::kNothing;
  const auto& gap = held_out ? axis.held_out : axis.fit;
  return ", gap " + deg_h(gap.before_rms_radps) + " -> " + deg_h(gap.after_rms_radps) + " deg/h";
}

}  // namespace

service::Occurrence diagnosis_event(const DiagnosisResult& result, std::uint32_t gyro_id,
                                    std::int64_t sensor_time_ns) {
  const Verdict verdict = result.diagnosis.verdict;
  std::string text = "gyro " + std::to_string(gyro_id);
  for (const auto axis : core::kAxes) {
    const auto& found = result.diagnosis.axes[core::index(axis)];
    if (!found) continue;
    text += "; axis " + std::string(core::name(axis)) + ": " + finding_of(*found) + gap_of(*found);
  }
  return {.code = "diagnosis_" + std::string(diagnosis::name(verdict)),
          .severity = verdict == Verdict::kConsistent ? service::Severity::kInformation
                                                      : service::Severity::kWarning,
          .text = report::shortened(report::one_line(text), kLongestText),
          .gyro_id = gyro_id,
          .sensor_time_ns = sensor_time_ns};
}

}  // namespace zerodrift::services
