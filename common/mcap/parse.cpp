// SPDX-License-Identifier: Apache-2.0
#include "common/mcap/parse.h"

namespace zerodrift::mcap {

namespace {

template <typename Of>
std::optional<Of> parsed(std::string_view content) {
  Fields fields(content);
  Of record;
  Of::visit(record, fields);
  if (!fields.good()) return std::nullopt;
  return record;
}

}  // namespace

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
  auto schema = parsed<Schema>(content);
  if (schema && schema->id == 0) schema.reset();
  return schema;
}

std::optional<Channel> parse_channel(std::string_view content) {
  return parsed<Channel>(content);
}

std::optional<Message> parse_message(std::string_view content) noexcept {
  Fields fields(content);
  Message message;
  fields(message.channel_id, message.sequence, message.log_time_ns, message.publish_time_ns);
  message.data = fields.rest();
  if (!fields.good()) return std::nullopt;
  return message;
}

std::optional<Chunk> parse_chunk_index(std::string_view content) noexcept {
  Fields fields(content);
  Chunk chunk;
  std::string_view offsets_of_indexes;
  std::uint64_t length_of_indexes = 0;
  std::string_view compression;
  fields(chunk.start_ns, chunk.end_ns, chunk.offset, chunk.length, offsets_of_indexes,
         length_of_indexes, compression, chunk.compressed_bytes, chunk.uncompressed_bytes);
  if (!fields.good()) return std::nullopt;
  chunk.compression = compression_of(compression).value_or(Compression::kNone);
  return chunk;
}

std::optional<Attachment> parse_attachment_index(std::string_view content) {
  return parsed<Attachment>(content);
}

std::optional<MetadataIndex> parse_metadata_index(std::string_view content) {
  return parsed<MetadataIndex>(content);
}

std::optional<Metadata> parse_metadata(std::string_view content) {
  return parsed<Metadata>(content);
}

std::optional<Statistics> parse_statistics(std::string_view content) {
  return parsed<Statistics>(content);
}

std::optional<ChunkHead> parse_chunk_head(std::string_view begin,
                                          std::uint64_t content_bytes) noexcept {
  Fields fields(begin);
  ChunkHead head;
  fields(head.chunk.start_ns, head.chunk.end_ns, head.chunk.uncompressed_bytes, head.crc,
         head.compression, head.chunk.compressed_bytes);
  if (!fields.good()) return std::nullopt;
  head.head_bytes = begin.size() - fields.rest().size();
  if (head.chunk.compressed_bytes != content_bytes - head.head_bytes) return std::nullopt;
  head.chunk.compression = compression_of(head.compression).value_or(Compression::kNone);
  return head;
}

}  // namespace zerodrift::mcap
