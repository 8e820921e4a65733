// SPDX-License-Identifier: Apache-2.0
// Where a server listens: "127.0.0.1:8765", "[::1]:8765".
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace zerodrift::web {

struct Address {
  std::string host = "127.0.0.1";  // a number, without brackets
  std::uint16_t port = 8765;       // 0: any that is free
  [[nodiscard]] std::string text() const;
};

// Throws WebError with one line where it is none. No name is looked up, "localhost" is 127.0.0.1.
Address parse_address(std::string_view text);

// Reached from this machine only: 127.0.0.0/8 and ::1.
bool is_loopback(std::string_view host);

}  // namespace zerodrift::web
