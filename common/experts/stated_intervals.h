// SPDX-License-Identifier: Apache-2.0
// How wrong a stack's forecasts of some ages were, and what is stated of every age by that.
#pragma once

#include <array>
#include <cstddef>

#include "common/core/state_archive.h"

namespace zerodrift::experts {

// Ages of the newest label at which experts are judged, s; the first is one label ahead.
inline constexpr std::array<double, 5> kHorizonsS{0.0, 60.0, 300.0, 900.0, 3600.0};
inline constexpr std::size_t kHorizons = kHorizonsS.size();
inline constexpr double kNormalQuantile = 1.959963984540054;  // of 95 %, two-sided

// What holds 95 % of the errors at labels that a horizon's forecasts had, and how old these
// forecasts were. Between two stops no label comes, so that the forecasts of a horizon are as old
// as the stops are apart, whatever the horizon.
struct JudgedWidth {
  double half_width = -1.0;  // negative: none was judged
  double age_s = 0.0;        // the geometric mean; after no younger horizon's

  void carry(core::StateArchive& archive) {
    archive(half_width, age_s);
    archive.require(age_s >= 0.0);
  }
};

// Between two ages that were judged an interval goes as a power of the age: an error whose variance
// is a sum of such powers, as of noise, walk and ramp, is no larger, since the logarithm of the sum
// is convex in that of the age. Behind the oldest age that was judged it grows in proportion, and
// behind the longest horizon's as the drift's part grew up to there: not at all of a map that
// holds, with the square of the time in a drift that goes on steadily.
struct StatedIntervals {
  // Of the drift at an age of the newest label; negative: unknown. O(horizons), no allocation.
  [[nodiscard]] double variance_at(double age_s) const noexcept;
  // Of a label's error, which has the label's noise; negative: unknown.
  [[nodiscard]] double half_width_at(double age_s) const noexcept;

  void carry(core::StateArchive& archive) {
    for (JudgedWidth& one : judged) archive(one);
    archive(label_variance, level_variance);
    archive.require(label_variance >= 0.0 && level_variance >= 0.0);
  }

  std::array<JudgedWidth, kHorizons> judged{};
  double label_variance = 0.0;  // of the newest label as a measurement
  double level_variance = 0.0;  // which the drift at the newest label is known by at best

 private:
  [[nodiscard]] double of_drift(double half_width) const noexcept;
  [[nodiscard]] double no_less_than_known(double half_width) const noexcept;
};

}  // namespace zerodrift::experts
