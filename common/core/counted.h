// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace zerodrift::core {

// A number of things for people: "1 gyro", "2 gyros", "38,638 samples". Of nouns with a plural in
// s.
[[nodiscard]] inline std::string counted(std::uint64_t number, std::string_view noun) {
  constexpr std::size_t kGroup = 3;
  std::string text = std::to_string(number);
  for (std::size_t at = text.size(); at > kGroup;) text.insert(at -= kGroup, 1, ',');
  text.append(" ").append(noun);
  return number == 1 ? text : text + "s";
}

}  // namespace zerodrift::core
