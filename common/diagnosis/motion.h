// SPDX-License-Identifier: Apache-2.0
// Turns of a gyro whose true rate a record doesn't give. The raw rate is no drift then; where the
// gyro stands still, it is.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/measured_series.h"

namespace zerodrift::diagnosis {

// Intervals from `begin` to before `end`.
struct Stretch {
  std::size_t begin = 0;
  std::size_t end = 0;

  [[nodiscard]] std::size_t size() const noexcept { return end - begin; }
};

struct UnreferencedMotion {
  double moving_share = 0.0;           // of the record
  std::vector<std::uint8_t> moving{};  // 1: the gyro turns; as long as the series
  Stretch at_rest;                     // the longest one in a single orientation; may be empty
};

// Nothing where the true rate of the axis is given, or nobody turns. An axis whose reference is
// constant has none.
//
// An interval is in motion where, of eleven around it, the second largest rate is above the second
// smallest by more than 0.05 deg/s (times the interval, of grids coarser than a second), 25
// standard deviations of the noise from sample to sample in the quietest tenth of the record and
// four steps of the reading, but at most 1 deg/s: no gyro that is worth a model does so at rest,
// and one wild sample does not make it. In a record that has such motion a tenth of the 0.05 deg/s
// is enough: a table that turns by hundreds of deg/h turns by tens as well. Of what lies between,
// the commonest rate is rest, and so are those before and after that go on from it within the same
// bound. A turn about any axis counts, as it changes what all feel of the Earth's rotation; two
// stretches with a turn between them that ends where it began are one. A gyro of which half the
// rates are above 10 deg/s never rests. O(n + stretches²).
[[nodiscard]] std::optional<UnreferencedMotion> motion_without_reference(
    const MeasuredSeries& series, core::Axis axis);

// The stretch at rest as a record of its own; turns within it are not valid.
[[nodiscard]] MeasuredSeries part_at_rest(const MeasuredSeries& series,
                                          const UnreferencedMotion& motion);

}  // namespace zerodrift::diagnosis
