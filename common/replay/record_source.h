// SPDX-License-Identifier: Apache-2.0
// A record as the streams that publishers send: what the publishers' own record sources and
// `zerodrift replay` have in common.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/core/samples.h"
#include "common/record/record_reader.h"

namespace zerodrift::replay {

struct RecordSourceOptions {
  record::RecordInput record{};
  double from_s = 0.0;                               // since the record's first rate
  double to_s = 0.0;                                 // 0: to the end
  std::optional<std::uint32_t> preferred_gyro_id{};  // record::RecordOptions
};

// A sample and what the source knows of the true rate. A reference may come without a rate.
struct GyroReading {
  std::optional<core::AngularRateSample> rate{};
  std::optional<core::RateReferenceSample> reference{};
};

// The next reading; nothing at the end.
using GyroSource = std::function<std::optional<GyroReading>()>;
using ThermalReading = std::variant<core::TemperatureSample, core::EnvironmentSample>;
// Temperatures of all probes and the environment, in order of time.
struct ThermalSource {
  std::vector<std::string> probes{};          // all that it has
  core::EnvironmentChannels environment = 0;  // likewise
  // The next reading; nothing at the end.
  std::function<std::optional<ThermalReading>()> next{};
};
using Warn = std::function<void(const std::string&)>;

// `warn` gets one line each for what is odd but usable. Throw std::invalid_argument or
// files::FileError with one line otherwise, the sources too. Clocks that are no replay's or
// simulation's become kReplay: the sender paces itself by its consumers now.
[[nodiscard]] GyroSource open_gyro_record(const RecordSourceOptions& options, const Warn& warn);
[[nodiscard]] ThermalSource open_thermal_record(const RecordSourceOptions& options,
                                                const Warn& warn);

}  // namespace zerodrift::replay
