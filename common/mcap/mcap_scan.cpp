// SPDX-License-Identifier: Apache-2.0
// Reading a file without a summary that can be trusted: record after record from the front.
#include <algorithm>

#include "common/mcap/mcap_reader.h"

namespace zerodrift::mcap {
namespace {

constexpr std::size_t kHeadBytes = 4096;  // of a record, to see what it is
constexpr std::uint64_t kMostSmallRecordBytes = std::uint64_t{64} << 20U;
constexpr std::uint64_t kMostLooseBytes = std::uint64_t{1} << 20U;  // in one stretch
constexpr std::size_t kSearchBytes = std::size_t{1} << 20U;

}  // namespace

void Reader::scan() {
  std::uint64_t offset = first_record_;
  for (;;) {
    std::uint64_t next = offset;
    const Step step = scan_record(offset, next);
    if (step == Step::kEnd) break;
    if (step == Step::kLost) {
      const auto found = resume_after(offset);
      report(offset, "no record is recognised here; " +
                         (found ? "went on with the chunk at byte " + std::to_string(*found)
                                : std::string("what follows is left out")));
      if (!found) break;
      next = *found;
    }
    offset = next;
  }
  auto& counts = contents_.statistics;
  counts.schemas = static_cast<std::uint16_t>(contents_.schemas.size());
  counts.channels = static_cast<std::uint32_t>(contents_.channels.size());
  counts.attachments = static_cast<std::uint32_t>(contents_.attachments.size());
  counts.metadata = static_cast<std::uint32_t>(contents_.metadata.size());
}

Reader::Step Reader::scan_record(std::uint64_t offset, std::uint64_t& next) {
  const std::uint64_t size = source_->size();
  const auto cut = [&](const std::string& what) {
    contents_.ending = Ending::kCut;
    report(offset, what + ": it was cut, or is still being written; what is whole before is read");
    return Step::kEnd;
  };
  std::string head;
  source_->read(offset, kHeadBytes, head);
  if (head.empty()) return cut("the file ends without a footer");
  const auto opcode = static_cast<std::uint8_t>(head.front());
  const bool is_known = (opcode != 0 && opcode <= kLastOpcode) || opcode >= kFirstPrivateOpcode;
  if (!is_known) return Step::kLost;
  if (head.size() < kRecordHeaderBytes) return cut("the file ends within a record");
  const auto content_bytes = mcap::load<std::uint64_t>(head.data() + 1);
  if (content_bytes > size - offset - kRecordHeaderBytes) {
    // One that is cut is the last; a length that was changed may have others behind it.
    if (resume_after(offset)) return Step::kLost;
    return cut("the file ends within a record");
  }
  next = offset + kRecordHeaderBytes + content_bytes;
  switch (static_cast<Opcode>(opcode)) {
    case Opcode::kDataEnd:
    case Opcode::kFooter:
      if (contents_.ending == Ending::kCut)
        report(size, "the file ends within its summary: it was cut there; all messages are before");
      return Step::kEnd;
    case Opcode::kChunk: scan_chunk(offset, content_bytes); return Step::kGoOn;
    case Opcode::kAttachment: scan_attachment(offset, content_bytes); return Step::kGoOn;
    case Opcode::kSchema:
    case Opcode::kChannel:
    case Opcode::kMessage:
    case Opcode::kMetadata: break;
    default: return Step::kGoOn;
  }
  if (content_bytes > kMostSmallRecordBytes) {
    report(offset, "a record of " + std::to_string(content_bytes) + " bytes, expected at most " +
                       std::to_string(kMostSmallRecordBytes) + "; left out");
    return Step::kGoOn;
  }
  if (head.size() < kRecordHeaderBytes + content_bytes)
    source_->read(offset, static_cast<std::size_t>(kRecordHeaderBytes + content_bytes), head);
  std::string_view rest(head);
  const auto record = take_record(rest);
  if (!record) return Step::kLost;
  take_definition(*record);
  if (record->is(Opcode::kMetadata)) {
    if (auto metadata = parse_metadata(record->content))
      contents_.metadata.push_back(std::move(*metadata));
  }
  if (record->is(Opcode::kMessage)) {
    if (const auto message = parse_message(record->content))
      scan_loose(offset, next - offset, *message);
  }
  return Step::kGoOn;
}

// A chunk that can't be read is reported and left out; its messages are counted otherwise, since
// readers will find it again.
void Reader::scan_chunk(std::uint64_t offset, std::uint64_t content_bytes) {
  Stretch stretch{StretchKind::kChunk, {}};
  stretch.chunk.offset = offset;
  stretch.chunk.length = kRecordHeaderBytes + content_bytes;
  std::string records;
  if (const std::string why = load(stretch, records); !why.empty()) return report(offset, why);
  std::string head;
  source_->read(offset + kRecordHeaderBytes, kHeadBytes, head);
  if (const auto fields = parse_chunk_head(head, content_bytes)) {
    stretch.chunk.compressed_bytes = fields->chunk.compressed_bytes;
    stretch.chunk.compression = fields->chunk.compression;
  }
  stretch.chunk.uncompressed_bytes = records.size();
  bool first = true;
  std::string_view rest(records);
  while (const auto record = take_record(rest)) {
    take_definition(*record);
    const auto message =
        record->is(Opcode::kMessage) ? parse_message(record->content) : std::nullopt;
    if (!message) continue;
    stretch.chunk.start_ns =
        first ? message->log_time_ns : std::min(stretch.chunk.start_ns, message->log_time_ns);
    stretch.chunk.end_ns = std::max(stretch.chunk.end_ns, message->log_time_ns);
    first = false;
    count(*message);
  }
  ++contents_.statistics.chunks;
  contents_.stretches.push_back(stretch);
}

void Reader::scan_attachment(std::uint64_t offset, std::uint64_t content_bytes) {
  std::string head;
  source_->read(offset + kRecordHeaderBytes, kHeadBytes, head);
  Fields fields(head);
  Attachment attachment{.offset = offset, .length = kRecordHeaderBytes + content_bytes};
  attachment.log_time_ns = fields.take<std::uint64_t>();
  attachment.create_time_ns = fields.take<std::uint64_t>();
  attachment.name = fields.take_text();
  attachment.media_type = fields.take_text();
  attachment.data_bytes = fields.take<std::uint64_t>();
  if (!fields.good() || attachment.data_bytes > content_bytes)
    return report(offset, "an attachment whose fields contradict each other; left out");
  contents_.attachments.push_back(std::move(attachment));
}

void Reader::scan_loose(std::uint64_t offset, std::uint64_t record_bytes, const Message& message) {
  auto& stretches = contents_.stretches;
  const bool goes_on = !stretches.empty() && stretches.back().kind == StretchKind::kLoose &&
                       stretches.back().chunk.offset + stretches.back().chunk.length == offset &&
                       stretches.back().chunk.length + record_bytes <= kMostLooseBytes;
  if (!goes_on) {
    stretches.push_back({StretchKind::kLoose, {}});
    stretches.back().chunk.offset = offset;
    stretches.back().chunk.start_ns = message.log_time_ns;
  }
  Chunk& chunk = stretches.back().chunk;
  chunk.length += record_bytes;
  chunk.compressed_bytes = chunk.uncompressed_bytes = chunk.length;
  chunk.start_ns = std::min(chunk.start_ns, message.log_time_ns);
  chunk.end_ns = std::max(chunk.end_ns, message.log_time_ns);
  count(message);
}

void Reader::count(const Message& message) {
  auto& statistics = contents_.statistics;
  const bool is_first = statistics.messages++ == 0;
  statistics.start_ns =
      is_first ? message.log_time_ns : std::min(statistics.start_ns, message.log_time_ns);
  statistics.end_ns = std::max(statistics.end_ns, message.log_time_ns);
  auto& counts = statistics.messages_by_channel;
  const auto known = std::find_if(counts.begin(), counts.end(), [&](const auto& entry) {
    return entry.first == message.channel_id;
  });
  if (known != counts.end()) {
    ++known->second;
  } else {
    counts.emplace_back(message.channel_id, 1);
  }
}

// The next place behind `offset` where a chunk stands: opcode, and fields whose lengths agree with
// each other and the file. Anything else of 41 bytes that does by chance is one in 2^64.
std::optional<std::uint64_t> Reader::resume_after(std::uint64_t offset) {
  constexpr std::size_t kLeast = kRecordHeaderBytes + 40;
  const std::uint64_t size = source_->size();
  std::string window;
  for (std::uint64_t begin = offset + 1; begin + kLeast <= size; begin += kSearchBytes) {
    source_->read(begin, kSearchBytes + kLeast + 8, window);
    for (std::size_t at = 0; at < kSearchBytes && at + kLeast <= window.size(); ++at) {
      if (window[at] != static_cast<char>(Opcode::kChunk)) continue;
      const auto content_bytes = mcap::load<std::uint64_t>(window.data() + at + 1);
      if (content_bytes > size - (begin + at) - kRecordHeaderBytes || content_bytes < 40) continue;
      const auto head = parse_chunk_head(
          std::string_view(window).substr(at + kRecordHeaderBytes, 48), content_bytes);
      if (head && compression_of(head->compression)) return begin + at;
    }
  }
  return std::nullopt;
}

}  // namespace zerodrift::mcap
