// SPDX-License-Identifier: Apache-2.0
// The subscriber of a bench that drives many gyros through the compensation.
#pragma once

#include <time.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <vector>

#include "common/dds/participant.h"
#include "common/service/monotonic_clock.h"

namespace zerodrift::bench {

// Counts what the chain answers, each sample of gyros 1 to `gyros` once. The middleware's thread
// counts, the bench reads between two steps.
class AnswerCounter {
 public:
  // Later than `deadline_ms` after it was published counts as late.
  AnswerCounter(std::uint32_t domain, std::uint32_t gyros, double deadline_ms)
      : newest_(gyros + 1),
        deadline_ns_(static_cast<std::int64_t>(1e6 * deadline_ms)),
        participant_("zerodrift_bench", {.domain = domain, .interfaces = {}, .peers = {}}),
        reader_(participant_, [this](const msg::CompensatedRate& sample, const dds::SampleOrigin&) {
          count(sample);
        }) {}

  struct Counts {
    std::uint64_t received = 0;
    std::uint64_t late = 0;
  };
  [[nodiscard]] Counts counts() const { return {received_.load(), late_.load()}; }
  // Every gyro has been answered at least once.
  [[nodiscard]] bool received_all() const {
    return std::all_of(newest_.begin() + 1, newest_.end(),
                       [](const auto& newest) { return newest.load() > 0; });
  }

 private:
  void count(const msg::CompensatedRate& sample) {
    const std::int64_t now_ns = service::monotonic_ns();
    if (sample.gyro_id() >= newest_.size()) return;
    auto& newest = newest_[sample.gyro_id()];
    if (sample.sequence_number() <= newest.load(std::memory_order_relaxed)) return;
    newest.store(sample.sequence_number(), std::memory_order_relaxed);
    if (now_ns - sample.publish_time_ns() > deadline_ns_) ++late_;
    ++received_;
  }

  std::vector<std::atomic<std::uint64_t>> newest_;  // by gyro
  std::int64_t deadline_ns_;
  std::atomic<std::uint64_t> received_{0};
  std::atomic<std::uint64_t> late_{0};
  dds::Participant participant_;
  dds::Reader<msg::CompensatedRate> reader_;
};

// CPU time of this process so far, s.
inline double own_cpu_s() {
  timespec used{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

}  // namespace zerodrift::bench
