// SPDX-License-Identifier: Apache-2.0
#include "common/measurement/column_watch.h"

#include <cmath>
#include <utility>

#include "common/core/measurable.h"
#include "common/core/units.h"

namespace zerodrift::measurement {
namespace {

using record::Quantity;

constexpr std::uint64_t kReadingsOfAStuckSensor = 100;

MeasurableRange of(const core::MeasurableRange& range) {
  return {{range.lowest, range.highest}, range.text};
}

}  // namespace

MeasurableRange measurable_range(Quantity quantity) {
  constexpr double kFastestRadps = 1e4 * core::kRadPerDeg;
  switch (quantity) {
    case Quantity::kRate:
    case Quantity::kReference: return {{-kFastestRadps, kFastestRadps}, "-10000 to 10000 deg/s"};
    case Quantity::kTemperature: return {{-100.0, 200.0}, "-100 to 200 degC"};
    case Quantity::kMagnetic: return of(core::kMeasurableMagneticUt);
    case Quantity::kAcceleration: return of(core::kMeasurableAccelerationMps2);
    case Quantity::kVibration: return of(core::kMeasurableVibrationG);
    case Quantity::kSourceCurrent: return of(core::kMeasurableSourceCurrentMa);
    case Quantity::kSupply: return of(core::kMeasurableSupplyV);
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
