// SPDX-License-Identifier: Apache-2.0
// Thermometers that Linux shows as files: hwmon, IIO and 1-wire.
//
//   class/hwmon/hwmon*/temp*_input              m°C; named by temp*_label, else <chip>_temp*; no
//                                               temperature where temp*_fault beside it is not 0
//   bus/iio/devices/iio:device*/in_temp*_input  m°C; named <device>_temp*
//   bus/iio/devices/iio:device*/in_temp*_raw    (raw + in_temp*_offset) * in_temp*_scale, m°C
//   bus/w1/devices/*/temperature                m°C; named w1_<id>
//   bus/w1/devices/*/w1_slave                   "... crc=.. YES", then "... t=<m°C>"
//
// Sources: kernel documentation hwmon/sysfs-interface, ABI/testing/sysfs-bus-iio,
// w1/slaves/w1_therm.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/core/samples.h"
#include "common/drivers/sysfs_file.h"

namespace zerodrift::drivers {

enum class ThermometerKind : std::uint8_t { kMillidegreeFile, kIioRaw, kW1Slave };

// As many bytes of a probe's name go over the wire (idl/dds/temperature.idl).
inline constexpr std::size_t kLongestProbe = 32;

struct ThermometerFile {
  std::string probe;  // [a-z0-9_], different from every other
  std::filesystem::path path;
  ThermometerKind kind = ThermometerKind::kMillidegreeFile;
};

// All thermometers below `root` ("/sys"), sorted by path; none is no error.
[[nodiscard]] std::vector<ThermometerFile> discover_thermometers(const std::filesystem::path& root);

// The kind follows from the file's name. Throws DriverError for a name that is none of the above.
[[nodiscard]] ThermometerFile describe_thermometer(std::string probe,
                                                   const std::filesystem::path& path);

struct ThermometerReading {
  core::TemperatureSample sample;  // measured = false, and NaN, where the file gave no temperature
  std::string reason;              // then one line that names the file and what was found
};

class SysfsThermometer {
 public:
  // Reads once, to throw DriverError now for a file that is missing or holds no temperature.
  explicit SysfsThermometer(ThermometerFile file);

  // Reads the file again; its temperature is of the time when this returns, which the caller stamps
  // it with. Never throws for what it finds; a file that comes back is read again, but one of
  // another chip is not this thermometer. Some 10 µs for hwmon and IIO, up to 0.75 s for 1-wire,
  // which converts while it is read.
  [[nodiscard]] ThermometerReading read();

  [[nodiscard]] const ThermometerFile& file() const noexcept { return file_; }

 private:
  [[nodiscard]] FileValue read_millidegrees() const;

  ThermometerFile file_;
  std::string chip_;  // as it says; empty where it says nothing
  std::uint64_t next_sequence_ = 0;
};

}  // namespace zerodrift::drivers
