// SPDX-License-Identifier: Apache-2.0
#include "services/thermal_publisher/periodic_reader.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <utility>

#include "common/service/monotonic_clock.h"

namespace zerodrift::services {

PeriodicReader::PeriodicReader(std::string what, std::chrono::nanoseconds period,
                               std::function<void()> read)
    : what_(std::move(what)),
      period_(period),
      read_(std::move(read)),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

std::chrono::nanoseconds PeriodicReader::overdue() const noexcept {
  const std::int64_t began_ns = began_ns_;
  const std::chrono::nanoseconds taken{began_ns == 0 ? 0 : service::monotonic_ns() - began_ns};
  return taken > period_ ? taken : std::chrono::nanoseconds{0};
}

void PeriodicReader::run(const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any stopped;
  auto due = std::chrono::steady_clock::now();
  while (!stop.stop_requested()) {
    began_ns_ = service::monotonic_ns();
    read_();
    began_ns_ = 0;
    due = std::max(due + period_, std::chrono::steady_clock::now());
    std::unique_lock lock(mutex);
    stopped.wait_until(lock, stop, due, [] { return false; });
  }
}

}  // namespace zerodrift::services
