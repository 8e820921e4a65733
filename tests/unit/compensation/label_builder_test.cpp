// SPDX-License-Identifier: Apache-2.0
// From samples to blocks to labels.
#include "common/compensation/label_builder.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

// ---------------------------------------------------------------------------------------------
// blocks

// Rule: a block holds exactly the samples whose intervals begin within its second; its mean and
// variance are those of the samples. Shifted sums of n values of order s lose at most about
// n epsilon s: 200 * 2.2e-16 * 1e-3; the variance that times s.
TEST(BlockAveragerLaws, MeansAndVariancesEqualDirectComputation) {
  Random random(1);
  BlockAverager blocks(1.0);
  std::vector<double> values;
  int closed_blocks = 0;
  for (int k = 1; k <= 4000; ++k) {
    const auto closed = blocks.advance(from_seconds(k / 200.0), 1.0 / 200.0);
    if (closed) {
      ++closed_blocks;
      ASSERT_EQ(values.size(), 200U);
      double mean = 0.0, variance = 0.0;
      for (const double v : values) mean += v / 200.0;
      for (const double v : values) variance += (v - mean) * (v - mean) / 199.0;
      EXPECT_EQ(closed->count[0], 200U);
      EXPECT_EQ(closed->count[1], 0U);
      EXPECT_NEAR(closed->mean_radps[0], mean, 5e-17);
      EXPECT_NEAR(closed->variance_radps2[0], variance, 5e-20);
      EXPECT_EQ(closed->begin, from_seconds(closed_blocks - 1));
      EXPECT_EQ(closed->end, from_seconds(closed_blocks));
      values.clear();
    }
    values.push_back(1e-3 + 1e-6 * random.gaussian());
    blocks.add(Axis::kX, values.back());
  }
  EXPECT_EQ(closed_blocks, 19);
}

// Rule: of a record with one sample a second each sample is a block of its own.
TEST(BlockAverager, OneHertzRecordsGiveOneSampleABlock) {
  BlockAverager blocks(1.0);
  for (int k = 1; k <= 10; ++k) {
    const auto closed = blocks.advance(from_seconds(k), 1.0);
    ASSERT_EQ(closed.has_value(), k > 1);
    if (closed) {
      EXPECT_EQ(closed->count[2], 1U);
      EXPECT_EQ(closed->mean_radps[2], k - 1.0);
      EXPECT_EQ(closed->variance_radps2[2], 0.0);
      EXPECT_EQ(closed->begin, from_seconds(k - 2));
      EXPECT_EQ(closed->end, from_seconds(k - 1));
    }
    blocks.add(Axis::kZ, k);
  }
}

// Rule: a gap ends a block where its last sample ended; no block reaches across it.
TEST(BlockAverager, AGapEndsTheBlockAtItsLastSample) {
  BlockAverager blocks(1.0);
  blocks.advance(from_seconds(0.1), 0.1);
  blocks.add(Axis::kX, 1.0);
  blocks.advance(from_seconds(0.2), 0.1);
  blocks.add(Axis::kX, 3.0);
  const auto closed = blocks.advance(from_seconds(100.0), 0.1);
  ASSERT_TRUE(closed);
  EXPECT_EQ(closed->end, from_seconds(0.2));
  EXPECT_EQ(closed->mean_radps[0], 2.0);
  EXPECT_EQ(blocks.advance(from_seconds(100.5), 0.1), std::nullopt);
}

// Rule: reference and turning marks belong to the block they were made in.
TEST(BlockAverager, MarksBelongToTheirBlock) {
  BlockAverager blocks(1.0);
  for (int k = 1; k <= 40; ++k) {
    const auto closed = blocks.advance(from_seconds(0.1 * k), 0.1);
    if (closed) {
      const bool second = closed->begin == from_seconds(1.0);
      EXPECT_EQ(blocks.turning(), second);
      EXPECT_EQ(closed->has_reference, second);
    }
    if (k == 15) {
      blocks.mark_turning();
      blocks.mark_reference();
    }
    blocks.add(Axis::kX, 0.0);
  }
}

// Rule: an interval that makes no sense counts as none; block times stay those of the stamps.
TEST(BlockAveragerAbuse, SenselessIntervalsCountAsNone) {
  for (const double interval_s : {std::numeric_limits<double>::quiet_NaN(), -1.0, 1e300,
                                  std::numeric_limits<double>::infinity()}) {
    BlockAverager blocks(1.0);
    int closed_blocks = 0;
    for (int k = 0; k <= 50; ++k) {
      if (const auto closed = blocks.advance(from_seconds(0.1 * k), interval_s)) {
        EXPECT_EQ(closed->begin, from_seconds(closed_blocks));
        EXPECT_EQ(closed->end, from_seconds(++closed_blocks));
      }
    }
    EXPECT_EQ(closed_blocks, 5);
  }
}

// ---------------------------------------------------------------------------------------------
// labels

DriftBlock still_block(int second, double mean_radps = 1e-5) {
  DriftBlock block;
  block.begin = from_seconds(second);
  block.end = from_seconds(second + 1);
  block.mean_radps = {mean_radps, -mean_radps, 0.0};
  block.count = {200, 200, 200};
  return block;
}

core::PerAxis<AxisContext> context(double value) {
  AxisContext axis;
  axis.features_ready = true;
  axis.features[0] = value;
  axis.applied_radps = 2.0 * value;
  axis.held_radps = 3.0 * value;
  return {axis, axis, axis};
}

constexpr core::PerAxis<double> kVariance{4.0, 9.0, 16.0};

// Rule: a label is the mean of its blocks, its variance that of the mean, its features and
// predictions those of the same time. Ten values: rounding below 1e-15 relative.
TEST(LabelBuilder, ALabelIsTheMeanOfItsBlocks) {
  LabelBuilder labels(10.0, 5.0);
  for (int s = 0; s < 14; ++s) {
    ASSERT_FALSE(labels.add(still_block(s, 1e-6 * s), context(s), {}, kVariance)) << s;
  }
  const auto label = labels.add(still_block(14), context(14), {}, kVariance);
  ASSERT_TRUE(label);
  EXPECT_EQ(label->begin, from_seconds(0));
  EXPECT_EQ(label->end, from_seconds(10));
  EXPECT_NEAR(label->drift_radps[0], 4.5e-6, 1e-20);
  EXPECT_NEAR(label->drift_radps[1], -4.5e-6, 1e-20);
  EXPECT_DOUBLE_EQ(label->variance_radps2[2], 1.6);
  EXPECT_DOUBLE_EQ(label->features[0][0], 4.5);
  EXPECT_DOUBLE_EQ(*label->applied_radps[0], 9.0);
  EXPECT_DOUBLE_EQ(*label->held_radps[0], 13.5);
  EXPECT_TRUE(label->features_ready[0]);
}

// Rule: predictions and features count only where they held for the whole label.
TEST(LabelBuilder, APredictionThatHeldForPartOfALabelIsNotJudged) {
  LabelBuilder labels(10.0, 0.0);
  for (int s = 0; s < 9; ++s) labels.add(still_block(s), context(1.0), {}, kVariance);
  auto last = context(1.0);
  last[0].applied_radps.reset();
  last[1].features_ready = false;
  const auto label = labels.add(still_block(9), last, {}, kVariance);
  ASSERT_TRUE(label);
  EXPECT_FALSE(label->applied_radps[0]);
  EXPECT_TRUE(label->held_radps[0]);
  EXPECT_FALSE(label->features_ready[1]);
  EXPECT_TRUE(label->features_ready[2]);
}

// Rule: an axis that was not measured has no label; the others have theirs.
TEST(LabelBuilder, AnAxisNotMeasuredHasNoLabel) {
  LabelBuilder labels(10.0, 0.0);
  std::optional<Label> label;
  for (int s = 0; s < 10; ++s) {
    DriftBlock block = still_block(s);
    block.count[1] = 0;
    block.mean_radps[1] = std::numeric_limits<double>::quiet_NaN();
    label = labels.add(block, context(1.0), {}, kVariance);
  }
  ASSERT_TRUE(label);
  EXPECT_TRUE(label->valid[0]);
  EXPECT_FALSE(label->valid[1]);
}

// Rule: motion discards everything unconfirmed. Whenever a turn begins, no label that is given out
// reaches to within 4 s of it: it is given out at the end of a still block, at most the one that
// holds the turn's beginning, and is by then confirm_s = 5 s old.
TEST(LabelBuilderLaws, NoLabelGivenOutHoldsTheBeginningOfATurn) {
  int labels_given = 0;
  for (int turn_block = 1; turn_block < 60; ++turn_block) {
    LabelBuilder labels(10.0, 5.0);
    // The block in which the turn begins may still pass for rest; the next one never does.
    for (int s = 0; s <= turn_block; ++s) {
      const double mean = s == turn_block ? 1.0 : 1e-5;
      if (const auto label = labels.add(still_block(s, mean), context(1.0), {}, kVariance)) {
        ++labels_given;
        EXPECT_LE(label->end + from_seconds(4.0), from_seconds(turn_block));
        EXPECT_NEAR(label->drift_radps[0], 1e-5, 1e-18);
      }
    }
    labels.discard();
    // After the turn labels start anew, from blocks after it only.
    for (int s = turn_block + 30; s < turn_block + 60; ++s) {
      if (const auto label = labels.add(still_block(s), context(1.0), {}, kVariance)) {
        EXPECT_GE(label->begin, from_seconds(turn_block + 30));
        EXPECT_NEAR(label->drift_radps[0], 1e-5, 1e-18);
      }
    }
  }
  EXPECT_GT(labels_given, 0);
}

// Rule: a pause longer than a label parts two labels.
TEST(LabelBuilder, APauseLongerThanALabelPartsTwo) {
  LabelBuilder labels(10.0, 0.0);
  for (int s = 0; s < 4; ++s) labels.add(still_block(s, 1e-6), context(1.0), {}, kVariance);
  const auto before = labels.add(still_block(100, 5e-6), context(1.0), {}, kVariance);
  ASSERT_TRUE(before);
  EXPECT_EQ(before->end, from_seconds(4));
  EXPECT_NEAR(before->drift_radps[0], 1e-6, 1e-20);
}

// Rule: a stretch that gave no label before it was discarded is fruitless, one that gave one ends
// the count, and motion that goes on discards nothing twice.
TEST(LabelBuilderLaws, StretchesWithoutALabelAreCountedInTurn) {
  Random random(11);
  LabelBuilder labels(10.0, 5.0);
  std::size_t fruitless = 0;
  int s = 0;
  for (int stretch = 0; stretch < 500; ++stretch) {
    const int length = 1 + static_cast<int>(random.below(25));
    bool has_given = false;
    for (int k = 0; k < length; ++k)
      has_given |= labels.add(still_block(s++), context(1.0), {}, kVariance).has_value();
    EXPECT_EQ(has_given, length >= 15) << length;
    fruitless = has_given ? 0 : fruitless + 1;
    for (auto moving = 1 + random.below(3); moving > 0; --moving, ++s) labels.discard();
    ASSERT_EQ(labels.fruitless_stretches(), fruitless);
  }
}

// Rule: however many short labels await a long confirmation, some are confirmed.
TEST(LabelBuilderAbuse, ShortLabelsWithALongConfirmationStillComeOut) {
  LabelBuilder labels(1.0, 600.0);
  int given = 0;
  for (int s = 0; s < 2000; ++s) {
    if (const auto label = labels.add(still_block(s), context(1.0), {}, kVariance)) {
      ++given;
      EXPECT_GE(from_seconds(s + 1), label->end + from_seconds(600.0));
    }
  }
  EXPECT_GE(given, 64);
}

}  // namespace
}  // namespace zerodrift::compensation
