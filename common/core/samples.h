// SPDX-License-Identifier: Apache-2.0
// What the sensors say, free of any transport: the domain types that sources produce and algorithms
// consume.
#pragma once

#include <cstdint>
#include <string>

#include "common/core/axis.h"
#include "common/core/state_archive.h"
#include "common/core/time.h"

namespace zerodrift::core {

// Where a sample's time comes from, which decides how a consumer may treat it.
enum class ClockSource : std::uint32_t {
  kUnknown = 0,
  kHardware = 1,  // a sensor's own clock: never wait for anything
  kHost = 2,      // stamped on arrival by the host: never wait for anything
  kReplay =
      3,  // a record: the sender waits for its consumers, so a consumer may complete its work first
  kSimulation = 4,  // the twin: as kReplay
};

// True where the source paces itself by its consumers, so that waiting loses nothing.
constexpr bool is_paced_by_consumers(ClockSource source) {
  return source == ClockSource::kReplay || source == ClockSource::kSimulation;
}

// One reading of a three-axis gyro, body frame. An axis that was not measured, is not finite or is
// known to be bad has valid = false; its rate then carries what came in (NaN where nothing did).
struct AngularRateSample {
  std::uint64_t sequence = 0;    // counts up by one a sample at the source
  SensorTime time{0};            // end of the integration interval
  double interval_s = 0.0;       // integration interval behind the delta-angle
  PerAxis<double> rate_radps{};  // mean rate over the interval, frame b
  PerAxis<bool> valid{};
  PerAxis<bool> clipped{};  // the sensor says it saturated
  ClockSource clock = ClockSource::kUnknown;
};

// One reading of one thermometer. `measured` = false says: nothing was measured up to `time` (a
// blank cell of a record, a failed read); it still moves the stream's time forward.
struct TemperatureSample {
  std::string probe;  // "coil", "coil_inner", "coil_outer", "case", "board", ...
  std::uint64_t sequence = 0;
  SensorTime time{0};
  double temperature_degc = 0.0;
  bool measured = true;
  ClockSource clock = ClockSource::kUnknown;
};

// What a reference knows of the true rate, body frame.
enum class ReferenceKind : std::uint32_t {
  kNone = 0,
  kRest = 1,  // declared at rest; rate = Earth rate in b, or 0 where Earth rate counts as drift
  kRateTable = 2,           // measured by a rate table
  kRecord = 3,              // a record's reference columns
  kNavigationResidual = 4,  // a filter's residual bias: drift applied at that time + residual
};

struct RateReferenceSample {
  SensorTime time{0};
  PerAxis<double> rate_radps{};
  PerAxis<double> variance{};  // (rad/s)²
  PerAxis<bool> valid{};
  ReferenceKind kind = ReferenceKind::kNone;
  std::uint64_t model_epoch = 0;  // for kNavigationResidual: the epoch the residual was seen under

  void carry(StateArchive& archive) {
    archive(time, rate_radps, variance, valid, kind, model_epoch);
  }
};

}  // namespace zerodrift::core
