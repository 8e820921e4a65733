// SPDX-License-Identifier: Apache-2.0
// How long a recording ran, by stamps of a clock that may have been set meanwhile.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/core/time.h"

namespace zerodrift::record {

// Stamps of several streams in the order of arrival. Where a stream's stamps go back by more than
// core::kLargestStepBack, the clock was set back. Where stamps go ahead by more than
// core::kLargestStep, and by a hundred mean steps, it was set forward, or nothing came meanwhile.
// What passed in such a step nobody knows: it counts as nothing.
class ElapsedTime {
 public:
  struct Stream {
    std::optional<core::SensorTime> newest{};
    std::uint64_t step = 0;  // behind which it came
  };
  struct Step {
    double after_s = 0.0;  // elapsed before it
    double by_s = 0.0;     // below 0: back
  };

  // Seconds since the first stamp; below 0 for one that is a little earlier. O(1).
  double add(core::SensorTime stamp, Stream& stream);

  // The first of them.
  [[nodiscard]] const std::vector<Step>& steps() const noexcept { return steps_; }
  [[nodiscard]] std::uint64_t step_count() const noexcept { return step_count_; }

 private:
  static constexpr std::size_t kStepsKept = 8;
  [[nodiscard]] double elapsed_s(core::SensorTime stamp) const;
  [[nodiscard]] bool is_step(core::SensorTime stamp, const Stream& stream) const;
  void begin_anew(core::SensorTime stamp);

  std::optional<core::SensorTime> newest_{};
  core::SensorTime began_{0};  // since the last step
  double before_s_ = 0.0;      // elapsed until then
  double forward_s_ = 0.0;     // sum of the steps between stamps, of long ones a part
  std::uint64_t forward_ = 0;  // their number
  std::vector<Step> steps_{};
  std::uint64_t step_count_ = 0;
};

}  // namespace zerodrift::record
