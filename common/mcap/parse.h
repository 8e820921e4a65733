// SPDX-License-Identifier: Apache-2.0
// Bytes of MCAP records as values. Every length is checked against what is there: nothing is
// allocated that the bytes don't hold.
#pragma once

#include <concepts>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/mcap/byte_order.h"
#include "common/mcap/format.h"

namespace zerodrift::mcap {

// Takes values from the front. After the first that doesn't fit, all are empty and good() is false.
class Fields {
 public:
  explicit Fields(std::string_view bytes) noexcept : rest_(bytes) {}

  template <std::unsigned_integral Integer>
  Integer take() noexcept {
    const std::string_view bytes = take_bytes(sizeof(Integer));
    return bytes.size() == sizeof(Integer) ? load<Integer>(bytes.data()) : Integer{0};
  }
  std::string_view take_bytes(std::uint64_t size) noexcept {
    if (!good_ || size > rest_.size()) {
      good_ = false;
      return {};
    }
    const std::string_view bytes = rest_.substr(0, static_cast<std::size_t>(size));
    rest_.remove_prefix(bytes.size());
    return bytes;
  }
  // A length of 32 bits, then the bytes.
  std::string_view take_text() noexcept { return take_bytes(take<std::uint32_t>()); }
  // Takes these, in turn.
  template <typename... Values>
  void operator()(Values&... values) {
    (take_into(values), ...);
  }

  [[nodiscard]] std::string_view rest() const noexcept { return rest_; }
  [[nodiscard]] bool good() const noexcept { return good_; }

 private:
  template <std::unsigned_integral Integer>
  void take_into(Integer& value) noexcept {
    value = take<Integer>();
  }
  void take_into(std::string_view& text) noexcept { text = take_text(); }
  void take_into(std::string& text) { text = take_text(); }
  // A length of 32 bits, then pairs until there are no more bytes.
  template <typename First, typename Second>
  void take_into(std::vector<std::pair<First, Second>>& pairs) {
    Fields content(take_text());
    while (content.good() && !content.rest().empty()) {
      std::pair<First, Second> pair;
      content(pair.first, pair.second);
      if (content.good()) pairs.push_back(std::move(pair));
    }
    good_ = good_ && content.good();
  }

  std::string_view rest_;
  bool good_ = true;
};

// One record, where it lies in what it was taken from.
struct Record {
  std::uint8_t opcode = 0;
  std::string_view content{};

  [[nodiscard]] bool is(Opcode wanted) const noexcept {
    return opcode == static_cast<std::uint8_t>(wanted);
  }
};

// Takes the record at the front of `bytes`; nothing, and `bytes` as it was, where there is no whole
// one.
[[nodiscard]] std::optional<Record> take_record(std::string_view& bytes) noexcept;

// Nothing where the content is too short or contradicts itself.
[[nodiscard]] std::optional<Schema> parse_schema(std::string_view content);
[[nodiscard]] std::optional<Channel> parse_channel(std::string_view content);
[[nodiscard]] std::optional<Message> parse_message(std::string_view content) noexcept;
[[nodiscard]] std::optional<Chunk> parse_chunk_index(std::string_view content) noexcept;
// Offset and length are the index's.
[[nodiscard]] std::optional<Attachment> parse_attachment_index(std::string_view content);
[[nodiscard]] std::optional<MetadataIndex> parse_metadata_index(std::string_view content);
[[nodiscard]] std::optional<Metadata> parse_metadata(std::string_view content);
[[nodiscard]] std::optional<Statistics> parse_statistics(std::string_view content);

// A chunk's fields before its records.
struct ChunkHead {
  Chunk chunk{};          // without offset and length
  std::uint32_t crc = 0;  // of the uncompressed records; 0: not given
  std::string_view compression{};
  std::uint64_t head_bytes = 0;
};
// Of the first bytes of a chunk's content, `content_bytes` long in the file. An unknown compression
// is kNone here and shows in its name.
[[nodiscard]] std::optional<ChunkHead> parse_chunk_head(std::string_view begin,
                                                        std::uint64_t content_bytes) noexcept;

}  // namespace zerodrift::mcap
