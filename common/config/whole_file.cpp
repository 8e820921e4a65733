// SPDX-License-Identifier: Apache-2.0
#include "common/config/whole_file.h"

#include "common/config/config_error.h"
#include "common/files/atomic_file.h"
#include "common/files/file_error.h"
#include "common/files/input_file.h"

namespace zerodrift::config {
namespace {

constexpr std::size_t kLargestFile = 1U << 24U;  // far above the largest model's

}  // namespace

std::string read_whole(const std::filesystem::path& path) try {
  return files::read_whole_file(path, kLargestFile);
} catch (const files::FileError& error) {
  throw ConfigError(error.what());
}

void write_whole(const std::filesystem::path& path, std::string_view text) try {
  files::AtomicFile file(path);
  file.append(text);
  file.commit();
} catch (const files::FileError& error) {
  throw ConfigError(error.what());
}

}  // namespace zerodrift::config
