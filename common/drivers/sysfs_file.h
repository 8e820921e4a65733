// SPDX-License-Identifier: Apache-2.0
// Numbers that Linux shows as files below /sys. Nothing here throws for what a file holds.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace zerodrift::drivers {

// A value, or one line that names the file and what was found.
struct FileValue {
  std::optional<double> value;
  std::string reason;
};

[[nodiscard]] FileValue no_value(const std::filesystem::path& path, const std::string& why);

// At most a page; nullopt, with errno set, where the file can't be read.
[[nodiscard]] std::optional<std::string> read_text(const std::filesystem::path& path);
[[nodiscard]] FileValue cannot_read(const std::filesystem::path& path);  // by errno

[[nodiscard]] std::string_view trim(std::string_view text);
// "found 'warm'": what stood there, safe to print, at most 60 bytes.
[[nodiscard]] std::string found_text(std::string_view text);
[[nodiscard]] std::optional<double> parse_number(std::string_view text);

[[nodiscard]] FileValue read_number(const std::filesystem::path& path);

// in_<channel>_raw of IIO: (raw + in_<channel>_offset) * in_<channel>_scale. A channel with an
// index (in_temp0_raw), an axis (in_magn_x_raw) or another modifier (in_temp_ambient_raw) may share
// the files of its type (in_magn_scale, in_temp_scale). Source: ABI/testing/sysfs-bus-iio.
[[nodiscard]] FileValue read_iio(const std::filesystem::path& raw);

// What the chip of a file calls itself, in `name` beside it; empty where it says nothing.
[[nodiscard]] std::string chip_of(const std::filesystem::path& file);
// What was read, unless the file is of another chip by now: the numbers of hwmon and IIO go to who
// comes first.
[[nodiscard]] FileValue of_chip(FileValue value, const std::filesystem::path& file,
                                const std::string& chip);

// Sorted; none where the folder can't be read.
[[nodiscard]] std::vector<std::filesystem::path> entries_of(const std::filesystem::path& folder);

}  // namespace zerodrift::drivers
