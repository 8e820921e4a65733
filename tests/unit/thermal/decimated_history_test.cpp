// SPDX-License-Identifier: Apache-2.0
#include "common/thermal/decimated_history.h"

#include <gtest/gtest.h>

#include <optional>
#include <random>
#include <string>
#include <string_view>

namespace zerodrift::thermal {
namespace {

using core::from_seconds;

TEST(DecimatedHistoryLaws, ARampIsReturnedExactlyAtAnyPastTimeForAnyStream) {
  constexpr std::uint64_t kSeed = 3;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  for (const double mean_interval_s : {0.005, 0.1, 1.0, 7.0}) {
    std::exponential_distribution<double> interval(1.0 / mean_interval_s);
    DecimatedHistory history(100.0, 1.0, 1000.0);
    double time_s = -30.0;
    while (time_s < 400.0) {
      time_s += interval(random) + 1e-6;
      history.add({from_seconds(time_s), 0.5 * time_s});
    }
    for (double lag_s = 0.0; lag_s <= 100.0; lag_s += 0.37) {
      const auto temperature = history.at(from_seconds(time_s) - from_seconds(lag_s));
      ASSERT_TRUE(temperature) << mean_interval_s << ' ' << lag_s;
      // Means are stamped to 1 ns: 0.5e-9 °C, at either end of the interpolation.
      ASSERT_NEAR(*temperature, 0.5 * (time_s - lag_s), 2e-9);
    }
  }
}

TEST(DecimatedHistoryLaws, ThereIsNothingBeforeTheFirstStepNorAfterTheNewestReading) {
  DecimatedHistory history(10.0, 1.0, 60.0);
  EXPECT_FALSE(history.at(from_seconds(0.0)));
  history.add({from_seconds(5.0), 20.0});
  EXPECT_EQ(history.at(from_seconds(5.0)), 20.0);
  EXPECT_FALSE(history.at(from_seconds(4.999)));
  EXPECT_FALSE(history.at(from_seconds(5.001)));
  history.add({from_seconds(6.0), 22.0});
  EXPECT_EQ(history.at(from_seconds(5.0)), 20.0);
  EXPECT_EQ(history.at(from_seconds(5.5)), 21.0);
  EXPECT_FALSE(history.at(core::kNever));
  EXPECT_FALSE(history.at(core::SensorTime::max()));
}

TEST(DecimatedHistoryScenario, AGapLongerThanAllowedIsNotBridgedButBothSidesRemain) {
  DecimatedHistory history(100.0, 1.0, 5.0);
  for (int i = 0; i <= 10; ++i) history.add({from_seconds(i), 10.0});
  for (int i = 30; i <= 40; ++i) history.add({from_seconds(i), 30.0});
  EXPECT_EQ(history.at(from_seconds(9.5)), 10.0);
  EXPECT_FALSE(history.at(from_seconds(20.0)));
  EXPECT_EQ(history.at(from_seconds(30.0)), 30.0);
  EXPECT_EQ(history.at(from_seconds(39.5)), 30.0);
}

TEST(DecimatedHistoryScenario, ResetForgetsAlsoTheOpenStep) {
  DecimatedHistory history(100.0, 10.0, 60.0);
  history.add({from_seconds(1.0), 1000.0});
  history.reset();
  history.add({from_seconds(2.0), 10.0});
  history.add({from_seconds(12.0), 10.0});
  EXPECT_EQ(history.at(from_seconds(7.0)), 10.0);
  EXPECT_FALSE(history.at(from_seconds(1.0)));
}

std::string state_of(DecimatedHistory& history, const Reading& newest) {
  std::string bytes;
  core::StateArchive archive(bytes);
  history.carry(archive, newest);
  return bytes;
}

TEST(DecimatedHistoryLaws, AStateIsTakenWithItsOwnNewestReadingOnly) {
  DecimatedHistory history(100.0, 1.0, 5.0);
  for (int i = 0; i <= 20; ++i) history.add({from_seconds(0.7 * i), 20.0 + 0.1 * i});
  const Reading newest{from_seconds(14.0), 22.0};
  const std::string bytes = state_of(history, newest);
  const auto taken = [&](const std::optional<Reading>& with) {
    DecimatedHistory other(100.0, 1.0, 5.0);
    core::StateArchive archive{std::string_view(bytes)};
    other.carry(archive, with);
    return archive.ok();
  };
  EXPECT_TRUE(taken(newest));
  EXPECT_FALSE(taken(Reading{from_seconds(13.0), 22.0})) << "the next reading would lie before it";
  EXPECT_FALSE(taken(Reading{from_seconds(15.0), 22.0}));
  EXPECT_FALSE(taken(std::nullopt));
}

}  // namespace
}  // namespace zerodrift::thermal
