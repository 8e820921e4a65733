// SPDX-License-Identifier: Apache-2.0
// Files that are read. They are regular files: a record is read more than once, and a device or a
// pipe may never end.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

namespace zerodrift::files {

// A file descriptor, the caller's to close. Never waits, as opening a pipe would. Throws
// FileError where the file can't be opened or is no regular file.
[[nodiscard]] int open_regular_file(const std::filesystem::path& path);

// What is left of a file; where that is more than `most_bytes`, some of it, which is more, too.
// Nothing where reading fails, with errno.
[[nodiscard]] std::optional<std::string> read_up_to(int fd, std::size_t most_bytes);

// Throws FileError, also where the file holds more than `most_bytes`.
[[nodiscard]] std::string read_whole_file(const std::filesystem::path& path,
                                          std::size_t most_bytes);

// The first `most_bytes` of a regular file, all of it where it is shorter; empty where it can't be
// opened or read, which whoever reads on says.
[[nodiscard]] std::string beginning_of(const std::filesystem::path& path, std::size_t most_bytes);

}  // namespace zerodrift::files
