// SPDX-License-Identifier: Apache-2.0
#include "common/experts/past_forecasts.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "tests/support/state_bytes.h"

namespace zerodrift::experts {
namespace {

using zerodrift::testing::read_state;
using zerodrift::testing::state_of;

// A forecast that knows when it was made.
using Stamps = PastForecasts<double>;

// -1: nobody foretells.
double due(Stamps& past, double time_s) {
  const double* const made = past.due(time_s);
  return made == nullptr ? -1.0 : *made;
}

void learn(Stamps& past, double time_s) {
  if (past.wants(time_s)) past.keep(time_s) = time_s;
}

// Rule: whoever foretells a label is at least a horizon old, and at most by one of those kept over
// it older, however labels come; in a pause everybody gets older.
TEST(PastForecastsLaws, WhoForetellsIsAHorizonOldAndHardlyOlder) {
  for (const double horizon_s : {60.0, 300.0, 3600.0}) {
    for (const std::size_t most : {1U, 4U, 31U}) {
      Stamps past(horizon_s, most, 0.0);
      std::mt19937_64 random(5);
      double time_s = 0.0;
      for (int k = 0; k < 3000; ++k) {
        const double step_s = 1.0 + static_cast<double>(random() % 12);
        time_s += step_s;
        const double made_s = due(past, time_s);
        ASSERT_TRUE(made_s > 0.0 || time_s - 12.0 < horizon_s);
        if (made_s > 0.0) {
          ASSERT_GE(time_s - made_s, horizon_s);
          ASSERT_LE(time_s - made_s, horizon_s * (1.0 + 1.0 / static_cast<double>(most)) + 24.0);
        }
        learn(past, time_s);
      }
    }
  }
}

TEST(PastForecastsLaws, OfAHorizonOfZeroTheNewestForetells) {
  Stamps past(0.0, 31, 0.0);
  EXPECT_EQ(due(past, 1.0), -1.0);
  for (double time_s = 1.0; time_s < 50.0; time_s += 1.0) {
    learn(past, time_s);
    ASSERT_EQ(due(past, time_s + 0.5), time_s);
  }
}

TEST(PastForecastsLaws, AStateCarriedGoesOnToTheBit) {
  Stamps whole(60.0, 4, 0.0);
  for (double time_s = 5.0; time_s < 400.0; time_s += 5.0) {
    (void)due(whole, time_s);
    learn(whole, time_s);
    Stamps resumed(60.0, 4, 0.0);
    ASSERT_TRUE(read_state(resumed, state_of(whole)));
    Stamps copy = whole;
    for (double later_s = time_s + 5.0; later_s < time_s + 100.0; later_s += 5.0) {
      ASSERT_EQ(due(resumed, later_s), due(copy, later_s));
      learn(copy, later_s);
      learn(resumed, later_s);
    }
  }
}

TEST(PastForecastsAbuse, MoreThanThereIsRoomForAndTimesThatGoBackAreRefused) {
  Stamps many(60.0, 8, 0.0);
  for (double time_s = 10.0; time_s < 100.0; time_s += 10.0) learn(many, time_s);
  const std::string good = state_of(many);
  Stamps few(60.0, 4, 0.0);
  EXPECT_FALSE(read_state(few, good));
  Stamps same(60.0, 8, 0.0);
  EXPECT_TRUE(read_state(same, good));
  EXPECT_FALSE(read_state(same, zerodrift::testing::with(good, 8 + 16, 5.0)));
}

}  // namespace
}  // namespace zerodrift::experts
