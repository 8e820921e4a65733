// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/arrival_count.h"

#include <gtest/gtest.h>

namespace zerodrift::services {
namespace {

ArrivalCount::Writer writer_of(unsigned char id) {
  ArrivalCount::Writer writer;
  writer.guidPrefix.value[11] = id;
  return writer;
}

TEST(ArrivalCountLaws, EachWritersGapsAreCounted) {
  ArrivalCount arrivals;
  for (const std::uint64_t number : {7U, 8U, 11U}) arrivals.note(writer_of(1), number);
  for (const std::uint64_t number : {1U, 2U, 3U}) arrivals.note(writer_of(2), number);
  arrivals.note(writer_of(1), 12);
  EXPECT_EQ(arrivals.missing(), 2U) << "9 and 10; what was before the first nobody can know";
}

TEST(ArrivalCountLaws, AfterTheBeginningAWriterIsExpectedFromItsFirstSampleOn) {
  ArrivalCount arrivals;
  arrivals.note_matched(writer_of(1));  // silent so far
  arrivals.begin();
  arrivals.note_matched(writer_of(2));
  arrivals.note(writer_of(1), 100);
  EXPECT_EQ(arrivals.missing(), 0U) << "99 it had said before";
  arrivals.note(writer_of(2), 5);
  EXPECT_EQ(arrivals.missing(), 4U);
  arrivals.note(writer_of(3), 1);
  EXPECT_EQ(arrivals.missing(), 4U);
}

// A standby goes on with its own first sample where the one before ended, some samples again.
TEST(ArrivalCountLaws, AStandbyThatTakesOverLosesNothing) {
  ArrivalCount arrivals;
  arrivals.begin();
  for (std::uint64_t i = 0; i < 100; ++i) arrivals.note_answer(1, 1000 + i, writer_of(1), i + 1);
  arrivals.note_answer(1, 1100, writer_of(2), 5);  // 1 to 4 were said before
  arrivals.note_answer(1, 1101, writer_of(2), 6);
  EXPECT_EQ(arrivals.missing(), 0U);
  arrivals.note_answer(1, 1105, writer_of(3), 1);
  EXPECT_EQ(arrivals.missing(), 3U);
}

// What a sensor did not measure nobody lost.
TEST(ArrivalCountLaws, AGapOfTheSourceIsNoLoss) {
  ArrivalCount arrivals;
  arrivals.begin();
  arrivals.note_answer(1, 10, writer_of(1), 1);
  arrivals.note_answer(1, 500, writer_of(1), 2);
  EXPECT_EQ(arrivals.missing(), 0U);
}

TEST(ArrivalCountAbuse, NumbersThatGoBackBeginAnew) {
  ArrivalCount arrivals;
  for (const std::uint64_t number : {7U, 3U, 4U, 4U}) arrivals.note(writer_of(1), number);
  EXPECT_EQ(arrivals.missing(), 0U);
}

}  // namespace
}  // namespace zerodrift::services
