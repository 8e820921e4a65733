// SPDX-License-Identifier: Apache-2.0
#include "common/recording/arrival_count.h"

#include <gtest/gtest.h>

namespace zerodrift::recording {
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

struct Answers {
  ArrivalCount arrivals{};
  Answers() { arrivals.begin(); }
  // The copy of a sample that an instance wrote.
  void hear(unsigned char instance, std::uint64_t number, std::uint64_t sequence,
            bool is_repeat = false, std::uint64_t run = 1) {
    arrivals.note_answer(writer_of(instance), number, {1, run, sequence, is_repeat});
  }
};

TEST(ArrivalCountLaws, WhatAnotherInstanceWroteIsNotMissing) {
  Answers answers;
  for (std::uint64_t i = 0; i < 100; ++i) answers.hear(1, i + 1, 1000 + i);
  answers.hear(2, 5, 1100);  // 1 to 4 were copies of what the first said
  answers.hear(2, 6, 1101);
  EXPECT_EQ(answers.arrivals.missing(), 0U);
  answers.hear(3, 1, 1105);
  EXPECT_EQ(answers.arrivals.missing(), 3U);
}

// Law: of several gyros that one instance answers each has its own count, over all its runs, and
// together they are all that is missing.
TEST(ArrivalCountLaws, EachGyroIsCountedApart) {
  ArrivalCount arrivals;
  arrivals.begin();
  std::uint64_t number = 0;
  for (std::uint64_t run = 1; run <= 3; ++run) {
    for (std::uint64_t sequence = 0; sequence < 50; ++sequence) {
      for (std::uint32_t gyro = 1; gyro <= 3; ++gyro) {
        ++number;
        const bool arrives = sequence % 10 >= gyro;  // gyro n lacks n of ten
        if (arrives || sequence == 0)
          arrivals.note_answer(writer_of(1), number, {gyro, run, sequence, false});
      }
    }
  }
  for (std::uint32_t gyro = 1; gyro <= 3; ++gyro)
    EXPECT_EQ(arrivals.missing_of(gyro), 3 * (5 * gyro - 1)) << gyro;
  EXPECT_EQ(arrivals.missing_of(4), 0U);
  EXPECT_EQ(arrivals.missing(), 3U * (5 * 6 - 3));
}

TEST(ArrivalCountLaws, MadeUpGyrosTakeNoKnownOnesPlace) {
  ArrivalCount arrivals;
  arrivals.begin();
  const auto writer = writer_of(1);
  std::uint64_t number = 0;
  arrivals.note_answer(writer, ++number, {1, 1, 1, false});
  for (std::uint32_t id = 2; id < 20'000; ++id)
    arrivals.note_answer(writer, ++number, {id, 1, 1, false});
  EXPECT_EQ(arrivals.missing(), 0U);
  number += 3;  // three that nobody heard
  arrivals.note_answer(writer, ++number, {1, 1, 5, false});
  EXPECT_EQ(arrivals.missing(), 3U);
}

TEST(ArrivalCountLaws, AnInstanceThatIsBehindFillsWhatOneAheadLeftOpen) {
  Answers answers;
  answers.hear(1, 1, 1);
  answers.hear(2, 1, 500);
  for (std::uint64_t i = 2; i < 500; ++i) answers.hear(1, i, i);
  answers.hear(1, 500, 500, true);
  EXPECT_EQ(answers.arrivals.missing(), 0U);
  answers.hear(2, 4, 503);
  answers.hear(1, 501, 501);
  answers.hear(1, 503, 503, true);
  EXPECT_EQ(answers.arrivals.missing(), 1U) << "neither's copy of 502";
}

TEST(ArrivalCountLaws, WhatAWriterSaidBeforeItWasHeardIsMissingUnlessAnotherSaidIt) {
  Answers answers;
  answers.hear(1, 257, 256);
  EXPECT_EQ(answers.arrivals.missing(), 256U);
  for (std::uint64_t i = 0; i < 200; ++i) answers.hear(2, i + 1, i);
  EXPECT_EQ(answers.arrivals.missing(), 56U);
}

// What a sensor did not measure nobody lost.
TEST(ArrivalCountLaws, AGapOfTheSourceIsNoLoss) {
  Answers answers;
  answers.hear(1, 1, 10);
  answers.hear(1, 2, 500);
  EXPECT_EQ(answers.arrivals.missing(), 0U);
}

TEST(ArrivalCountLaws, ARunBeginsAnew) {
  Answers answers;
  answers.hear(1, 1, 100000);
  answers.hear(1, 2, 0, false, 2);
  answers.hear(1, 3, 1, false, 2);
  EXPECT_EQ(answers.arrivals.missing(), 0U);
  answers.hear(1, 5, 3, false, 2);
  answers.hear(1, 6, 0, false, 3);
  EXPECT_EQ(answers.arrivals.missing(), 1U) << "of the run that is over";
}

TEST(ArrivalCountAbuse, NumbersThatGoBackBeginAnew) {
  ArrivalCount arrivals;
  for (const std::uint64_t number : {7U, 3U, 4U, 4U}) arrivals.note(writer_of(1), number);
  EXPECT_EQ(arrivals.missing(), 0U);
}

}  // namespace
}  // namespace zerodrift::recording
