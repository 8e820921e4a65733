// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/latency_end.h"

#include <time.h>

#include <atomic>
#include <iostream>
#include <sstream>
#include <vector>

#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
#include "tests/bench/datagram_loss.h"

namespace zerodrift::bench {
namespace {

// Latency of each sequence number. One thread records; others read once it is at rest.
class Receipts {
 public:
  explicit Receipts(std::size_t capacity) : latencies_ns_(capacity + 1) {
    for (auto& latency : latencies_ns_) latency.store(kMissing, std::memory_order_relaxed);
  }
  void record(const Ping& ping, std::int64_t now_ns) {
    if (ping.sequence >= latencies_ns_.size()) return;
    auto& latency = latencies_ns_[ping.sequence];
    if (latency.load(std::memory_order_relaxed) != kMissing) {
      ++duplicates_;
    } else {
      latency.store(now_ns - ping.sent_ns, std::memory_order_release);
    }
  }
  [[nodiscard]] std::string text(std::uint64_t first, std::uint64_t last) const {
    std::ostringstream line;
    line << duplicates_;
    for (std::uint64_t i = first; i <= last && i < latencies_ns_.size(); ++i) {
      line << ' ' << latencies_ns_[i].load(std::memory_order_acquire);
    }
    return line.str();
  }

 private:
  static constexpr std::int64_t kMissing = -1;
  std::vector<std::atomic<std::int64_t>> latencies_ns_;
  std::atomic<std::uint64_t> duplicates_{0};
};

void sleep_until(std::int64_t monotonic_ns) {
  constexpr std::int64_t kSecond = 1000000000;
  const timespec until{monotonic_ns / kSecond, monotonic_ns % kSecond};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) != 0) {
  }
}

class End {
 public:
  explicit End(const LatencyEndOptions& options)
      : receipts_(options.capacity),
        link_(open_link(options.link, [this](const Ping& ping) { on_ping(ping); })) {}

  std::string obey(const std::string& line) {
    std::istringstream words(line);
    std::string command;
    words >> command;
    if (command == "connected") return link_->connected() ? "yes" : "no";
    if (command == "send") {
      double rate_hz = 0.0;
      std::uint64_t count = 0;
      words >> rate_hz >> count;
      return send(rate_hz, count);
    }
    if (command == "answer") {
      std::string verdict;
      words >> verdict;
      answering_ = verdict == "on";
      return "done";
    }
    if (command == "received") {
      std::uint64_t first = 0;
      std::uint64_t last = 0;
      words >> first >> last;
      return receipts_.text(first, last);
    }
    if (command == "lose") {
      unsigned permille = 0;
      words >> permille;
      return std::to_string(lose_datagrams(permille));
    }
    return "unknown command";
  }

 private:
  void on_ping(const Ping& ping) {
    const std::int64_t now_ns = service::monotonic_ns();
    if (answering_) link_->send(ping);
    receipts_.record(ping, now_ns);
  }

  std::string send(double rate_hz, std::uint64_t count) {
    const auto period_ns = static_cast<std::int64_t>(1e9 / rate_hz);
    const std::uint64_t first = next_;
    std::int64_t due_ns = service::monotonic_ns();
    for (std::uint64_t i = 0; i < count; ++i) {
      due_ns += period_ns;
      sleep_until(due_ns);
      link_->send({next_++, service::monotonic_ns(), 1.0 / rate_hz});
    }
    return std::to_string(first) + ' ' + std::to_string(next_ - 1);
  }

  Receipts receipts_;
  std::atomic<bool> answering_{false};
  std::uint64_t next_ = 1;
  std::unique_ptr<LatencyLink> link_;
};

}  // namespace

int run_latency_end(const LatencyEndOptions& options) {
  service::apply(options.realtime);
  End end(options);
  for (std::string line; std::getline(std::cin, line);) {
    std::cout << end.obey(line) << std::endl;
  }
  return service::kExitDone;
}

}  // namespace zerodrift::bench
