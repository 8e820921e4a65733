// SPDX-License-Identifier: Apache-2.0
#include "common/core/wrapped_text.h"

#include <gtest/gtest.h>

#include <random>
#include <sstream>
#include <string>

namespace zerodrift::core {
namespace {

TEST(WrappedText, CountsCharactersNotBytes) {
  EXPECT_EQ(character_count("deg/√h"), 6U);
}

TEST(WrappedText, BreaksAtTheLastBlankThatFits) {
  EXPECT_EQ(wrapped("one two three", 7), "one two\nthree");
  EXPECT_EQ(wrapped("√√√ √√√ √√√", 7), "√√√ √√√\n√√√");
  EXPECT_EQ(wrapped("", 7), "");
}

TEST(WrappedText, ALongerWordHasALineOfItsOwn) {
  EXPECT_EQ(wrapped("a longerthanthat b", 7), "a\nlongerthanthat\nb");
}

TEST(WrappedText, WhatFollowsStandsBelowWhatItIsAbout) {
  EXPECT_EQ(wrapped("  --rate   of the sensor", 18, 11),
            "  --rate   of the\n"
            "           sensor");
  EXPECT_EQ(wrapped("  --rate   a longerthanthat b", 18, 11),
            "  --rate   a\n"
            "           longerthanthat\n"
            "           b");
}

// Whatever the text, nothing of it is lost and no line that could be broken is too long.
TEST(WrappedText, HoldsEveryWordInOrderWithinItsWidth) {
  std::mt19937 random{11};
  for (int round = 0; round < 2000; ++round) {
    std::string text;
    for (int i = 0; i < 60; ++i) text += random() % 5 == 0 ? ' ' : static_cast<char>('a' + i % 26);
    const std::size_t indent = random() % 12;
    const std::size_t width = indent + 1 + random() % 20;
    const std::string lines = wrapped(text, width, indent);
    std::istringstream before(text);
    std::istringstream after(lines);
    std::string word;
    std::string same;
    while (before >> word) ASSERT_TRUE(after >> same && same == word) << text << '\n' << lines;
    ASSERT_FALSE(after >> same) << lines;
    std::istringstream each(lines);
    for (std::string line; std::getline(each, line);) {
      const std::size_t last = line.find_last_of(' ');
      ASSERT_TRUE(line.size() <= width || last == std::string::npos || last <= indent ||
                  line.find_first_not_of(' ') > last)
          << "'" << line << "' of " << width << ", " << indent << "\n"
          << text;
    }
  }
}

}  // namespace
}  // namespace zerodrift::core
