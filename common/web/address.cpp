// SPDX-License-Identifier: Apache-2.0
#include "common/web/address.h"

#include <arpa/inet.h>

#include <charconv>

#include "common/core/one_line.h"
#include "common/web/web_error.h"

namespace zerodrift::web {
namespace {

bool is_ipv4(const std::string& host) {
  in_addr address{};
  return inet_pton(AF_INET, host.c_str(), &address) == 1;
}

bool is_ipv6(const std::string& host) {
  in6_addr address{};
  return inet_pton(AF_INET6, host.c_str(), &address) == 1;
}

}  // namespace

std::string Address::text() const {
  const bool is_v6 = host.find(':') != std::string::npos;
  return (is_v6 ? '[' + host + ']' : host) + ':' + std::to_string(port);
}

Address parse_address(std::string_view text) {
  const auto refuse = [&] {
    throw WebError("'" + core::one_line(std::string(text)) +
                   "' is not an address to listen at; expected e.g. 127.0.0.1:8765");
  };
  Address address;
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) refuse();
  std::string_view host = text.substr(0, colon);
  const bool has_brackets = host.size() > 2 && host.front() == '[' && host.back() == ']';
  address.host = has_brackets ? host.substr(1, host.size() - 2) : host;
  if (address.host == "localhost") address.host = "127.0.0.1";
  if (!(has_brackets ? is_ipv6(address.host) : is_ipv4(address.host))) refuse();
  const char* end = text.data() + text.size();
  const auto read = std::from_chars(text.data() + colon + 1, end, address.port);
  if (read.ec != std::errc{} || read.ptr != end) refuse();
  return address;
}

bool is_loopback(std::string_view host) {
  const std::string text(host);
  return text == "::1" || (text.starts_with("127.") && is_ipv4(text));
}

}  // namespace zerodrift::web
