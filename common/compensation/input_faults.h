// SPDX-License-Identifier: Apache-2.0
// What people read where the input itself is wrong; by the service as events, by commands as
// lines.
#pragma once

#include <string>
#include <vector>

#include "common/compensation/compensator.h"

namespace zerodrift::compensation {

inline constexpr const char* kDoubleCorrectionText =
    "what is taken off comes back with the opposite sign in the raw rates: the compensation is "
    "given its own output, and corrects twice; publish compensated rates under another gyro id";

inline constexpr const char* kCostlyPriorText =
    "an axis's drift changes less than the prior says, and what the prior leaves changes more: it "
    "is "
    "of another gyro, or no longer right; `calibrate` it anew, or go on without it (`ctl revert`, "
    "or no `prior`)";

inline constexpr const char* kShortRestText =
    "stillness ended, three times in turn and more, before anything could be learned in it, which "
    "takes learning.label_interval_s, confirm_s and some seconds: longer stops, or a shorter label";

inline constexpr const char* kUnforeseenStartText =
    "the gyro stayed where it began, elsewhere than was foretold: it is another one (then `ctl "
    "reset`, as what was learned of temperature misleads for hours), its bias doesn't repeat, "
    "or it rotates";

// Names the axes that are reversed now.
[[nodiscard]] inline std::string reversed_text(const Compensator& compensator) {
  std::string axes;
  for (const auto axis : core::kAxes) {
    if (!compensator.is_reversed(axis)) continue;
    axes += (axes.empty() ? "axis " : ", ") + std::string(core::name(axis));
  }
  return axes +
         " turns the other way round than its reference or the Earth says; nothing is learned from "
         "it (mounting.axes turns an axis round)";
}

// All that was found of a record.
[[nodiscard]] inline std::vector<std::string> input_faults(const Compensator& compensator) {
  std::vector<std::string> lines;
  if (compensator.counts().reversed_axes > 0) lines.push_back(reversed_text(compensator));
  if (compensator.counts().own_outputs > 0) lines.emplace_back(kDoubleCorrectionText);
  if (compensator.counts().costly_priors > 0) lines.emplace_back(kCostlyPriorText);
  if (compensator.counts().short_rests > 0) lines.emplace_back(kShortRestText);
  if (compensator.counts().unforeseen_starts > 0) lines.emplace_back(kUnforeseenStartText);
  return lines;
}

}  // namespace zerodrift::compensation
