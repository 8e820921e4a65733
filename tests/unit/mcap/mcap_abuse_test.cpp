// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>

#include "common/mcap/byte_order.h"
#include "common/mcap/mcap_error.h"
#include "tests/unit/mcap/example_file.h"

namespace zerodrift::mcap {
namespace {

using testing::Example;
using testing::KeptMessage;
using testing::make_example;
using testing::open;
using testing::read_all;

std::size_t messages_whole_at(const Example& example, std::size_t size) {
  std::size_t whole = 0;
  for (const auto& [end, messages] : example.chunk_ends) {
    // Behind each chunk stand its indexes, which nobody needs for reading.
    if (end <= size) whole = messages;
  }
  return whole;
}

TEST(McapCut, AtAnyByteGivesAllWholeChunksAndSaysThatItWasCut) {
  const Example example = make_example({.messages = 30});
  ASSERT_GE(example.chunk_ends.size(), 4U);
  for (std::size_t size = 8; size < example.bytes.size(); ++size) {
    Reader reader = open(example.bytes.substr(0, size));
    const auto all = read_all(reader);
    ASSERT_GE(all.size(), messages_whole_at(example, size)) << size;
    ASSERT_TRUE(std::equal(all.begin(), all.end(), example.messages.begin())) << size;
    ASSERT_NE(reader.contents().ending, Ending::kWhole) << size;
    ASSERT_FALSE(reader.findings().empty()) << size;
  }
}

TEST(McapCut, BeforeTheMagicEndsIsNoMcapFile) {
  const Example example = make_example();
  for (std::size_t size = 0; size < 8; ++size)
    EXPECT_THROW(open(example.bytes.substr(0, size)), McapError) << size;
}

// No flip goes by unseen: either every message is as it was written, or a line tells what is
// missing; and no message is there that was not written.
class EachCompressionFlipped : public ::testing::TestWithParam<Compression> {};
INSTANTIATE_TEST_SUITE_P(All, EachCompressionFlipped,
                         ::testing::Values(Compression::kNone, Compression::kLz4,
                                           Compression::kZstd));

TEST_P(EachCompressionFlipped, AnySingleBitIsDetectedOrHarmless) {
  const Example example = make_example({.compression = GetParam(), .messages = 16});
  for (std::size_t bit = 0; bit < example.bytes.size() * 8; ++bit) {
    std::string bytes = example.bytes;
    bytes[bit / 8] = static_cast<char>(bytes[bit / 8] ^ (1 << (bit % 8)));
    if (bit < 64) {
      EXPECT_THROW(open(bytes), McapError);
      continue;
    }
    Reader reader = open(bytes);
    const auto all = read_all(reader);
    for (const auto& attachment : reader.contents().attachments) {
      try {
        EXPECT_EQ(reader.attachment(attachment), "attached text") << bit / 8;
      } catch (const McapError&) {
        // told
      }
    }
    reader.verify();
    if (!reader.findings().empty()) {
      for (const KeptMessage& message : all) {
        ASSERT_NE(std::find(example.messages.begin(), example.messages.end(), message),
                  example.messages.end())
            << "byte " << bit / 8;
      }
      continue;
    }
    ASSERT_EQ(all, example.messages) << "byte " << bit / 8;
  }
}

TEST(McapDamage, OfOneChunkLeavesOutThatChunkAndNamesItsByte) {
  Example example = make_example({.compression = Compression::kNone});
  Reader before = open(example.bytes);
  const Chunk second = before.contents().stretches.at(1).chunk;
  example.bytes[second.offset + second.length - 1] ^= 1;
  Reader reader = open(example.bytes);
  const auto all = read_all(reader);
  EXPECT_LT(all.size(), example.messages.size());
  EXPECT_GT(all.size(), example.messages.size() / 2);
  EXPECT_EQ(all.back(), example.messages.back());
  ASSERT_EQ(reader.findings().size(), 1U);
  EXPECT_NE(reader.findings()[0].find("byte " + std::to_string(second.offset) +
                                      ": the CRC-32 of a chunk is "),
            std::string::npos)
      << reader.findings()[0];
}

// A file whose middle is gone and that has no summary: what follows is found all the same.
TEST(McapDamage, WithoutASummaryIsSteppedOver) {
  const Example example = make_example({.messages = 100});
  const std::size_t third = example.chunk_ends.at(2).first;
  std::string bytes = example.bytes.substr(0, example.chunk_ends.back().first);
  bytes.replace(third, 5, 5, '\0');
  Reader reader = open(bytes);
  const auto all = read_all(reader);
  EXPECT_GT(all.size(), example.messages.size() * 3 / 4);
  EXPECT_EQ(all.back(), example.messages.back());
  ASSERT_GE(reader.findings().size(), 1U);
  EXPECT_NE(reader.findings()[0].find("no record is recognised"), std::string::npos);
}

TEST(McapHostile, LengthsDoNotAllocate) {
  const Example example = make_example({.messages = 12});
  const std::string body = example.bytes.substr(0, example.chunk_ends.back().first);
  const std::string huge(8, '\xff');
  // Every eight bytes of the file as a length of 2^64 - 1. A reader that believed one would end
  // with std::bad_alloc or std::length_error.
  for (std::size_t at = 8; at + 8 <= body.size(); ++at) {
    std::string bytes = body;
    bytes.replace(at, 8, huge);
    Reader reader = open(bytes, {.most_chunk_bytes = 1 << 20});
    EXPECT_LE(read_all(reader).size(), example.messages.size());
  }
}

TEST(McapHostile, AChunkThatClaimsToBecomeTooLongIsRefused) {
  Example example = make_example({.messages = 12});
  Reader before = open(example.bytes);
  const Chunk first = before.contents().stretches.at(0).chunk;
  std::string claim;
  append(claim, std::uint64_t{1} << 40U);
  example.bytes.replace(first.offset + kRecordHeaderBytes + 16, 8, claim);
  Reader reader = open(example.bytes);
  static_cast<void>(read_all(reader));
  ASSERT_EQ(reader.findings().size(), 1U);
  EXPECT_NE(reader.findings()[0].find("1099511627776 bytes when uncompressed, expected at most"),
            std::string::npos)
      << reader.findings()[0];
}

TEST(McapHostile, AnUnknownCompressionIsNamed) {
  Example example = make_example({.compression = Compression::kZstd, .messages = 12});
  Reader before = open(example.bytes);
  const Chunk first = before.contents().stretches.at(0).chunk;
  example.bytes.replace(first.offset + kRecordHeaderBytes + 32, 4, "abcd");
  Reader reader = open(example.bytes);
  static_cast<void>(read_all(reader));
  ASSERT_EQ(reader.findings().size(), 1U);
  EXPECT_NE(reader.findings()[0].find("'abcd', expected zstd, lz4 or none"), std::string::npos);
}

TEST(McapHostile, ADamagedAttachmentIsRefusedByItsCrc) {
  Example example = make_example();
  example.bytes[example.bytes.find("attached text")] = 'A';
  Reader reader = open(example.bytes);
  EXPECT_THROW(static_cast<void>(reader.attachment(reader.contents().attachments.at(0))),
               McapError);
}

}  // namespace
}  // namespace zerodrift::mcap
