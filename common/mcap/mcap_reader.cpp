// SPDX-License-Identifier: Apache-2.0
#include "common/mcap/mcap_reader.h"

#include <algorithm>
#include <cstdio>

#include "common/files/input_file.h"
#include "common/mcap/compression.h"
#include "common/mcap/crc32.h"
#include "common/mcap/mcap_error.h"

namespace zerodrift::mcap {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 20U;

std::string hex(std::uint32_t value) {
  char text[16];
  std::snprintf(text, sizeof text, "%08x", value);
  return text;
}

}  // namespace

const Channel* Contents::channel(std::uint16_t id) const noexcept {
  const auto found = std::find_if(channels.begin(), channels.end(),
                                  [&](const Channel& channel) { return channel.id == id; });
  return found == channels.end() ? nullptr : &*found;
}

const Schema* Contents::schema(std::uint16_t id) const noexcept {
  const auto found = std::find_if(schemas.begin(), schemas.end(),
                                  [&](const Schema& schema) { return schema.id == id; });
  return found == schemas.end() ? nullptr : &*found;
}

bool is_mcap(const std::filesystem::path& path) {
  return files::beginning_of(path, kMagic.size()) == kMagic;
}

Reader::Reader(const std::filesystem::path& path, ReaderOptions options)
    : Reader(std::make_unique<FileSource>(path), path.string(), options) {}

Reader::Reader(std::unique_ptr<const ByteSource> source, std::string name, ReaderOptions options)
    : source_(std::move(source)), name_(std::move(name)), options_(options) {
  read_header();
  if (read_summary() == Found::kYes) return;
  contents_.schemas.clear();
  contents_.channels.clear();
  contents_.stretches.clear();
  contents_.attachments.clear();
  contents_.metadata.clear();
  contents_.statistics = {};
  scan();
}

void Reader::report(std::uint64_t offset, const std::string& what) {
  findings_.push_back(core::one_line(name_ + ": byte " + std::to_string(offset) + ": " + what));
}

void Reader::read_header() {
  std::string bytes;
  source_->read(0, kPieceBytes, bytes);
  if (!bytes.starts_with(kMagic))
    throw McapError(name_ + ": is no MCAP file: it doesn't begin with MCAP's magic");
  std::string_view rest(bytes);
  rest.remove_prefix(kMagic.size());
  first_record_ = kMagic.size();
  const auto record = take_record(rest);
  if (!record || !record->is(Opcode::kHeader)) return;  // the scan reports it
  Fields fields(record->content);
  contents_.profile = fields.take_text();
  contents_.library = fields.take_text();
  first_record_ = bytes.size() - rest.size();
}

std::shared_ptr<const std::string> Reader::records(std::size_t stretch) {
  const auto known = std::find_if(kept_.begin(), kept_.end(),
                                  [&](const auto& entry) { return entry.first == stretch; });
  if (known != kept_.end()) {
    const auto entry = *known;
    kept_.erase(known);
    kept_.push_back(entry);
    return entry.second;
  }
  if (unreadable_.contains(stretch)) return nullptr;
  auto records = std::make_shared<std::string>();
  const Stretch& where = contents_.stretches.at(stretch);
  if (const std::string why = load(where, *records); !why.empty()) {
    unreadable_.insert(stretch);
    report(where.chunk.offset, why);
    return nullptr;
  }
  if (kept_.size() >= std::max<std::size_t>(1, options_.chunks_kept)) kept_.pop_front();
  kept_.emplace_back(stretch, records);
  return records;
}

// Empty, or why the records can't be had.
std::string Reader::load(const Stretch& stretch, std::string& records) const {
  const Chunk& chunk = stretch.chunk;
  if (chunk.length > options_.most_chunk_bytes || chunk.length > source_->size()) {
    return "a chunk of " + std::to_string(chunk.length) + " bytes, expected at most " +
           std::to_string(options_.most_chunk_bytes) + "; left out";
  }
  std::string bytes;
  source_->read(chunk.offset, static_cast<std::size_t>(chunk.length), bytes);
  if (stretch.kind == StretchKind::kLoose) {
    records = std::move(bytes);
    return records.size() == chunk.length ? "" : "the file is shorter than it was; left out";
  }
  std::string_view rest(bytes);
  const auto record = take_record(rest);
  if (!record || !record->is(Opcode::kChunk) || !rest.empty())
    return "found no chunk of " + std::to_string(chunk.length) +
           " bytes, which the index says is here; left out";
  const auto head = parse_chunk_head(record->content, record->content.size());
  if (!head) return "a chunk whose fields contradict each other; left out";
  const auto compression = compression_of(head->compression);
  if (!compression) {
    return "a chunk compressed by '" + std::string(head->compression.substr(0, 40)) +
           "', expected zstd, lz4 or none; left out";
  }
  if (head->chunk.uncompressed_bytes > options_.most_chunk_bytes) {
    return "a chunk of " + std::to_string(head->chunk.uncompressed_bytes) +
           " bytes when uncompressed, expected at most " +
           std::to_string(options_.most_chunk_bytes) + "; left out";
  }
  const std::string_view packed =
      record->content.substr(static_cast<std::size_t>(head->head_bytes));
  if (!decompress(*compression, packed, static_cast<std::size_t>(head->chunk.uncompressed_bytes),
                  records)) {
    return "a chunk that is not " +
           (head->compression.empty() ? std::string("the bytes")
                                      : "a " + std::string(head->compression) + " stream") +
           " of " + std::to_string(head->chunk.uncompressed_bytes) + " bytes; left out";
  }
  const std::uint32_t crc = head->crc == 0 ? 0 : crc32(records);
  if (crc == head->crc) return {};
  return "the CRC-32 of a chunk is " + hex(crc) + ", expected " + hex(head->crc) + "; left out (" +
         std::to_string(records.size()) + " bytes uncompressed)";
}

std::string Reader::attachment(const Attachment& attachment) const {
  const std::string where = name_ + ": byte " + std::to_string(attachment.offset) +
                            ": attachment '" + attachment.name + "': ";
  if (attachment.length > options_.most_attachment_bytes) {
    throw McapError(where + "is " + std::to_string(attachment.length) +
                    " bytes long, expected at most " +
                    std::to_string(options_.most_attachment_bytes));
  }
  std::string bytes;
  source_->read(attachment.offset, static_cast<std::size_t>(attachment.length), bytes);
  std::string_view rest(bytes);
  const auto record = take_record(rest);
  if (!record || !record->is(Opcode::kAttachment)) throw McapError(where + "found something else");
  Fields fields(record->content);
  fields.take<std::uint64_t>();
  fields.take<std::uint64_t>();
  fields.take_text();
  fields.take_text();
  const std::string_view data = fields.take_bytes(fields.take<std::uint64_t>());
  const std::string_view covered = record->content.substr(
      0, record->content.size() - std::min<std::size_t>(4, record->content.size()));
  const auto expected = fields.take<std::uint32_t>();
  if (!fields.good() || !fields.rest().empty())
    throw McapError(where + "its fields contradict each other");
  if (expected != 0 && crc32(covered) != expected) {
    throw McapError(where + "its CRC-32 is " + hex(crc32(covered)) + ", expected " + hex(expected));
  }
  return std::string(data);
}

void Reader::verify() {
  if (data_end_ == 0) return;
  std::string bytes;
  source_->read(data_end_, kRecordHeaderBytes + 4, bytes);
  std::string_view rest(bytes);
  const auto record = take_record(rest);
  if (!record || !record->is(Opcode::kDataEnd) || record->content.size() != 4)
    return report(data_end_, "found no end of the data, which the summary follows");
  const auto expected = mcap::load<std::uint32_t>(record->content.data());
  if (expected == 0) return;
  std::uint32_t crc = 0;
  for (std::uint64_t offset = 0; offset < data_end_;) {
    source_->read(
        offset, static_cast<std::size_t>(std::min<std::uint64_t>(kPieceBytes, data_end_ - offset)),
        bytes);
    if (bytes.empty()) break;
    crc = crc32(bytes, crc);
    offset += bytes.size();
  }
  if (crc == expected) return;
  report(data_end_, "the CRC-32 of all data is " + hex(crc) + ", expected " + hex(expected) +
                        ": something before this byte was changed");
}

bool Cursor::next(Message& message) {
  for (;;) {
    while (const auto record = take_record(rest_)) {
      if (!record->is(Opcode::kMessage)) continue;
      const auto found = parse_message(record->content);
      if (!found || reader_->contents().channel(found->channel_id) == nullptr) continue;
      message = *found;
      return true;
    }
    if (stretch_ == reader_->contents().stretches.size()) return false;
    records_ = reader_->records(stretch_++);
    rest_ = records_ ? std::string_view(*records_) : std::string_view{};
  }
}

double Cursor::progress() const noexcept {
  const std::size_t all = reader_->contents().stretches.size();
  return all == 0 ? 1.0 : static_cast<double>(stretch_) / static_cast<double>(all);
}

}  // namespace zerodrift::mcap
