// SPDX-License-Identifier: Apache-2.0
// One column of a record: passes on what can have been measured and remembers the rest.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "common/record/record_layout.h"

namespace zerodrift::measurement {

inline constexpr double kStandardGravityMps2 = 9.80665;

// What a sensor can have measured, in the default unit of the quantity.
struct MeasurableRange {
  double lowest = 0.0;
  double highest = 0.0;
  const char* text = "";
};

class ColumnWatch {
 public:
  explicit ColumnWatch(record::BoundColumn column);

  // The reading, or NaN where it can't have been measured. Default unit of the quantity, rates in
  // rad/s.
  double pass(double value);

  [[nodiscard]] const record::BoundColumn& column() const { return column_; }
  [[nodiscard]] std::uint64_t readings() const { return readings_; }
  // So many equal readings from the first to the last are no measurement.
  [[nodiscard]] bool never_moves() const;
  [[nodiscard]] double range() const { return readings_ > 0 ? highest_ - lowest_ : 0.0; }
  [[nodiscard]] double last() const { return last_; }

  // A line on the readings that were not passed on, if any.
  [[nodiscard]] std::optional<std::string> complaint() const;
  [[nodiscard]] std::string column_name() const;

 private:
  [[nodiscard]] bool is_rate() const;
  [[nodiscard]] double in_unit(double value) const;
  [[nodiscard]] std::string unit() const;
  [[nodiscard]] std::string hint() const;

  record::BoundColumn column_;
  MeasurableRange measurable_;
  std::uint64_t readings_ = 0;
  std::uint64_t impossible_ = 0;
  double last_ = std::numeric_limits<double>::quiet_NaN();
  double lowest_ = std::numeric_limits<double>::infinity();
  double highest_ = -std::numeric_limits<double>::infinity();
  double lowest_impossible_ = std::numeric_limits<double>::infinity();
  double highest_impossible_ = -std::numeric_limits<double>::infinity();
};

}  // namespace zerodrift::measurement
