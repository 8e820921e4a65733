// SPDX-License-Identifier: Apache-2.0
// What an instance of the compensation wrote just before it fell silent is written again by the one
// that takes over. A reader gives each such sample out once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>

#include "common/dds/topics.h"

namespace zerodrift::dds {

// For topics that one writer at a time writes: nothing is a repeat.
template <typename Message>
class RepeatFilter {
 public:
  bool is_repeat(const Message&, const eprosima::fastrtps::rtps::GUID_t&) { return false; }
};

// A repeat is the same sample of the same gyro, by sequence number and sensor time, from another
// writer than before. 2048 samples are remembered, a second at 2 kHz. Allocates with the first
// sample of a gyro.
template <>
class RepeatFilter<msg::CompensatedRate> {
 public:
  bool is_repeat(const msg::CompensatedRate& message,
                 const eprosima::fastrtps::rtps::GUID_t& writer) {
    Entry& entry = gyros_[message.gyro_id()][message.sequence_number() % kSpan];
    if (entry.used && entry.sequence == message.sequence_number() &&
        entry.sensor_time_ns == message.sensor_time_ns() && entry.writer != writer) {
      return true;
    }
    entry = {message.sequence_number(), message.sensor_time_ns(), writer, true};
    return false;
  }

 private:
  static constexpr std::size_t kSpan = 2048;
  struct Entry {
    std::uint64_t sequence = 0;
    std::int64_t sensor_time_ns = 0;
    eprosima::fastrtps::rtps::GUID_t writer{};
    bool used = false;
  };
  std::map<std::uint32_t, std::array<Entry, kSpan>> gyros_;
};

}  // namespace zerodrift::dds
