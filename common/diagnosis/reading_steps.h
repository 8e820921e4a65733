// SPDX-License-Identifier: Apache-2.0
// The step that the readings of a column are multiples of, by their size: the same for all where
// they have a number of decimals, ten times as large for ten times as large readings where they
// have a number of significant digits.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/core/units.h"

namespace zerodrift::diagnosis {

class ReadingSteps {
 public:
  // SI per unit that the column is written in.
  explicit ReadingSteps(double unit) : unit_(unit) {}
  ReadingSteps() : ReadingSteps(core::radps_from_deg_h(1.0)) {}

  // A reading, SI. O(1); a few operations once a size is known to have no step.
  void add(double value);

  // The step around readings of this size, SI; 0 where they need more than twelve digits, as what
  // was measured in another unit does, or there are none. The common divisor of readings of these
  // decimals where there are many, else a power of ten of the column's unit.
  [[nodiscard]] double step_at(double value) const;

 private:
  static constexpr int kLowest = -9;  // powers of ten of the unit
  static constexpr std::size_t kDecades = 18;

  struct Decade {
    std::uint32_t readings = 0;  // that differ from the one before
    bool has_step = true;
    int decimals = kLowest;
    std::int64_t divisor = 0;  // of all readings, in steps of 10^-decimals
    double last = 0.0;
  };

  [[nodiscard]] static std::size_t decade_of(double in_units);

  double unit_;
  std::array<Decade, kDecades> decades_{};
};

}  // namespace zerodrift::diagnosis
