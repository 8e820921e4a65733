// SPDX-License-Identifier: Apache-2.0
// RTPS submessages byte by byte, as a hostile sender would make them: every field is what it is
// told to be. RTPS 2.3, 9.4.5; all little-endian.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace zerodrift::rtps_bytes {

using Bytes = std::vector<std::uint8_t>;
using Prefix = std::array<std::uint8_t, 12>;

inline Prefix prefix_of(std::uint8_t octet) {
  Prefix prefix{};
  prefix.fill(octet);
  return prefix;
}

// Fields one after the other.
class Body {
 public:
  Body& u8(std::uint64_t value) { return put(value, 1); }
  Body& u16(std::uint64_t value) { return put(value, 2); }
  Body& u32(std::uint64_t value) { return put(value, 4); }
  Body& entity(std::uint32_t id) {  // big-endian
    for (int shift = 24; shift >= 0; shift -= 8)
      bytes_.push_back(static_cast<std::uint8_t>(id >> static_cast<unsigned>(shift)));
    return *this;
  }
  Body& sequence(std::uint64_t number) { return u32(number >> 32U).u32(number & 0xFFFFFFFFU); }
  Body& prefix(const Prefix& prefix) {
    bytes_.insert(bytes_.end(), prefix.begin(), prefix.end());
    return *this;
  }
  Body& zeros(std::size_t count) {
    bytes_.resize(bytes_.size() + count);
    return *this;
  }
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }

 private:
  Body& put(std::uint64_t value, int octets) {
    for (int k = 0; k < octets; ++k) bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * k)));
    return *this;
  }
  Bytes bytes_;
};

// Header and submessages.
class Message {
 public:
  explicit Message(const Prefix& prefix) {
    bytes_ = {'R', 'T', 'P', 'S', 2, 2, 1, 15};
    bytes_.insert(bytes_.end(), prefix.begin(), prefix.end());
  }
  Message& add(std::uint8_t id, const Body& body, std::uint8_t flags = 0) {
    const auto size = body.bytes().size();
    bytes_.push_back(id);
    bytes_.push_back(static_cast<std::uint8_t>(flags | 1U));
    bytes_.push_back(static_cast<std::uint8_t>(size & 0xFFU));
    bytes_.push_back(static_cast<std::uint8_t>(size >> 8U));
    bytes_.insert(bytes_.end(), body.bytes().begin(), body.bytes().end());
    return *this;
  }
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }

 private:
  Bytes bytes_;
};

// Who speaks to whom, and what an honest sender would say at this moment.
struct Ends {
  std::uint32_t reader = 0;
  std::uint32_t writer = 0;
  std::uint64_t newest = 1;  // sequence number of the writer's newest sample
  std::uint32_t count = 1;   // of its newest heartbeat, or of the reader's newest acknowledgement
};

inline Body data(const Ends& ends, std::uint64_t sequence, std::uint64_t to_inline_qos = 16,
                 std::size_t payload = 8) {
  return Body()
      .u16(0)
      .u16(to_inline_qos)
      .entity(ends.reader)
      .entity(ends.writer)
      .sequence(sequence)
      .zeros(payload);
}
struct Fragments {
  std::uint64_t first = 1;
  std::uint64_t count = 1;
  std::uint64_t size = 64;
  std::uint64_t sample_size = 128;
  std::size_t payload = 64;
  std::uint64_t to_inline_qos = 28;
};
inline Body data_frag(const Ends& ends, std::uint64_t sequence, const Fragments& of) {
  return Body()
      .u16(0)
      .u16(of.to_inline_qos)
      .entity(ends.reader)
      .entity(ends.writer)
      .sequence(sequence)
      .u32(of.first)
      .u16(of.count)
      .u16(of.size)
      .u32(of.sample_size)
      .zeros(of.payload);
}
inline Body heartbeat(const Ends& ends, std::uint64_t first, std::uint64_t last,
                      std::uint64_t count) {
  return Body().entity(ends.reader).entity(ends.writer).sequence(first).sequence(last).u32(count);
}
inline Body gap(const Ends& ends, std::uint64_t start, std::uint64_t base, std::uint64_t bits = 0,
                std::size_t words = 0) {
  return Body()
      .entity(ends.reader)
      .entity(ends.writer)
      .sequence(start)
      .sequence(base)
      .u32(bits)
      .zeros(4 * words);
}
inline Body ack_nack(const Ends& ends, std::uint64_t base, std::uint64_t bits, std::size_t words,
                     std::uint64_t count) {
  return Body()
      .entity(ends.reader)
      .entity(ends.writer)
      .sequence(base)
      .u32(bits)
      .zeros(4 * words)
      .u32(count);
}
inline Body nack_frag(const Ends& ends, std::uint64_t sequence, std::uint64_t base,
                      std::uint64_t bits, std::size_t words, std::uint64_t count) {
  return Body()
      .entity(ends.reader)
      .entity(ends.writer)
      .sequence(sequence)
      .u32(base)
      .u32(bits)
      .zeros(4 * words)
      .u32(count);
}
inline Body heartbeat_frag(const Ends& ends, std::uint64_t sequence, std::uint64_t last,
                           std::uint64_t count) {
  return Body().entity(ends.reader).entity(ends.writer).sequence(sequence).u32(last).u32(count);
}
inline Body info_source(const Prefix& prefix) {
  return Body().u32(0).u8(2).u8(2).u8(1).u8(15).prefix(prefix);
}

// Where fields end: of 8, 16, 32 and 64 bits, signed and not.
inline const std::vector<std::uint64_t>& ends_of_fields() {
  static const std::vector<std::uint64_t> kEnds = [] {
    std::vector<std::uint64_t> ends{0, 1, 2};
    for (const unsigned bits : {7U, 8U, 15U, 16U, 31U, 32U, 40U, 62U, 63U}) {
      const std::uint64_t power = std::uint64_t{1} << bits;
      ends.insert(ends.end(), {power - 1, power, power + 1});
    }
    ends.insert(ends.end(), {~std::uint64_t{0} - 1, ~std::uint64_t{0}});
    return ends;
  }();
  return kEnds;
}

struct Named {
  std::string name;
  Bytes bytes;
};

// One message for each field of each submessage at each of its ends, all other fields as an honest
// sender would have them. `speaker`: whose name it is in. `above`: only ends beyond it.
inline std::vector<Named> hostile_messages(const Prefix& speaker, const Prefix& addressee,
                                           const Ends& of_writer, const Ends& of_reader,
                                           std::uint64_t above = 0) {
  std::vector<Named> all;
  const auto add = [&](const std::string& name, std::uint64_t value, std::uint8_t id,
                       const Body& body, std::uint8_t flags = 0) {
    Message message(speaker);
    message.add(0x0e, Body().prefix(addressee)).add(id, body, flags);
    all.push_back({name + " = " + std::to_string(value), message.bytes()});
  };
  const std::uint64_t newest = of_writer.newest;
  const std::uint64_t next_count = std::uint64_t{of_writer.count} + 1;
  const std::uint64_t next_ack = std::uint64_t{of_reader.count} + 1;
  for (const std::uint64_t end : ends_of_fields()) {
    if (end < above) continue;
    add("GAP start", end, 0x08, gap(of_writer, end, newest + 1));
    add("GAP base", end, 0x08, gap(of_writer, newest, end));
    add("GAP bits", end, 0x08, gap(of_writer, newest, newest, end, 8));
    add("GAP base and bits", end, 0x08, gap(of_writer, newest, end, 256, 8));
    add("HEARTBEAT first", end, 0x07, heartbeat(of_writer, end, newest, next_count));
    add("HEARTBEAT last", end, 0x07, heartbeat(of_writer, 1, end, next_count));
    add("HEARTBEAT both", end, 0x07, heartbeat(of_writer, end, end, next_count));
    add("HEARTBEAT count", end, 0x07, heartbeat(of_writer, 1, newest, end));
    add("HEARTBEAT_FRAG sequence", end, 0x13, heartbeat_frag(of_writer, end, 1, next_count));
    add("HEARTBEAT_FRAG last", end, 0x13, heartbeat_frag(of_writer, newest, end, next_count));
    add("ACKNACK base", end, 0x06, ack_nack(of_reader, end, 0, 0, next_ack));
    add("ACKNACK base with bits", end, 0x06, ack_nack(of_reader, end, 256, 8, next_ack));
    add("ACKNACK bits", end, 0x06, ack_nack(of_reader, 1, end, 8, next_ack));
    add("ACKNACK count", end, 0x06, ack_nack(of_reader, 0, 0, 0, end));
    add("NACK_FRAG sequence", end, 0x12, nack_frag(of_reader, end, 1, 32, 1, next_ack));
    add("NACK_FRAG base", end, 0x12, nack_frag(of_reader, 1, end, 256, 8, next_ack));
    add("NACK_FRAG bits", end, 0x12, nack_frag(of_reader, 1, 1, end, 8, next_ack));
    add("NACK_FRAG count", end, 0x12, nack_frag(of_reader, 1, 1, 32, 1, end));
    add("INFO_TS", end, 0x09, Body().u32(end).u32(end));
    add("INFO_REPLY", end, 0x0f, Body().u32(end).u32(end).u32(end).u32(end).u32(end).u32(end));
    // A sample in a known writer's name is a sample: only those that can't be meant are here.
    constexpr std::uint8_t kHasData = 4;
    if (end == 0 || end > newest + (1U << 20U))
      add("DATA sequence", end, 0x15, data(of_writer, end), kHasData);
    if (end != 16) add("DATA to inline QoS", end, 0x15, data(of_writer, 1, end), kHasData);
    const auto fragment = [&](const char* name, const Fragments& of, std::uint64_t sequence) {
      add(name, end, 0x16, data_frag(of_writer, sequence, of));
    };
    fragment("DATA_FRAG sequence", {}, end <= newest ? 1 : end);
    fragment("DATA_FRAG first", {.first = end}, 1);
    fragment("DATA_FRAG count", {.count = end}, 1);
    fragment("DATA_FRAG size", {.size = end}, 1);
    fragment("DATA_FRAG sample size", {.sample_size = end}, 1);
    fragment("DATA_FRAG to inline QoS", {.to_inline_qos = end}, 1);
    fragment("DATA_FRAG more than it holds", {.count = 2, .sample_size = end}, 1);
  }
  add("INFO_SRC of the addressee", 0, 0x0c, info_source(addressee));
  add("INFO_SRC short", 0, 0x0c, Body().u32(0));
  add("INFO_DST short", 0, 0x0e, Body().u32(0));
  return all;
}

}  // namespace zerodrift::rtps_bytes
