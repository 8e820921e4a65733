// SPDX-License-Identifier: Apache-2.0
#include "common/record/column_map.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/core/units.h"
#include "common/files/file_error.h"
#include "common/record/csv_cells.h"

namespace zerodrift::record {
namespace {

struct QuantityName {
  Quantity quantity;
  std::string_view stem;
  bool has_axis;
};

constexpr std::array kScalarAndAxisQuantities{
    QuantityName{Quantity::kTime, "time", false},
    QuantityName{Quantity::kRate, "rate", true},
    QuantityName{Quantity::kReference, "reference", true},
    QuantityName{Quantity::kMagnetic, "magnetic", true},
    QuantityName{Quantity::kAcceleration, "acceleration", true},
    QuantityName{Quantity::kVibration, "vibration", false},
    QuantityName{Quantity::kSourceCurrent, "source_current", false},
    QuantityName{Quantity::kSupply, "supply", false},
};
constexpr std::string_view kTemperaturePrefix = "temperature_";
constexpr std::string_view kChannelNames =
    "time, rate_{x,y,z}, reference_{x,y,z}, temperature_<probe>, magnetic_{x,y,z}, "
    "acceleration_{x,y,z}, "
    "vibration, source_current, supply";

struct UnitOfQuantity {
  Quantity quantity;
  std::string_view unit;
  UnitConversion conversion;
};

// The first unit of a quantity is its default. A reference has the units of a rate.
constexpr std::array kUnits{
    UnitOfQuantity{Quantity::kTime, "s", {}},
    UnitOfQuantity{Quantity::kTime, "ms", {1e-3, 0.0}},
    UnitOfQuantity{Quantity::kTime, "us", {1e-6, 0.0}},
    UnitOfQuantity{Quantity::kTime, "ns", {1e-9, 0.0}},
    UnitOfQuantity{Quantity::kTime, kIso8601, {}},  // no factor: a date since 1970
    UnitOfQuantity{Quantity::kRate, "rad/s", {}},
    UnitOfQuantity{Quantity::kRate, "deg/s", {core::kRadPerDeg, 0.0}},
    UnitOfQuantity{Quantity::kRate, "deg/h", {core::kRadPerSecPerDegPerHour, 0.0}},
    UnitOfQuantity{Quantity::kTemperature, "degC", {}},
    UnitOfQuantity{Quantity::kTemperature, "K", {1.0, -273.15}},
    UnitOfQuantity{Quantity::kTemperature, "degF", {5.0 / 9.0, -160.0 / 9.0}},
    UnitOfQuantity{Quantity::kMagnetic, "uT", {}},
    UnitOfQuantity{Quantity::kMagnetic, "mT", {1e3, 0.0}},
    UnitOfQuantity{Quantity::kMagnetic, "T", {1e6, 0.0}},
    UnitOfQuantity{Quantity::kMagnetic, "G", {1e2, 0.0}},
    UnitOfQuantity{Quantity::kAcceleration, "m/s^2", {}},
    UnitOfQuantity{Quantity::kAcceleration, "g", {core::kStandardGravityMps2, 0.0}},
    UnitOfQuantity{Quantity::kVibration, "g", {}},
    UnitOfQuantity{Quantity::kVibration, "m/s^2", {1.0 / core::kStandardGravityMps2, 0.0}},
    UnitOfQuantity{Quantity::kSourceCurrent, "mA", {}},
    UnitOfQuantity{Quantity::kSourceCurrent, "A", {1e3, 0.0}},
    UnitOfQuantity{Quantity::kSupply, "V", {}},
    UnitOfQuantity{Quantity::kSupply, "mV", {1e-3, 0.0}},
};

constexpr Quantity unit_owner(Quantity quantity) {
  return quantity == Quantity::kReference ? Quantity::kRate : quantity;
}

// The spelling a column's name uses: "deg/h" -> "deg_h", "m/s^2" -> "m_s2".
std::string column_spelling(std::string_view unit) {
  std::string spelled;
  for (const char c : unit) {
    if (c == '/')
      spelled += '_';
    else if (c != '^')
      spelled += c;
  }
  return spelled;
}

// Takes `prefix` off the front of `text` where it is there.
bool consume(std::string_view& text, std::string_view prefix) {
  if (!text.starts_with(prefix)) return false;
  text.remove_prefix(prefix.size());
  return true;
}

std::optional<core::Axis> consume_axis(std::string_view& text) {
  for (const core::Axis axis : core::kAxes) {
    if (consume(text, core::name(axis))) return axis;
  }
  return std::nullopt;
}

// What follows a channel in a column's name: nothing, or '_' and the unit.
std::optional<std::string> consume_unit_suffix(std::string_view text) {
  if (text.empty()) return std::string{};
  if (!consume(text, "_")) return std::nullopt;
  return std::string{text};
}

std::optional<CanonicalName> parse_temperature_name(std::string_view column) {
  if (!consume(column, kTemperaturePrefix) || column.empty()) return std::nullopt;
  const std::size_t last = column.rfind('_');
  const bool has_suffix = last != std::string_view::npos;
  const std::string_view unit = has_suffix ? column.substr(last + 1) : column;
  if (!has_suffix && unit_conversion(Quantity::kTemperature, unit))
    return std::nullopt;  // no probe
  const std::string_view probe = has_suffix ? column.substr(0, last) : column;
  if (probe.empty()) return std::nullopt;
  return CanonicalName{Channel{Quantity::kTemperature, core::Axis::kX, std::string{probe}},
                       has_suffix ? std::string{unit} : std::string{}};
}

std::optional<CanonicalName> parse_name_of(const QuantityName& known, std::string_view column) {
  if (!consume(column, known.stem)) return std::nullopt;
  Channel channel{known.quantity, core::Axis::kX, {}};
  if (known.has_axis) {
    if (!consume(column, "_")) return std::nullopt;
    const std::optional<core::Axis> axis = consume_axis(column);
    if (!axis) return std::nullopt;
    channel.axis = *axis;
  }
  std::optional<std::string> unit = consume_unit_suffix(column);
  if (!unit) return std::nullopt;
  return CanonicalName{std::move(channel), std::move(*unit)};
}

[[noreturn]] void refuse(std::string_view entry, const std::string& why) {
  throw files::FileError("--columns: '" + printable(entry) + "': " + why);
}

Channel parse_channel(std::string_view entry, std::string_view channel_name) {
  const std::optional<CanonicalName> parsed = parse_canonical_name(channel_name);
  if (channel_name.starts_with(kTemperaturePrefix) &&
      channel_name.size() > kTemperaturePrefix.size()) {
    if (parsed && !parsed->unit.empty() && unit_conversion(Quantity::kTemperature, parsed->unit)) {
      refuse(entry, "the unit belongs behind the column: '" + name(parsed->channel) + "=<column>[" +
                        parsed->unit + "]'");
    }
    return {Quantity::kTemperature, core::Axis::kX,
            std::string{channel_name.substr(kTemperaturePrefix.size())}};
  }
  if (!parsed || !parsed->unit.empty()) {
    refuse(entry, std::string{"'"} + printable(channel_name) + "' is no channel; channels are " +
                      std::string{kChannelNames});
  }
  return parsed->channel;
}

double parse_factor(std::string_view entry, std::string_view text) {
  const std::optional<double> factor = parse_number(trim(text));
  if (!factor || !std::isfinite(*factor) || *factor == 0.0) {
    refuse(entry, std::string{"'"} + printable(text) +
                      "' is no factor; expected a number other than 0 behind '*'");
  }
  return *factor;
}

// Splits "column*2.5" at the last '*'. True where there was one.
bool consume_factor(std::string_view entry, std::string_view& column, double& factor) {
  const std::size_t star = column.rfind('*');
  if (star == std::string_view::npos) return false;
  factor = parse_factor(entry, column.substr(star + 1));
  column = trim(column.substr(0, star));
  return true;
}

// Splits "column[unit]". Nullopt where there is no bracket.
std::optional<std::string_view> consume_bracket(std::string_view entry, std::string_view& column) {
  if (!column.ends_with(']')) return std::nullopt;
  const std::size_t open = column.rfind('[');
  if (open == std::string_view::npos) refuse(entry, "']' without '['");
  const std::string_view unit = trim(column.substr(open + 1, column.size() - open - 2));
  column = trim(column.substr(0, open));
  return unit;
}

ColumnMapping parse_entry(std::string_view entry) {
  const std::size_t equals = entry.find('=');
  if (equals == std::string_view::npos) refuse(entry, "expected <channel>=<column>[<unit>]");
  ColumnMapping mapping;
  mapping.channel = parse_channel(entry, trim(entry.substr(0, equals)));
  const Quantity quantity = mapping.channel.quantity;

  std::string_view column = trim(entry.substr(equals + 1));
  const std::optional<std::string_view> unit = consume_bracket(entry, column);
  const bool counts = consume_factor(entry, column, mapping.factor);
  if (column.empty()) refuse(entry, "no column is named");
  if (!unit && !(counts && quantity == Quantity::kTime))
    refuse(entry, "no unit; write '" + std::string{entry} + "[<unit>]' with one of " +
                      accepted_units(quantity));
  mapping.unit = std::string{unit.value_or(default_unit(quantity))};
  if (!unit_conversion(quantity, mapping.unit)) {
    refuse(entry, "unknown unit '" + printable(mapping.unit) +
                      "'; accepted: " + accepted_units(quantity) +
                      (mapping.unit.starts_with("lsb*")
                           ? "; counts, each worth a part of one: '<column>*<factor>[<unit>]'"
                           : ""));
  }
  if (mapping.unit == kIso8601 && counts) refuse(entry, "a date takes no factor");
  mapping.column = std::string{column};
  return mapping;
}

}  // namespace

std::string name(const Channel& channel) {
  if (channel.quantity == Quantity::kTemperature)
    return std::string{kTemperaturePrefix} + channel.probe;
  const auto known =
      std::find_if(kScalarAndAxisQuantities.begin(), kScalarAndAxisQuantities.end(),
                   [&](const QuantityName& q) { return q.quantity == channel.quantity; });
  std::string text{known->stem};
  if (known->has_axis) (text += '_') += core::name(channel.axis);
  return text;
}

std::string column_name(const Channel& channel) {
  return name(channel) + '_' + column_spelling(default_unit(channel.quantity));
}

Channel environment_channel(std::size_t number) {
  constexpr std::array kWithAxes{Quantity::kMagnetic, Quantity::kAcceleration};
  constexpr std::array kWithout{Quantity::kVibration, Quantity::kSourceCurrent, Quantity::kSupply};
  constexpr std::size_t kOfAxes = kWithAxes.size() * core::kAxisCount;
  if (number >= kOfAxes) return {kWithout.at(number - kOfAxes), core::Axis::kX, {}};
  return {kWithAxes[number / core::kAxisCount], core::kAxes[number % core::kAxisCount], {}};
}

std::string_view default_unit(Quantity quantity) {
  return std::find_if(kUnits.begin(), kUnits.end(),
                      [owner = unit_owner(quantity)](const UnitOfQuantity& u) {
                        return u.quantity == owner;
                      })
      ->unit;
}

std::optional<UnitConversion> unit_conversion(Quantity quantity, std::string_view unit) {
  const std::string spelled = column_spelling(unit);
  for (const UnitOfQuantity& known : kUnits) {
    if (known.quantity == unit_owner(quantity) && column_spelling(known.unit) == spelled)
      return known.conversion;
  }
  return std::nullopt;
}

std::vector<std::string_view> units_of(Quantity quantity) {
  std::vector<std::string_view> units;
  for (const UnitOfQuantity& known : kUnits) {
    if (known.quantity == unit_owner(quantity)) units.push_back(known.unit);
  }
  return units;
}

std::string accepted_units(Quantity quantity) {
  std::string list;
  for (const std::string_view unit : units_of(quantity)) {
    if (!list.empty()) list += ' ';
    list += unit;
  }
  return list;
}

std::optional<CanonicalName> parse_canonical_name(std::string_view column) {
  for (const QuantityName& known : kScalarAndAxisQuantities) {
    if (auto parsed = parse_name_of(known, column)) return parsed;
  }
  return parse_temperature_name(column);
}

std::vector<ColumnMapping> parse_column_map(std::string_view text) {
  std::vector<ColumnMapping> map;
  if (trim(text).empty()) return map;
  while (true) {
    const std::size_t comma = text.find(',');
    const std::string_view entry = trim(text.substr(0, comma));
    ColumnMapping mapping = parse_entry(entry);
    const bool repeated = std::any_of(map.begin(), map.end(), [&](const ColumnMapping& m) {
      return m.channel == mapping.channel;
    });
    if (repeated) refuse(entry, std::string{"'"} + name(mapping.channel) + "' is mapped twice");
    map.push_back(std::move(mapping));
    if (comma == std::string_view::npos) return map;
    text.remove_prefix(comma + 1);
  }
}

}  // namespace zerodrift::record
