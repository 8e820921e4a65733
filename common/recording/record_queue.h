// SPDX-License-Identifier: Apache-2.0
// Between the middleware's threads, which must never wait for a disk, and the one thread that
// writes.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>

#include "common/dds/topics.h"

namespace zerodrift::recording {

// What else a message is to the recorder.
enum class MessageRole : std::uint32_t {
  kPlain,
  kPaced,      // of a replay or simulation, whose source waits until it was taken
  kPacedOnly,  // of one as well, but not recorded: without its payload
  kTrigger,    // no message: something happened that recordings with a pre-trigger buffer wait for
};

constexpr bool is_paced(MessageRole role) noexcept {
  return role == MessageRole::kPaced || role == MessageRole::kPacedOnly;
}
constexpr bool is_recorded(MessageRole role) noexcept {
  return role == MessageRole::kPlain || role == MessageRole::kPaced;
}

struct QueuedMessage {
  std::uint32_t topic = 0;    // index into dds::kAllTopics
  std::uint32_t gyro_id = 0;  // 0: the message has none
  std::uint64_t sequence = 0;
  std::int64_t log_ns = 0;      // Unix time of arrival: for the file alone, as any clock may be set
  std::int64_t arrival_ns = 0;  // of the monotonic clock
  std::int64_t publish_ns = 0;
  MessageRole role = MessageRole::kPlain;
  std::string_view part{};  // of a gyro: a thermometer's name
  std::string_view payload{};
};

// Messages as they were queued, one behind the other in one piece of memory.
class MessageBatch {
 public:
  void append(const QueuedMessage& message);
  // Takes the message at `position`, from 0 on, and moves behind it; false at the end. The views
  // are valid as long as the batch isn't changed.
  bool next(std::size_t& position, QueuedMessage& message) const noexcept;
  void clear() noexcept;

  [[nodiscard]] bool empty() const noexcept { return bytes_.empty(); }
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_.size(); }
  // Of the monotonic clock.
  [[nodiscard]] std::int64_t newest_arrival_ns() const noexcept { return newest_arrival_ns_; }

 private:
  std::string bytes_;
  std::int64_t newest_arrival_ns_ = 0;
};

class RecordQueue {
 public:
  explicit RecordQueue(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  // Any thread; waits for nobody but another push() and the exchange of two pointers in take().
  // What finds no room is dropped and, where it is to be recorded, counted. Takes memory only until
  // the queue was once as full as it gets.
  void push(const QueuedMessage& message);
  // The writer's: waits until something is worth while, `at_most` at longest; what came meanwhile
  // is in `batch` then. False once the queue is closed and empty.
  bool take(MessageBatch& batch, std::chrono::milliseconds at_most);
  void close();

  [[nodiscard]] std::uint64_t dropped() const noexcept;
  [[nodiscard]] std::uint64_t dropped(std::size_t topic) const noexcept {
    return dropped_[topic].load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::size_t peak_bytes() const noexcept {
    return peak_.load(std::memory_order_relaxed);
  }

 private:
  // Enough for the writer to be notified: a quarter of a chunk, or half of a replay's patience.
  static constexpr std::size_t kWorthWhileBytes = std::size_t{256} << 10U;
  static constexpr std::uint32_t kWorthWhilePaced = 64;

  std::size_t most_bytes_;
  std::mutex mutex_;
  std::condition_variable worth_while_;
  MessageBatch filling_;
  std::uint32_t paced_ = 0;
  bool closed_ = false;
  std::array<std::atomic<std::uint64_t>, dds::kAllTopics.size()> dropped_{};
  std::atomic<std::size_t> peak_{0};
};

}  // namespace zerodrift::recording
