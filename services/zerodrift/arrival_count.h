// SPDX-License-Identifier: Apache-2.0
// How many samples of a topic never arrived, by the numbers of those that did: the middleware
// numbers each writer's samples from 1 on.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <mutex>

#include "common/dds/topics.h"

namespace zerodrift::services {

// One topic. Any thread.
class ArrivalCount {
 public:
  using Writer = eprosima::fastrtps::rtps::GUID_t;

  // Whoever is first heard from now on, and was not matched before, was expected from its first
  // sample on; of one that was there before nobody knows what it had said.
  void begin() {
    const std::lock_guard lock(mutex_);
    has_begun_ = true;
  }
  void note_matched(const Writer& writer) {
    const std::lock_guard lock(mutex_);
    if (!has_begun_) newest_.try_emplace(writer, kBefore);
  }

  // A sample with its writer's number.
  void note(const Writer& writer, std::uint64_t number) {
    const std::lock_guard lock(mutex_);
    note_locked(writer, number);
  }
  // Of a topic that one writer at a time owns: another one goes on where the one before ended, by
  // the sample's own number, which counts up by one for each gyro.
  void note_answer(std::uint32_t gyro_id, std::uint64_t sequence, const Writer& writer,
                   std::uint64_t number) {
    const std::lock_guard lock(mutex_);
    auto [known, is_new] = answers_.try_emplace(gyro_id);
    Answer& newest = known->second;
    if (is_new || newest.writer == writer) {
      note_locked(writer, number);
    } else {
      count(newest.sequence, sequence);
      newest_[writer] = number;
    }
    newest = {writer, sequence};
  }

  [[nodiscard]] std::uint64_t missing() const noexcept { return missing_; }

 private:
  static constexpr std::uint64_t kBefore = ~std::uint64_t{0};  // its number is not known
  struct Answer {
    Writer writer{};
    std::uint64_t sequence = 0;
  };

  void note_locked(const Writer& writer, std::uint64_t number) {
    auto [known, is_new] = newest_.try_emplace(writer, has_begun_ ? 0 : kBefore);
    count(known->second, number);
    known->second = number;
  }
  // A number that goes back begins anew.
  void count(std::uint64_t before, std::uint64_t number) noexcept {
    if (before != kBefore && number > before) missing_ += number - before - 1;
  }

  std::mutex mutex_;
  bool has_begun_ = false;
  std::atomic<std::uint64_t> missing_{0};
  std::map<Writer, std::uint64_t> newest_;
  std::map<std::uint32_t, Answer> answers_;
};

}  // namespace zerodrift::services
