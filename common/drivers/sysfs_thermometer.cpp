// SPDX-License-Identifier: Apache-2.0
#include "common/drivers/sysfs_thermometer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "common/drivers/driver_error.h"

namespace zerodrift::drivers {
namespace {

namespace fs = std::filesystem;

constexpr double kDegcPerMillidegree = 1e-3;
constexpr double kAbsoluteZeroDegc = -273.15;
constexpr double kHottestDegc = 2000.0;  // of any thermocouple

// No sensor's registers are all 0, but the CRC of nothing else than zeros is 0.
constexpr std::string_view kShorted = "00 00 00 00 00 00 00 00 00 ";

FileValue read_w1_slave(const fs::path& path) {
  const std::optional<std::string> text = read_text(path);
  if (!text) return cannot_read(path);
  if (text->find("YES") == std::string::npos)
    return no_value(path, "the 1-wire CRC does not say YES");
  if (text->starts_with(kShorted))
    return no_value(path, "all that it says is 0: the 1-wire bus is shorted to ground");
  const std::size_t at = text->find("t=");
  const std::optional<double> number =
      at == std::string::npos ? std::nullopt : parse_number(text->substr(at + 2));
  if (!number) return no_value(path, found_text(*text) + ", expected t=<m°C>");
  return {number, {}};
}

// `temperature` of a 1-wire sensor shows no bytes; w1_slave beside it does.
FileValue read_temperature(const fs::path& path) {
  const FileValue value = read_number(path);
  std::error_code ignored;
  const fs::path bytes = path.parent_path() / "w1_slave";
  const bool is_doubtful = value.value == 0.0 && path.filename() == "temperature";
  return is_doubtful && fs::exists(bytes, ignored) ? read_w1_slave(bytes) : value;
}

// temp1_fault of hwmon: an open or missing sensor, whose temp1_input is any number.
bool is_faulty(const fs::path& path) {
  const std::string file = path.filename().string();
  if (!file.starts_with("temp") || !file.ends_with("_input")) return false;
  const fs::path fault = path.parent_path() / (file.substr(0, file.rfind('_')) + "_fault");
  return read_number(fault).value.value_or(0.0) != 0.0;
}

FileValue read_file(const ThermometerFile& file) {
  switch (file.kind) {
    case ThermometerKind::kMillidegreeFile: return read_temperature(file.path);
    case ThermometerKind::kIioRaw: return read_iio(file.path);
    case ThermometerKind::kW1Slave: return read_w1_slave(file.path);
  }
  return {};
}

std::optional<ThermometerKind> kind_of(const std::string& file_name) {
  const std::string_view file{file_name};
  const bool is_temperature_input = file.starts_with("temp") || file.starts_with("in_temp");
  if (is_temperature_input && file.ends_with("_input")) return ThermometerKind::kMillidegreeFile;
  if (file.starts_with("in_temp") && file.ends_with("_raw")) return ThermometerKind::kIioRaw;
  if (file == "w1_slave") return ThermometerKind::kW1Slave;
  if (file == "temperature") return ThermometerKind::kMillidegreeFile;
  return std::nullopt;
}

std::string as_probe_name(std::string_view text) {
  std::string probe;
  for (const char c : text) {
    const bool upper = c >= 'A' && c <= 'Z';
    const bool kept = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
    if (upper) {
      probe += static_cast<char>(c - 'A' + 'a');
    } else if (kept) {
      probe += c;
    } else if (!probe.empty() && probe.back() != '_') {
      probe += '_';
    }
  }
  while (probe.ends_with('_')) probe.pop_back();
  return probe;
}

std::string text_or(const fs::path& path, const std::string& otherwise) {
  const std::optional<std::string> text = read_text(path);
  const std::string_view content = text ? trim(*text) : std::string_view{};
  return content.empty() ? otherwise : std::string{content};
}

// temp1_input -> its label, else coretemp_temp1; in_temp_raw -> <device>_temp; w1_slave -> w1_<id>.
std::string probe_name(const fs::path& path) {
  const fs::path folder = path.parent_path();
  const std::string file = path.filename().string();
  const std::string channel = file.substr(0, file.rfind('_'));
  if (file == "w1_slave" || file == "temperature")
    return as_probe_name("w1_" + folder.filename().string());
  const std::string chip = text_or(folder / "name", folder.filename().string());
  const std::string_view short_channel =
      std::string_view{channel}.substr(channel.starts_with("in_") ? 3 : 0);
  return as_probe_name(
      text_or(folder / (channel + "_label"), chip + "_" + std::string{short_channel}));
}

// A 1-wire sensor shows both files; `temperature` needs no parsing.
bool is_shown_better_by(const fs::path& path, const std::vector<fs::path>& siblings) {
  const std::string file = path.filename().string();
  const auto has = [&](const std::string& name) {
    return std::find(siblings.begin(), siblings.end(), path.parent_path() / name) != siblings.end();
  };
  if (file == "w1_slave") return has("temperature");
  if (file.ends_with("_raw")) return has(file.substr(0, file.size() - 4) + "_input");
  return false;
}

void make_unique(std::string& probe, const std::vector<ThermometerFile>& others) {
  const std::string stem = probe.substr(0, kLongestProbe);
  probe = stem;
  const auto taken = [&] {
    return std::any_of(others.begin(), others.end(),
                       [&](const ThermometerFile& other) { return other.probe == probe; });
  };
  for (int number = 2; taken(); ++number) {
    const std::string suffix = "_" + std::to_string(number);
    probe = stem.substr(0, kLongestProbe - suffix.size()) + suffix;
  }
}

}  // namespace

std::vector<ThermometerFile> discover_thermometers(const std::filesystem::path& root) {
  constexpr std::array<const char*, 3> kFolders{"class/hwmon", "bus/iio/devices", "bus/w1/devices"};
  std::vector<ThermometerFile> found;
  for (const char* folder : kFolders) {
    for (const fs::path& device : entries_of(root / folder)) {
      const std::vector<fs::path> files = entries_of(device);
      for (const fs::path& path : files) {
        const std::optional<ThermometerKind> kind = kind_of(path.filename().string());
        if (!kind || is_shown_better_by(path, files)) continue;
        std::string probe = probe_name(path);
        make_unique(probe, found);
        found.push_back({std::move(probe), path, *kind});
      }
    }
  }
  return found;
}

ThermometerFile describe_thermometer(std::string probe, const std::filesystem::path& path) {
  const std::optional<ThermometerKind> kind = kind_of(path.filename().string());
  if (!kind) {
    throw DriverError(path.string() +
                      ": no thermometer file; expected temp*_input, in_temp*_input, in_temp*_raw, "
                      "temperature or w1_slave");
  }
  return {std::move(probe), path, *kind};
}

SysfsThermometer::SysfsThermometer(ThermometerFile file)
    : file_(std::move(file)), chip_(chip_of(file_.path)) {
  const FileValue first = read_millidegrees();
  if (!first.value) throw DriverError(first.reason);
}

FileValue SysfsThermometer::read_millidegrees() const {
  const fs::path& path = file_.path;
  if (is_faulty(path)) return no_value(path, "its fault file says that the sensor is open or gone");
  const FileValue value = of_chip(read_file(file_), path, chip_);
  if (!value.value) return value;
  const double degc = *value.value * kDegcPerMillidegree;
  if (degc < kAbsoluteZeroDegc || degc > kHottestDegc)
    return no_value(path, "found " + std::to_string(std::llround(degc)) + " °C, no temperature");
  return value;
}

ThermometerReading SysfsThermometer::read() {
  FileValue outcome = read_millidegrees();
  ThermometerReading reading;
  reading.sample.probe = file_.probe;
  reading.sample.sequence = next_sequence_++;
  reading.sample.measured = outcome.value.has_value();
  reading.sample.temperature_degc = outcome.value ? *outcome.value * kDegcPerMillidegree
                                                  : std::numeric_limits<double>::quiet_NaN();
  reading.sample.clock = core::ClockSource::kHost;
  reading.reason = std::move(outcome.reason);
  return reading;
}

}  // namespace zerodrift::drivers
