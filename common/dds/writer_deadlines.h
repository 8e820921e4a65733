// SPDX-License-Identifier: Apache-2.0
// When a reader last received from each writer: what makes a silence, and gives it a name.
#pragma once

#include <fastdds/rtps/common/Guid.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <mutex>
#include <vector>

namespace zerodrift::dds {

// Who sent a sample, of which key, and which of its samples it was: a writer's first is number 1.
struct SampleOrigin {
  eprosima::fastrtps::rtps::GUID_t writer;
  eprosima::fastdds::dds::InstanceHandle_t instance;
  std::uint64_t number = 0;
};

namespace detail {

// Nanoseconds of the host's monotonic clock; never 0.
[[nodiscard]] std::int64_t steady_ns() noexcept;

// When something last came, and how often it was silent for longer than its deadline since that was
// asked. One thread notes, another may ask meanwhile; no lock, no memory.
class DeadlineWatch {
 public:
  // `applies`: whether silence after it is to be reported.
  void note(std::int64_t now_ns, bool applies, std::chrono::nanoseconds deadline) noexcept;
  // Silences of more than the deadline that ended since the last call, and one that lasts and was
  // not counted before.
  [[nodiscard]] std::uint64_t take_silences(std::int64_t now_ns,
                                            std::chrono::nanoseconds deadline) noexcept;
  void forget() noexcept {
    counted_ns_ = 0;
    silences_ = 0;
    at_ns_ = 0;
  }
  [[nodiscard]] bool is_free() const noexcept { return at_ns_ == 0; }

 private:
  std::atomic<std::int64_t> at_ns_{0};       // 0: never
  std::atomic<std::int64_t> counted_ns_{0};  // of the silence after it: counted already
  std::atomic<std::uint64_t> silences_{0};
  std::atomic<bool> applies_{false};
};

// The writers that a reader received from, so that a silence has a name. One thread notes, others
// may ask meanwhile.
class WriterDeadlines {
 public:
  struct Silent {
    eprosima::fastrtps::rtps::GUID_t writer;
    std::uint32_t gyro_id = 0;
    std::uint64_t times = 0;
  };

  // The receiving thread. No memory; a lock only with the first sample of a writer's key; O(1)
  // while one writer writes, else O(kMost). A writer beyond kMost is not kept: it is never silent.
  void note(const SampleOrigin& origin, std::uint32_t gyro_id, bool deadline_applies,
            std::chrono::nanoseconds deadline, std::int64_t now_ns = steady_ns()) noexcept;
  // Who was silent since the last call.
  [[nodiscard]] std::vector<Silent> silent(std::chrono::nanoseconds deadline,
                                           std::int64_t now_ns = steady_ns());
  // A writer is gone: it is never silent, and its place is free.
  void forget(const eprosima::fastrtps::rtps::GUID_t& writer);

 private:
  static constexpr std::size_t kMost = 128;
  struct Watched {
    SampleOrigin origin{};
    std::uint32_t gyro_id = 0;
    DeadlineWatch last{};
  };
  [[nodiscard]] Watched* known(const SampleOrigin& origin) noexcept;
  Watched* take_place(const SampleOrigin& origin, std::uint32_t gyro_id) noexcept;

  std::mutex mutex_;  // a place is taken, looked through or freed
  std::array<Watched, kMost> watched_;
  std::size_t newest_ = 0;  // the receiving thread's
};

}  // namespace detail
}  // namespace zerodrift::dds
