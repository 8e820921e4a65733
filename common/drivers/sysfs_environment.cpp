// SPDX-License-Identifier: Apache-2.0
#include "common/drivers/sysfs_environment.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "common/drivers/driver_error.h"
#include "common/drivers/sysfs_file.h"

namespace zerodrift::drivers {
namespace {

constexpr std::string_view kRaw = "_raw";
constexpr std::string_view kInput = "_input";

// What files of one kind measure. A number or an axis follows the stem.
struct Kind {
  std::string_view stem;
  core::EnvironmentChannels channels;
  double per_unit;  // the channel's unit in the file's
  bool has_raw;
};

constexpr std::array kKinds{
    Kind{"in_magn_", 0b111U, 100.0, true},    Kind{"in_accel_", 0b111U << 3U, 1.0, true},
    Kind{"in_current", 1U << 7U, 1.0, true},  Kind{"curr", 1U << 7U, 1.0, false},
    Kind{"in_voltage", 1U << 8U, 1e-3, true}, Kind{"in", 1U << 8U, 1e-3, false}};

bool is_of(const Kind& kind, std::string_view file) {
  if (!file.starts_with(kind.stem)) return false;
  file.remove_prefix(kind.stem.size());
  const std::string_view what = file.substr(0, file.find('_'));
  const bool is_end =
      file.substr(what.size()) == kInput || (kind.has_raw && file.substr(what.size()) == kRaw);
  return is_end && (what.find_first_not_of("0123456789") == std::string_view::npos ||
                    what.find_first_not_of("xyz") == std::string_view::npos);
}

const Kind& kind_of(const EnvironmentFile& file) {
  const std::string name = file.path.filename().string();
  std::string expected;
  for (const Kind& kind : kKinds) {
    if (!core::has_channel(kind.channels, file.channel)) continue;
    if (is_of(kind, name)) return kind;
    expected += (expected.empty() ? ", expected " : " or ") + std::string(kind.stem) + "*_input";
    if (kind.has_raw) expected += " or " + std::string(kind.stem) + "*_raw";
  }
  throw DriverError(file.path.string() + ": no file of this channel" +
                    (expected.empty() ? "; Linux shows none" : expected));
}

FileValue read_file(const EnvironmentFile& file) {
  FileValue found =
      file.path.filename().string().ends_with(kRaw) ? read_iio(file.path) : read_number(file.path);
  if (found.value) *found.value *= (file.is_reversed ? -1.0 : 1.0) * kind_of(file).per_unit;
  return found;
}

}  // namespace

SysfsEnvironment::SysfsEnvironment(std::vector<EnvironmentFile> files) : files_(std::move(files)) {
  for (const EnvironmentFile& file : files_) {
    static_cast<void>(kind_of(file));
    if (FileValue first = read_file(file); !first.value) throw DriverError(first.reason);
    channels_ |= 1U << file.channel;
  }
}

EnvironmentReading SysfsEnvironment::read(core::SensorTime host_time) {
  EnvironmentReading reading;
  reading.sample.sequence = next_sequence_++;
  reading.sample.time = host_time;
  reading.sample.channels = channels_;
  reading.sample.clock = core::ClockSource::kHost;
  for (const EnvironmentFile& file : files_) {
    FileValue found = read_file(file);
    if (found.value) {
      core::channel(reading.sample.values, file.channel) = *found.value;
    } else {
      reading.reasons.push_back(std::move(found.reason));
    }
  }
  return reading;
}

}  // namespace zerodrift::drivers
