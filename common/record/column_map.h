// SPDX-License-Identifier: Apache-2.0
// The vocabulary of a record's columns: quantities, their units, the canonical names
// ("rate_x_deg_h") and the --columns map that gives a foreign CSV's columns those meanings.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/axis.h"

namespace zerodrift::record {

enum class Quantity : std::uint8_t {
  kTime,
  kRate,         // measured angular rate, body frame
  kReference,    // true angular rate, body frame
  kTemperature,  // one a probe
  kMagnetic,
  kAcceleration,
  kVibration,
  kSourceCurrent,
  kSupply,
};

// One stream of values: a quantity, with its axis or its probe where it has one.
struct Channel {
  Quantity quantity = Quantity::kTime;
  core::Axis axis = core::Axis::kX;  // rate, reference, magnetic, acceleration
  std::string probe;                 // temperature

  bool operator==(const Channel&) const = default;
};

// The channel that has this number in core::Environment.
[[nodiscard]] Channel environment_channel(std::size_t number);

// "rate_x", "temperature_coil", "supply": the name used on the left side of a --columns entry.
[[nodiscard]] std::string name(const Channel& channel);

// "rate_x_rad_s", "temperature_coil_degC", "supply_V": the column's name in the default unit.
[[nodiscard]] std::string column_name(const Channel& channel);

// value in the default unit = cell * scale + offset
struct UnitConversion {
  double scale = 1.0;
  double offset = 0.0;
};

// A quantity's default unit is the one a RecordRow holds: s, rad/s, degC, uT, m/s^2 (vibration: g),
// mA, V.
[[nodiscard]] std::string_view default_unit(Quantity quantity);

// Accepts "deg/h" as in --columns and "deg_h" as in a column's name; nullopt for a unit this
// quantity doesn't have.
[[nodiscard]] std::optional<UnitConversion> unit_conversion(Quantity quantity,
                                                            std::string_view unit);

// All that a quantity has, the default first.
[[nodiscard]] std::vector<std::string_view> units_of(Quantity quantity);

// "deg/h deg/s rad/s": for error lines.
[[nodiscard]] std::string accepted_units(Quantity quantity);

// The unit of a time that is written as a date (decimal_time.h).
inline constexpr std::string_view kIso8601 = "iso8601";

// A column's name read as <channel>_<unit>. The unit may be one that the quantity doesn't have
// (also an empty one).
struct CanonicalName {
  Channel channel;
  std::string unit;
};

// Nullopt where the name doesn't begin with a known quantity (and its axis or probe).
[[nodiscard]] std::optional<CanonicalName> parse_canonical_name(std::string_view column);

// One entry of the map: value = cell * factor, in `unit`.
struct ColumnMapping {
  Channel channel;
  // As in the file's header; of a file without one the column's number, from 1. For the time, "row"
  // is the row's number (from 0) where the file has no such column.
  std::string column;
  std::string unit;
  double factor = 1.0;
};

// Reads 'time=stamp[ns],rate_x=gyro_x[rad/s],temperature_coil=temp_c[degC]'. An entry is
//   <channel>=<column>[<unit>]            in that unit
//   <channel>=<column>*<factor>[<unit>]   counts, each worth <factor> of that unit:
//                                         'rate_x=gx*0.05[deg/s]'
//   time=<column>*<factor>                seconds: 'time=row*0.005' is a 200 Hz clock. No other
//                                         channel's factor goes without a unit: deg/s is as likely
//                                         as rad/s
//   time=<column>[iso8601]                dates: 2024-05-01T12:00:00.5Z
// In a file without a header a column is its number, from 1: 'time=1[s],rate_x=2[deg/s]'.
// Empty text is an empty map. Throws files::FileError naming the entry.
[[nodiscard]] std::vector<ColumnMapping> parse_column_map(std::string_view text);

}  // namespace zerodrift::record
