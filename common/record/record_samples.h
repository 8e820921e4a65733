// SPDX-License-Identifier: Apache-2.0
// A row of a record as the samples that sources publish. Live replay and offline tools both go
// through here, so they see the same bits. Of a CSV record, sequence = number of the row, among
// those that bring a rate for a rate, and clock = kReplay; of an MCAP file a sample is what was
// recorded, its clock included.
#pragma once

#include <cstddef>
#include <optional>

#include "common/core/samples.h"
#include "common/record/record_reader.h"

namespace zerodrift::record {

// Whether a row holds a rate, or a reading of a probe. Of a CSV record every row does, but for
// rates where the record numbers these (RecordRow::has_rate); a blank cell says that nothing was
// measured.
[[nodiscard]] bool brings_rate(const RecordRow& row) noexcept;
[[nodiscard]] bool brings_temperature(const RecordRow& row, std::size_t probe) noexcept;

// For a row that brings one. An axis without a column, with a blank cell or with a value that isn't
// finite is invalid.
[[nodiscard]] core::AngularRateSample to_angular_rate(const RecordRow& row) noexcept;

// For a row that brings one. Fills `sample` (reused, so that nothing is allocated a row) with what
// probe info.probes[probe] says.
void to_temperature(const RecordRow& row, const RecordInfo& info, std::size_t probe,
                    core::TemperatureSample& sample);

// Nullopt where the row brings nothing of the environment. Of a CSV record every row does that has
// such columns; values that are not finite count as not measured.
[[nodiscard]] std::optional<core::EnvironmentSample> to_environment(
    const RecordRow& row, const RecordInfo& info) noexcept;

// Nullopt where the record has no reference column at all: then nothing is known of the true rate.
// Otherwise an axis without a column, or with a blank cell, is invalid.
// `variance_radps2` is the reference's own, the same on each axis. Of an MCAP file: what this row
// brings, with its own variance.
[[nodiscard]] std::optional<core::RateReferenceSample> to_rate_reference(
    const RecordRow& row, const RecordInfo& info, double variance_radps2 = 0.0) noexcept;

}  // namespace zerodrift::record
