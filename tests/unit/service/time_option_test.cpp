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

// What is silently left aside would be taken for done: no duration of -5 s is "to the end".
TEST(TimeOption, ADurationIsAboveZeroAndBounded) {
  CLI::App app;
  double value_s = 0.0;
  double wait_s = 1.0;
  app.add_option("--duration", value_s)->transform(in_seconds_above_0());
  app.add_option("--wait", wait_s)->transform(in_seconds_from_0());
  for (const char* text : {"0", "-5", "-5min", "1e300", "1e9d", "nan", "inf", "1e9h", "", "x"})
    EXPECT_THROW(app.parse("--duration=\"" + std::string(text) + "\""), CLI::Error) << text;
  for (const char* text : {"-5", "1e300", "nan", "x"})
    EXPECT_THROW(app.parse("--wait=\"" + std::string(text) + "\""), CLI::Error) << text;
  app.parse("--duration=5min --wait=0");
  EXPECT_EQ(value_s, 300.0);
  EXPECT_EQ(wait_s, 0.0);
}

TEST(RateOption, IsAboveZeroAndBounded) {
  CLI::App app;
  double rate_hz = 0.0;
  app.add_option("--rate", rate_hz)->transform(in_hertz());
  for (const char* text : {"0", "-1", "-1kHz", "1e300", "nan", "inf", "1e9kHz"})
    EXPECT_THROW(app.parse("--rate=\"" + std::string(text) + "\""), CLI::Error) << text;
}

TEST(RateOption, TakesHertzAndShowsItsDefaultWithTheUnit) {
  CLI::App app;
  double rate_hz = 200.0;
  show_default_in("Hz", app.add_option("--rate", rate_hz)->transform(in_hertz()));
  EXPECT_NE(app.help().find("--rate FLOAT:20Hz|1kHz=200Hz"), std::string::npos) << app.help();
  app.parse("");
  EXPECT_EQ(rate_hz, 200.0);
  for (const auto& [text, value_hz] : {std::pair{"20", 20.0}, std::pair{"20Hz", 20.0},
                                       std::pair{"'0.5 hz'", 0.5}, std::pair{"1.5kHz", 1500.0}}) {
    app.parse("--rate " + std::string(text));
    EXPECT_EQ(rate_hz, value_hz) << text;
  }
  try {
    app.parse("--rate 20s");
    FAIL() << "a time is no rate";
  } catch (const CLI::ParseError& error) {
    EXPECT_EQ(std::string(error.what()),
              "--rate: found '20s', expected a rate above 0 and up to 1 MHz, as 20, 20Hz or 1kHz");
  }
}

}  // namespace
}  // namespace zerodrift::service
