// SPDX-License-Identifier: Apache-2.0
// Stands in for the compensator's arithmetic: each answer is a hash of every input before it, so
// that an input that is lost, doubled or out of order shows in all answers from there on.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>

#include "common/compensation/compensator.h"
#include "common/core/samples.h"

namespace zerodrift::simulation {

constexpr std::uint64_t mixed(std::uint64_t hash, std::uint64_t value) noexcept {
  hash = (hash ^ value) * 0x9e3779b97f4a7c15;
  return hash ^ (hash >> 29U);
}

struct HashAnswer {
  struct Raw {
    std::uint64_t sequence = 0;
    core::ClockSource clock = core::ClockSource::kHardware;
  } raw{};
  bool late = false;  // its number is far ahead of the others
  std::uint64_t model_epoch = 0;
  std::uint64_t digest = 0;
};

class HashEngine {
 public:
  struct Counts {
    std::uint64_t labels = 0;
    std::uint64_t samples_out = 0;
  };
  struct NoLearner {
    static bool run_one() { return false; }
  };

  compensation::Admission push(const core::AngularRateSample& sample, std::int64_t = 0,
                               std::int64_t = 0) {
    if (sample.sequence <= newest_) return compensation::Admission::kDuplicate;
    waiting_.push_back(sample);
    return compensation::Admission::kInOrder;
  }
  void push(const core::TemperatureSample& sample) {
    temperatures_.push_back({sample.sequence, sample.time});
    received_ = std::max(received_, sample.sequence);
  }
  void push(const core::RateReferenceSample&) {}
  [[nodiscard]] compensation::Readiness readiness() const {
    return waiting_.empty() ? compensation::Readiness::kNothing : compensation::Readiness::kReady;
  }
  [[nodiscard]] core::ClockSource waiting_clock() const { return waiting_.front().clock; }
  [[nodiscard]] core::SensorTime needed_time() const { return core::SensorTime{0}; }
  HashAnswer answer_next() {
    const core::AngularRateSample sample = waiting_.front();
    waiting_.pop_front();
    while (!temperatures_.empty() && temperatures_.front().time <= sample.time - kDelay) {
      hash_ = mixed(hash_, ~temperatures_.front().sequence);
      temperatures_.pop_front();
    }
    const bool late = newest_ != 0 && sample.sequence > newest_ + kFarAhead;
    if (!late) newest_ = sample.sequence;
    hash_ = mixed(hash_, sample.sequence);
    ++counts_.samples_out;
    return {.raw = {sample.sequence, sample.clock}, .late = late, .digest = hash_};
  }
  void restart_stream() {
    newest_ = 0;
    hash_ = mixed(hash_, 1);
  }
  [[nodiscard]] bool has_received(const core::TemperatureSample& sample) const {
    return sample.sequence <= received_;
  }
  [[nodiscard]] bool has_received(const core::RateReferenceSample&) const { return true; }
  [[nodiscard]] Counts counts() const { return counts_; }
  static NoLearner& learner() {
    static NoLearner none;
    return none;
  }

 private:
  static constexpr core::SensorTime kDelay{50'000'000};
  static constexpr std::uint64_t kFarAhead = 1'000'000;
  struct Temperature {
    std::uint64_t sequence;
    core::SensorTime time;
  };
  std::deque<core::AngularRateSample> waiting_{};
  std::deque<Temperature> temperatures_{};
  std::uint64_t received_ = 0;
  std::uint64_t newest_ = 0;
  std::uint64_t hash_ = 0;
  Counts counts_{};
};

}  // namespace zerodrift::simulation
