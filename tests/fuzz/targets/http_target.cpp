// SPDX-License-Identifier: Apache-2.0
// Input: what stands between GET and HTTP/1.1.
#include <algorithm>

#include "common/web/static_files.h"
#include "common/web/target.h"
#include "tests/fuzz/expectations.h"

namespace zerodrift::fuzz {
namespace {

std::string escaped(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string result;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '/') {
      result += c;
    } else {
      result += {'%', kDigits[byte >> 4U], kDigits[byte & 0xFU]};
    }
  }
  return result;
}

}  // namespace

void http_target(Bytes input) {
  const auto target = web::parse_target(as_text(input));
  if (!target) return;
  const std::string& path = target->path;
  demand(path.starts_with('/'), "a path begins at the root");
  demand((path + '/').find("/../") == std::string::npos, "no path leaves its folder");
  demand((path + '/').find("/./") == std::string::npos, "no path stays where it is");
  demand(path.find("//") == std::string::npos, "no segment is empty");
  demand(std::none_of(path.begin(), path.end(),
                      [](char c) {
                        return static_cast<unsigned char>(c) < 0x20 || c == '\x7f' || c == '\\';
                      }),
         "a path is printable");
  const auto again = web::parse_target(escaped(path));
  demand(again && again->path == path, "a path that was read can be asked for again");
  web::Request request;
  request.target = *target;
  demand(!web::StaticFiles().respond(request), "without files nothing is served");
}

}  // namespace zerodrift::fuzz
