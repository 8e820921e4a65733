// SPDX-License-Identifier: Apache-2.0
// What the compiler really read, out of Ninja's log of the last build.
#pragma once

#include <filesystem>
#include <istream>
#include <string>
#include <vector>

namespace zerodrift::architecture {

// One compiled source and every file the compiler opened for it.
struct Compilation {
  std::string source;
  std::vector<std::string> opened;
};

// Reads the output of `ninja -t deps`. Entries that Ninja calls stale (their object is gone or
// newer than the log) are left out. Paths become absolute, from `build_dir` where relative.
std::vector<Compilation> parse_dependencies(std::istream& log,
                                            const std::filesystem::path& build_dir);

// Runs `ninja -t deps` in a build tree. Throws std::runtime_error where that fails, as with
// another generator.
std::vector<Compilation> read_dependencies(const std::string& ninja,
                                           const std::filesystem::path& build_dir);

}  // namespace zerodrift::architecture
