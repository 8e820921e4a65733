// SPDX-License-Identifier: Apache-2.0
// Field, acceleration, source current and supply as Linux shows them, each in a file that is named:
// which of a board's sensors is the gyro's, and how it lies on it, no file says.
//
//   in_magn_<x|y|z>_raw, _input    IIO, G     magnetic_<axis>
//   in_accel_<x|y|z>_raw, _input   IIO, m/s²  acceleration_<axis>
//   in_current<n>_raw, _input      IIO, mA    source_current
//   curr<n>_input                  hwmon, mA  source_current
//   in_voltage<n>_raw, _input      IIO, mV    supply
//   in<n>_input                    hwmon, mV  supply
//
// Sources: kernel documentation hwmon/sysfs-interface, ABI/testing/sysfs-bus-iio.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/core/samples.h"

namespace zerodrift::drivers {

struct EnvironmentFile {
  std::size_t channel = 0;  // its number in core::Environment
  std::filesystem::path path;
  bool is_reversed = false;  // the sensor's axis points the other way
};

// One line that names the file of a channel that gave no value, and what was found.
struct NotMeasured {
  std::size_t channel = 0;
  std::string reason;
};

struct EnvironmentReading {
  core::EnvironmentSample sample;
  std::vector<NotMeasured> not_measured;
};

class SysfsEnvironment {
 public:
  // Reads each file once, to throw DriverError now where it measures another quantity, is missing
  // or holds nothing that a sensor of the quantity measures.
  explicit SysfsEnvironment(std::vector<EnvironmentFile> files);

  // Reads all again, some 10 µs each. Never throws for what it finds; a file that comes back is
  // read again, but one of another chip is not this sensor.
  [[nodiscard]] EnvironmentReading read(core::SensorTime host_time);

 private:
  std::vector<EnvironmentFile> files_;
  std::vector<std::string> chips_;  // of each file, as it says
  core::EnvironmentChannels channels_ = 0;
  std::uint64_t next_sequence_ = 0;
};

}  // namespace zerodrift::drivers
