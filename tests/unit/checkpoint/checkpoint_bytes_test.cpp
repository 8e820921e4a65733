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
#include "tests/unit/checkpoint/saved_learner.h"

namespace zerodrift::checkpoint {
namespace {

using compensation::CompensationOptions;
using compensation::LearnerState;
using compensation::RestoredLearner;
using testing::Bench;
using testing::saved_after;
using testing::small_options;

constexpr std::uint32_t kGyro = 7;
constexpr int kLabels = 90;

// CRC-32 of ISO 3309, bit by bit; "123456789" gives 0xCBF43926.
std::uint32_t crc32(std::string_view bytes) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const char byte : bytes) {
    crc ^= static_cast<unsigned char>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
  }
  return ~crc;
}

void put(std::string& bytes, std::size_t at, std::uint64_t value, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i)
    bytes[at + i] = static_cast<char>((value >> (8 * i)) & 255U);
}

// The envelope as the schema's comment describes it.
std::string wrap(const std::string& message, std::uint32_t version = kFormatVersion) {
  std::string bytes = "ZDRIFTCP" + std::string(16, '\0') + message;
  put(bytes, 8, version, 4);
  put(bytes, 16, message.size(), 8);
  put(bytes, 12, crc32(bytes.substr(8, 4) + bytes.substr(16)), 4);
  return bytes;
}

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

// Rule: -0.0, the smallest and the largest numbers are kept as they are.
TEST(CheckpointLaws, EveryDoubleIsKeptToTheBit) {
  const CompensationOptions options = small_options();
  LearnerState state = saved_after(kLabels);
  const std::array values{-0.0, std::numeric_limits<double>::denorm_min(),
                          std::numeric_limits<double>::max(), 0.1, 1.0 / 3.0};
  for (const double value : values) {
    state.axes[2].svr.bias = state.axes[2].svr.thetas[3] = value;
    state.axes[0].judge.table.learned[1].held_variance = value;
    state.axes[1].model.held_slope_radps2 = value;
    const LearnerState read = decode(encode({kGyro, options}, state), {kGyro, options});
    const auto same = [&](double found) { return std::memcmp(&found, &value, sizeof value) == 0; };
    EXPECT_TRUE(same(read.axes[2].svr.bias) && same(read.axes[2].svr.thetas[3])) << value;
    EXPECT_TRUE(same(read.axes[0].judge.table.learned[1].held_variance)) << value;
    EXPECT_TRUE(same(read.axes[1].model.held_slope_radps2.value_or(7.0))) << value;
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
        case 0:
          bad[at] = static_cast<char>(next(256));
          break;
        case 1:
          std::memcpy(bad.data() + at, &evil[next(evil.size())], 8);
          break;
        case 2:
          bad.erase(at, 1 + next(40));
          break;
        default:
          bad.insert(at, bad.substr(next(bad.size()), next(40)));
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
  EXPECT_NE(refusal(wrap(message, 2)).find("format version 2, expected 1: saved by a newer"),
            std::string::npos);
  EXPECT_NE(refusal(wrap(message, 0)).find("format version 0, expected 1"), std::string::npos);
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
