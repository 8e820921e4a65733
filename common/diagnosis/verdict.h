// SPDX-License-Identifier: Apache-2.0
// What a diagnosis comes to, for programs and for people.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/finding.h"
#include "common/diagnosis/measured_series.h"
#include "common/diagnosis/motion.h"
#include "common/diagnosis/playback.h"
#include "common/twin/model.h"

namespace zerodrift::diagnosis {

[[nodiscard]] Verdict verdict_of(const AxisDiagnosis& axis);
[[nodiscard]] std::string sentence_of(const AxisDiagnosis& axis);
// "shupe (or gradient) and line".
[[nodiscard]] std::string list_of(const std::vector<NamedEffect>& effects);
// Each effect once, in the order in which they are reported.
[[nodiscard]] std::string names_of(const std::vector<Recalibration>& recalibrated);
// Behind an answer: what held-out data did not confirm.
[[nodiscard]] std::string spoken_against(std::span<const std::string> refuted);
[[nodiscard]] std::string shown_by_nothing(std::span<const std::string> unproven);

// Behind an answer: which of the effects are the record's own; empty for none.
[[nodiscard]] std::string about_events(const std::vector<NamedEffect>& effects);
// Behind an answer: what share of the other records judged nothing, all of them where parts of the
// record did in their place; empty for nearly none.
[[nodiscard]] std::string about_reach(double share_out_of_reach, HeldOut judge);
// Behind an answer: that blocks of the record judge, since the others would show nothing.
[[nodiscard]] std::string about_blocks();

// Why a record is too short to be diagnosed, or nothing.
[[nodiscard]] std::optional<std::string> why_too_short(const MeasuredSeries& series);
// What a record that could decide has: the length that something can be kept back of, and what the
// listed effects need and this record lacks.
[[nodiscard]] std::string what_would_decide(const twin::Model& model, const MeasuredSeries& series,
                                            const Playback& playback, core::Axis axis);
[[nodiscard]] AxisDiagnosis can_not_be_diagnosed(AxisDiagnosis result, const std::string& why,
                                                 const std::string& what_would);

// Of a gyro that turns without a true rate: one that never rests for long enough, and what is said
// of one of which the longest stretch at rest was judged.
[[nodiscard]] AxisDiagnosis moved_without_reference(const UnreferencedMotion& motion);
[[nodiscard]] std::string about_rest(const UnreferencedMotion& motion, const MeasuredSeries& part);

}  // namespace zerodrift::diagnosis
