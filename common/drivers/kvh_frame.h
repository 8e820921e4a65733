// SPDX-License-Identifier: Apache-2.0
// The binary "message format A" of KVH fibre-optic gyros and IMUs (DSP-1760, 1725 / 1750 / 1775
// IMU): 36 bytes, most significant byte first.
//
//   byte  0..3   header FE 81 FF 55
//         4..15  rotation x, y, z: float32, rad or deg, angle since the last frame or rate *
//        16..27  acceleration x, y, z: float32, g (no meaning from a DSP-1760)
//        28      status: bits 0..2 rotation x..z valid, bits 4..6 acceleration x..z valid
//        29      sequence number: 0..127, up by one a frame
//        30..31  temperature: int16, °C, 1/100 °C, °F or 1/100 °F *
//        32..35  CRC-32/MPEG-2 of bytes 0..31: polynomial 0x04C11DB7, initial value 0xFFFFFFFF,
//                not reflected, no final xor
//   * as the unit is set up
//
// Source: KVH 1775 IMU user manual 56-0298, tables 5-1, 5-2, 5-8, 5-9. Other messages on the line
// (built-in test results, configuration echoes, formats B and C) are skipped as bytes that belong
// to no frame.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "common/core/axis.h"

namespace zerodrift::drivers {

inline constexpr std::size_t kKvhFrameSize = 36;
inline constexpr unsigned kKvhSequenceModulus = 128;

struct KvhFrame {
  core::PerAxis<float> rotation{};  // in the unit that the gyro is set up for
  core::PerAxis<float> acceleration_g{};
  core::PerAxis<bool> rotation_valid{};
  core::PerAxis<bool> acceleration_valid{};
  std::uint8_t sequence = 0;     // 0..127
  std::int16_t temperature = 0;  // in the unit that the gyro is set up for

  bool operator==(const KvhFrame&) const = default;
};

[[nodiscard]] std::uint32_t crc32_mpeg2(std::span<const std::uint8_t> bytes) noexcept;

// The bytes a gyro would send: for simulated gyros and tests.
[[nodiscard]] std::array<std::uint8_t, kKvhFrameSize> encode(const KvhFrame& frame) noexcept;

// bytes in = kKvhFrameSize * (frames + frames_repeated) + bytes_skipped + bytes of the frame that
// isn't complete yet.
struct KvhLinkStatistics {
  std::uint64_t frames = 0;
  std::uint64_t frames_repeated = 0;  // to the bit the one before, left out: a link doubled it
  std::uint64_t crc_errors = 0;       // a header, and 32 bytes behind it that don't fit the CRC
  std::uint64_t bytes_skipped = 0;    // in no good frame
  // By the sequence numbers; 128 lost in a row look like none (but see ArrivalClock).
  std::uint64_t frames_missing = 0;
};

// Finds frames in a stream of bytes that may begin anywhere and hold noise. After a bad frame the
// search goes on one byte behind its header, so that a good frame that began within it is not lost.
// No allocation.
class KvhFrameParser {
 public:
  // The frame that this byte completes. At most kKvhFrameSize² steps, and only in noise full of
  // headers; else O(1).
  std::optional<KvhFrame> push(std::uint8_t byte) noexcept;

  // Counts up by one a frame sent, missing ones included: of the last frame, from 0 for the first.
  [[nodiscard]] std::uint64_t unwrapped_sequence() const noexcept { return unwrapped_sequence_; }

  [[nodiscard]] const KvhLinkStatistics& statistics() const noexcept { return statistics_; }

 private:
  [[nodiscard]] bool begins_like_a_frame() const noexcept;
  [[nodiscard]] bool crc_fits() const noexcept;
  void drop_first_byte() noexcept;
  void drop_to_next_header() noexcept;
  void count_frame(std::uint8_t sequence) noexcept;

  std::array<std::uint8_t, kKvhFrameSize> window_{};
  std::array<std::uint8_t, kKvhFrameSize> last_{};  // frame; zeros before the first
  std::size_t size_ = 0;                            // window_[0, size_) begins like a frame
  std::optional<std::uint8_t> last_sequence_;
  std::uint64_t unwrapped_sequence_ = 0;
  KvhLinkStatistics statistics_;
};

}  // namespace zerodrift::drivers
