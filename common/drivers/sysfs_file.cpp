// SPDX-License-Identifier: Apache-2.0
#include "common/drivers/sysfs_file.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <system_error>

#include "common/core/one_line.h"

namespace zerodrift::drivers {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestFile = 4096;  // sysfs gives at most a page

// in_magn_x, in_temp0, in_temp_ambient -> in_magn, in_temp
std::string type_of(const std::string& channel) {
  constexpr std::string_view kDirection = "in_";
  constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyz";
  return channel.substr(0, channel.find_first_not_of(kLetters, kDirection.size()));
}

std::string channel_of(const fs::path& raw) {
  const std::string file = raw.filename().string();
  return file.substr(0, file.rfind("_raw"));
}

std::optional<fs::path> iio_attribute(const fs::path& raw, std::string_view attribute) {
  const std::string channel = channel_of(raw);
  std::error_code ignored;
  for (const std::string& stem : {channel, type_of(channel)}) {
    fs::path candidate = raw.parent_path() / (stem + std::string{attribute});
    if (fs::exists(candidate, ignored)) return candidate;
  }
  return std::nullopt;
}

}  // namespace

FileValue no_value(const fs::path& path, const std::string& why) {
  return {std::nullopt, path.string() + ": " + why};
}

FileValue cannot_read(const fs::path& path) {
  return no_value(path, std::string{"cannot read the sensor: "} + std::strerror(errno));
}

std::string_view trim(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

std::string found_text(std::string_view text) {
  constexpr std::size_t kLongestShown = 60;
  return "found '" + core::one_line(trim(text), kLongestShown) + "'";
}

std::optional<double> parse_number(std::string_view text) {
  text = trim(text);
  double value = 0.0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc{} || stop != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<std::string> read_text(const fs::path& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    errno = EISDIR;
    return std::nullopt;
  }
  errno = 0;
  std::ifstream file{path, std::ios::binary};
  std::string text(kLongestFile, '\0');
  if (!file || (file.read(text.data(), static_cast<std::streamsize>(text.size())), file.bad())) {
    if (errno == 0) errno = EIO;
    return std::nullopt;
  }
  text.resize(static_cast<std::size_t>(file.gcount()));
  return text;
}

FileValue read_number(const fs::path& path) {
  const std::optional<std::string> text = read_text(path);
  if (!text) return cannot_read(path);
  const std::optional<double> number = parse_number(*text);
  if (!number) return no_value(path, found_text(*text) + ", expected a number");
  return {number, {}};
}

FileValue read_iio(const fs::path& raw) {
  FileValue result = read_number(raw);
  if (!result.value) return result;
  if (const auto path = iio_attribute(raw, "_offset")) {
    const FileValue offset = read_number(*path);
    if (!offset.value) return offset;
    *result.value += *offset.value;
  }
  const auto path = iio_attribute(raw, "_scale");
  if (!path) {
    const std::string own = channel_of(raw);
    const std::string shared = type_of(own);
    const std::string none = shared == own ? "has no " : "has neither " + own + "_scale nor ";
    return no_value(raw, none + shared + "_scale beside it, without which counts mean nothing");
  }
  const FileValue scale = read_number(*path);
  if (!scale.value) return scale;
  *result.value *= *scale.value;
  return result;
}

std::string chip_of(const fs::path& file) {
  const std::optional<std::string> name = read_text(file.parent_path() / "name");
  return name ? std::string{trim(*name)} : "";
}

FileValue of_chip(FileValue value, const fs::path& file, const std::string& chip) {
  if (!value.value) return value;
  const std::string now = chip_of(file);
  return now == chip ? value : no_value(file, "is now of '" + now + "', was of '" + chip + "'");
}

std::vector<fs::path> entries_of(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> entries;
  for (fs::directory_iterator it{folder, error}, end; !error && it != end; it.increment(error))
    entries.push_back(it->path());
  std::sort(entries.begin(), entries.end());
  return entries;
}

}  // namespace zerodrift::drivers
