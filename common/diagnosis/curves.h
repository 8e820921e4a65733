// SPDX-License-Identifier: Apache-2.0
// Curves of a diagnosis for pictures, all of means over a minute.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/finding.h"
#include "common/diagnosis/measured_series.h"

namespace zerodrift::diagnosis {

[[nodiscard]] Waveforms waveforms_of(const MeasuredSeries& series,
                                     const std::vector<double>& measured,
                                     const std::vector<std::uint8_t>& valid,
                                     const std::vector<double>& before,
                                     const std::vector<double>& after);

// Against the input that the first named effect reads, or that the unknown one depends on.
[[nodiscard]] std::optional<ResidualAgainstInput> residual_against_input(
    const AxisDiagnosis& axis, const MeasuredSeries& series, core::Axis which,
    const std::vector<double>& residual, const std::vector<double>& explained,
    const std::vector<std::uint8_t>& valid);

}  // namespace zerodrift::diagnosis
