// SPDX-License-Identifier: Apache-2.0
#include "common/drivers/sysfs_environment.h"

#include <algorithm>
#include <charconv>
#include <string_view>
#include <utility>

#include "common/core/measurable.h"
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

std::string short_text(double value) {
  constexpr int kDigits = 6;
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value,
                                 std::chars_format::general, kDigits);
  return {text.data(), end.ptr};
}

FileValue read_file(const EnvironmentFile& file, const std::string& chip) {
  FileValue found =
      file.path.filename().string().ends_with(kRaw) ? read_iio(file.path) : read_number(file.path);
  found = of_chip(std::move(found), file.path, chip);
  if (!found.value) return found;
  *found.value *= (file.is_reversed ? -1.0 : 1.0) * kind_of(file).per_unit;
  const core::MeasurableRange& measurable = core::measurable_environment(file.channel);
  if (measurable.holds(*found.value)) return found;
  return no_value(file.path, "found " + short_text(*found.value) + ' ' + measurable.unit +
                                 ", expected " + measurable.text);
}

}  // namespace

SysfsEnvironment::SysfsEnvironment(std::vector<EnvironmentFile> files) : files_(std::move(files)) {
  for (const EnvironmentFile& file : files_) {
    static_cast<void>(kind_of(file));
    chips_.push_back(chip_of(file.path));
    if (FileValue first = read_file(file, chips_.back()); !first.value)
      throw DriverError(first.reason);
    channels_ |= 1U << file.channel;
  }
}

EnvironmentReading SysfsEnvironment::read(core::SensorTime host_time) {
  EnvironmentReading reading;
  reading.sample.sequence = next_sequence_++;
  reading.sample.time = host_time;
  reading.sample.channels = channels_;
  reading.sample.clock = core::ClockSource::kHost;
  for (std::size_t i = 0; i < files_.size(); ++i) {
    FileValue found = read_file(files_[i], chips_[i]);
    if (found.value) {
      core::channel(reading.sample.values, files_[i].channel) = *found.value;
    } else {
      reading.not_measured.push_back({files_[i].channel, std::move(found.reason)});
    }
  }
  return reading;
}

}  // namespace zerodrift::drivers
