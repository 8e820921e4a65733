// SPDX-License-Identifier: Apache-2.0
// How many samples of a topic never arrived, by the numbers of those that did: the middleware
// numbers each writer's samples from 1 on.
#pragma once

#include <algorithm>
#include <cstdint>
#include <mutex>

#include "common/core/bounded_table.h"
#include "common/dds/topics.h"

namespace zerodrift::recording {

inline constexpr const char* kDidNotArrive =
    "messages did not arrive; a replay keeps pace with `--wait-for recorder`";

// One topic. Any thread.
class ArrivalCount {
 public:
  using Writer = eprosima::fastrtps::rtps::GUID_t;

  // Whoever first writes from now on, and was not matched before, was expected from its first
  // sample on; of one that was there before nobody knows what it had said.
  void begin() {
    const std::lock_guard lock(mutex_);
    has_begun_ = true;
  }
  void note_matched(const Writer& writer) {
    const std::lock_guard lock(mutex_);
    if (!has_begun_) newest_.find_or_make(writer, kBefore);
  }

  // A sample with its writer's number.
  void note(const Writer& writer, std::uint64_t number) {
    const std::lock_guard lock(mutex_);
    note_locked(writer, number);
  }
  struct Answer {
    std::uint32_t gyro_id = 0;
    std::uint64_t run_id = 0;
    std::uint64_t sequence = 0;
    bool is_repeat = false;  // another writer's copy came before
  };
  // Of a topic that several instances write, each all samples: what one's reader did not get it may
  // have of another. The samples' own numbers count up by one in a run.
  void note_answer(const Writer& writer, std::uint64_t number, const Answer& answer) {
    const std::lock_guard lock(mutex_);
    const std::uint64_t unreceived = note_locked(writer, number);
    if (answer.is_repeat) return;
    Run* known = runs_.find_or_make(answer.gyro_id);
    if (known == nullptr) return;
    Run& run = *known;
    if (run.count == 0 || run.id != answer.run_id) {
      // What its writer had said before is of this run, too.
      run = {answer.run_id, answer.sequence - std::min(unreceived, answer.sequence),
             answer.sequence, 0, run.holes()};
    }
    run.first = std::min(run.first, answer.sequence);
    run.newest = std::max(run.newest, answer.sequence);
    ++run.count;
  }

  // Nothing of a sensor's own gaps: those no writer numbered.
  [[nodiscard]] std::uint64_t missing() const {
    const std::lock_guard lock(mutex_);
    if (runs_.entries().empty()) return unreceived_;  // no topic of answers
    std::uint64_t holes = 0;
    for (const auto& [gyro_id, run] : runs_.entries()) holes += run.holes();
    return std::min(unreceived_, holes);
  }
  // Of the answers for one gyro.
  [[nodiscard]] std::uint64_t missing_of(std::uint32_t gyro_id) const {
    const std::lock_guard lock(mutex_);
    const auto run = runs_.entries().find(gyro_id);
    return run == runs_.entries().end() ? 0 : std::min(unreceived_, run->second.holes());
  }

 private:
  static constexpr std::uint64_t kBefore = ~std::uint64_t{0};  // its number is not known
  struct Run {
    std::uint64_t id = 0;
    std::uint64_t first = 0;
    std::uint64_t newest = 0;
    std::uint64_t count = 0;
    std::uint64_t holes_before = 0;  // in runs of this gyro that are over
    [[nodiscard]] std::uint64_t holes() const noexcept {
      const std::uint64_t span = count == 0 ? 0 : newest - first + 1;
      return holes_before + (span > count ? span - count : 0);
    }
  };

  // How many numbers were skipped. One that goes back begins anew.
  std::uint64_t note_locked(const Writer& writer, std::uint64_t number) {
    std::uint64_t* newest = newest_.find_or_make(writer, has_begun_ ? 0 : kBefore);
    if (newest == nullptr) return 0;
    const bool skips = *newest != kBefore && number > *newest;
    const std::uint64_t skipped = skips ? number - *newest - 1 : 0;
    *newest = number;
    unreceived_ += skipped;
    return skipped;
  }

  mutable std::mutex mutex_;
  bool has_begun_ = false;
  std::uint64_t unreceived_ = 0;                              // by the writers' numbers
  core::BoundedTable<Writer, std::uint64_t> newest_{65'536};  // 5 MB; of more nothing is missed
  core::BoundedTable<std::uint32_t, Run> runs_{4096};
};

}  // namespace zerodrift::recording
