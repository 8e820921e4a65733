// SPDX-License-Identifier: Apache-2.0
#include "common/measurement/column_watch.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/units.h"
#include "common/report/numbers.h"
#include "common/report/plain_text.h"

namespace zerodrift::measurement {
namespace {

using record::Quantity;
using report::significant;

constexpr std::uint64_t kReadingsOfAStuckSensor = 100;
constexpr std::size_t kLongestHeader = 60;

MeasurableRange measurable_range(Quantity quantity) {
  constexpr double kFastestRadps = 1e4 * core::kRadPerDeg;
  constexpr double kStrongestUt = 1e5;
  constexpr double kHardestMps2 = 1e3 * kStandardGravityMps2;
  switch (quantity) {
    case Quantity::kRate:
    case Quantity::kReference: return {-kFastestRadps, kFastestRadps, "-10000 to 10000 deg/s"};
    case Quantity::kTemperature: return {-100.0, 200.0, "-100 to 200 degC"};
    case Quantity::kMagnetic: return {-kStrongestUt, kStrongestUt, "-100 to 100 mT"};
    case Quantity::kAcceleration: return {-kHardestMps2, kHardestMps2, "-1000 to 1000 g"};
    case Quantity::kVibration: return {0.0, 1e3, "0 to 1000 g"};
    case Quantity::kSourceCurrent: return {0.0, 1e5, "0 to 100 A"};
    case Quantity::kSupply: return {-1e3, 1e3, "-1000 to 1000 V"};
    case Quantity::kTime: break;
  }
  return {-std::numeric_limits<double>::max(), std::numeric_limits<double>::max(), "any"};
}

}  // namespace

ColumnWatch::ColumnWatch(record::BoundColumn column)
    : column_(std::move(column)), measurable_(measurable_range(column_.channel.quantity)) {}

double ColumnWatch::pass(double value) {
  if (std::isnan(value)) return value;
  if (!(value >= measurable_.lowest && value <= measurable_.highest)) {
    ++impossible_;
    lowest_impossible_ = std::min(lowest_impossible_, value);
    highest_impossible_ = std::max(highest_impossible_, value);
    return std::numeric_limits<double>::quiet_NaN();
  }
  ++readings_;
  last_ = value;
  lowest_ = std::min(lowest_, value);
  highest_ = std::max(highest_, value);
  return value;
}

bool ColumnWatch::never_moves() const {
  return readings_ >= kReadingsOfAStuckSensor && !(lowest_ < highest_);
}

std::optional<std::string> ColumnWatch::complaint() const {
  if (impossible_ == 0) return std::nullopt;
  const std::uint64_t all = impossible_ + readings_;
  return column_name() + ": " + std::to_string(impossible_) + " of " + std::to_string(all) +
         " readings lie between " + significant(in_unit(lowest_impossible_), 4) + " and " +
         significant(in_unit(highest_impossible_), 4) + " " + unit() + ", expected " +
         measurable_.text + "; taken as not measured" + hint();
}

std::string ColumnWatch::column_name() const {
  return "column " + report::shortened(column_.header, kLongestHeader);
}

bool ColumnWatch::is_rate() const {
  return column_.channel.quantity == Quantity::kRate ||
         column_.channel.quantity == Quantity::kReference;
}

double ColumnWatch::in_unit(double value) const {
  return is_rate() ? value / core::kRadPerDeg : value;
}

std::string ColumnWatch::unit() const {
  return is_rate() ? "deg/s" : std::string(record::default_unit(column_.channel.quantity));
}

// What the unit probably is, where nearly all is impossible.
std::string ColumnWatch::hint() const {
  if (impossible_ < readings_) return {};
  constexpr double kZeroDegcInKelvin = 273.15;
  const auto fits = [&](double offset) {
    return lowest_impossible_ + offset >= measurable_.lowest &&
           highest_impossible_ + offset <= measurable_.highest;
  };
  const auto mapped = [&](const char* unit) {
    return " (is it in " + std::string(unit) + "? then --columns '" +
           record::name(column_.channel) + "=" + report::shortened(column_.header, kLongestHeader) +
           "[" + unit + "]')";
  };
  if (column_.channel.quantity == Quantity::kTemperature) {
    if (fits(-kZeroDegcInKelvin)) return mapped("K");
    if (fits(kZeroDegcInKelvin)) return mapped("degC");
  }
  if (is_rate()) return " (is the unit right? rad/s, deg/s and deg/h are accepted)";
  return " (is the unit right? accepted: " + record::accepted_units(column_.channel.quantity) + ")";
}

}  // namespace zerodrift::measurement
