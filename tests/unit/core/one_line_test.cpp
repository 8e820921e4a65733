// SPDX-License-Identifier: Apache-2.0
#include "common/core/one_line.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>

namespace zerodrift::core {
namespace {

TEST(OneLine, KeepsUnitsGreekLettersAndWhatIsBeyondTheBasicPlane) {
  for (const char* text : {"", "σ(τ) in deg/√h, 24 °C, 𝜎", "U+00A0\u00a0", "\u2027\u202f\u2065"}) {
    EXPECT_EQ(one_line(text), text);
    EXPECT_TRUE(is_one_line(text)) << text;
  }
}

TEST(OneLine, MakesTabsAndLineEndsBlanks) {
  EXPECT_EQ(one_line("a\tb\r\nc"), "a b  c");
}

class ControlCharacter : public testing::TestWithParam<unsigned> {};

std::string utf8_of(unsigned point) {
  const auto byte = [](unsigned value) { return static_cast<char>(value); };
  if (point < 0x80U) return {byte(point)};
  if (point < 0x800U) return {byte(0xC0U | point >> 6U), byte(0x80U | (point & 0x3FU))};
  return {byte(0xE0U | point >> 12U), byte(0x80U | (point >> 6U & 0x3FU)),
          byte(0x80U | (point & 0x3FU))};
}

TEST_P(ControlCharacter, ReachesNoLogAndNoTerminal) {
  const std::string control = utf8_of(GetParam());
  const std::string line = one_line("a" + control + "b");
  EXPECT_TRUE(line == "a?b" || line == "a b") << line;
  EXPECT_FALSE(is_one_line(control));
}

INSTANTIATE_TEST_SUITE_P(C0, ControlCharacter, testing::Range(0x00U, 0x20U));
INSTANTIATE_TEST_SUITE_P(DeleteAndC1, ControlCharacter, testing::Range(0x7FU, 0xA0U));
INSTANTIATE_TEST_SUITE_P(LineAndDirection, ControlCharacter, testing::Range(0x2028U, 0x202FU));
INSTANTIATE_TEST_SUITE_P(Isolates, ControlCharacter, testing::Range(0x2066U, 0x206AU));

class BrokenUtf8 : public testing::TestWithParam<std::string> {};

TEST_P(BrokenUtf8, BecomesAQuestionMarkForEachByte) {
  const std::string marks(GetParam().size(), '?');
  EXPECT_EQ(one_line("a" + GetParam()), "a" + marks);
  EXPECT_EQ(one_line(GetParam() + "a"), marks + "a");
  EXPECT_FALSE(is_one_line(GetParam()));
}

INSTANTIATE_TEST_SUITE_P(All, BrokenUtf8,
                         testing::Values("\xff", "\x80", "\xc3", "\xe2\x82", "\xf0\x9f\x98",
                                         "\xc0\xbc",            // '<' written too long
                                         "\xed\xa0\x80",        // a surrogate
                                         "\xf4\x90\x80\x80"));  // above U+10FFFF

// Rule: whatever the bytes are, the line is clean, no longer, and cleaning it again changes
// nothing; a bound cuts whole characters.
TEST(OneLineAbuse, OfAnyBytesIsCleanAndNeverLonger) {
  constexpr std::uint64_t kSeed = 17;
  std::mt19937_64 random{kSeed};
  for (int round = 0; round < 5000; ++round) {
    std::string bytes;
    for (int i = 0; i < 40; ++i) bytes += static_cast<char>(random() >> 56U);
    const std::string line = one_line(bytes);
    ASSERT_TRUE(is_one_line(line)) << "seed " << kSeed << " round " << round;
    ASSERT_LE(line.size(), bytes.size());
    ASSERT_EQ(one_line(line), line);
    const std::string cut = one_line(bytes, 17);
    ASSERT_LE(cut.size(), 17U);
    ASSERT_TRUE(is_one_line(cut));
    ASSERT_TRUE(line.starts_with(cut));
    ASSERT_EQ(is_one_line(bytes), line == bytes);
  }
  EXPECT_EQ(one_line("12 °C", 4), "12 ");
}

TEST(Shortened, EndsBehindAWholeWordAndShowsThatMoreFollowed) {
  EXPECT_EQ(shortened("bias of axis x", 14), "bias of axis x");
  EXPECT_EQ(shortened("bias of axis x", 13), "bias of...");
  EXPECT_EQ(shortened("bias of axis x", 10), "bias of...");
  EXPECT_EQ(shortened("bias of axis x", 9), "bias...");
  EXPECT_EQ(shortened("bias", 3), "...");
  EXPECT_EQ(shortened("°°°°", 7), "°°...");
  EXPECT_EQ(shortened("a\nb", 4), "a b");
}

}  // namespace
}  // namespace zerodrift::core
