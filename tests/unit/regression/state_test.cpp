// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>

#include "common/regression/online_svr.h"
#include "tests/unit/regression/test_records.h"

namespace zerodrift::regression::testing {
namespace {

constexpr std::uint64_t kSeed = 21;

void expect_equal_to_the_bit(const OnlineSvr& a, const OnlineSvr& b) {
  const OnlineSvrState left = a.export_state(), right = b.export_state();
  EXPECT_EQ(left.bias, right.bias);
  EXPECT_EQ(left.arrival_count, right.arrival_count);
  EXPECT_EQ(left.refresh_cursor, right.refresh_cursor);
  EXPECT_EQ(left.sets, right.sets);
  EXPECT_EQ(left.tiers, right.tiers);
  EXPECT_EQ(left.thetas, right.thetas);
  EXPECT_EQ(left.margin_slots, right.margin_slots);
  EXPECT_EQ(left.margin_factor, right.margin_factor);
  EXPECT_EQ(left.unsettled_slots, right.unsettled_slots);
  EXPECT_EQ(left.forgotten_slots, right.forgotten_slots);
  for (std::size_t slot = 0; slot < left.sets.size(); ++slot) {
    if (left.sets[slot] == SampleSet::kVacant) continue;
    ASSERT_EQ(left.residuals[slot], right.residuals[slot]);
    ASSERT_EQ(left.targets[slot], right.targets[slot]);
    ASSERT_EQ(left.weights[slot], right.weights[slot]);
    ASSERT_EQ(left.arrivals[slot], right.arrivals[slot]);
  }
}

void expect_resumes_to_the_bit(const OnlineSvrOptions& options, RecordKind kind) {
  RecordGenerator record(kind, options.dimension, kSeed);
  OnlineSvr original(options);
  for (const Sample& sample : record.take(3 * options.capacity)) original.add(sample.x, sample.y);
  OnlineSvr resumed = OnlineSvr::from_state(options, original.export_state());
  for (const Sample& sample : record.take(3 * options.capacity)) {
    const UpdateReport a = original.add(sample.x, sample.y), b = resumed.add(sample.x, sample.y);
    ASSERT_EQ(a.outcome, b.outcome);
    ASSERT_EQ(a.events, b.events);
    ASSERT_EQ(a.prior_residual, b.prior_residual);
    ASSERT_EQ(original.predict(sample.x), resumed.predict(sample.x));
  }
  expect_equal_to_the_bit(original, resumed);
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
  int saved_unfinished = 0;
  for (int i = 0; i < 300; ++i) {
    const Sample sample = record.next();
    original.add(sample.x, sample.y);
    if (original.is_settled()) continue;
    ++saved_unfinished;
    OnlineSvr resumed = OnlineSvr::from_state(options, original.export_state());
    while (!resumed.settle()) {
    }
    while (!original.settle()) {
    }
    expect_equal_to_the_bit(original, resumed);
  }
  EXPECT_GT(saved_unfinished, 20);
}

TEST(StateAbuse, AStateThatDoesNotBelongIsRefusedByNameOfTheField) {
  const OnlineSvrOptions options = options_of(2, 40, 10.0);
  OnlineSvr svr(options);
  for (const Sample& sample : RecordGenerator(RecordKind::kSmooth, 2, kSeed).take(60)) {
    svr.add(sample.x, sample.y);
  }
  const OnlineSvrState good = svr.export_state();
  ASSERT_GT(good.margin_slots.size(), 1u);
  const auto message_of = [&](const std::function<void(OnlineSvrState&)>& spoil) {
    OnlineSvrState state = good;
    spoil(state);
    try {
      (void)OnlineSvr::from_state(options, state);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  const auto expect_refused = [&](const char* field,
                                  const std::function<void(OnlineSvrState&)>& spoil) {
    EXPECT_NE(message_of(spoil).find(field), std::string::npos) << message_of(spoil);
  };
  EXPECT_EQ(message_of([](OnlineSvrState&) {}), "accepted");
  expect_refused("features", [](OnlineSvrState& s) { s.features.pop_back(); });
  expect_refused("features", [](OnlineSvrState& s) { s.features[0] = std::nan(""); });
  expect_refused("targets", [](OnlineSvrState& s) { s.targets[0] = INFINITY; });
  expect_refused("weights", [](OnlineSvrState& s) { s.weights.pop_back(); });
  expect_refused("weights", [](OnlineSvrState& s) { s.weights[0] = 0.0; });
  expect_refused("weights", [](OnlineSvrState& s) { s.weights[0] = 1.5; });
  expect_refused("weights", [](OnlineSvrState& s) { s.weights[0] = std::nan(""); });
  expect_refused("thetas", [](OnlineSvrState& s) { s.thetas[0] = 11.0; });
  expect_refused("thetas", [&](OnlineSvrState& s) { s.weights[good.margin_slots[0]] = 1e-6; });
  expect_refused("residuals", [](OnlineSvrState& s) { s.residuals[1] = std::nan(""); });
  expect_refused("bias", [](OnlineSvrState& s) { s.bias = std::nan(""); });
  expect_refused("margin_slots", [](OnlineSvrState& s) { s.margin_slots[1] = s.margin_slots[0]; });
  expect_refused("margin_slots", [](OnlineSvrState& s) { s.margin_slots[0] = 100000; });
  expect_refused("margin_factor", [](OnlineSvrState& s) { s.margin_factor[0] = 0.0; });
  expect_refused("margin_factor", [](OnlineSvrState& s) { s.margin_factor.push_back(1.0); });
  expect_refused("unsettled_slots", [](OnlineSvrState& s) { s.unsettled_slots = {0}; });
  expect_refused("forgotten_slots", [](OnlineSvrState& s) { s.forgotten_slots = {0}; });
  expect_refused("refresh_cursor", [](OnlineSvrState& s) { s.refresh_cursor = 41; });
  expect_refused("arrivals", [](OnlineSvrState& s) { s.arrival_count = 10; });
  expect_refused("tiers", [](OnlineSvrState& s) { s.tiers[0] = WindowTier::kOld; });
  expect_refused("sets", [](OnlineSvrState& s) { s.sets.clear(); });
}

}  // namespace
}  // namespace zerodrift::regression::testing
