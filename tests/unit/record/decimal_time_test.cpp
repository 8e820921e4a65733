// SPDX-License-Identifier: Apache-2.0
#include "common/record/decimal_time.h"

#include <gtest/gtest.h>

#include <charconv>
#include <cstdint>
#include <limits>
#include <random>

namespace zerodrift::record {
namespace {

using core::SensorTime;

double parse_double(const std::string& text) {
  double value = 0.0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

TEST(DecimalTimeLaws, PrintThenParseGivesTheSameNanosecondOverTheWholeRange) {
  constexpr std::uint64_t kSeed = 11;
  std::mt19937_64 random{kSeed};
  constexpr std::int64_t kLimit = std::numeric_limits<std::int64_t>::max();
  for (const std::int64_t count :
       {std::int64_t{0}, std::int64_t{1}, std::int64_t{-1}, kLimit, -kLimit}) {
    EXPECT_EQ(parse_decimal_time(print_seconds(SensorTime{count}), 9), SensorTime{count});
  }
  for (int i = 0; i < 10000; ++i) {
    const SensorTime time{static_cast<std::int64_t>(random()) >> (i % 63)};
    ASSERT_EQ(parse_decimal_time(print_seconds(time), 9), time) << "seed " << kSeed << " i " << i;
  }
}

// A double near 2^20 s is spaced 2^-32 s = 0.23 ns; read, multiplied and rounded it errs below 0.5
// ns.
TEST(DecimalTimeLaws, FromSecondsOfThePrintedTimeIsTheSameNanosecondWithinTwelveDays) {
  constexpr std::uint64_t kSeed = 12;
  std::mt19937_64 random{kSeed};
  std::uniform_int_distribution<std::int64_t> within{-1'000'000'000'000'000, 1'000'000'000'000'000};
  for (int i = 0; i < 10000; ++i) {
    const SensorTime time{within(random)};
    ASSERT_EQ(core::from_seconds(parse_double(print_seconds(time))), time)
        << "seed " << kSeed << " i " << i;
  }
}

TEST(DecimalTime, PrintsNineDecimals) {
  EXPECT_EQ(print_seconds(SensorTime{0}), "0.000000000");
  EXPECT_EQ(print_seconds(SensorTime{5'000'000}), "0.005000000");
  EXPECT_EQ(print_seconds(SensorTime{-1'500'000'001}), "-1.500000001");
}

TEST(DecimalTime, KeepsEachNanosecondOfAUnixTime) {
  EXPECT_EQ(parse_decimal_time("1700000000.123456789", 9), SensorTime{1'700'000'000'123'456'789});
}

TEST(DecimalTime, ReadsEachUnit) {
  EXPECT_EQ(parse_decimal_time("256551281491968", 0), SensorTime{256'551'281'491'968});
  EXPECT_EQ(parse_decimal_time("12.5", 3), SensorTime{12'500});
  EXPECT_EQ(parse_decimal_time("+12", 6), SensorTime{12'000'000});
  EXPECT_EQ(parse_decimal_time(".5", 9), SensorTime{500'000'000});
  EXPECT_EQ(parse_decimal_time("5.", 9), SensorTime{5'000'000'000});
}

TEST(DecimalTime, RoundsHalfAwayFromZero) {
  EXPECT_EQ(parse_decimal_time("0.0000000014999", 9), SensorTime{1});
  EXPECT_EQ(parse_decimal_time("0.0000000015", 9), SensorTime{2});
  EXPECT_EQ(parse_decimal_time("-0.5", 0), SensorTime{-1});
}

TEST(DecimalTime, RefusesWhatIsNoPlainDecimalOrDoesNotFit) {
  for (const char* text : {"", "-", ".", "1e3", "1,5", "1.2.3", "0x10", "nan", "1 ", "--1",
                           "9223372036.854775808", "99999999999999999999"}) {
    EXPECT_FALSE(parse_decimal_time(text, 9).has_value()) << text;
  }
}

TEST(Dates, CountSecondsSince1970) {
  EXPECT_EQ(parse_iso8601("1970-01-01T00:00:00Z"), SensorTime{0});
  EXPECT_EQ(parse_iso8601("1969-12-31T23:59:59.999999999Z"), SensorTime{-1});
  EXPECT_EQ(parse_iso8601("2001-09-09T01:46:40Z"), SensorTime{1'000'000'000'000'000'000});
  EXPECT_EQ(parse_iso8601("2000-02-29 12:00"), SensorTime{951'825'600'000'000'000});
}

TEST(Dates, KeepEachNanosecondAndRoundHalfUp) {
  const std::int64_t second = 1'700'000'000'000'000'000;
  EXPECT_EQ(parse_iso8601("2023-11-14T22:13:20.123456789Z"), SensorTime{second + 123'456'789});
  EXPECT_EQ(parse_iso8601("2023-11-14T22:13:20,5Z"), SensorTime{second + 500'000'000});
  EXPECT_EQ(parse_iso8601("2023-11-14T22:13:20.0000000005"), SensorTime{second + 1});
  EXPECT_EQ(parse_iso8601("2023-11-14T22:13:20.99999999999"), SensorTime{second + 1'000'000'000});
}

TEST(Dates, TakeOffTheOffsetOfTheirClock) {
  const auto noon = parse_iso8601("2024-05-01T12:00:00Z");
  EXPECT_EQ(parse_iso8601("2024-05-01T14:00:00+02:00"), noon);
  EXPECT_EQ(parse_iso8601("2024-05-01T14:00:00+0200"), noon);
  EXPECT_EQ(parse_iso8601("2024-05-01t14:00:00+02"), noon);
  EXPECT_EQ(parse_iso8601("2024-04-30 22:30:00-13:30"), noon);
}

TEST(Dates, RefuseWhatIsNone) {
  for (const char* text :
       {"", "2024", "2024-05-01", "2024-05-01T", "2024-05-01T12", "2024-13-01T12:00Z",
        "2023-02-29T12:00Z", "2024-05-01T24:00Z", "2024-05-01T12:60Z", "2024-05-01T12:00:60Z",
        "2024-05-01T12:00:00.Z", "2024-05-01T12:00:00Zx", "2024-05-01T12:00:00+2",
        "2024-05-01T12:00:00+24:00", "01.05.2024 12:00:00", "24-05-01T12:00Z", "1677-12-31T00:00Z",
        "2262-01-01T00:00Z", "-2024-05-01T12:00Z"}) {
    EXPECT_FALSE(parse_iso8601(text).has_value()) << text;
  }
}

}  // namespace
}  // namespace zerodrift::record
