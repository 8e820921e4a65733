// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>

#include "common/regression/online_svr.h"
#include "tests/support/state_bytes.h"
#include "tests/unit/regression/test_records.h"

namespace zerodrift::regression::testing {
namespace {

using zerodrift::testing::read_state;
using zerodrift::testing::state_of;
using zerodrift::testing::with;

constexpr std::uint64_t kSeed = 21;

void expect_resumes_to_the_bit(const OnlineSvrOptions& options, RecordKind kind) {
  RecordGenerator record(kind, options.dimension, kSeed);
  OnlineSvr original(options);
  for (const Sample& sample : record.take(3 * options.capacity)) original.add(sample.x, sample.y);
  OnlineSvr resumed(options);
  ASSERT_TRUE(read_state(resumed, state_of(original)));
  EXPECT_EQ(state_of(resumed), state_of(original));
  for (const Sample& sample : record.take(3 * options.capacity)) {
    const UpdateReport a = original.add(sample.x, sample.y), b = resumed.add(sample.x, sample.y);
    ASSERT_EQ(a.outcome, b.outcome);
    ASSERT_EQ(a.events, b.events);
    ASSERT_EQ(a.prior_residual, b.prior_residual);
    ASSERT_EQ(original.predict(sample.x), resumed.predict(sample.x));
  }
  EXPECT_EQ(state_of(resumed), state_of(original));
}

TEST(StateLaws, AResumedLearnerContinuesToTheBit) {
  for (const RecordKind kind : kAllRecordKinds) {
    for (const KernelKind kernel : kAllKernelKinds) {
      SCOPED_TRACE(std::string(name(kind)) + " " + name(kernel));
      OnlineSvrOptions options = options_of(2, 40, 10.0, kernel);
      expect_resumes_to_the_bit(options, kind);
      options.window = WindowPolicy::kTwoTier;
      expect_resumes_to_the_bit(options, kind);
    }
  }
}

TEST(StateLaws, ALearnerSavedInMidUpdateContinuesToTheBit) {
  OnlineSvrOptions options = options_of(2, 40, 10.0);
  options.event_budget = 2;
  RecordGenerator record(RecordKind::kJumps, 2, kSeed);
  OnlineSvr original(options);
  OnlineSvr resumed(options);  // whatever it held before
  int saved_unfinished = 0;
  for (int i = 0; i < 300; ++i) {
    const Sample sample = record.next();
    original.add(sample.x, sample.y);
    if (original.has_finished()) continue;
    ++saved_unfinished;
    ASSERT_TRUE(read_state(resumed, state_of(original)));
    while (!resumed.finish_pending()) {
    }
    while (!original.finish_pending()) {
    }
    EXPECT_EQ(state_of(resumed), state_of(original));
  }
  EXPECT_GT(saved_unfinished, 20);
}

// Where what stands in the state of an SVR of two features: bias, arrivals, cursor and the list of
// its slots; samples; the margin's slots, the unsettled ones, the factor.
struct Places {
  explicit Places(const OnlineSvr& svr) : samples(svr.size()), margin(svr.set_counts().margin) {}

  static constexpr std::size_t kArrivals = 8, kCursor = 16, kSlots = 32, kSampleSize = 59;
  [[nodiscard]] std::size_t sample(std::size_t i) const {
    return kSlots + 8 * samples + kSampleSize * i;
  }
  static constexpr std::size_t kTarget = 16, kResidual = 24, kWeight = 32, kTheta = 40,
                               kLeaves = 48, kSet = 49, kTier = 50, kArrival = 51;
  [[nodiscard]] std::size_t margin_slots() const { return sample(samples) + 8; }
  [[nodiscard]] std::size_t pending() const { return margin_slots() + 8 * margin; }
  [[nodiscard]] std::size_t factor() const { return pending() + 8; }

  std::size_t samples;
  std::size_t margin;
};

TEST(StateAbuse, AStateThatDoesNotBelongIsRefused) {
  const OnlineSvrOptions options = options_of(2, 40, 10.0);
  OnlineSvr svr(options);
  for (const Sample& sample : RecordGenerator(RecordKind::kSmooth, 2, kSeed).take(60)) {
    svr.add(sample.x, sample.y);
  }
  const std::string good = state_of(svr);
  const Places at(svr);
  ASSERT_GT(at.margin, 1u);
  ASSERT_EQ(good.size(), at.factor() + 8 * (at.margin - 1) * at.margin / 2) << "as Places says";
  const auto is_taken = [&](const std::string& bytes) {
    OnlineSvr other(options);
    return read_state(other, bytes);
  };
  EXPECT_TRUE(is_taken(good));
  EXPECT_FALSE(is_taken(good + '\0'));
  for (std::size_t size = 0; size < good.size(); size += 7)
    EXPECT_FALSE(is_taken(good.substr(0, size))) << size;

  const double nan = std::nan("");
  const std::uint64_t far = 100000, capacity = 40, none = 0, few = 10;
  std::uint64_t first_slot = 0, first_of_margin = 0;
  std::memcpy(&first_slot, good.data() + Places::kSlots, 8);
  std::memcpy(&first_of_margin, good.data() + at.margin_slots(), 8);
  EXPECT_FALSE(is_taken(with(good, 0, nan))) << "bias";
  EXPECT_FALSE(is_taken(with(good, Places::kArrivals, few))) << "arrivals beyond their number";
  EXPECT_FALSE(is_taken(with(good, Places::kCursor, capacity + 1))) << "cursor";
  EXPECT_FALSE(is_taken(with(good, Places::kSlots - 8, far))) << "number of samples";
  EXPECT_FALSE(is_taken(with(good, Places::kSlots, far))) << "slot";
  EXPECT_FALSE(is_taken(with(good, Places::kSlots + 8, first_slot))) << "slot taken twice";
  for (std::size_t i = 0; i < at.samples; ++i) {
    const std::size_t sample = at.sample(i);
    EXPECT_FALSE(is_taken(with(good, sample + 8, nan))) << "feature";
    EXPECT_FALSE(is_taken(with(good, sample + Places::kTarget, 1e300))) << "target";
    EXPECT_FALSE(is_taken(with(good, sample + Places::kResidual, nan))) << "residual";
    for (const double weight : {0.0, 1.5, nan, -1.0})
      EXPECT_FALSE(is_taken(with(good, sample + Places::kWeight, weight))) << "weight";
    EXPECT_FALSE(is_taken(with(good, sample + Places::kTheta, 11.0))) << "theta";
    for (char set = 0; set < 7; ++set) {
      if (set == good[sample + Places::kSet]) continue;
      EXPECT_FALSE(is_taken(with(good, sample + Places::kSet, set))) << "set " << int{set};
    }
    for (char tier = 0; tier < 4; ++tier) {
      if (tier == good[sample + Places::kTier]) continue;
      EXPECT_FALSE(is_taken(with(good, sample + Places::kTier, tier))) << "tier " << int{tier};
    }
    EXPECT_FALSE(is_taken(with(good, sample + Places::kLeaves, char{1}))) << "leaves";
    EXPECT_FALSE(is_taken(with(good, sample + Places::kArrival, far))) << "arrival";
    EXPECT_TRUE(i == 0 || !is_taken(with(good, sample + Places::kArrival, none))) << "order";
  }
  EXPECT_FALSE(is_taken(with(good, at.margin_slots() - 8, far))) << "size of the margin";
  EXPECT_FALSE(is_taken(with(good, at.margin_slots(), far))) << "margin";
  EXPECT_FALSE(is_taken(with(good, at.margin_slots() + 8, first_of_margin))) << "margin";
  EXPECT_FALSE(is_taken(with(good, at.factor(), 0.0))) << "diagonal of the factor";
  EXPECT_FALSE(is_taken(with(good, at.factor(), 1e101))) << "factor";
}

// Rule: whatever is written over a state, it is refused or makes a learner that takes samples.
TEST(StateAbuse, WhatIsWrittenOverAStateIsRefusedOrDoesNoHarm) {
  OnlineSvrOptions options = options_of(2, 12, 10.0);
  options.window = WindowPolicy::kTwoTier;
  options.recent_capacity = 6;
  OnlineSvr svr(options);
  RecordGenerator record(RecordKind::kSmooth, 2, kSeed);
  for (const Sample& sample : record.take(30)) svr.add(sample.x, sample.y);
  const std::string good = state_of(svr);
  const std::vector<Sample> more = record.take(12);
  std::size_t taken = 0;
  for (const std::uint64_t number :
       {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{0x4010000000000000},
        std::uint64_t{0xc07f000000000000}, std::uint64_t{0x7fefffffffffffff}}) {
    for (std::size_t at = 0; at + 8 <= good.size(); ++at) {
      OnlineSvr other(options);
      if (!read_state(other, with(good, at, number))) continue;
      ++taken;
      for (const Sample& sample : more) other.add(sample.x, sample.y);
    }
  }
  EXPECT_GT(taken, 100u) << "or this tests little";
}

}  // namespace
}  // namespace zerodrift::regression::testing
