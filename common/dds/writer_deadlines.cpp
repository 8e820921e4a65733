// SPDX-License-Identifier: Apache-2.0
#include "common/dds/writer_deadlines.h"

#include <algorithm>

namespace zerodrift::dds::detail {

std::int64_t steady_ns() noexcept {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

void DeadlineWatch::note(std::int64_t now_ns, bool applies,
                         std::chrono::nanoseconds deadline) noexcept {
  const std::int64_t before = at_ns_.load(std::memory_order_relaxed);
  if (before != 0 && now_ns - before > deadline.count() &&
      applies_.load(std::memory_order_relaxed) &&
      counted_ns_.load(std::memory_order_relaxed) != before) {
    silences_.fetch_add(1, std::memory_order_relaxed);
  }
  applies_.store(applies, std::memory_order_relaxed);
  at_ns_.store(now_ns, std::memory_order_release);
}

std::uint64_t DeadlineWatch::take_silences(std::int64_t now_ns,
                                           std::chrono::nanoseconds deadline) noexcept {
  const std::int64_t last = at_ns_.load(std::memory_order_acquire);
  std::uint64_t taken = silences_.exchange(0, std::memory_order_relaxed);
  const bool lasts = last != 0 && now_ns - last > deadline.count() &&
                     applies_.load(std::memory_order_relaxed) &&
                     counted_ns_.load(std::memory_order_relaxed) != last;
  if (lasts) {
    counted_ns_.store(last, std::memory_order_relaxed);
    ++taken;
  }
  return taken;
}

WriterDeadlines::Watched* WriterDeadlines::known(const SampleOrigin& origin) noexcept {
  const auto is_of = [&](const Watched& watched) {
    return !watched.last.is_free() && watched.origin.writer == origin.writer &&
           watched.origin.instance == origin.instance;
  };
  if (is_of(watched_[newest_])) return &watched_[newest_];
  const auto found = std::find_if(watched_.begin(), watched_.end(), is_of);
  if (found == watched_.end()) return nullptr;
  newest_ = static_cast<std::size_t>(found - watched_.begin());
  return &*found;
}

WriterDeadlines::Watched* WriterDeadlines::take_place(const SampleOrigin& origin,
                                                      std::uint32_t gyro_id) noexcept {
  const std::lock_guard lock(mutex_);
  const auto free = std::find_if(watched_.begin(), watched_.end(),
                                 [](const Watched& h) { return h.last.is_free(); });
  if (free == watched_.end()) return nullptr;
  free->origin = origin;
  free->gyro_id = gyro_id;
  newest_ = static_cast<std::size_t>(free - watched_.begin());
  return &*free;
}

void WriterDeadlines::note(const SampleOrigin& origin, std::uint32_t gyro_id, bool deadline_applies,
                           std::chrono::nanoseconds deadline, std::int64_t now_ns) noexcept {
  Watched* watched = known(origin);
  if (watched == nullptr) watched = take_place(origin, gyro_id);
  if (watched != nullptr) watched->last.note(now_ns, deadline_applies, deadline);
}

std::vector<WriterDeadlines::Silent> WriterDeadlines::silent(std::chrono::nanoseconds deadline,
                                                             std::int64_t now_ns) {
  std::vector<Silent> all;
  const std::lock_guard lock(mutex_);
  for (Watched& watched : watched_) {
    if (watched.last.is_free()) continue;
    const std::uint64_t times = watched.last.take_silences(now_ns, deadline);
    if (times > 0) all.push_back({watched.origin.writer, watched.gyro_id, times});
  }
  return all;
}

void WriterDeadlines::forget(const eprosima::fastrtps::rtps::GUID_t& writer) {
  const std::lock_guard lock(mutex_);
  for (Watched& watched : watched_) {
    if (!watched.last.is_free() && watched.origin.writer == writer) watched.last.forget();
  }
}

}  // namespace zerodrift::dds::detail
