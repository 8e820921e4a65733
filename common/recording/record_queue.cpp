// SPDX-License-Identifier: Apache-2.0
#include "common/recording/record_queue.h"

#include <algorithm>
#include <cstring>
#include <type_traits>
#include <utility>

namespace zerodrift::recording {
namespace {

// What stands before each message's part and payload.
struct Head {
  std::uint32_t topic;
  std::uint32_t gyro_id;
  std::uint64_t sequence;
  std::int64_t log_ns;
  std::int64_t arrival_ns;
  std::int64_t publish_ns;
  MessageRole role;
  std::uint32_t part_bytes;
  std::uint64_t payload_bytes;
};
static_assert(std::is_trivially_copyable_v<Head>);

}  // namespace

void MessageBatch::append(const QueuedMessage& message) {
  const Head head{message.topic,         message.gyro_id,
                  message.sequence,      message.log_ns,
                  message.arrival_ns,    message.publish_ns,
                  message.role,          static_cast<std::uint32_t>(message.part.size()),
                  message.payload.size()};
  char bytes[sizeof head];
  std::memcpy(bytes, &head, sizeof head);
  bytes_.append(bytes, sizeof bytes);
  bytes_.append(message.part);
  bytes_.append(message.payload);
  newest_arrival_ns_ = std::max(newest_arrival_ns_, message.arrival_ns);
}

bool MessageBatch::next(std::size_t& position, QueuedMessage& message) const noexcept {
  if (position == bytes_.size()) return false;
  Head head;
  std::memcpy(&head, bytes_.data() + position, sizeof head);
  position += sizeof head;
  const std::string_view all(bytes_);
  message = {
      .topic = head.topic,
      .gyro_id = head.gyro_id,
      .sequence = head.sequence,
      .log_ns = head.log_ns,
      .arrival_ns = head.arrival_ns,
      .publish_ns = head.publish_ns,
      .role = head.role,
      .part = std::string_view(all.data() + position, head.part_bytes),
      .payload = std::string_view(all.data() + position + head.part_bytes, head.payload_bytes)};
  position += head.part_bytes + head.payload_bytes;
  return true;
}

void MessageBatch::clear() noexcept {
  bytes_.clear();
  newest_arrival_ns_ = 0;
}

void RecordQueue::push(const QueuedMessage& message) {
  const std::size_t size = sizeof(Head) + message.part.size() + message.payload.size();
  bool notify = false;
  {
    const std::lock_guard lock(mutex_);
    const std::size_t before = filling_.bytes();
    if (closed_ || before + size > most_bytes_) {
      if (!closed_ && is_recorded(message.role))
        dropped_[message.topic].fetch_add(1, std::memory_order_relaxed);
      return;
    }
    filling_.append(message);
    if (is_paced(message.role)) ++paced_;
    notify = (before < kWorthWhileBytes && filling_.bytes() >= kWorthWhileBytes) ||
             (is_paced(message.role) && paced_ == kWorthWhilePaced);
    if (filling_.bytes() > peak_bytes()) peak_.store(filling_.bytes(), std::memory_order_relaxed);
  }
  if (notify) worth_while_.notify_one();
}

bool RecordQueue::take(MessageBatch& batch, std::chrono::milliseconds at_most) {
  batch.clear();
  std::unique_lock lock(mutex_);
  worth_while_.wait_for(lock, at_most, [this] {
    return closed_ || filling_.bytes() >= kWorthWhileBytes || paced_ >= kWorthWhilePaced;
  });
  std::swap(batch, filling_);
  paced_ = 0;
  return !(closed_ && batch.empty());
}

void RecordQueue::close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  worth_while_.notify_one();
}

std::uint64_t RecordQueue::dropped() const noexcept {
  std::uint64_t all = 0;
  for (const auto& topic : dropped_) all += topic.load(std::memory_order_relaxed);
  return all;
}

}  // namespace zerodrift::recording
