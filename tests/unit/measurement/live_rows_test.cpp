// SPDX-License-Identifier: Apache-2.0
// Streams of a running system as rows: the same whatever came first, and none of a wild stamp.
#include "common/measurement/live_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

namespace zerodrift::measurement {
namespace {

core::SensorTime at(double seconds) {
  return core::from_seconds(seconds);
}

core::AngularRateSample rate(int i, double time_s) {
  return {.sequence = static_cast<std::uint64_t>(i),
          .time = at(time_s),
          .interval_s = 1.0,
          .rate_radps = {0.001 * i, std::nan(""), -0.001 * i},
          .valid = {true, false, true}};
}

core::RateReferenceSample reference(int i, double time_s) {
  return {.time = at(time_s),
          .rate_radps = {0.5 * i, 0.0, 0.0},
          .valid = {true, true, i % 7 != 0},
          .kind = core::ReferenceKind::kRecord};
}

core::TemperatureSample reading(const std::string& probe, double time_s, double degc) {
  return {.probe = probe, .time = at(time_s), .temperature_degc = degc};
}

// A supply and a field along x.
core::EnvironmentSample environment(double time_s, double supply_v, double field_ut) {
  core::EnvironmentSample sample{.time = at(time_s), .channels = 1U << 8U | 1U};
  sample.values.supply_v = supply_v;
  sample.values.magnetic_ut[0] = field_ut;
  return sample;
}

std::vector<record::RecordRow> rows_of(LiveRows& rows) {
  std::vector<record::RecordRow> all;
  while (const record::RecordRow* row = rows.next()) all.push_back(*row);
  return all;
}

bool is_same(double a, double b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}

void expect_same(const std::vector<record::RecordRow>& a, const std::vector<record::RecordRow>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    SCOPED_TRACE(i);
    EXPECT_EQ(a[i].time, b[i].time);
    EXPECT_EQ(a[i].index, b[i].index);
    EXPECT_EQ(a[i].interval_s, b[i].interval_s);
    ASSERT_EQ(a[i].temperature_degc.size(), b[i].temperature_degc.size());
    for (std::size_t p = 0; p < a[i].temperature_degc.size(); ++p)
      EXPECT_TRUE(is_same(a[i].temperature_degc[p], b[i].temperature_degc[p]));
    for (std::size_t c = 0; c < core::kEnvironmentChannels; ++c)
      EXPECT_TRUE(is_same(core::channel(a[i].inputs, c), core::channel(b[i].inputs, c)));
    for (std::size_t axis = 0; axis < core::kAxisCount; ++axis) {
      EXPECT_TRUE(is_same(a[i].rate_radps[axis], b[i].rate_radps[axis]));
      EXPECT_TRUE(is_same(a[i].reference_radps[axis], b[i].reference_radps[axis]));
    }
  }
}

// Five streams, each in its own order, mixed with a seed; rates before temperatures by up to 30.
std::vector<record::RecordRow> mixed(unsigned seed) {
  constexpr int kSamples = 400;
  LiveRows rows({.rates_before_start = 100});
  std::vector<std::function<void(int)>> streams{
      [&](int i) { rows.push(rate(i, i)); }, [&](int i) { rows.push(reference(i, i)); },
      [&](int i) { rows.push(reading("board", i, 20.0 + i)); },
      [&](int i) { rows.push(reading("coil_outer", i, 30.0 + 0.1 * i)); },
      [&](int i) {
        rows.push(environment(i, 5.0 + 0.5 * i, i % 3 == 0 ? record::kNotMeasured : 1.0));
      }};
  std::vector<int> sent(streams.size(), 0);
  std::mt19937 generator(seed);
  std::vector<record::RecordRow> all;
  for (;;) {
    const int least = *std::min_element(sent.begin(), sent.end());
    if (least == kSamples) break;
    std::size_t s = generator() % streams.size();
    while (sent[s] == kSamples || sent[s] > least + 30) s = (s + 1) % streams.size();
    streams[s](sent[s]++);
    for (auto& row : rows_of(rows)) all.push_back(std::move(row));
  }
  rows.finish();
  for (auto& row : rows_of(rows)) all.push_back(std::move(row));
  EXPECT_EQ(rows.probes(), (std::vector<std::string>{"coil_outer", "board"}));
  EXPECT_EQ(rows.environment(), 1U << 8U | 1U);
  return all;
}

TEST(LiveRows, AreTheSameInWhateverOrderTheStreamsArrive) {
  const auto first = mixed(1);
  ASSERT_EQ(first.size(), 400U);
  EXPECT_EQ(first[5].temperature_degc, (std::vector<double>{30.5, 25.0}));
  EXPECT_TRUE(std::isnan(first[7].reference_radps[2]));
  EXPECT_EQ(first[7].reference_radps[0], 3.5);
  EXPECT_EQ(first[7].inputs.supply_v, 8.5);
  EXPECT_EQ(first[7].inputs.magnetic_ut[0], 1.0);
  EXPECT_TRUE(std::isnan(first[9].inputs.magnetic_ut[0]));
  EXPECT_TRUE(std::isnan(first[7].inputs.vibration_g));
  for (unsigned seed = 2; seed < 8; ++seed) {
    SCOPED_TRACE(seed);
    expect_same(mixed(seed), first);
  }
}

TEST(LiveRows, TakeTheMeanOfTheTemperaturesSinceTheRowBefore) {
  LiveRows rows({.rates_before_start = 2});
  for (const double t : {0.0, 0.25, 0.5, 0.75, 1.0, 2.5}) rows.push(reading("coil", t, 10.0 * t));
  for (int i = 0; i < 3; ++i) rows.push(rate(i, i));
  const auto all = rows_of(rows);
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[0].temperature_degc[0], 0.0);
  EXPECT_EQ(all[1].temperature_degc[0], 6.25);
  EXPECT_TRUE(std::isnan(all[2].temperature_degc[0]));
  EXPECT_FALSE(rows.has_reference());
  EXPECT_EQ(all[2].reference_radps[0], 0.0);
}

// Without a true rate nobody knows what of a rate is drift.
TEST(LiveRows, LeaveOutRatesWhoseTrueRateNobodySaid) {
  LiveRows rows({.rates_before_start = 5});
  for (int i = 0; i < 3; ++i) rows.push(reference(i, i));
  for (int i = 0; i < 6; ++i) rows.push(rate(i, i));
  rows.finish();
  const auto all = rows_of(rows);
  ASSERT_EQ(all.size(), 6U);
  EXPECT_FALSE(std::isnan(all[3].rate_radps[0]));  // a second later the true rate still holds
  EXPECT_TRUE(std::isnan(all[4].rate_radps[0]));
  EXPECT_EQ(rows.counts().without_reference, 2U);
}

// Rule: what a filter says rests on the compensation, which rests on what is diagnosed.
TEST(LiveRows, WhatANavigationFilterGivesBackIsNoTrueRate) {
  for (const auto kind : {core::ReferenceKind::kNone, core::ReferenceKind::kRest,
                          core::ReferenceKind::kNavigationResidual}) {
    LiveRows rows({.rates_before_start = 1});
    auto feedback = reference(1, 0.0);
    feedback.kind = kind;
    rows.push(feedback);
    rows.push(rate(1, 0.0));
    ASSERT_EQ(rows_of(rows).size(), 1U);
    EXPECT_FALSE(rows.has_reference()) << static_cast<int>(kind);
  }
}

TEST(LiveRows, OneWildStampCostsOneSampleAndAGapIsBelieved) {
  LiveRows rows({.rates_before_start = 1});
  for (const double t : {0.0, 1.0, 1e6, 2.0, 1.5, 3.0}) rows.push(rate(1, t));
  EXPECT_EQ(rows_of(rows).size(), 4U);
  EXPECT_EQ(rows.counts().rates_refused, 2U);
  for (const double t : {9000.0, 9001.0, 9002.0}) rows.push(rate(1, t));
  const auto after = rows_of(rows);
  ASSERT_EQ(after.size(), 2U);
  EXPECT_EQ(after[0].time, at(9001.0));
}

// A thermometer that stopped is waited for as long as memory allows, not longer.
TEST(LiveRows, MemoryIsBoundedWhereATemperatureStops) {
  constexpr std::size_t kMost = 64;
  LiveRows rows({.rates_before_start = 4, .most_waiting = kMost});
  rows.push(reading("coil", 0.0, 20.0));
  std::size_t given = 0;
  for (int i = 0; i < 1000; ++i) {
    rows.push(rate(i, i));
    given += rows_of(rows).size();
    EXPECT_LE(rows.waiting(), kMost);
  }
  EXPECT_GT(given, 900U);
  rows.push(reading("coil", 999.5, 21.0));  // it is back, and waited for again
  rows.push(rate(1000, 1000.0));
  EXPECT_TRUE(rows_of(rows).empty());
}

TEST(LiveRows, MadeUpThermometersTakeNoMemoryAndNoKnownOnesPlace) {
  LiveRows rows({.rates_before_start = 4, .most_waiting = 64, .most_probes = 3});
  rows.push(reading("coil", 0.0, 20.0));
  for (int i = 0; i < 1000; ++i) rows.push(reading("made_up_" + std::to_string(i), 0.0, 20.0));
  EXPECT_EQ(rows.counts().readings_refused, 998U);
  for (int i = 0; i < 4; ++i) {
    rows.push(reading("coil", i + 0.5, 20.0));
    rows.push(rate(i, i));
  }
  rows.finish();
  EXPECT_EQ(rows_of(rows).size(), 4U);
  EXPECT_EQ(rows.probes(), (std::vector<std::string>{"coil", "made_up_0", "made_up_1"}));
}

TEST(LiveRows, ProbesAndTrueRatesThatComeTooLateAreCounted) {
  LiveRows rows({.rates_before_start = 2});
  for (int i = 0; i < 3; ++i) rows.push(rate(i, i));
  EXPECT_EQ(rows_of(rows).size(), 3U);
  rows.push(reading("coil", 3.0, 20.0));
  rows.push(reference(1, 3.0));
  rows.push(rate(3, 3.0));
  ASSERT_EQ(rows_of(rows).size(), 1U);
  EXPECT_EQ(rows.counts().late_probes, 1U);
  EXPECT_EQ(rows.counts().late_references, 1U);
}

// Rule: what is not in the row of its time is in none, and is counted.
TEST(LiveRows, WhatComesAfterItsRowOrCannotWaitIsLeftOutAndCounted) {
  LiveRows rows({.rates_before_start = 2, .most_waiting = 4, .most_readings = 8});
  rows.push(environment(0.0, 5.0, 1.0));
  std::size_t given = 0;
  for (int i = 0; i < 6; ++i) {
    rows.push(rate(i, i));
    given += rows_of(rows).size();
  }
  EXPECT_EQ(given, 6U) << "four wait at most, then nobody is waited for";
  rows.push(environment(1.0, 6.0, 1.0));
  EXPECT_EQ(rows.counts().readings_lost, 2U) << "of two channels";
  rows.push(rate(6, 6.0));
  EXPECT_TRUE(rows_of(rows).empty()) << "it has spoken again";
  for (int i = 0; i < 11; ++i) rows.push(environment(5.5 + 0.1 * i, 8.0, 1.0));
  EXPECT_EQ(rows.counts().readings_lost, 2U + 2U * 3U) << "eleven of each, of which eight wait";
  const auto after = rows_of(rows);
  ASSERT_EQ(after.size(), 1U);
  EXPECT_EQ(after[0].inputs.supply_v, 8.0) << "and none of those that were late";
}

TEST(LiveRows, OneThatIsGoneIsNotWaitedForAndChannelsThatComeTooLateAreCounted) {
  LiveRows rows({.rates_before_start = 2});
  rows.push(environment(0.0, 5.0, 1.0));
  for (int i = 0; i < 6; ++i) rows.push(rate(i, i));
  EXPECT_EQ(rows_of(rows).size(), 1U);
  rows.stop_waiting();
  EXPECT_EQ(rows_of(rows).size(), 5U);
  core::EnvironmentSample late{.time = at(6.0), .channels = 1U << 6U};
  late.values.vibration_g = 1.0;
  rows.push(late);
  EXPECT_EQ(rows.counts().late_channels, 1U);
  rows.push(rate(6, 6.0));
  const auto after = rows_of(rows);
  ASSERT_EQ(after.size(), 1U);
  EXPECT_TRUE(std::isnan(after[0].inputs.vibration_g));
}

}  // namespace
}  // namespace zerodrift::measurement
