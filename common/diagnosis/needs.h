// SPDX-License-Identifier: Apache-2.0
// What an effect needs of a record to be seen in it, and why a record doesn't meet that.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/finding.h"
#include "common/diagnosis/measured_series.h"
#include "common/diagnosis/playback.h"
#include "common/twin/effect.h"

namespace zerodrift::diagnosis {

// Why a record can't test an effect, or nothing.
[[nodiscard]] std::optional<std::string> why_not_testable(const twin::EffectDefinition& definition,
                                                          const MeasuredSeries& series,
                                                          const Playback& playback,
                                                          core::Axis axis);

// Why a record doesn't meet one need of effects, or nothing.
[[nodiscard]] std::optional<std::string> why_unmet(twin::Need need, const MeasuredSeries& series,
                                                   const Playback& playback, core::Axis axis);
// What meets it, as in "a record with ...". Empty for what any record has.
[[nodiscard]] std::string_view wanted(twin::Need need);
// Whether the record excites any effect that depends on more than time.
[[nodiscard]] bool an_input_moves(const MeasuredSeries& series, const Playback& playback,
                                  core::Axis axis);

// Amplitudes of an effect that the record can say nothing of, since it lacks the component of a
// field, an acceleration or a rotation that they belong to: "magnetic.y_deg_h_per_ut". Empty where
// the effect can't be tested at all.
[[nodiscard]] std::vector<NotTestable> amplitudes_not_testable(
    const twin::EffectDefinition& definition, const MeasuredSeries& series,
    const Playback& playback, core::Axis axis);

// Names of the parameters of a role.
[[nodiscard]] std::vector<std::string> names_of(const twin::EffectDefinition& definition,
                                                twin::ParameterRole role);

}  // namespace zerodrift::diagnosis
