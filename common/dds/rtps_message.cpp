// SPDX-License-Identifier: Apache-2.0
#include "common/dds/rtps_message.h"

#include <algorithm>

namespace zerodrift::dds::rtps_message {
namespace {

constexpr std::size_t kSubmessageHeaderSize = 4;
constexpr std::uint8_t kLittleEndianFlag = 0x01;
constexpr std::uint8_t kInlineQosFlag = 0x02;      // of DATA and DATA_FRAG
constexpr std::uint8_t kKeyOfFragmentFlag = 0x04;  // of DATA_FRAG
constexpr std::uint8_t kNoTimestampFlag = 0x02;    // of INFO_TS
constexpr std::uint32_t kMostBits = 256;           // of a set of numbers
constexpr std::uint16_t kEndOfParameters = 1;
constexpr std::size_t kSizeOfData = 20;  // up to its inline QoS
constexpr std::size_t kSizeOfDataFrag = 32;

// Reads on from where it stands; whoever reads past the end gets 0 and is not whole.
class Fields {
 public:
  Fields(std::span<const std::uint8_t> bytes, bool little_endian)
      : bytes_(bytes), little_endian_(little_endian) {}
  std::uint32_t entity() { return static_cast<std::uint32_t>(number(4, false)); }
  std::uint16_t u16() { return static_cast<std::uint16_t>(number(2, little_endian_)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(number(4, little_endian_)); }
  // Two words, the upper one first, whatever the byte order.
  std::uint64_t sequence() {
    const std::uint64_t high = u32();
    return high << 32U | u32();
  }
  void skip(std::size_t size) {
    whole_ = whole_ && size <= bytes_.size();
    bytes_ = bytes_.subspan(std::min(size, bytes_.size()));
  }
  [[nodiscard]] bool whole() const { return whole_; }
  [[nodiscard]] std::size_t left() const { return bytes_.size(); }

 private:
  std::uint64_t number(std::size_t size, bool little_endian) {
    std::uint64_t value = 0;
    if (size <= bytes_.size()) {
      for (std::size_t k = 0; k < size; ++k)
        value = value << 8U | bytes_[little_endian ? size - 1 - k : k];
    }
    skip(size);
    return value;
  }

  std::span<const std::uint8_t> bytes_;
  bool little_endian_;
  bool whole_ = true;
};

bool is_sequence(std::uint64_t number) {
  return number >= 1 && number <= kLargestSequence;
}

// Up to behind its end mark.
void skip_parameters(Fields& fields) {
  while (fields.whole()) {
    const std::uint16_t id = fields.u16();
    const std::uint16_t size = fields.u16();
    if (id == kEndOfParameters) return;
    fields.skip((size + std::size_t{3}) / 4 * 4);
  }
}

// The bits of a set, whose base is read; how many there are.
std::optional<std::uint32_t> skip_bits(Fields& fields) {
  const std::uint32_t bits = fields.u32();
  if (bits > kMostBits) return std::nullopt;
  fields.skip((bits + 31U) / 32U * 4U);
  return bits;
}

using Stated = std::optional<Statement>;
using Of = Statement::Of;

Stated if_whole(const Fields& fields, const Statement& statement) {
  return fields.whole() ? Stated(statement) : std::nullopt;
}

struct SampleHead {
  Statement statement;
  std::size_t to_inline_qos = 0;  // from the body's begin
};
// Up to the sequence number. `fixed`: what comes before the inline QoS at least.
std::optional<SampleHead> sample_head(Fields& fields, std::size_t fixed) {
  fields.skip(2);
  SampleHead head;
  head.to_inline_qos = std::size_t{4} + fields.u16();
  head.statement.of = Of::kSamples;
  head.statement.reader = fields.entity();
  head.statement.writer = fields.entity();
  head.statement.newest = fields.sequence();
  if (!fields.whole() || head.to_inline_qos < fixed || !is_sequence(head.statement.newest))
    return std::nullopt;
  return head;
}

Stated data(const Submessage& submessage, Fields fields) {
  const auto head = sample_head(fields, kSizeOfData);
  if (!head) return std::nullopt;
  fields.skip(head->to_inline_qos - kSizeOfData);
  if ((submessage.flags & kInlineQosFlag) != 0) skip_parameters(fields);
  return if_whole(fields, head->statement);
}

Stated data_frag(const Submessage& submessage, Fields fields) {
  const auto head = sample_head(fields, kSizeOfDataFrag);
  if (!head || (submessage.flags & kKeyOfFragmentFlag) != 0) return std::nullopt;
  const std::uint64_t first = fields.u32();
  const std::uint64_t fragments = fields.u16();
  const std::uint64_t fragment_size = fields.u16();
  const std::uint64_t sample_size = fields.u32();
  // Fast DDS keeps a list within the sample, one word at the begin of each fragment.
  if (fragment_size == 0 || fragment_size % 4 != 0) return std::nullopt;
  if (sample_size == 0 || sample_size > kLargestSample) return std::nullopt;
  const std::uint64_t all = (sample_size + fragment_size - 1) / fragment_size;
  if (first == 0 || fragments == 0 || first - 1 + fragments > all) return std::nullopt;
  fields.skip(head->to_inline_qos - kSizeOfDataFrag);
  if ((submessage.flags & kInlineQosFlag) != 0) skip_parameters(fields);
  const std::uint64_t announced =
      std::min(fragments * fragment_size, sample_size - (first - 1) * fragment_size);
  if (fields.left() < announced) return std::nullopt;
  return if_whole(fields, head->statement);
}

Stated heartbeat(Fields fields) {
  Statement statement{.of = Of::kHeartbeat, .reader = fields.entity(), .writer = fields.entity()};
  const std::uint64_t first = fields.sequence();
  statement.newest = fields.sequence();
  statement.count = fields.u32();
  // Of an empty history the last is one below the first.
  if (!is_sequence(first) || statement.newest > kLargestSequence || statement.newest + 1 < first)
    return std::nullopt;
  return if_whole(fields, statement);
}

Stated gap(Fields fields) {
  Statement statement{.of = Of::kGap, .reader = fields.entity(), .writer = fields.entity()};
  const std::uint64_t start = fields.sequence();
  const std::uint64_t base = fields.sequence();
  const auto bits = skip_bits(fields);
  if (!bits || !is_sequence(start) || !is_sequence(base)) return std::nullopt;
  statement.newest = base - 1 + *bits;
  statement.span = base > start ? base - start : 0;
  return if_whole(fields, statement);
}

Stated acknowledgement(Fields fields) {
  Statement statement{
      .of = Of::kAcknowledgement, .reader = fields.entity(), .writer = fields.entity()};
  // 0: a reader's first, which asks for a heartbeat.
  const std::uint64_t base = fields.sequence();
  const auto bits = skip_bits(fields);
  statement.count = fields.u32();
  if (!bits || base > kLargestSequence) return std::nullopt;
  return if_whole(fields, statement);
}

Stated missing_fragments(Fields fields) {
  Statement statement{
      .of = Of::kMissingFragments, .reader = fields.entity(), .writer = fields.entity()};
  const std::uint64_t sequence = fields.sequence();
  const std::uint32_t base = fields.u32();
  const auto bits = skip_bits(fields);
  statement.count = fields.u32();
  if (!bits || !is_sequence(sequence) || base == 0 || base > kLargestSample) return std::nullopt;
  return if_whole(fields, statement);
}

Stated heartbeat_frag(Fields fields) {
  Statement statement{.of = Of::kSamples, .reader = fields.entity(), .writer = fields.entity()};
  statement.newest = fields.sequence();
  const std::uint32_t last = fields.u32();
  fields.u32();
  if (!is_sequence(statement.newest) || last == 0 || last > kLargestSample) return std::nullopt;
  return if_whole(fields, statement);
}

Stated of_size(const Submessage& submessage, std::size_t least) {
  return submessage.body.size() >= least ? Stated(Statement{}) : std::nullopt;
}

}  // namespace

std::optional<Submessage> Submessages::next() {
  if (rest_.size() < kSubmessageHeaderSize) return std::nullopt;
  Submessage submessage{.id = rest_[0], .flags = rest_[1]};
  Fields length_field(rest_.subspan(2), (submessage.flags & kLittleEndianFlag) != 0);
  std::size_t length = length_field.u16();
  rest_ = rest_.subspan(kSubmessageHeaderSize);
  // 0: up to the end, except where nothing is the content.
  if (length == 0 && submessage.id != kInfoTimestamp && submessage.id != kPad)
    length = rest_.size();
  if (length > rest_.size()) return std::nullopt;
  // Each begins at a multiple of 4; Fast DDS rounds up where it looks for statistics.
  if (length % 4 != 0 && length != rest_.size()) return std::nullopt;
  submessage.body = rest_.first(length);
  rest_ = rest_.subspan(length);
  return submessage;
}

std::optional<Statement> statement_of(const Submessage& submessage) {
  const Fields fields(submessage.body, (submessage.flags & kLittleEndianFlag) != 0);
  switch (submessage.id) {
    case kData: return data(submessage, fields);
    case kDataFrag: return data_frag(submessage, fields);
    case kHeartbeat: return heartbeat(fields);
    case kHeartbeatFrag: return heartbeat_frag(fields);
    case kGap: return gap(fields);
    case kAckNack: return acknowledgement(fields);
    case kNackFrag: return missing_fragments(fields);
    case kInfoTimestamp:
      return of_size(submessage, (submessage.flags & kNoTimestampFlag) != 0 ? 0 : 8);
    case kInfoDestination: return of_size(submessage, 12);
    case kInfoSource: return of_size(submessage, 20);
    default: return Statement{};
  }
}

Prefix source_of(const Submessage& info_source) {
  Prefix prefix{};
  std::copy_n(info_source.body.begin() + 8, prefix.size(), prefix.begin());
  return prefix;
}

}  // namespace zerodrift::dds::rtps_message
