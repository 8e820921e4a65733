// SPDX-License-Identifier: Apache-2.0
// What a request asks for.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace zerodrift::web {

struct Target {
  std::string path;  // decoded: "/", "/assets/a.js"; no segment is empty, "." or ".."
  std::map<std::string, std::string> query;  // decoded; of several with one name, the first
};

// The origin form of a target (RFC 9112, 3.2.1): "/path?name=value". Nothing for any other, for
// what leaves its folder however it is written, for control characters, backslashes and bad
// escapes. A '+' is a '+'. O(length).
std::optional<Target> parse_target(std::string_view target);

}  // namespace zerodrift::web
