// SPDX-License-Identifier: Apache-2.0
// Writes an MCAP file (https://mcap.dev/spec): messages in chunks with indexes and CRCs, schemas
// and channels before the chunks that need them and again in the summary, attachments and metadata
// between chunks. Whatever was handed to the sink is readable without the rest: a file that ends
// after any whole chunk gives that chunk out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/mcap/compression.h"
#include "common/mcap/format.h"

namespace zerodrift::mcap {

struct WriterOptions {
  Compression compression = Compression::kZstd;
  std::size_t chunk_bytes = std::size_t{1}
                            << 20U;  // uncompressed; a chunk that has so many is over
  std::string profile{};
  std::string library{"zerodrift"};
};

// Takes the next bytes of the file.
using Sink = std::function<void(std::string_view)>;

// One thread at a time. Memory: a chunk, compressed and not; of each chunk written, about
// 100 bytes and 16 for each channel in it, until the summary.
class Writer {
 public:
  // Writes the header. Throws what the sink throws, as all below.
  Writer(Sink sink, WriterOptions options);
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  // Ids are 1, 2, ... Throws McapError for the 65536th.
  std::uint16_t add_schema(std::string_view name, std::string_view encoding, std::string_view data);
  std::uint16_t add_channel(std::uint16_t schema_id, std::string_view topic,
                            std::string_view message_encoding, const Pairs& metadata = {});

  // Into the open chunk, which goes out when it is full. Amortised O(bytes). The channel must be
  // one of add_channel()'s (std::logic_error).
  void write(const Message& message);
  // Ends the open chunk, if there is one. Where the sink throws, the chunk stays open: it may be
  // tried again, here or by write() and finish().
  void flush();
  void attach(const Attachment& what, std::string_view data);
  void add_metadata(const Metadata& metadata);
  // The open chunk, the summary and the footer. Nothing may be written after it.
  void finish();

  [[nodiscard]] std::uint64_t bytes() const noexcept { return offset_; }
  [[nodiscard]] std::size_t open_chunk_bytes() const noexcept { return chunk_.size(); }
  // Of those in the statistics, how many no sink has taken yet.
  [[nodiscard]] std::uint64_t open_chunk_messages() const noexcept { return chunk_messages_; }
  [[nodiscard]] const Statistics& statistics() const noexcept { return statistics_; }

 private:
  struct WrittenChunk {
    Chunk chunk{};
    std::uint64_t index_bytes = 0;
    NumbersByChannel index_offsets{};
  };

  void put(std::string_view bytes);
  void put_record(Opcode opcode, std::string_view content);
  void append_indexes(WrittenChunk& written);  // to record_
  template <typename Items, typename Encode>
  void put_group(Opcode opcode, const Items& items, const Encode& encode, std::string& offsets);
  [[nodiscard]] Statistics complete_statistics() const;

  Sink sink_;
  WriterOptions options_;
  std::uint64_t offset_ = 0;
  std::uint32_t crc_ = 0;  // of the part of the file that is being written: data, then summary
  std::vector<Schema> schemas_;
  std::vector<Channel> channels_;
  std::vector<std::uint64_t> messages_;  // by channel
  std::vector<WrittenChunk> chunks_;
  std::vector<Attachment> attachments_;
  std::vector<MetadataIndex> metadata_;
  Statistics statistics_{};

  std::string chunk_;  // open, uncompressed
  std::uint64_t chunk_messages_ = 0;
  std::uint64_t chunk_start_ns_ = 0;
  std::uint64_t chunk_end_ns_ = 0;
  // Of the open chunk, by channel: log time and offset of each message.
  std::vector<std::vector<std::pair<std::uint64_t, std::uint64_t>>> entries_;
  std::string record_;  // reused
};

}  // namespace zerodrift::mcap
