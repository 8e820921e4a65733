// SPDX-License-Identifier: Apache-2.0
// A small MCAP file and what is in it, for tests.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/mcap/mcap_reader.h"
#include "common/mcap/mcap_writer.h"

namespace zerodrift::mcap::testing {

struct KeptMessage {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;
  std::uint64_t publish_time_ns = 0;
  std::string data{};
  bool operator==(const KeptMessage&) const = default;
};

struct Example {
  std::string bytes{};
  std::vector<KeptMessage> messages{};
  // How long the file was when this many messages had gone out in whole chunks.
  std::vector<std::pair<std::size_t, std::size_t>> chunk_ends{};
};

struct ExampleOptions {
  Compression compression = Compression::kZstd;
  int messages = 40;
  std::size_t chunk_bytes = 300;
};

// Two schemas, three channels, an attachment, metadata; log times partly out of order. The first
// channels are there before any message, the last one comes in the middle.
inline Example make_example(const ExampleOptions& options = {}) {
  Example example;
  Writer writer([&](std::string_view bytes) { example.bytes.append(bytes); },
                {.compression = options.compression, .chunk_bytes = options.chunk_bytes});
  const auto schema = writer.add_schema("a::Type", "omgidl", "struct Type { double x; };");
  const auto other = writer.add_schema("a::Other", "omgidl", "struct Other { octet y; };");
  writer.add_channel(schema, "first", "cdr", {{"gyro_id", "1"}});
  writer.add_channel(other, "second", "cdr");
  std::size_t sent = 0;
  for (int i = 0; i < options.messages; ++i) {
    if (i == options.messages / 2) {
      writer.attach(
          {.log_time_ns = 5, .create_time_ns = 6, .name = "a.txt", .media_type = "text/plain"},
          "attached text");
      writer.add_metadata({"about", {{"key", "value"}, {"other", ""}}});
      writer.add_channel(schema, "third", "cdr");
    }
    const auto channels = i < options.messages / 2 ? 2U : 3U;
    KeptMessage kept{
        .channel_id = static_cast<std::uint16_t>(1U + static_cast<unsigned>(i) % channels),
        .sequence = static_cast<std::uint32_t>(i),
        .log_time_ns = 1000U + static_cast<std::uint64_t>(i % 7 == 3 ? i - 2 : i),
        .publish_time_ns = static_cast<std::uint64_t>(i),
        .data = std::string(static_cast<std::size_t>(i % 5) * 7, static_cast<char>('a' + i % 26))};
    example.messages.push_back(kept);
    writer.write(
        {kept.channel_id, kept.sequence, kept.log_time_ns, kept.publish_time_ns, kept.data});
    ++sent;
    if (writer.open_chunk_bytes() == 0) example.chunk_ends.emplace_back(example.bytes.size(), sent);
  }
  writer.flush();
  example.chunk_ends.emplace_back(example.bytes.size(), sent);
  writer.finish();
  return example;
}

inline Reader open(std::string bytes, ReaderOptions options = {}) {
  return Reader(std::make_unique<MemorySource>(std::move(bytes)), "example.mcap", options);
}

inline std::vector<KeptMessage> read_all(Reader& reader) {
  std::vector<KeptMessage> all;
  Cursor cursor(reader);
  for (Message message; cursor.next(message);) {
    all.push_back({message.channel_id, message.sequence, message.log_time_ns,
                   message.publish_time_ns, std::string(message.data)});
  }
  return all;
}

}  // namespace zerodrift::mcap::testing
