// SPDX-License-Identifier: Apache-2.0
#include "common/report/plain_text.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>

#include "tests/unit/report/markup.h"

namespace zerodrift::report {
namespace {

TEST(PlainText, EscapesWhatMarkupMeans) {
  EXPECT_EQ(escaped("<a href=\"x\">'&'</a>"),
            "&lt;a href=&quot;x&quot;&gt;&#39;&amp;&#39;&lt;/a&gt;");
}

TEST(PlainText, AnyBytesMakeWellFormedMarkup) {
  constexpr std::uint64_t kSeed = 5;
  std::mt19937_64 random{kSeed};
  for (int round = 0; round < 2000; ++round) {
    std::string bytes;
    for (int i = 0; i < 40; ++i) bytes += static_cast<char>(random() >> 56U);
    const std::string safe = escaped(bytes);
    const Markup markup = read_markup("<p title=\"" + safe + "\">" + safe + "</p>");
    ASSERT_EQ(markup.error, "") << "seed " << kSeed << " round " << round;
    ASSERT_EQ(markup.elements.size(), 1U);
    ASSERT_EQ(one_line(safe), safe);
  }
}

TEST(PlainText, ShortensByCharactersNotByBytes) {
  EXPECT_EQ(shortened("√√√", 3), "√√√");
  EXPECT_EQ(shortened("√√√√", 3), "√√…");
  EXPECT_EQ(shortened("", 3), "");
}

}  // namespace
}  // namespace zerodrift::report
