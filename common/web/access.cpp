// SPDX-License-Identifier: Apache-2.0
#include "common/web/access.h"

#include <openssl/crypto.h>

#include <algorithm>
#include <cctype>

namespace zerodrift::web {
namespace {

std::string lower_case(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

// "[::1]:8765" -> "::1"
std::string name_of(std::string_view host) {
  if (host.starts_with('[')) {
    const std::size_t end = host.find(']');
    return end == std::string_view::npos ? "" : std::string(host.substr(1, end - 1));
  }
  return lower_case(host.substr(0, host.find(':')));
}

bool names_loopback(std::string_view host) {
  const std::string name = name_of(host);
  return name == "localhost" || is_loopback(name);
}

// "http://127.0.0.1:8765" is the same host as "127.0.0.1:8765".
bool is_same_host(std::string_view origin, std::string_view host) {
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (origin.starts_with(scheme))
      return lower_case(origin.substr(scheme.size())) == lower_case(host);
  }
  return false;
}

std::string_view shown_token(const Request& request) {
  constexpr std::string_view kBearer = "bearer ";
  if (lower_case(request.authorization).starts_with(kBearer))
    return std::string_view(request.authorization).substr(kBearer.size());
  const auto found = request.target.query.find("token");
  return found == request.target.query.end() ? std::string_view() : found->second;
}

}  // namespace

bool equal_in_constant_time(std::string_view a, std::string_view b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

std::optional<Response> Access::refusal(const Request& request, Wants wants) const {
  if (request.host.empty()) return plain_response(400, "a Host header is needed");
  if (is_loopback(options_.listen.host) && !names_loopback(request.host)) {
    return plain_response(403, "this host name is not of the loopback interface");
  }
  if (request.is_upgrade && !request.origin.empty() &&
      !is_same_host(request.origin, request.host)) {
    const auto& allowed = options_.allowed_origins;
    const bool is_allowed = std::any_of(allowed.begin(), allowed.end(), [&](const auto& origin) {
      return origin == "*" || lower_case(origin) == lower_case(request.origin);
    });
    if (!is_allowed)
      return plain_response(403, "pages of this origin may not connect; see --allow-origin");
  }
  if (wants == Wants::kData && !options_.token.empty() &&
      !equal_in_constant_time(shown_token(request), options_.token)) {
    Response response = plain_response(
        401, "a token is needed: 'Authorization: Bearer TOKEN', or '?token=TOKEN' in the address");
    response.headers.emplace_back("WWW-Authenticate", "Bearer");
    return response;
  }
  return std::nullopt;
}

}  // namespace zerodrift::web
