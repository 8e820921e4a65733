// SPDX-License-Identifier: Apache-2.0
// Which samples of an axis are fitted and which judge what comes of it.
#pragma once

#include <cstdint>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/held_out.h"
#include "common/diagnosis/records_of_axis.h"
#include "common/twin/model.h"

namespace zerodrift::diagnosis {

// Of one record, of which `sound` samples are fitted, and of those for validation, without their
// faults and, where coefficients of the model wait for the first record, without what that did not
// reach. Blocks of the record itself where none of the others can judge.
[[nodiscard]] Split split_records(const twin::Model& model, const PlayedRecord& record,
                                  const std::vector<PlayedRecord>& validation,
                                  const std::vector<std::uint8_t>& sound, core::Axis axis);

}  // namespace zerodrift::diagnosis
