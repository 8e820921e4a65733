// SPDX-License-Identifier: Apache-2.0
#include "common/drivers/kvh_frame.h"

#include <algorithm>
#include <bit>
#include <boost/crc.hpp>

namespace zerodrift::drivers {
namespace {

constexpr std::array<std::uint8_t, 4> kHeader{0xFE, 0x81, 0xFF, 0x55};
constexpr std::size_t kRotationAt = 4;
constexpr std::size_t kAccelerationAt = 16;
constexpr std::size_t kStatusAt = 28;
constexpr std::size_t kSequenceAt = 29;
constexpr std::size_t kTemperatureAt = 30;
constexpr std::size_t kCrcAt = 32;
constexpr unsigned kRotationStatusBit = 0;
constexpr unsigned kAccelerationStatusBit = 4;

using Bytes = std::array<std::uint8_t, kKvhFrameSize>;

std::uint32_t load_u32(const Bytes& bytes, std::size_t at) {
  return static_cast<std::uint32_t>(bytes[at]) << 24 |
         static_cast<std::uint32_t>(bytes[at + 1]) << 16 |
         static_cast<std::uint32_t>(bytes[at + 2]) << 8 | static_cast<std::uint32_t>(bytes[at + 3]);
}

void store_u32(Bytes& bytes, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i)
    bytes[at + i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
}

core::PerAxis<float> load_floats(const Bytes& bytes, std::size_t at) {
  core::PerAxis<float> values{};
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = std::bit_cast<float>(load_u32(bytes, at + 4 * i));
  return values;
}

void store_floats(Bytes& bytes, std::size_t at, const core::PerAxis<float>& values) {
  for (std::size_t i = 0; i < values.size(); ++i)
    store_u32(bytes, at + 4 * i, std::bit_cast<std::uint32_t>(values[i]));
}

core::PerAxis<bool> load_status(std::uint8_t status, unsigned first_bit) {
  const unsigned bits = status;
  core::PerAxis<bool> valid{};
  for (unsigned i = 0; i < valid.size(); ++i) valid[i] = (bits >> (first_bit + i) & 1U) != 0;
  return valid;
}

unsigned status_bits(const core::PerAxis<bool>& valid, unsigned first_bit) {
  unsigned bits = 0;
  for (unsigned i = 0; i < valid.size(); ++i) bits |= (valid[i] ? 1U : 0U) << (first_bit + i);
  return bits;
}

KvhFrame decode(const Bytes& bytes) {
  KvhFrame frame;
  frame.rotation = load_floats(bytes, kRotationAt);
  frame.acceleration_g = load_floats(bytes, kAccelerationAt);
  frame.rotation_valid = load_status(bytes[kStatusAt], kRotationStatusBit);
  frame.acceleration_valid = load_status(bytes[kStatusAt], kAccelerationStatusBit);
  frame.sequence = bytes[kSequenceAt] % kKvhSequenceModulus;
  frame.temperature =
      static_cast<std::int16_t>(bytes[kTemperatureAt] << 8 | bytes[kTemperatureAt + 1]);
  return frame;
}

}  // namespace

std::uint32_t crc32_mpeg2(std::span<const std::uint8_t> bytes) noexcept {
  boost::crc_optimal<32, 0x04C11DB7, 0xFFFFFFFF, 0, false, false> crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return crc.checksum();
}

std::array<std::uint8_t, kKvhFrameSize> encode(const KvhFrame& frame) noexcept {
  Bytes bytes{};
  std::copy(kHeader.begin(), kHeader.end(), bytes.begin());
  store_floats(bytes, kRotationAt, frame.rotation);
  store_floats(bytes, kAccelerationAt, frame.acceleration_g);
  bytes[kStatusAt] =
      static_cast<std::uint8_t>(status_bits(frame.rotation_valid, kRotationStatusBit) |
                                status_bits(frame.acceleration_valid, kAccelerationStatusBit));
  bytes[kSequenceAt] = frame.sequence % kKvhSequenceModulus;
  const auto temperature = static_cast<std::uint16_t>(frame.temperature);
  bytes[kTemperatureAt] = static_cast<std::uint8_t>(temperature >> 8);
  bytes[kTemperatureAt + 1] = static_cast<std::uint8_t>(temperature);
  store_u32(bytes, kCrcAt, crc32_mpeg2(std::span{bytes}.first(kCrcAt)));
  return bytes;
}

std::optional<KvhFrame> KvhFrameParser::push(std::uint8_t byte) noexcept {
  window_[size_++] = byte;
  if (!begins_like_a_frame()) drop_to_next_header();
  if (size_ < kKvhFrameSize) return std::nullopt;
  if (!crc_fits()) {
    ++statistics_.crc_errors;
    drop_to_next_header();
    return std::nullopt;
  }
  size_ = 0;
  if (window_ == last_) {
    ++statistics_.frames_repeated;
    return std::nullopt;
  }
  last_ = window_;
  const KvhFrame frame = decode(window_);
  count_frame(frame.sequence);
  return frame;
}

bool KvhFrameParser::begins_like_a_frame() const noexcept {
  return std::equal(kHeader.begin(), kHeader.begin() + std::min(size_, kHeader.size()),
                    window_.begin());
}

bool KvhFrameParser::crc_fits() const noexcept {
  return crc32_mpeg2(std::span{window_}.first(kCrcAt)) == load_u32(window_, kCrcAt);
}

void KvhFrameParser::drop_first_byte() noexcept {
  std::copy(window_.begin() + 1, window_.begin() + static_cast<std::ptrdiff_t>(size_),
            window_.begin());
  --size_;
  ++statistics_.bytes_skipped;
}

void KvhFrameParser::drop_to_next_header() noexcept {
  do {
    drop_first_byte();
  } while (size_ > 0 && !begins_like_a_frame());
}

void KvhFrameParser::count_frame(std::uint8_t sequence) noexcept {
  ++statistics_.frames;
  if (last_sequence_) {
    const unsigned missing =
        (sequence + 2 * kKvhSequenceModulus - *last_sequence_ - 1) % kKvhSequenceModulus;
    statistics_.frames_missing += missing;
    unwrapped_sequence_ += missing + 1;
  }
  last_sequence_ = sequence;
}

}  // namespace zerodrift::drivers
