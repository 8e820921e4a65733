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

void append_record(std::string& bytes, Opcode opcode, std::string_view content) {
  bytes.push_back(static_cast<char>(opcode));
  append(bytes, static_cast<std::uint64_t>(content.size()));
  bytes.append(content);
}

template <typename... Values>
std::string encoded_of(const Values&... values) {
  std::string bytes;
  Appender{bytes}(values...);
  return bytes;
}

template <typename Of>
std::string encoded(const Of& record) {
  std::string bytes;
  Of::visit(record, Appender{bytes});
  return bytes;
}

}  // namespace

Writer::Writer(Sink sink, WriterOptions options)
    : sink_(std::move(sink)), options_(std::move(options)) {
  put(kMagic);
  put_record(Opcode::kHeader, encoded_of(options_.profile, options_.library));
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
  Appender{chunk_}(static_cast<std::uint64_t>(kMessageHeaderBytes + message.data.size()),
                   message.channel_id, message.sequence, message.log_time_ns,
                   message.publish_time_ns);
  chunk_.append(message.data);

  const auto widen = [&](std::uint64_t& start, std::uint64_t& end, bool is_first) {
    start = is_first ? message.log_time_ns : std::min(start, message.log_time_ns);
    end = is_first ? message.log_time_ns : std::max(end, message.log_time_ns);
  };
  widen(chunk_start_ns_, chunk_end_ns_, is_first_of_chunk);
  widen(statistics_.start_ns, statistics_.end_ns, statistics_.messages == 0);
  ++statistics_.messages;
  ++chunk_messages_;
  ++messages_[message.channel_id - 1U];
  if (chunk_.size() >= options_.chunk_bytes) flush();
}

void Writer::flush() {
  if (chunk_.empty()) return;
  record_.clear();
  record_.push_back(static_cast<char>(Opcode::kChunk));
  append(record_, std::uint64_t{0});  // the length, once it is known
  Appender{record_}(chunk_start_ns_, chunk_end_ns_, static_cast<std::uint64_t>(chunk_.size()),
                    crc32(chunk_), name(options_.compression));
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
  chunk_messages_ = 0;
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
    for (const auto& [time_ns, at] : entries) Appender{index}(time_ns, at);
    append_record(record_, Opcode::kMessageIndex, index);
  }
  written.index_bytes = record_.size() - begin;
}

void Writer::attach(const Attachment& what, std::string_view data) {
  std::string content = encoded_of(what.log_time_ns, what.create_time_ns, what.name,
                                   what.media_type, static_cast<std::uint64_t>(data.size()));
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
  const std::string content = encoded(metadata);
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
  Appender{offsets}(begin, offset_ - begin);
}

Statistics Writer::complete_statistics() const {
  Statistics all = statistics_;
  all.schemas = static_cast<std::uint16_t>(schemas_.size());
  all.channels = static_cast<std::uint32_t>(channels_.size());
  all.attachments = static_cast<std::uint32_t>(attachments_.size());
  all.metadata = static_cast<std::uint32_t>(metadata_.size());
  all.chunks = static_cast<std::uint32_t>(chunks_.size());
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (messages_[i] > 0) all.messages_by_channel.emplace_back(channels_[i].id, messages_[i]);
  }
  return all;
}

void Writer::finish() {
  flush();
  put_record(Opcode::kDataEnd, encoded_of(crc_));

  const std::uint64_t summary = offset_;
  crc_ = 0;
  std::string offsets;
  const auto plain = [](const auto& item) { return encoded(item); };
  put_group(Opcode::kSchema, schemas_, plain, offsets);
  put_group(Opcode::kChannel, channels_, plain, offsets);
  put_group(Opcode::kStatistics, std::array{complete_statistics()}, plain, offsets);
  put_group(
      Opcode::kChunkIndex, chunks_,
      [](const WrittenChunk& written) {
        const Chunk& chunk = written.chunk;
        return encoded_of(chunk.start_ns, chunk.end_ns, chunk.offset, chunk.length,
                          written.index_offsets, written.index_bytes, name(chunk.compression),
                          chunk.compressed_bytes, chunk.uncompressed_bytes);
      },
      offsets);
  put_group(Opcode::kAttachmentIndex, attachments_, plain, offsets);
  put_group(Opcode::kMetadataIndex, metadata_, plain, offsets);
  const std::uint64_t summary_offsets = offset_;
  put(offsets);

  // The footer's CRC covers the summary up to the CRC itself.
  std::string footer(1, static_cast<char>(Opcode::kFooter));
  Appender{footer}(std::uint64_t{20}, summary, summary_offsets);
  append(footer, crc32(footer, crc_));
  put(footer);
  put(kMagic);
}

}  // namespace zerodrift::mcap
