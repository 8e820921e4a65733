// SPDX-License-Identifier: Apache-2.0
// What a subscriber saw of one gyro's samples, judged by their sequence numbers.
#pragma once

#include <cstdint>
#include <mutex>
#include <vector>

namespace zerodrift::hosts_test {

struct StreamVerdict {
  std::uint64_t sent = 0;      // sequence numbers judged
  std::uint64_t received = 0;  // of these, each counted once
  std::uint64_t missing = 0;
  std::uint64_t doubled = 0;        // came more than once
  std::uint64_t out_of_order = 0;   // came after a later one
  std::uint64_t longest_gap = 0;    // missing in a row
  double longest_silence_ms = 0.0;  // from one arrival to the next
  // From the sensor's stamp to the arrival.
  double latency_p50_ms = 0.0;
  double latency_p99_ms = 0.0;
  double latency_max_ms = 0.0;
  // How often samples came more than 50 ms later than usual (the median): no repair takes that long
  // on these networks, but a machine that stands still does. Those in a row count once.
  std::uint64_t standstills = 0;
};

// Any thread. Times in ns of one clock that doesn't step.
class SampleStream {
 public:
  void note(std::uint64_t sequence, std::int64_t sensor_ns, std::int64_t arrived_ns);
  // Of sequence numbers first..last. O(n log n).
  [[nodiscard]] StreamVerdict judge(std::uint64_t first, std::uint64_t last) const;
  // 0: nothing came yet.
  [[nodiscard]] std::uint64_t newest() const;
  [[nodiscard]] std::size_t size() const;

 private:
  struct Arrival {
    std::uint64_t sequence = 0;
    std::int64_t sensor_ns = 0;
    std::int64_t arrived_ns = 0;
  };
  mutable std::mutex mutex_;
  std::vector<Arrival> arrivals_;
  std::uint64_t newest_ = 0;
};

}  // namespace zerodrift::hosts_test
