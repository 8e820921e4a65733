// SPDX-License-Identifier: Apache-2.0
#include "common/drivers/kvh_frame.h"

#include <gtest/gtest.h>

#include <random>
#include <string_view>
#include <vector>

namespace zerodrift::drivers {
namespace {

using Bytes = std::vector<std::uint8_t>;

KvhFrame numbered_frame(unsigned number) {
  KvhFrame frame;
  const auto value = static_cast<float>(number);
  frame.rotation = {1e-6F * value, -2e-6F * value, 3e-6F};
  frame.acceleration_g = {0.0F, 0.25F, -1.0F};
  frame.rotation_valid = {true, number % 3 != 0, true};
  frame.acceleration_valid = {true, true, number % 5 != 0};
  frame.sequence = static_cast<std::uint8_t>(number % kKvhSequenceModulus);
  frame.temperature = static_cast<std::int16_t>(static_cast<int>(number % 100) - 40);
  return frame;
}

void append(Bytes& bytes, const KvhFrame& frame) {
  const auto encoded = encode(frame);
  bytes.insert(bytes.end(), encoded.begin(), encoded.end());
}

std::vector<KvhFrame> parse(KvhFrameParser& parser, const Bytes& bytes) {
  std::vector<KvhFrame> frames;
  for (const std::uint8_t byte : bytes) {
    if (const auto frame = parser.push(byte)) frames.push_back(*frame);
  }
  return frames;
}

// The check value of CRC-32/MPEG-2 in the catalogue of parametrised CRC algorithms.
TEST(KvhFrames, CrcHasItsCatalogueCheckValue) {
  constexpr std::string_view kDigits = "123456789";
  const Bytes bytes{kDigits.begin(), kDigits.end()};
  EXPECT_EQ(crc32_mpeg2(bytes), 0x0376E6E7U);
}

TEST(KvhFrames, LayoutIsThatOfTheManual) {
  KvhFrame frame;
  frame.rotation = {1.0F, -2.0F, 0.0F};       // 0x3F800000, 0xC0000000
  frame.acceleration_g = {0.0F, 0.0F, 0.5F};  // 0x3F000000
  frame.rotation_valid = {true, false, true};
  frame.acceleration_valid = {false, false, true};
  frame.sequence = 127;
  frame.temperature = -2;
  const Bytes expected{0xFE, 0x81, 0xFF, 0x55, 0x3F, 0x80, 0,    0,   0xC0, 0,   0,
                       0,    0,    0,    0,    0,    0,    0,    0,   0,    0,   0,
                       0,    0,    0x3F, 0,    0,    0,    0x45, 127, 0xFF, 0xFE};
  const auto encoded = encode(frame);
  EXPECT_EQ(Bytes(encoded.begin(), encoded.begin() + 32), expected);
  const std::uint32_t crc = crc32_mpeg2(expected);
  for (unsigned i = 0; i < 4; ++i)
    EXPECT_EQ(encoded[32 + i], static_cast<std::uint8_t>(crc >> (24 - 8 * i)));
}

TEST(KvhFrames, EncodedFramesReadBack) {
  KvhFrameParser parser;
  Bytes bytes;
  for (unsigned i = 0; i < 300; ++i) append(bytes, numbered_frame(i));
  const auto frames = parse(parser, bytes);
  ASSERT_EQ(frames.size(), 300U);
  for (unsigned i = 0; i < 300; ++i) EXPECT_EQ(frames[i], numbered_frame(i)) << i;
  EXPECT_EQ(parser.statistics().frames_missing, 0U);  // over two wraps of the sequence
  EXPECT_EQ(parser.statistics().bytes_skipped, 0U);
  EXPECT_EQ(parser.unwrapped_sequence(), 299U);
}

TEST(KvhFrames, AStreamEnteredAnywhereGivesEachWholeFrame) {
  Bytes bytes;
  for (unsigned i = 0; i < 3; ++i) append(bytes, numbered_frame(i));
  for (std::size_t start = 1; start <= kKvhFrameSize; ++start) {
    KvhFrameParser parser;
    const auto frames =
        parse(parser, Bytes(bytes.begin() + static_cast<std::ptrdiff_t>(start), bytes.end()));
    ASSERT_EQ(frames.size(), 2U) << start;
    EXPECT_EQ(frames[0], numbered_frame(1)) << start;
    EXPECT_EQ(parser.statistics().bytes_skipped, kKvhFrameSize - start);
  }
}

TEST(KvhFrames, AnyOneBitFlippedLosesThatFrameOnly) {
  for (std::size_t bit = 0; bit < 8 * kKvhFrameSize; ++bit) {
    Bytes bytes;
    for (unsigned i = 0; i < 3; ++i) append(bytes, numbered_frame(i));
    bytes[kKvhFrameSize + bit / 8] =
        static_cast<std::uint8_t>(bytes[kKvhFrameSize + bit / 8] ^ (1U << bit % 8));
    KvhFrameParser parser;
    const auto frames = parse(parser, bytes);
    ASSERT_EQ(frames.size(), 2U) << bit;
    EXPECT_EQ(frames[0], numbered_frame(0)) << bit;
    EXPECT_EQ(frames[1], numbered_frame(2)) << bit;
    EXPECT_EQ(parser.statistics().crc_errors, bit < 32 ? 0U : 1U) << bit;
    EXPECT_EQ(parser.statistics().frames_missing, 1U) << bit;
    EXPECT_EQ(parser.statistics().bytes_skipped, kKvhFrameSize) << bit;
  }
}

TEST(KvhFrames, AFrameThatBeginsWithinACutOneIsNotLost) {
  for (std::size_t kept = 1; kept < kKvhFrameSize; ++kept) {
    Bytes bytes;
    append(bytes, numbered_frame(0));
    bytes.resize(kept);
    append(bytes, numbered_frame(1));
    KvhFrameParser parser;
    const auto frames = parse(parser, bytes);
    ASSERT_EQ(frames.size(), 1U) << kept;
    EXPECT_EQ(frames[0], numbered_frame(1)) << kept;
  }
}

TEST(KvhFrames, OtherMessagesOnTheLineAreSkipped) {
  Bytes bytes{0xFE, 0x81, 0x00, 0xAA, 0x7F, 0x7F, 0x7F, 0x00};  // an extended built-in test
  append(bytes, numbered_frame(1));
  KvhFrameParser parser;
  EXPECT_EQ(parse(parser, bytes).size(), 1U);
  EXPECT_EQ(parser.statistics().bytes_skipped, 8U);
  EXPECT_EQ(parser.statistics().crc_errors, 0U);
}

TEST(KvhFrames, MissingFramesAreCountedAcrossTheWrap) {
  KvhFrameParser parser;
  Bytes bytes;
  for (const unsigned number : {126U, 127U, 128U, 131U, 131U + 127U})
    append(bytes, numbered_frame(number));
  EXPECT_EQ(parse(parser, bytes).size(), 5U);
  EXPECT_EQ(parser.statistics().frames_missing, 2U + 126U);
  EXPECT_EQ(parser.unwrapped_sequence(), 5U + 127U);
}

// Rule: a frame that a link doubles is one sample, and nothing was lost before it. Before: 127
// frames counted as lost, and its rotation twice.
TEST(KvhFrames, ADoubledFrameCountsOnce) {
  KvhFrameParser parser;
  Bytes bytes;
  for (const unsigned number : {126U, 127U, 127U, 127U, 0U, 1U, 1U, 2U})
    append(bytes, numbered_frame(number));
  EXPECT_EQ(parse(parser, bytes).size(), 5U);
  EXPECT_EQ(parser.statistics().frames_repeated, 3U);
  EXPECT_EQ(parser.statistics().frames_missing, 0U);
  EXPECT_EQ(parser.unwrapped_sequence(), 4U);
}

// Law, on a hostile stream: frames whole, doubled or with a flipped bit, cut ones, noise of random
// bytes and of header bytes. Every whole frame comes out, in order, nothing else does, and the byte
// count balances.
TEST(KvhFrameLaws, EveryWholeFrameInAnyNoiseComesOutAndBytesBalance) {
  constexpr std::uint64_t kSeed = 31;
  constexpr std::uint8_t kHeaderBytes[]{0xFE, 0x81, 0xFF, 0x55};
  std::mt19937_64 random{kSeed};
  for (int trial = 0; trial < 200; ++trial) {
    Bytes bytes;
    std::vector<KvhFrame> sent;
    for (unsigned i = 0; i < 200; ++i) {
      const KvhFrame frame = numbered_frame(i);
      const std::size_t start = bytes.size();
      switch (random() % 7) {
        case 0:
          append(bytes, frame);
          bytes[start + random() % kKvhFrameSize] ^= static_cast<std::uint8_t>(1U << random() % 8);
          break;
        case 1:
          append(bytes, frame);
          bytes.resize(start + random() % (kKvhFrameSize - 3));  // noise makes no whole CRC
          break;
        case 2:
          for (std::size_t n = random() % 100; n > 0; --n)
            bytes.push_back(static_cast<std::uint8_t>(random()));
          break;
        case 3:
          for (std::size_t n = random() % 100; n > 0; --n)
            bytes.push_back(kHeaderBytes[random() % 4]);
          break;
        case 4: append(bytes, frame); [[fallthrough]];
        default: append(bytes, frame); sent.push_back(frame);
      }
    }
    append(bytes, numbered_frame(200));  // completes what a cut frame before it may have begun
    sent.push_back(numbered_frame(200));

    KvhFrameParser parser;
    const auto received = parse(parser, bytes);
    ASSERT_EQ(received, sent) << "seed " << kSeed << " trial " << trial;
    const KvhLinkStatistics& statistics = parser.statistics();
    EXPECT_EQ(statistics.frames, sent.size());
    EXPECT_EQ(bytes.size(), kKvhFrameSize * (statistics.frames + statistics.frames_repeated) +
                                statistics.bytes_skipped);
  }
}

// A wrong frame passes the CRC once in 2^32 headers; 10^6 random bytes hold none.
TEST(KvhFrameLaws, RandomBytesGiveNoFrame) {
  constexpr std::uint64_t kSeed = 32;
  std::mt19937_64 random{kSeed};
  KvhFrameParser parser;
  for (int i = 0; i < 1'000'000; ++i) {
    ASSERT_FALSE(parser.push(static_cast<std::uint8_t>(random())).has_value()) << "seed " << kSeed;
  }
  EXPECT_GE(parser.statistics().bytes_skipped, 1'000'000 - kKvhFrameSize);
}

}  // namespace
}  // namespace zerodrift::drivers
