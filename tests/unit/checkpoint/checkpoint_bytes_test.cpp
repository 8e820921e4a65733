// SPDX-License-Identifier: Apache-2.0
// What a checkpoint says is what was saved, to the bit; anything else is refused.
#include "common/checkpoint/checkpoint_bytes.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>

#include "common/checkpoint/checkpoint_error.h"
#include "idl/proto/checkpoint.pb.h"
#include "tests/unit/checkpoint/envelope.h"
#include "tests/unit/checkpoint/saved_learner.h"

namespace zerodrift::checkpoint {
namespace {

using compensation::CompensationOptions;
using compensation::LearnerState;
using compensation::RestoredLearner;
using testing::Bench;
using testing::crc32;
using testing::saved_after;
using testing::small_options;
using testing::wrap;

constexpr std::uint32_t kGyro = 7;
constexpr int kLabels = 90;

std::string encoded(int labels = kLabels) {
  const CompensationOptions options = small_options();
  return encode({kGyro, options}, saved_after(labels));
}

// The line that decode() refuses with; "" if it doesn't.
std::string refusal(const std::string& bytes, std::uint32_t gyro_id = kGyro,
                    const CompensationOptions& options = small_options()) {
  try {
    static_cast<void>(decode(bytes, {gyro_id, options}));
  } catch (const CheckpointError& error) {
    return error.what();
  }
  return "";
}

TEST(Checkpoint, TheCrcIsTheStandardOne) {
  ASSERT_EQ(crc32("123456789"), 0xCBF43926U);
  const std::string bytes = encoded();
  EXPECT_EQ(wrap(bytes.substr(kEnvelopeSize)), bytes);
}

// Rule: the same state gives the same bytes, and reading them gives the same state; and so does the
// learner that is made from it.
TEST(CheckpointLaws, SavingWhatWasLoadedGivesTheSameBytes) {
  const CompensationOptions options = small_options();
  for (const int labels : {0, 1, 3, 4, 5, 20, 36, 37, 38, 75, kLabels}) {
    const std::string bytes = encoded(labels);
    EXPECT_EQ(encoded(labels), bytes) << labels;
    const LearnerState state = decode(bytes, {kGyro, options});
    EXPECT_EQ(encode({kGyro, options}, state), bytes) << labels;
    Bench bench(options);
    bench.restore(std::make_shared<RestoredLearner>(options, state));
    EXPECT_EQ(encode({kGyro, options}, bench.state()), bytes) << labels;
  }
}

// Rule: through bytes, a learner goes on to the bit: after as many labels more it gives the same
// bytes as one that was never saved.
TEST(CheckpointLaws, ALoadedLearnerLearnsOnToTheBit) {
  const CompensationOptions options = small_options();
  const std::string whole = encoded(kLabels);
  for (int cut = 0; cut < kLabels; ++cut) {
    Bench resumed(options);
    resumed.restore(
        std::make_shared<RestoredLearner>(options, decode(encoded(cut), {kGyro, options})));
    resumed.learn(cut, kLabels - cut);
    EXPECT_TRUE(encode({kGyro, options}, resumed.state()) == whole) << "cut " << cut;
  }
}

TEST(CheckpointLaws, ATruncationAtAnyLengthIsRefused) {
  const std::string bytes = encoded();
  for (std::size_t length = 0; length < bytes.size(); ++length)
    ASSERT_NE(refusal(bytes.substr(0, length)), "") << length;
  EXPECT_NE(refusal(bytes + '\0'), "");
  EXPECT_NE(refusal(bytes.substr(0, 1000)).find("truncated"), std::string::npos);
  EXPECT_EQ(refusal(bytes), "");
}

TEST(CheckpointLaws, AnyByteChangedInAnyWayIsRefused) {
  std::string bytes = encoded(12);
  std::set<std::string> kinds;
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    for (const unsigned change : {0x01U, 0x80U, 0xFFU}) {
      const char kept = bytes[at];
      bytes[at] = static_cast<char>(static_cast<unsigned char>(kept) ^ change);
      const std::string line = refusal(bytes);
      bytes[at] = kept;
      ASSERT_NE(line, "") << "byte " << at << " change " << change;
      ASSERT_EQ(line.find('\n'), std::string::npos);
    }
  }
  EXPECT_EQ(refusal(bytes), "");
}

// Rule: contents that were never a learner's are refused by value or make a learner that works;
// nothing crashes. With a valid CRC: bytes overwritten, removed and put in.
TEST(CheckpointAbuse, HostileContentsWithAValidCrcNeverCrash) {
  const CompensationOptions options = small_options();
  const std::string message = encoded(60).substr(kEnvelopeSize);
  std::uint64_t seed = 1;
  const auto next = [&](std::uint64_t below) {
    seed = seed * 6364136223846793005ULL + 1442695040888963407ULL;
    return (seed >> 33U) % below;
  };
  const std::array<double, 6> evil{std::numeric_limits<double>::quiet_NaN(),
                                   std::numeric_limits<double>::infinity(),
                                   -1e308,
                                   1e9,
                                   -1.0,
                                   1e-300};
  int refused = 0;
  int taken = 0;
  for (int round = 0; round < 4000; ++round) {
    std::string bad = message;
    for (std::uint64_t change = 0; change <= next(3); ++change) {
      const std::size_t at = next(bad.size() - 8);
      switch (next(4)) {
        case 0: bad[at] = static_cast<char>(next(256)); break;
        case 1: std::memcpy(bad.data() + at, &evil[next(evil.size())], 8); break;
        case 2: bad.erase(at, 1 + next(40)); break;
        default: bad.insert(at, bad.substr(next(bad.size()), next(40)));
      }
    }
    try {
      Bench bench(options);
      bench.restore(
          std::make_shared<RestoredLearner>(options, decode(wrap(bad), {kGyro, options})));
      bench.learn(60, 10);
      ++taken;
    } catch (const CheckpointError&) {
      ++refused;
    } catch (const std::invalid_argument&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 400);
  EXPECT_GT(taken, 400) << "values changed within reason must be taken, or this tests little";
}

TEST(Checkpoint, OfAnotherFormatVersionIsRefused) {
  const std::string message = encoded().substr(kEnvelopeSize);
  EXPECT_EQ(refusal(wrap(message, 3)),
            "found format version 3, expected 2: saved by a newer zerodrift");
  EXPECT_EQ(refusal(wrap(message, 1)),
            "found format version 1, expected 2: saved by an older zerodrift");
}

// A checkpoint as another version of the program would have written it.
template <typename Change>
std::string changed(const Change& change, int labels = kLabels) {
  proto::Checkpoint message;
  message.ParseFromString(encoded(labels).substr(kEnvelopeSize));
  change(message);
  return wrap(message.SerializeAsString());
}

// Rule: what a learner of another layout knew is refused in one line; its kernels outlive the
// upgrade, also where keys of the configuration have come or gone.
TEST(Checkpoint, OfAnotherLayoutItsKernelsAreKept) {
  const CompensationOptions options = small_options();
  const LearnerState whole = decode(encoded(), {kGyro, options});
  const std::string bytes = changed([](auto& message) {
    message.set_layout(compensation::kLearnerLayout + 1);
    message.set_producer("zerodrift 99");
    message.set_learner("of another layout");
    message.add_options()->set_key("svr.something_new");
    message.mutable_options()->DeleteSubrange(0, 1);
  });
  EXPECT_EQ(refusal(bytes),
            "found what a learner of layout " + std::to_string(compensation::kLearnerLayout + 1) +
                " knew, expected layout " + std::to_string(compensation::kLearnerLayout) +
                ": saved by zerodrift 99");
  const LearnerState kernels = decode_kernels(bytes, {kGyro, options});
  EXPECT_EQ(kernels.epoch, whole.epoch + 1) << "it is another model";
  EXPECT_EQ(kernels.bytes, "");
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    EXPECT_EQ(kernels.kernels[i].kernel, whole.kernels[i].kernel);
    EXPECT_EQ(kernels.kernels[i].epsilon, whole.kernels[i].epsilon);
  }
  EXPECT_THROW((void)decode_kernels(bytes, {kGyro + 1, options}), CheckpointError);
  CompensationOptions other = options;
  other.model.capacity = 20;
  EXPECT_THROW((void)decode_kernels(bytes, {kGyro, other}), CheckpointError);
}

TEST(Checkpoint, WithKernelsThatAreNoneIsRefused) {
  EXPECT_NE(refusal(changed([](auto& m) { m.mutable_kernels()->RemoveLast(); })), "");
  EXPECT_NE(refusal(changed([](auto& m) { m.mutable_kernels(0)->set_kind(5); })), "");
  EXPECT_NE(refusal(changed([](auto& m) { m.clear_learner(); })), "");
}

TEST(Checkpoint, WhatIsNoCheckpointIsRefused) {
  EXPECT_NE(refusal("").find("something else than a checkpoint"), std::string::npos);
  EXPECT_NE(refusal("time_s,rate_x_deg_h\n").find("ZDRIFTCP"), std::string::npos);
  EXPECT_NE(refusal(wrap("")), "");
  EXPECT_NE(refusal(wrap("\xFF\xFF\xFF")).find("no checkpoint message"), std::string::npos);
}

TEST(Checkpoint, OfAnotherGyroIsRefused) {
  EXPECT_EQ(refusal(encoded(), 8), "found a checkpoint of gyro 7, expected one of gyro 8");
}

// Rule: any option that decides what the learner's numbers mean is named with both values; what
// only surrounds the learner may change.
TEST(Checkpoint, OfOtherOptionsIsRefusedByKey) {
  const std::string bytes = encoded(20);
  const auto with = [&](auto&& change) {
    CompensationOptions options = small_options();
    change(options);
    return refusal(bytes, kGyro, options);
  };
  EXPECT_EQ(with([](auto& o) { o.model.capacity = 20; }),
            "found a checkpoint made with svr.capacity '10', expected '20' as configured");
  const auto names = [](const std::string& line, const char* key) {
    return line.find(key) != std::string::npos;
  };
  EXPECT_TRUE(names(with([](auto& o) { o.features[0].probe = "case"; }), "features[0]"));
  EXPECT_TRUE(names(with([](auto& o) { o.features[0].scale = 3.0; }), "features[0]"));
  EXPECT_TRUE(names(with([](auto& o) { o.features.push_back(o.features[0]); }), "features[1]"));
  EXPECT_TRUE(names(with([](auto& o) { o.model.epsilon *= 1.0 + 1e-15; }), "svr.epsilon"));
  EXPECT_TRUE(names(with([](auto& o) { o.model.box_constraint = 7.0; }), "svr.box_constraint"));
  EXPECT_TRUE(names(with([](auto& o) { o.model.kernel.gamma = 7.0; }), "svr.gamma"));
  EXPECT_TRUE(names(with([](auto& o) { o.model.kernel.kind = regression::KernelKind::kLinear; }),
                    "svr.kernel"));
  EXPECT_TRUE(names(with([](auto& o) { o.model.selection.reset(); }), "svr.selection"));
  EXPECT_TRUE(
      names(with([](auto& o) { o.model.window = regression::WindowPolicy::kFifo; }), "svr.window"));
  EXPECT_TRUE(
      names(with([](auto& o) { o.learning.label_interval_s = 6.0; }), "learning.label_interval_s"));
  EXPECT_TRUE(names(with([](auto& o) { o.learning.initial_labels = 5; }), "initial_labels"));
  EXPECT_TRUE(
      names(with([](auto& o) { o.track.local_polynomial.window_s = 30.0; }), "temperature_rate"));
  EXPECT_TRUE(names(with([](auto& o) { o.earth_rate.mode = compensation::EarthRateMode::kKnown; }),
                    "earth_rate"));
  EXPECT_EQ(with([](auto& o) {
              o.learning.handover_s = 2.0;
              o.temperature_stale_s = 60.0;
            }),
            "");
}

TEST(Checkpoint, WithAFeatureTooManyIsRefused) {
  CompensationOptions two = small_options();
  two.features.push_back({.kind = thermal::FeatureKind::kTemperatureRate, .probe = "coil"});
  Bench bench(two);
  bench.learn(0, 8);
  EXPECT_NE(refusal(encode({kGyro, two}, bench.state())), "");
}

}  // namespace
}  // namespace zerodrift::checkpoint
