// SPDX-License-Identifier: Apache-2.0
// What the sensors say, free of any transport: the domain types that sources produce and algorithms
// consume.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
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

// Whether a number can be the rate of a gyro at all: finite, and within 1e6 rad/s. Loggers write
// numbers as 1e38 for what they don't have, whose square or sum no statistics survive.
[[nodiscard]] inline bool is_rate(double rate_radps) noexcept {
  return std::abs(rate_radps) <= 1e6;
}

// One reading of a three-axis gyro, body frame. An axis that was not measured, is no rate or is
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

inline constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();
inline constexpr PerAxis<double> kNoAxisMeasured{kNotMeasured, kNotMeasured, kNotMeasured};

// What a gyro is exposed to beside rotation and temperature; NaN: not measured. A channel's number
// is its place here, each axis counted: 0 magnetic_ut[0] to 8 supply_v.
struct Environment {
  PerAxis<double> magnetic_ut = kNoAxisMeasured;        // frame b
  PerAxis<double> acceleration_mps2 = kNoAxisMeasured;  // specific force, frame b
  double vibration_g = kNotMeasured;                    // rms
  double source_current_ma = kNotMeasured;
  double supply_v = kNotMeasured;
};

inline constexpr std::size_t kEnvironmentChannels = 9;

[[nodiscard]] constexpr const double& channel(const Environment& environment,
                                              std::size_t number) noexcept {
  if (number < kAxisCount) return environment.magnetic_ut[number];
  if (number < 2 * kAxisCount) return environment.acceleration_mps2[number - kAxisCount];
  if (number == 2 * kAxisCount) return environment.vibration_g;
  return number == 2 * kAxisCount + 1 ? environment.source_current_ma : environment.supply_v;
}
[[nodiscard]] constexpr double& channel(Environment& environment, std::size_t number) noexcept {
  return const_cast<double&>(channel(static_cast<const Environment&>(environment), number));
}

[[nodiscard]] inline bool is_any_measured(const Environment& environment) noexcept {
  for (std::size_t i = 0; i < kEnvironmentChannels; ++i) {
    if (std::isfinite(channel(environment, i))) return true;
  }
  return false;
}

// A set of channels, a bit each.
using EnvironmentChannels = std::uint32_t;
[[nodiscard]] constexpr bool has_channel(EnvironmentChannels channels,
                                         std::size_t number) noexcept {
  return (channels >> number & 1U) != 0;
}

// What was measured of it at one time. A channel of `channels` without a value says: nothing was
// measured up to `time`.
struct EnvironmentSample {
  std::uint64_t sequence = 0;
  SensorTime time{0};
  EnvironmentChannels channels = 0;  // those that the source has; no other has a value
  Environment values{};              // finite or NaN
  ClockSource clock = ClockSource::kUnknown;
};

// Of values as they came: leaves those that are of a channel, were measured and are finite.
inline void keep_measured(EnvironmentSample& sample, EnvironmentChannels channels,
                          EnvironmentChannels measured) noexcept {
  sample.channels = channels & ((1U << kEnvironmentChannels) - 1U);
  for (std::size_t i = 0; i < kEnvironmentChannels; ++i) {
    double& value = channel(sample.values, i);
    if (!has_channel(channels & measured, i) || !std::isfinite(value)) value = kNotMeasured;
  }
}

// What a reference knows of the true rate, body frame.
enum class ReferenceKind : std::uint32_t {
  kNone = 0,
  kRest = 1,  // declared at rest; rate = Earth rate in b, or 0 where Earth rate counts as drift
  kRateTable = 2,           // measured by a rate table
  kRecord = 3,              // a record's reference columns
  kNavigationResidual = 4,  // a filter's residual bias: drift applied at that time + residual
};
// Measured from outside. The other kinds are nobody's true rate: what a filter knows of the drift,
// or that the vehicle rests.
constexpr bool is_true_rate(ReferenceKind kind) {
  return kind == ReferenceKind::kRateTable || kind == ReferenceKind::kRecord;
}

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
