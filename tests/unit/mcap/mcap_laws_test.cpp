// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "common/mcap/byte_order.h"
#include "common/mcap/crc32.h"
#include "common/mcap/mcap_error.h"
#include "tests/unit/mcap/example_file.h"

namespace zerodrift::mcap {
namespace {

using testing::make_example;
using testing::open;
using testing::read_all;

class EachCompression : public ::testing::TestWithParam<Compression> {};
INSTANTIATE_TEST_SUITE_P(All, EachCompression,
                         ::testing::Values(Compression::kNone, Compression::kLz4,
                                           Compression::kZstd));

TEST_P(EachCompression, GivesBackWhatWasWritten) {
  const auto example = make_example({.compression = GetParam(), .messages = 2000});
  Reader reader = open(example.bytes);
  EXPECT_EQ(reader.contents().ending, Ending::kWhole);
  EXPECT_GT(reader.contents().stretches.size(), 10U);
  EXPECT_EQ(read_all(reader), example.messages);
  reader.verify();
  EXPECT_EQ(reader.findings(), std::vector<std::string>{});
}

TEST_P(EachCompression, ScannedWithoutItsSummaryGivesTheSame) {
  const auto example = make_example({.compression = GetParam(), .messages = 300});
  Reader whole = open(example.bytes);
  Reader scanned = open(example.bytes.substr(0, example.chunk_ends.back().first));
  EXPECT_EQ(scanned.contents().ending, Ending::kCut);
  EXPECT_EQ(read_all(scanned), example.messages);
  ASSERT_EQ(scanned.contents().channels.size(), whole.contents().channels.size());
  EXPECT_EQ(scanned.contents().schemas.size(), whole.contents().schemas.size());
  EXPECT_EQ(scanned.contents().statistics.messages, whole.contents().statistics.messages);
  EXPECT_EQ(scanned.contents().statistics.start_ns, whole.contents().statistics.start_ns);
  EXPECT_EQ(scanned.contents().statistics.end_ns, whole.contents().statistics.end_ns);
  EXPECT_EQ(scanned.contents().attachments.size(), 1U);
  EXPECT_EQ(scanned.contents().metadata.size(), 1U);
  ASSERT_EQ(scanned.findings().size(), 1U);
  EXPECT_NE(scanned.findings()[0].find("example.mcap: byte "), std::string::npos);
}

TEST(McapLaws, SummaryTellsSchemasChannelsAttachmentsMetadataAndCounts) {
  const auto example = make_example();
  Reader reader = open(example.bytes);
  const Contents& contents = reader.contents();
  ASSERT_EQ(contents.channels.size(), 3U);
  EXPECT_EQ(contents.channels[0].topic, "first");
  EXPECT_EQ(contents.channels[0].message_encoding, "cdr");
  EXPECT_EQ(value_of(contents.channels[0].metadata, "gyro_id"), "1");
  ASSERT_EQ(contents.schemas.size(), 2U);
  EXPECT_EQ(contents.schema(2)->data, "struct Other { octet y; };");
  ASSERT_EQ(contents.attachments.size(), 1U);
  EXPECT_EQ(contents.attachments[0].media_type, "text/plain");
  EXPECT_EQ(reader.attachment(contents.attachments[0]), "attached text");
  ASSERT_EQ(contents.metadata.size(), 1U);
  EXPECT_EQ(contents.metadata[0].values, (Pairs{{"key", "value"}, {"other", ""}}));
  EXPECT_EQ(contents.statistics.messages, example.messages.size());
  EXPECT_EQ(contents.statistics.start_ns, 1000U);
  EXPECT_EQ(contents.statistics.end_ns, 1039U);
}

TEST(McapLaws, AFileWithoutAnyMessageIsWhole) {
  std::string bytes;
  Writer writer([&](std::string_view more) { bytes.append(more); }, {});
  writer.finish();
  Reader reader = open(bytes);
  EXPECT_EQ(reader.contents().ending, Ending::kWhole);
  EXPECT_EQ(read_all(reader), std::vector<testing::KeptMessage>{});
}

// Others need not chunk, index or count.
TEST(McapLaws, MessagesOutsideOfChunksAreFound) {
  std::string bytes(kMagic);
  const auto put = [&](Opcode opcode, const std::string& content) {
    bytes.push_back(static_cast<char>(opcode));
    append(bytes, static_cast<std::uint64_t>(content.size()));
    bytes += content;
  };
  std::string header;
  append_text(header, "");
  append_text(header, "another");
  put(Opcode::kHeader, header);
  std::string channel;
  append(channel, std::uint16_t{7});
  append(channel, std::uint16_t{0});
  append_text(channel, "topic");
  append_text(channel, "json");
  append_text(channel, "");
  put(Opcode::kChannel, channel);
  for (std::uint32_t i = 0; i < 3; ++i) {
    std::string message;
    append(message, std::uint16_t{7});
    append(message, i);
    append(message, std::uint64_t{100} + i);
    append(message, std::uint64_t{100} + i);
    put(Opcode::kMessage, message + "{}");
  }
  put(Opcode::kDataEnd, std::string(4, '\0'));
  put(Opcode::kFooter, std::string(20, '\0'));
  bytes += kMagic;
  Reader reader = open(bytes);
  const auto all = read_all(reader);
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[2].sequence, 2U);
  EXPECT_EQ(all[2].data, "{}");
  EXPECT_EQ(reader.contents().statistics.end_ns, 102U);
}

// Byte for byte as the specification's page has it: magic, header, and the footer whose CRC covers
// the summary and the footer's own first 25 bytes.
TEST(McapGolden, BeginAndEndAreTheSpecificationsBytes) {
  std::string bytes;
  Writer writer([&](std::string_view more) { bytes.append(more); },
                {.profile = "p", .library = "lib"});
  writer.finish();
  const std::string begin{"\x89MCAP0\r\n\x01\x0c\0\0\0\0\0\0\0\x01\0\0\0p\x03\0\0\0lib", 29};
  EXPECT_EQ(bytes.substr(0, begin.size()), begin);
  EXPECT_EQ(bytes.substr(bytes.size() - 8), kMagic);
  const std::size_t footer = bytes.size() - 8 - 29;
  EXPECT_EQ(bytes.substr(footer, 9), std::string("\x02\x14\0\0\0\0\0\0\0", 9));
  const auto summary = load<std::uint64_t>(bytes.data() + footer + 9);
  // Behind the data's end: opcode 0x0F, four bytes of CRC over all that is before it.
  const std::size_t data_end = summary - 13;
  EXPECT_EQ(bytes.substr(data_end, 9), std::string("\x0f\x04\0\0\0\0\0\0\0", 9));
  EXPECT_EQ(load<std::uint32_t>(bytes.data() + data_end + 9), crc32(bytes.substr(0, data_end)));
  EXPECT_EQ(load<std::uint32_t>(bytes.data() + footer + 25),
            crc32(bytes.substr(summary, footer + 25 - summary)));
}

TEST(McapLaws, OneCursorAfterTheOtherUncompressesAChunkOnce) {
  const auto example = make_example({.messages = 500});
  Reader reader = open(example.bytes);
  const auto first = reader.records(0);
  EXPECT_EQ(reader.records(0).get(), first.get());
}

}  // namespace
}  // namespace zerodrift::mcap
