// SPDX-License-Identifier: Apache-2.0
#include "common/measurement/column_watch.h"

#include <cmath>
#include <utility>

#include "common/core/units.h"

namespace zerodrift::measurement {
namespace {

using record::Quantity;

constexpr std::uint64_t kReadingsOfAStuckSensor = 100;

}  // namespace

MeasurableRange measurable_range(Quantity quantity) {
  constexpr double kFastestRadps = 1e4 * core::kRadPerDeg;
  constexpr double kStrongestUt = 1e5;
  constexpr double kHardestMps2 = 1e3 * core::kStandardGravityMps2;
  switch (quantity) {
    case Quantity::kRate:
    case Quantity::kReference: return {{-kFastestRadps, kFastestRadps}, "-10000 to 10000 deg/s"};
    case Quantity::kTemperature: return {{-100.0, 200.0}, "-100 to 200 degC"};
    case Quantity::kMagnetic: return {{-kStrongestUt, kStrongestUt}, "-100 to 100 mT"};
    case Quantity::kAcceleration: return {{-kHardestMps2, kHardestMps2}, "-1000 to 1000 g"};
    case Quantity::kVibration: return {{0.0, 1e3}, "0 to 1000 g"};
    case Quantity::kSourceCurrent: return {{0.0, 1e5}, "0 to 100 A"};
    case Quantity::kSupply: return {{-1e3, 1e3}, "-1000 to 1000 V"};
    case Quantity::kTime: break;
  }
  return {{-std::numeric_limits<double>::max(), std::numeric_limits<double>::max()}, "any"};
}

ColumnWatch::ColumnWatch(record::BoundColumn column)
    : column_(std::move(column)), measurable_(measurable_range(column_.channel.quantity).range) {}

double ColumnWatch::pass(double value) {
  if (std::isnan(value)) return value;
  if (!measurable_.holds(value)) {
    ++impossible_;
    refused_.include(value);
    return std::numeric_limits<double>::quiet_NaN();
  }
  ++readings_;
  passed_.include(value);
  return value;
}

bool ColumnWatch::never_moves() const {
  return readings_ >= kReadingsOfAStuckSensor && !(passed_.lowest < passed_.highest);
}

}  // namespace zerodrift::measurement
