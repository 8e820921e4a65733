// SPDX-License-Identifier: Apache-2.0
#include "common/core/state_archive.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <optional>
#include <string>

namespace zerodrift::core {
namespace {

struct Everything {
  bool flag = false;
  std::uint8_t small = 0;
  std::int64_t ticks = 0;
  std::uint64_t count = 0;
  double number = 0.0;
  SensorTime time{kNever};
  std::optional<double> maybe{};
  RingBuffer<double> ring{3};

  void carry(StateArchive& archive) {
    archive(flag, small, ticks, count, number, time, maybe, ring);
  }
};

template <typename T>
std::string bytes_of(T value) {
  std::string bytes;
  StateArchive archive(bytes);
  archive(value);
  return bytes;
}

template <typename T>
bool is_read(const T& value) {
  const std::string bytes = bytes_of(value);
  StateArchive archive{std::string_view(bytes)};
  T back{};
  archive(back);
  return archive.ok() && archive.at_end();
}

TEST(StateArchiveLaws, WhatWasWrittenIsReadToTheBit) {
  Everything state{.flag = true,
                   .small = 7,
                   .ticks = -5,
                   .count = std::numeric_limits<std::uint64_t>::max(),
                   .number = -0.1,
                   .time = kLatestUsableTime,
                   .maybe = 1e-300};
  state.ring.push(1.0);
  state.ring.push(2.0);
  const std::string bytes = bytes_of(state);
  StateArchive archive{std::string_view(bytes)};
  Everything back;
  archive(back);
  EXPECT_TRUE(archive.ok() && archive.at_end());
  EXPECT_EQ(bytes_of(back), bytes);
  EXPECT_TRUE(is_read(Everything{}));
}

TEST(StateArchiveAbuse, CutAnywhereItIsRefused) {
  const std::string bytes = bytes_of(Everything{});
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    StateArchive archive{std::string_view(bytes).substr(0, size)};
    Everything back;
    archive(back);
    EXPECT_FALSE(archive.ok()) << size;
  }
}

TEST(StateArchiveAbuse, NumbersThatNoStateHoldsAreRefused) {
  using Doubles = std::numeric_limits<double>;
  for (const double number : {Doubles::quiet_NaN(), Doubles::infinity(), -Doubles::max(), 1.1e30})
    EXPECT_FALSE(is_read(number)) << number;
  for (const double number : {Doubles::denorm_min(), -1e30, 0.0}) EXPECT_TRUE(is_read(number));
}

struct Counted {
  std::size_t count = 0;
  void carry(StateArchive& archive) { archive.counts(count); }
};

TEST(StateArchiveAbuse, CountsThatNothingCanHaveComeToAreRefused) {
  constexpr std::size_t kMost = StateArchive::kLargestCount;
  EXPECT_GT(kMost * kMost, kMost);
  for (const std::size_t count : {std::size_t{0}, std::size_t{5}, kMost})
    EXPECT_TRUE(is_read(Counted{count})) << count;
  for (const std::size_t count : {kMost + 1, std::size_t{1} << 32, ~std::size_t{0}})
    EXPECT_FALSE(is_read(Counted{count})) << count;
}

TEST(StateArchiveAbuse, TimesWhoseDifferencesWouldOverflowAreRefused) {
  for (const SensorTime time : {SensorTime::max(), kNever + SensorTime{1}, 2 * kLatestUsableTime})
    EXPECT_FALSE(is_read(time)) << time.count();
  // A block may begin a little before its first sample.
  const SensorTime earlier = -kLatestUsableTime - SensorTime{60'000'000'000};
  for (const SensorTime time : {kNever, kLatestUsableTime, earlier, SensorTime{0}})
    EXPECT_TRUE(is_read(time)) << time.count();
  EXPECT_FALSE(is_read(std::numeric_limits<std::int64_t>::min()));
  EXPECT_TRUE(is_read(std::int64_t{-1}));
}

TEST(StateArchiveAbuse, FlagsAndCountsBeyondTheirRangeAreRefused) {
  std::string flag = "\x02";
  StateArchive archive{std::string_view(flag)};
  bool value = false;
  archive(value);
  EXPECT_FALSE(archive.ok());

  RingBuffer<double> wide(4);
  while (!wide.full()) wide.push(1.0);
  const std::string bytes = bytes_of(wide);
  StateArchive reader{std::string_view(bytes)};
  RingBuffer<double> narrow(3);
  reader(narrow);
  EXPECT_FALSE(reader.ok());
}

}  // namespace
}  // namespace zerodrift::core
