// SPDX-License-Identifier: Apache-2.0
// A file that somebody elsewhere names, by a command over the network: a plain name in one folder,
// never a path.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace zerodrift::files {

// What such a name is refused for. what() is one line that quotes the name and nothing else: not
// the folder, not what the file holds.
class NameRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Why that is no name, or nothing: 1 to 64 letters, digits, '-', '_' and '.', the first no '.'.
[[nodiscard]] std::optional<std::string> problem_of_name(std::string_view name);

// The name in quotes, as one clean and bounded line, for a message.
[[nodiscard]] std::string quoted_name(std::string_view name);

// All bytes of the regular file of that name, at most `most_bytes`. No link is followed, and what
// is judged is what is then read: the file is opened first. Throws NameRefused.
[[nodiscard]] std::string read_named(const std::filesystem::path& folder, std::string_view name,
                                     std::size_t most_bytes);

}  // namespace zerodrift::files
