// SPDX-License-Identifier: Apache-2.0
#include "common/mcap/parse.h"

namespace zerodrift::mcap {

Pairs Fields::take_pairs() {
  Pairs pairs;
  Fields content(take_text());
  while (content.good() && !content.rest().empty()) {
    std::string key(content.take_text());
    std::string value(content.take_text());
    if (content.good()) pairs.emplace_back(std::move(key), std::move(value));
  }
  good_ = good_ && content.good();
  return pairs;
}

std::optional<Record> take_record(std::string_view& bytes) noexcept {
  Fields fields(bytes);
  Record record;
  record.opcode = fields.take<std::uint8_t>();
  record.content = fields.take_bytes(fields.take<std::uint64_t>());
  if (!fields.good() || record.opcode == 0) return std::nullopt;
  bytes = fields.rest();
  return record;
}

std::optional<Schema> parse_schema(std::string_view content) {
  Fields fields(content);
  Schema schema;
  schema.id = fields.take<std::uint16_t>();
  schema.name = fields.take_text();
  schema.encoding = fields.take_text();
  schema.data = fields.take_text();
  if (!fields.good() || schema.id == 0) return std::nullopt;
  return schema;
}

std::optional<Channel> parse_channel(std::string_view content) {
  Fields fields(content);
  Channel channel;
  channel.id = fields.take<std::uint16_t>();
  channel.schema_id = fields.take<std::uint16_t>();
  channel.topic = fields.take_text();
  channel.message_encoding = fields.take_text();
  channel.metadata = fields.take_pairs();
  if (!fields.good()) return std::nullopt;
  return channel;
}

std::optional<Message> parse_message(std::string_view content) noexcept {
  Fields fields(content);
  Message message;
  message.channel_id = fields.take<std::uint16_t>();
  message.sequence = fields.take<std::uint32_t>();
  message.log_time_ns = fields.take<std::uint64_t>();
  message.publish_time_ns = fields.take<std::uint64_t>();
  message.data = fields.rest();
  if (!fields.good()) return std::nullopt;
  return message;
}

std::optional<Chunk> parse_chunk_index(std::string_view content) noexcept {
  Fields fields(content);
  Chunk chunk;
  chunk.start_ns = fields.take<std::uint64_t>();
  chunk.end_ns = fields.take<std::uint64_t>();
  chunk.offset = fields.take<std::uint64_t>();
  chunk.length = fields.take<std::uint64_t>();
  fields.take_text();            // offsets of the message indexes
  fields.take<std::uint64_t>();  // and their length
  const auto compression = compression_of(fields.take_text());
  chunk.compressed_bytes = fields.take<std::uint64_t>();
  chunk.uncompressed_bytes = fields.take<std::uint64_t>();
  if (!fields.good()) return std::nullopt;
  chunk.compression = compression.value_or(Compression::kNone);
  return chunk;
}

std::optional<Attachment> parse_attachment_index(std::string_view content) {
  Fields fields(content);
  Attachment attachment;
  attachment.offset = fields.take<std::uint64_t>();
  attachment.length = fields.take<std::uint64_t>();
  attachment.log_time_ns = fields.take<std::uint64_t>();
  attachment.create_time_ns = fields.take<std::uint64_t>();
  attachment.data_bytes = fields.take<std::uint64_t>();
  attachment.name = fields.take_text();
  attachment.media_type = fields.take_text();
  if (!fields.good()) return std::nullopt;
  return attachment;
}

std::optional<MetadataIndex> parse_metadata_index(std::string_view content) {
  Fields fields(content);
  MetadataIndex index;
  index.offset = fields.take<std::uint64_t>();
  index.length = fields.take<std::uint64_t>();
  index.name = fields.take_text();
  if (!fields.good()) return std::nullopt;
  return index;
}

std::optional<Metadata> parse_metadata(std::string_view content) {
  Fields fields(content);
  Metadata metadata;
  metadata.name = fields.take_text();
  metadata.values = fields.take_pairs();
  if (!fields.good()) return std::nullopt;
  return metadata;
}

std::optional<Statistics> parse_statistics(std::string_view content) {
  Fields fields(content);
  Statistics statistics;
  statistics.messages = fields.take<std::uint64_t>();
  statistics.schemas = fields.take<std::uint16_t>();
  statistics.channels = fields.take<std::uint32_t>();
  statistics.attachments = fields.take<std::uint32_t>();
  statistics.metadata = fields.take<std::uint32_t>();
  statistics.chunks = fields.take<std::uint32_t>();
  statistics.start_ns = fields.take<std::uint64_t>();
  statistics.end_ns = fields.take<std::uint64_t>();
  Fields counts(fields.take_text());
  while (counts.good() && !counts.rest().empty()) {
    const auto channel = counts.take<std::uint16_t>();
    statistics.messages_by_channel.emplace_back(channel, counts.take<std::uint64_t>());
  }
  if (!fields.good() || !counts.good()) return std::nullopt;
  return statistics;
}

std::optional<ChunkHead> parse_chunk_head(std::string_view begin,
                                          std::uint64_t content_bytes) noexcept {
  Fields fields(begin);
  ChunkHead head;
  head.chunk.start_ns = fields.take<std::uint64_t>();
  head.chunk.end_ns = fields.take<std::uint64_t>();
  head.chunk.uncompressed_bytes = fields.take<std::uint64_t>();
  head.crc = fields.take<std::uint32_t>();
  head.compression = fields.take_text();
  head.chunk.compressed_bytes = fields.take<std::uint64_t>();
  if (!fields.good()) return std::nullopt;
  head.head_bytes = begin.size() - fields.rest().size();
  if (head.chunk.compressed_bytes != content_bytes - head.head_bytes) return std::nullopt;
  head.chunk.compression = compression_of(head.compression).value_or(Compression::kNone);
  return head;
}

}  // namespace zerodrift::mcap
