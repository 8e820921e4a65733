// SPDX-License-Identifier: Apache-2.0
#include "common/mcap/mcap_writer.h"

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>

#include "common/mcap/byte_order.h"
#include "common/mcap/crc32.h"
#include "common/mcap/mcap_error.h"

namespace zerodrift::mcap {
namespace {

constexpr std::size_t kMessageHeaderBytes = 2 + 4 + 8 + 8;

void append_pairs(std::string& bytes, const Pairs& pairs) {
  std::string content;
  for (const auto& [key, value] : pairs) {
    append_text(content, key);
    append_text(content, value);
  }
  append_text(bytes, content);
}

void append_record(std::string& bytes, Opcode opcode, std::string_view content) {
  bytes.push_back(static_cast<char>(opcode));
  append(bytes, static_cast<std::uint64_t>(content.size()));
  bytes.append(content);
}

std::string encoded(const Schema& schema) {
  std::string bytes;
  append(bytes, schema.id);
  append_text(bytes, schema.name);
  append_text(bytes, schema.encoding);
  append_text(bytes, schema.data);
  return bytes;
}

std::string encoded(const Channel& channel) {
  std::string bytes;
  append(bytes, channel.id);
  append(bytes, channel.schema_id);
  append_text(bytes, channel.topic);
  append_text(bytes, channel.message_encoding);
  append_pairs(bytes, channel.metadata);
  return bytes;
}

std::string encoded(const Attachment& attachment) {
  std::string bytes;
  append(bytes, attachment.offset);
  append(bytes, attachment.length);
  append(bytes, attachment.log_time_ns);
  append(bytes, attachment.create_time_ns);
  append(bytes, attachment.data_bytes);
  append_text(bytes, attachment.name);
  append_text(bytes, attachment.media_type);
  return bytes;
}

std::string encoded(const MetadataIndex& index) {
  std::string bytes;
  append(bytes, index.offset);
  append(bytes, index.length);
  append_text(bytes, index.name);
  return bytes;
}

}  // namespace

Writer::Writer(Sink sink, WriterOptions options)
    : sink_(std::move(sink)), options_(std::move(options)) {
  put(kMagic);
  std::string header;
  append_text(header, options_.profile);
  append_text(header, options_.library);
  put_record(Opcode::kHeader, header);
}

void Writer::put(std::string_view bytes) {
  sink_(bytes);
  offset_ += bytes.size();
  crc_ = crc32(bytes, crc_);
}

void Writer::put_record(Opcode opcode, std::string_view content) {
  std::string record;
  append_record(record, opcode, content);
  put(record);
}

std::uint16_t Writer::add_schema(std::string_view name, std::string_view encoding,
                                 std::string_view data) {
  if (schemas_.size() == std::numeric_limits<std::uint16_t>::max())
    throw McapError("an MCAP file can't hold more than 65535 schemas");
  schemas_.push_back({static_cast<std::uint16_t>(schemas_.size() + 1), std::string(name),
                      std::string(encoding), std::string(data)});
  put_record(Opcode::kSchema, encoded(schemas_.back()));
  return schemas_.back().id;
}

std::uint16_t Writer::add_channel(std::uint16_t schema_id, std::string_view topic,
                                  std::string_view message_encoding, const Pairs& metadata) {
  if (channels_.size() == std::numeric_limits<std::uint16_t>::max())
    throw McapError("an MCAP file can't hold more than 65535 channels");
  channels_.push_back({static_cast<std::uint16_t>(channels_.size() + 1), schema_id,
                       std::string(topic), std::string(message_encoding), metadata});
  messages_.push_back(0);
  entries_.emplace_back();
  put_record(Opcode::kChannel, encoded(channels_.back()));
  return channels_.back().id;
}

void Writer::write(const Message& message) {
  if (message.channel_id == 0 || message.channel_id > channels_.size())
    throw std::logic_error("mcap: a message of a channel that was not added");
  const bool is_first_of_chunk = chunk_.empty();
  entries_[message.channel_id - 1U].emplace_back(message.log_time_ns, chunk_.size());
  chunk_.push_back(static_cast<char>(Opcode::kMessage));
  append(chunk_, static_cast<std::uint64_t>(kMessageHeaderBytes + message.data.size()));
  append(chunk_, message.channel_id);
  append(chunk_, message.sequence);
  append(chunk_, message.log_time_ns);
  append(chunk_, message.publish_time_ns);
  chunk_.append(message.data);

  const auto widen = [&](std::uint64_t& start, std::uint64_t& end, bool is_first) {
    start = is_first ? message.log_time_ns : std::min(start, message.log_time_ns);
    end = is_first ? message.log_time_ns : std::max(end, message.log_time_ns);
  };
  widen(chunk_start_ns_, chunk_end_ns_, is_first_of_chunk);
  widen(statistics_.start_ns, statistics_.end_ns, statistics_.messages == 0);
  ++statistics_.messages;
  ++messages_[message.channel_id - 1U];
  if (chunk_.size() >= options_.chunk_bytes) flush();
}

void Writer::flush() {
  if (chunk_.empty()) return;
  const std::string_view compression = name(options_.compression);
  record_.clear();
  record_.push_back(static_cast<char>(Opcode::kChunk));
  append(record_, std::uint64_t{0});  // the length, once it is known
  append(record_, chunk_start_ns_);
  append(record_, chunk_end_ns_);
  append(record_, static_cast<std::uint64_t>(chunk_.size()));
  append(record_, crc32(chunk_));
  append_text(record_, compression);
  const std::size_t size_at = record_.size();
  append(record_, std::uint64_t{0});
  const std::size_t begin = record_.size();
  compress(options_.compression, chunk_, record_);
  const auto store = [&](std::size_t at, std::uint64_t value) {
    std::string bytes;
    append(bytes, value);
    record_.replace(at, bytes.size(), bytes);
  };
  store(1, record_.size() - kRecordHeaderBytes);
  store(size_at, record_.size() - begin);

  WrittenChunk written{.chunk = {.offset = offset_,
                                 .length = record_.size(),
                                 .start_ns = chunk_start_ns_,
                                 .end_ns = chunk_end_ns_,
                                 .compressed_bytes = record_.size() - begin,
                                 .uncompressed_bytes = chunk_.size(),
                                 .compression = options_.compression}};
  append_indexes(written);
  // All at once: where the sink throws, nothing of the chunk is in the file, and it can be tried
  // again.
  put(record_);
  chunks_.push_back(std::move(written));
  chunk_.clear();
  for (auto& entries : entries_) entries.clear();
}

void Writer::append_indexes(WrittenChunk& written) {
  const std::size_t begin = record_.size();
  std::string index;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    auto& entries = entries_[i];
    if (entries.empty()) continue;
    const std::uint16_t channel = channels_[i].id;
    // A merge sort that keeps the order of equal times; the entries come nearly sorted.
    std::stable_sort(entries.begin(), entries.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    written.index_offsets.emplace_back(channel, offset_ + record_.size());
    index.clear();
    append(index, channel);
    append(index, static_cast<std::uint32_t>(16 * entries.size()));
    for (const auto& [time_ns, at] : entries) {
      append(index, time_ns);
      append(index, at);
    }
    append_record(record_, Opcode::kMessageIndex, index);
  }
  written.index_bytes = record_.size() - begin;
}

void Writer::attach(const Attachment& what, std::string_view data) {
  std::string content;
  append(content, what.log_time_ns);
  append(content, what.create_time_ns);
  append_text(content, what.name);
  append_text(content, what.media_type);
  append(content, static_cast<std::uint64_t>(data.size()));
  content.append(data);
  append(content, crc32(content));
  Attachment written = what;
  written.offset = offset_;
  written.length = kRecordHeaderBytes + content.size();
  written.data_bytes = data.size();
  put_record(Opcode::kAttachment, content);
  attachments_.push_back(std::move(written));
}

void Writer::add_metadata(const Metadata& metadata) {
  std::string content;
  append_text(content, metadata.name);
  append_pairs(content, metadata.values);
  metadata_.push_back({offset_, kRecordHeaderBytes + content.size(), metadata.name});
  put_record(Opcode::kMetadata, content);
}

template <typename Items, typename Encode>
void Writer::put_group(Opcode opcode, const Items& items, const Encode& encode,
                       std::string& offsets) {
  if (items.empty()) return;
  const std::uint64_t begin = offset_;
  for (const auto& item : items) put_record(opcode, encode(item));
  offsets.push_back(static_cast<char>(Opcode::kSummaryOffset));
  append(offsets, std::uint64_t{17});
  offsets.push_back(static_cast<char>(opcode));
  append(offsets, begin);
  append(offsets, offset_ - begin);
}

std::string Writer::encoded_statistics() const {
  std::string bytes;
  append(bytes, statistics_.messages);
  append(bytes, static_cast<std::uint16_t>(schemas_.size()));
  append(bytes, static_cast<std::uint32_t>(channels_.size()));
  append(bytes, static_cast<std::uint32_t>(attachments_.size()));
  append(bytes, static_cast<std::uint32_t>(metadata_.size()));
  append(bytes, static_cast<std::uint32_t>(chunks_.size()));
  append(bytes, statistics_.start_ns);
  append(bytes, statistics_.end_ns);
  std::string counts;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (messages_[i] == 0) continue;
    append(counts, channels_[i].id);
    append(counts, messages_[i]);
  }
  append_text(bytes, counts);
  return bytes;
}

void Writer::finish() {
  flush();
  std::string data_end;
  append(data_end, crc_);
  put_record(Opcode::kDataEnd, data_end);

  const std::uint64_t summary = offset_;
  crc_ = 0;
  std::string offsets;
  const auto plain = [](const auto& item) { return encoded(item); };
  put_group(Opcode::kSchema, schemas_, plain, offsets);
  put_group(Opcode::kChannel, channels_, plain, offsets);
  put_group(
      Opcode::kStatistics, std::array{&statistics_},
      [&](const Statistics*) { return encoded_statistics(); }, offsets);
  put_group(
      Opcode::kChunkIndex, chunks_,
      [](const WrittenChunk& written) {
        std::string bytes;
        append(bytes, written.chunk.start_ns);
        append(bytes, written.chunk.end_ns);
        append(bytes, written.chunk.offset);
        append(bytes, written.chunk.length);
        append(bytes, static_cast<std::uint32_t>(10 * written.index_offsets.size()));
        for (const auto& [channel, offset] : written.index_offsets) {
          append(bytes, channel);
          append(bytes, offset);
        }
        append(bytes, written.index_bytes);
        append_text(bytes, name(written.chunk.compression));
        append(bytes, written.chunk.compressed_bytes);
        append(bytes, written.chunk.uncompressed_bytes);
        return bytes;
      },
      offsets);
  put_group(Opcode::kAttachmentIndex, attachments_, plain, offsets);
  put_group(Opcode::kMetadataIndex, metadata_, plain, offsets);
  const std::uint64_t summary_offsets = offset_;
  put(offsets);

  // The footer's CRC covers the summary up to the CRC itself.
  std::string footer(1, static_cast<char>(Opcode::kFooter));
  append(footer, std::uint64_t{20});
  append(footer, summary);
  append(footer, summary_offsets);
  append(footer, crc32(footer, crc_));
  put(footer);
  put(kMagic);
}

}  // namespace zerodrift::mcap
