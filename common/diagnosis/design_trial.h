// SPDX-License-Identifier: Apache-2.0
// Whether an experiment does tell explanations apart: each is simulated over it, and the record
// diagnosed as any other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/design.h"
#include "common/diagnosis/measured_series.h"
#include "common/twin/model.h"
#include "common/twin/profile.h"

namespace zerodrift::diagnosis {

// What a record of one axis, of its true rate and of everything else would hold, at a sample a
// second or the model's rate if that is lower. O(duration).
[[nodiscard]] MeasuredSeries simulated_series(const twin::Model& model,
                                              const twin::Profile& profile, core::Axis axis,
                                              std::uint64_t seed);

struct Share {
  std::string explanation;
  core::Axis axis = core::Axis::kX;
  std::size_t resolved = 0;  // records whose diagnosis keeps it in its set and no other explanation
  std::size_t records = 0;
};

// One share for each explanation of each question, `replicates` records each; the seeds of their
// noise follow from `seed`. A few seconds a record.
[[nodiscard]] std::vector<Share> measured_shares(const std::vector<Question>& questions,
                                                 const twin::Profile& profile,
                                                 std::size_t replicates, std::uint64_t seed,
                                                 const std::function<void(double)>& progress);

}  // namespace zerodrift::diagnosis
