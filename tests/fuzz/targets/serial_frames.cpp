// SPDX-License-Identifier: Apache-2.0
// Input: bytes from a gyro's serial line.
#include <algorithm>

#include "common/drivers/kvh_frame.h"
#include "tests/fuzz/expectations.h"

namespace zerodrift::fuzz {
namespace {

using drivers::kKvhFrameSize;
using drivers::KvhFrame;

// Bytes, because a rotation may be no number and a status has bits that nothing reads.
bool is_read_again(const KvhFrame& frame) {
  const auto bytes = drivers::encode(frame);
  drivers::KvhFrameParser parser;
  std::optional<KvhFrame> again;
  for (const std::uint8_t byte : bytes) again = parser.push(byte);
  return again && drivers::encode(*again) == bytes;
}

}  // namespace

void serial_frames(Bytes input) {
  drivers::KvhFrameParser parser;
  std::uint64_t before = 0;
  for (const std::uint8_t byte : input) {
    const auto frame = parser.push(byte);
    if (!frame) continue;
    const auto& seen = parser.statistics();
    demand(parser.unwrapped_sequence() == seen.frames + seen.frames_missing - 1,
           "the sequence counts frames and missing ones");
    demand(seen.frames == 1 || parser.unwrapped_sequence() > before, "the sequence grows");
    demand(is_read_again(*frame), "a frame that was read is one that a gyro could send");
    before = parser.unwrapped_sequence();
  }
  const auto& seen = parser.statistics();
  const std::uint64_t accounted =
      kKvhFrameSize * (seen.frames + seen.frames_repeated) + seen.bytes_skipped;
  demand(accounted <= input.size() && input.size() - accounted < kKvhFrameSize,
         "each byte is of a frame, skipped, or of the frame that is not complete");
}

}  // namespace zerodrift::fuzz
