// SPDX-License-Identifier: Apache-2.0
// The same sample may come from several instances of the compensation. A reader gives it out once.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/core/bounded_table.h"
#include "common/core/first_come.h"
#include "common/dds/topics.h"

namespace zerodrift::dds {

// The run of what a writer writes: one for each writer that ever was, never 0. FNV-1a, 64 bits.
inline std::uint64_t run_of(const eprosima::fastrtps::rtps::GUID_t& writer) noexcept {
  std::uint64_t hash = 0xcbf29ce484222325;
  const auto add = [&hash](std::uint8_t byte) { hash = (hash ^ byte) * 0x100000001b3; };
  for (const auto byte : writer.guidPrefix.value) add(byte);
  for (const auto byte : writer.entityId.value) add(byte);
  return hash == 0 ? 1 : hash;
}

// For readers to whom it matters who wrote: nothing is a repeat.
struct EveryCopy {
  template <typename Message>
  static bool is_repeat(const Message&, const eprosima::fastrtps::rtps::GUID_t&) {
    return false;
  }
};

// So it is with topics whose samples one writer writes.
template <typename Message>
class RepeatFilter : public EveryCopy {};

// A repeat is a sample of the same gyro, run and number (core/first_come.h). Samples that name no
// run are their writer's own. Allocates 5 kB with the first sample of a gyro; of more than
// kMostGyros gyros nothing is a repeat.
template <>
class RepeatFilter<msg::CompensatedRate> {
 public:
  static constexpr std::size_t kMostGyros = 256;  // twice what one compensation answers

  bool is_repeat(const msg::CompensatedRate& message,
                 const eprosima::fastrtps::rtps::GUID_t& writer) {
    auto* gyro = gyros_.find_or_make(message.gyro_id());
    if (gyro == nullptr) return false;
    const std::uint64_t run = message.run_id() != 0 ? message.run_id() : run_of(writer);
    return !gyro->takes(run, message.sequence_number(), writer, message.order() == 0);
  }

 private:
  core::BoundedTable<std::uint32_t, core::FirstCome<eprosima::fastrtps::rtps::GUID_t>> gyros_{
      kMostGyros};
};

}  // namespace zerodrift::dds
