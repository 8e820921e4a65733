// SPDX-License-Identifier: Apache-2.0
// Requests and responses of HTTP, as far as a server's application sees them.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/web/target.h"

namespace zerodrift::web {

struct Request {
  bool is_upgrade = false;  // to a WebSocket
  Target target;
  std::string host;
  std::string origin;         // empty: none was given
  std::string authorization;  // never to be logged, as little as the query
  std::string if_none_match;
  std::string accept_encoding;
  std::vector<std::string> subprotocols;
  std::string remote;  // "127.0.0.1:40000"
};

using Body = std::shared_ptr<const std::string>;
inline Body body_of(std::string text) {
  return std::make_shared<const std::string>(std::move(text));
}

struct Response {
  unsigned status = 200;
  std::string content_type = "text/plain; charset=utf-8";
  Body body;
  std::vector<std::pair<std::string, std::string>> headers{};
};

// One line of plain text.
inline Response plain_response(unsigned status, const std::string& line) {
  return {.status = status, .body = body_of(line + '\n')};
}

}  // namespace zerodrift::web
