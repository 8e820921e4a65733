// SPDX-License-Identifier: Apache-2.0
// Who may ask: host names against DNS rebinding, origins of pages, the token.
//
// - Listening at loopback, the Host header must name loopback: a foreign page whose name was made
//   to point here says its own name.
// - A WebSocket that a page opens must come from a page of this server or an allowed origin. A
//   request without Origin is of no page: a native client.
// - With a token, whoever wants data must show it.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/web/address.h"
#include "common/web/message.h"

namespace zerodrift::web {

struct AccessOptions {
  Address listen;
  std::string token;                           // empty: none is asked for
  std::vector<std::string> allowed_origins{};  // "https://app.example.org", or "*" for all
};

enum class Wants { kPage, kData };  // a page holds nothing of the system; data does

class Access {
 public:
  explicit Access(AccessOptions options) : options_(std::move(options)) {}

  // Nothing: allowed. Else the refusal: 400, 401 or 403.
  [[nodiscard]] std::optional<Response> refusal(const Request& request, Wants wants) const;

 private:
  AccessOptions options_;
};

// In time that depends on the lengths only.
bool equal_in_constant_time(std::string_view a, std::string_view b);

}  // namespace zerodrift::web
