// SPDX-License-Identifier: Apache-2.0
// One column of a record: passes on what can have been measured and remembers the rest.
#pragma once

#include <cstdint>
#include <limits>
#include <string>

#include "common/record/record_layout.h"

namespace zerodrift::measurement {

struct ValueRange {
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -std::numeric_limits<double>::infinity();

  void include(double value) {
    lowest = value < lowest ? value : lowest;
    highest = value > highest ? value : highest;
  }
  [[nodiscard]] bool holds(double value) const { return value >= lowest && value <= highest; }
  [[nodiscard]] bool holds(const ValueRange& other) const {
    return holds(other.lowest) && holds(other.highest);
  }
};

// What a sensor can have measured, in the default unit of the quantity.
struct MeasurableRange {
  ValueRange range;
  const char* text = "";
};

[[nodiscard]] MeasurableRange measurable_range(record::Quantity quantity);

class ColumnWatch {
 public:
  explicit ColumnWatch(record::BoundColumn column);

  // The reading, or NaN where it can't have been measured. Default unit of the quantity, rates in
  // rad/s.
  double pass(double value);

  [[nodiscard]] const record::BoundColumn& column() const { return column_; }
  [[nodiscard]] record::Quantity quantity() const { return column_.channel.quantity; }
  // Passed on; empty (lowest above highest) where none was.
  [[nodiscard]] std::uint64_t readings() const { return readings_; }
  [[nodiscard]] const ValueRange& passed() const { return passed_; }
  [[nodiscard]] double spanned() const {
    return readings_ > 0 ? passed_.highest - passed_.lowest : 0.0;
  }
  // Not passed on.
  [[nodiscard]] std::uint64_t impossible_readings() const { return impossible_; }
  [[nodiscard]] const ValueRange& impossible() const { return refused_; }
  // So many equal readings from the first to the last are no measurement.
  [[nodiscard]] bool never_moves() const;

 private:
  record::BoundColumn column_;
  ValueRange measurable_;
  std::uint64_t readings_ = 0;
  std::uint64_t impossible_ = 0;
  ValueRange passed_;
  ValueRange refused_;
};

}  // namespace zerodrift::measurement
