// SPDX-License-Identifier: Apache-2.0
// What was refused, for whoever reports it.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace zerodrift::dds {

// What was refused since the last time somebody asked.
struct SecurityNotice {
  std::string code;  // as in the table of deploy/security/README.md
  std::string text;  // one line on the newest
  std::uint64_t count = 0;
};

// Any thread. One entry a code: bounded, whatever arrives.
class SecurityNotices {
 public:
  void add(const std::string& code, std::string text);
  // Each notice once.
  std::vector<SecurityNotice> take();

 private:
  std::mutex mutex_;
  std::map<std::string, SecurityNotice> notices_;
};

}  // namespace zerodrift::dds
