// SPDX-License-Identifier: Apache-2.0
// The records of an MCAP file (https://mcap.dev/spec, version 0), as values. All integers are
// little-endian; a record is an opcode of one byte, a length of eight, the content.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/mcap/compression.h"

namespace zerodrift::mcap {

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
inline constexpr std::size_t kRecordHeaderBytes = 9;
inline constexpr std::size_t kFooterBytes = kRecordHeaderBytes + 20;

enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kAttachment = 0x09,
  kAttachmentIndex = 0x0A,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};
inline constexpr std::uint8_t kLastOpcode = 0x0F;
// From here on are others' own records, to be passed over.
inline constexpr std::uint8_t kFirstPrivateOpcode = 0x80;

using Pairs = std::vector<std::pair<std::string, std::string>>;
using NumbersByChannel = std::vector<std::pair<std::uint16_t, std::uint64_t>>;

// The value of a key; empty where there is none.
[[nodiscard]] inline std::string_view value_of(const Pairs& pairs, std::string_view key) noexcept {
  for (const auto& [name, value] : pairs) {
    if (name == key) return value;
  }
  return {};
}

// A record whose fields follow each other lists them in the order of the file, for reading and for
// writing.
struct Schema {
  std::uint16_t id = 0;  // from 1
  std::string name{};
  std::string encoding{};
  std::string data{};

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& fields) {
    fields(self.id, self.name, self.encoding, self.data);
  }
};

struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;
  std::string topic{};
  std::string message_encoding{};
  Pairs metadata{};

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& fields) {
    fields(self.id, self.schema_id, self.topic, self.message_encoding, self.metadata);
  }
};

// `data` is valid as long as what it was parsed from.
struct Message {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;
  std::uint64_t publish_time_ns = 0;
  std::string_view data{};
};

// Where a chunk is and what it says of itself.
struct Chunk {
  std::uint64_t offset = 0;  // of its record
  std::uint64_t length = 0;  // of the whole record
  std::uint64_t start_ns = 0;
  std::uint64_t end_ns = 0;
  std::uint64_t compressed_bytes = 0;
  std::uint64_t uncompressed_bytes = 0;
  Compression compression = Compression::kNone;
};

struct Attachment {
  std::uint64_t offset = 0;  // of its record
  std::uint64_t length = 0;  // of the whole record
  std::uint64_t log_time_ns = 0;
  std::uint64_t create_time_ns = 0;
  std::uint64_t data_bytes = 0;
  std::string name{};
  std::string media_type{};

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& fields) {
    fields(self.offset, self.length, self.log_time_ns, self.create_time_ns, self.data_bytes,
           self.name, self.media_type);
  }
};

struct Metadata {
  std::string name{};
  Pairs values{};

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& fields) {
    fields(self.name, self.values);
  }
};

struct MetadataIndex {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::string name{};

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& fields) {
    fields(self.offset, self.length, self.name);
  }
};

struct Statistics {
  std::uint64_t messages = 0;
  std::uint16_t schemas = 0;
  std::uint32_t channels = 0;
  std::uint32_t attachments = 0;
  std::uint32_t metadata = 0;
  std::uint32_t chunks = 0;
  std::uint64_t start_ns = 0;
  std::uint64_t end_ns = 0;
  NumbersByChannel messages_by_channel{};

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& fields) {
    fields(self.messages, self.schemas, self.channels, self.attachments, self.metadata, self.chunks,
           self.start_ns, self.end_ns, self.messages_by_channel);
  }
};

}  // namespace zerodrift::mcap
