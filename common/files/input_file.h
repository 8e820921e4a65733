// SPDX-License-Identifier: Apache-2.0
// Files that are read. They are regular files: a record is read more than once, and a device or a
// pipe may never end.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "common/files/descriptor.h"

namespace zerodrift::files {

// Never waits, as opening a pipe would. Throws FileError where the file can't be opened or is no
// regular file.
[[nodiscard]] Descriptor open_regular_file(const std::filesystem::path& path);

// What is left of a file; where that is more than `most_bytes`, some of it, which is more, too.
// Nothing where reading fails, with errno.
[[nodiscard]] std::optional<std::string> read_up_to(int fd, std::size_t most_bytes);

// Throws FileError, also where the file holds more than `most_bytes`.
[[nodiscard]] std::string read_whole_file(const std::filesystem::path& path,
                                          std::size_t most_bytes);

// The first `most_bytes` of a regular file, all of it where it is shorter; empty where it can't be
// opened or read, which whoever reads on says.
[[nodiscard]] std::string beginning_of(const std::filesystem::path& path, std::size_t most_bytes);

// Calls `take` with the bytes of a regular file, a block after the other. Throws FileError.
void read_in_blocks(const std::filesystem::path& path,
                    const std::function<void(std::string_view)>& take);

}  // namespace zerodrift::files
