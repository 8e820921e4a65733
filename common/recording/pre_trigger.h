// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>

#include "common/recording/record_queue.h"

namespace zerodrift::recording {

// Keeps the last seconds until something happens, in so many bytes at most. One thread.
class PreTrigger {
 public:
  PreTrigger(double span_s, std::size_t most_bytes)
      : span_ns_(static_cast<std::int64_t>(1e9 * span_s)), most_bytes_(most_bytes) {}

  void keep(MessageBatch&& batch, std::int64_t now_ns) {
    if (!batch.empty()) {
      bytes_ += batch.bytes();
      batches_.push_back(std::move(batch));
    }
    while (!batches_.empty() && batches_.front().newest_arrival_ns() < now_ns - span_ns_)
      drop_front();
    while (bytes_ > most_bytes_ && batches_.size() > 1) {
      is_shortened_ = true;
      drop_front();
    }
  }

  template <typename Write>
  void give_out(std::int64_t trigger_ns, Write&& write) {
    for (const auto& batch : batches_) {
      std::size_t position = 0;
      for (QueuedMessage message; batch.next(position, message);) {
        if (message.arrival_ns >= trigger_ns - span_ns_) write(message);
      }
    }
    batches_.clear();
    bytes_ = 0;
  }
  // The memory did not suffice for the time that was asked for.
  [[nodiscard]] bool is_shortened() const noexcept { return is_shortened_; }

 private:
  void drop_front() {
    bytes_ -= batches_.front().bytes();
    batches_.pop_front();
  }

  std::int64_t span_ns_;
  std::size_t most_bytes_;
  std::deque<MessageBatch> batches_;
  std::size_t bytes_ = 0;
  bool is_shortened_ = false;
};

}  // namespace zerodrift::recording
