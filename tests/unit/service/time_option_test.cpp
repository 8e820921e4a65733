// SPDX-License-Identifier: Apache-2.0
#include "common/service/time_option.h"

#include <gtest/gtest.h>

namespace zerodrift::service {
namespace {

struct Parsed {
  double value_s = -1.0;
  std::string refusal;
};

Parsed parse(const std::string& text) {
  CLI::App app;
  Parsed parsed;
  app.add_option("--duration", parsed.value_s)->transform(in_seconds())->check(CLI::PositiveNumber);
  try {
    app.parse("--duration \"" + text + "\"");
  } catch (const CLI::ParseError& error) {
    parsed.refusal = error.what();
  }
  return parsed;
}

TEST(TimeOption, TakesEveryUnitAndSecondsWithoutOne) {
  EXPECT_EQ(parse("60").value_s, 60.0);
  EXPECT_EQ(parse("60s").value_s, 60.0);
  EXPECT_EQ(parse("60 s").value_s, 60.0);
  EXPECT_EQ(parse("5min").value_s, 300.0);
  EXPECT_EQ(parse("1.5h").value_s, 5400.0);
  EXPECT_EQ(parse("5H").value_s, 18000.0);
  EXPECT_EQ(parse("1d").value_s, 86400.0);
  EXPECT_EQ(parse("200ms").value_s, 200 * 1e-3);
  EXPECT_EQ(parse("1e5").value_s, 1e5);
  EXPECT_EQ(parse("0.1").value_s, 0.1);
}

TEST(TimeOption, RefusesTheRestInOneLine) {
  for (const char* text : {"s", "60m", "60sec", "5 min 3 s", "1:30", "nan", "inf", "0x10"}) {
    EXPECT_EQ(parse(text).refusal, "--duration: found '" + std::string(text) +
                                       "', expected a time as 60, 60s, 5min, 5h or 200ms");
  }
  EXPECT_NE(parse("0s").refusal, "");
  EXPECT_NE(parse("-5min").refusal, "");
}

// An integer option (a period in whole seconds) takes what is a whole number.
TEST(TimeOption, WritesLargeTimesWithoutAnExponent) {
  CLI::App app;
  int period_s = 0;
  app.add_option("--period", period_s)->transform(in_seconds());
  app.parse("--period 100000000");
  EXPECT_EQ(period_s, 100'000'000);
  app.parse("--period 24h");
  EXPECT_EQ(period_s, 86'400);
  EXPECT_THROW(app.parse("--period 200ms"), CLI::ParseError);
}

}  // namespace
}  // namespace zerodrift::service
