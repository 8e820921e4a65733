// SPDX-License-Identifier: Apache-2.0
#include "common/dds/receiving_watch.h"

#include <algorithm>

namespace zerodrift::dds {

ReceivingWatch::Passage::Passage(ReceivingWatch& watch, Time now) noexcept {
  const std::int64_t now_ns =
      std::max<std::int64_t>(1, std::chrono::nanoseconds(now.time_since_epoch()).count());
  for (auto& slot : watch.since_ns_) {
    std::int64_t free = kFree;
    if (!slot.compare_exchange_strong(free, now_ns, std::memory_order_acq_rel)) continue;
    slot_ = &slot;
    return;
  }
}

std::optional<std::int64_t> ReceivingWatch::busy_since_ns() const noexcept {
  std::optional<std::int64_t> oldest;
  for (const auto& slot : since_ns_) {
    const std::int64_t since_ns = slot.load(std::memory_order_acquire);
    if (since_ns != kFree && (!oldest || since_ns < *oldest)) oldest = since_ns;
  }
  return oldest;
}

bool StuckCount::look(std::optional<std::int64_t> busy_since_ns) noexcept {
  rounds_ = busy_since_ns && busy_since_ns == seen_ ? rounds_ + 1 : 0;
  seen_ = busy_since_ns;
  return rounds_ >= kRounds;
}

}  // namespace zerodrift::dds
