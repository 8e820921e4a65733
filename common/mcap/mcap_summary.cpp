// SPDX-License-Identifier: Apache-2.0
// Reading by the summary at the end of the file.
#include <algorithm>

#include "common/mcap/crc32.h"
#include "common/mcap/mcap_reader.h"

namespace zerodrift::mcap {
namespace {

constexpr std::uint64_t kMostSummaryBytes = std::uint64_t{256} << 20U;
constexpr std::uint64_t kDataEndBytes = kRecordHeaderBytes + 4;

}  // namespace

// kNo: the file is to be scanned; findings_ says why unless it merely has no summary.
Reader::Found Reader::read_summary() {
  const std::uint64_t size = source_->size();
  const std::uint64_t end_bytes = kFooterBytes + kMagic.size();
  std::string tail;
  if (size >= first_record_ + end_bytes)
    source_->read(size - end_bytes, static_cast<std::size_t>(end_bytes), tail);
  std::string_view rest(tail);
  const auto footer = take_record(rest);
  if (!footer || !footer->is(Opcode::kFooter) || footer->content.size() != 20 || rest != kMagic) {
    contents_.ending = Ending::kCut;
    return Found::kNo;
  }
  Fields fields(footer->content);
  const auto begin = fields.take<std::uint64_t>();
  fields.take<std::uint64_t>();
  const auto expected = fields.take<std::uint32_t>();
  const std::uint64_t footer_at = size - end_bytes;
  if (begin == 0) return Found::kNo;
  contents_.ending = Ending::kDamaged;
  if (begin < first_record_ + kDataEndBytes || begin > footer_at ||
      footer_at - begin > kMostSummaryBytes) {
    report(footer_at, "the footer says the summary begins at byte " + std::to_string(begin) +
                          ", which it can't; the file is scanned from the front");
    return Found::kNo;
  }
  std::string summary;
  source_->read(begin, static_cast<std::size_t>(footer_at - begin), summary);
  const std::string_view covered = std::string_view(tail).substr(0, kFooterBytes - 4);
  if (expected != 0 && crc32(covered, crc32(summary)) != expected) {
    report(begin, "the CRC-32 of the summary is wrong; the file is scanned from the front");
    return Found::kNo;
  }
  data_end_ = begin - kDataEndBytes;
  if (take_summary(summary, data_end_) == Found::kNo) {
    data_end_ = 0;
    report(begin, "the summary contradicts itself; the file is scanned from the front");
    return Found::kNo;
  }
  // A writer need not index; then only a scan finds the messages.
  if (contents_.stretches.empty() && contents_.statistics.messages > 0) {
    contents_.ending = Ending::kWhole;
    return Found::kNo;
  }
  contents_.ending = Ending::kWhole;
  return Found::kYes;
}

Reader::Found Reader::take_summary(std::string_view records, std::uint64_t data_end) {
  const auto lies_in_data = [&](std::uint64_t offset, std::uint64_t length) {
    return offset >= first_record_ && offset <= data_end && length >= kRecordHeaderBytes &&
           length <= data_end - offset;
  };
  bool has_statistics = false;
  while (const auto record = take_record(records)) {
    if (record->is(Opcode::kSchema) || record->is(Opcode::kChannel)) {
      take_definition(*record);
    } else if (record->is(Opcode::kStatistics)) {
      const auto statistics = parse_statistics(record->content);
      if (!statistics) return Found::kNo;
      contents_.statistics = *statistics;
      has_statistics = true;
    } else if (record->is(Opcode::kChunkIndex)) {
      const auto chunk = parse_chunk_index(record->content);
      if (!chunk || !lies_in_data(chunk->offset, chunk->length)) return Found::kNo;
      contents_.stretches.push_back({StretchKind::kChunk, *chunk});
    } else if (record->is(Opcode::kAttachmentIndex)) {
      auto attachment = parse_attachment_index(record->content);
      if (!attachment || !lies_in_data(attachment->offset, attachment->length)) return Found::kNo;
      contents_.attachments.push_back(std::move(*attachment));
    } else if (record->is(Opcode::kMetadataIndex)) {
      const auto index = parse_metadata_index(record->content);
      if (!index || !lies_in_data(index->offset, index->length)) return Found::kNo;
      if (read_metadata(*index) == Found::kNo)
        report(index->offset, "metadata that can't be read; left out");
    }
  }
  std::stable_sort(
      contents_.stretches.begin(), contents_.stretches.end(),
      [](const Stretch& a, const Stretch& b) { return a.chunk.offset < b.chunk.offset; });
  // Without statistics nobody knows whether messages lie outside of chunks.
  return records.empty() && has_statistics ? Found::kYes : Found::kNo;
}

Reader::Found Reader::read_metadata(const MetadataIndex& index) {
  if (index.length > options_.most_chunk_bytes) return Found::kNo;
  std::string bytes;
  source_->read(index.offset, static_cast<std::size_t>(index.length), bytes);
  std::string_view rest(bytes);
  const auto record = take_record(rest);
  if (!record || !record->is(Opcode::kMetadata)) return Found::kNo;
  auto metadata = parse_metadata(record->content);
  if (!metadata) return Found::kNo;
  contents_.metadata.push_back(std::move(*metadata));
  return Found::kYes;
}

// The first definition of an id counts.
void Reader::take_definition(const Record& record) {
  if (record.is(Opcode::kSchema)) {
    auto schema = parse_schema(record.content);
    if (schema && contents_.schema(schema->id) == nullptr)
      contents_.schemas.push_back(std::move(*schema));
  } else if (record.is(Opcode::kChannel)) {
    auto channel = parse_channel(record.content);
    if (channel && contents_.channel(channel->id) == nullptr)
      contents_.channels.push_back(std::move(*channel));
  }
}

}  // namespace zerodrift::mcap
