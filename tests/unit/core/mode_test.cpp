// SPDX-License-Identifier: Apache-2.0
// Rule: who subscribes finds every reason by its number in the IDL, and what it means on a page, in
// the words of the console.
#include "common/core/mode.h"

#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <sstream>
#include <string>

namespace zerodrift::core {
namespace {

std::string content(const std::string& file) {
  std::ostringstream text;
  text << std::ifstream(std::string(ZERODRIFT_SOURCE_DIR) + "/" + file).rdbuf();
  return text.str();
}

// The first group of the only match; empty where there is none.
std::string found(const std::string& text, const std::string& pattern) {
  std::smatch match;
  return std::regex_search(text, match, std::regex(pattern)) ? match[1].str() : "";
}

TEST(Reasons, StandInTheIdlByTheirNumbers) {
  std::string listed;
  for (std::size_t r = 0; r < kReasons; ++r) {
    listed += (listed.empty() ? "reason: " : ", ") + std::to_string(r) + " " +
              std::string(name(static_cast<Reason>(r)));
  }
  const std::string idl =
      std::regex_replace(content("idl/dds/compensated_rate.idl"), std::regex("\n//  *"), " ");
  EXPECT_NE(idl.find(listed + " ("), std::string::npos) << listed;
}

TEST(Reasons, StandOnThePageOfSubscribersInTheConsolesWords) {
  const std::string page = content("docs/subscribing.md");
  const std::string console = content("services/console/page/src/lib/verdict.ts");
  for (std::size_t r = 0; r < kReasons; ++r) {
    const std::string reason(name(static_cast<Reason>(r)));
    const std::string meaning =
        found(page, "\n\\| " + std::to_string(r) + " \\| `" + reason + "` \\| ([^|]+) \\|");
    EXPECT_NE(meaning, "") << reason;
    if (static_cast<Reason>(r) == Reason::kNone) continue;  // the console has nothing to say
    EXPECT_EQ(meaning, found(console, "\n  " + reason + ": '(.*)',")) << reason;
  }
  EXPECT_EQ(page.find("\n| " + std::to_string(kReasons) + " | "), std::string::npos);
}

}  // namespace
}  // namespace zerodrift::core
