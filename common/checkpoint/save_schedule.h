// SPDX-License-Identifier: Apache-2.0
// When learners are saved without being asked: a model that changed is due once a period, after a
// command at once, and stays due until it was saved. Time is an argument, ns of any clock that only
// grows.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

namespace zerodrift::checkpoint {

class SaveSchedule {
 public:
  // Of a gyro that is to be saved at all.
  struct Model {
    std::uint32_t gyro_id = 0;
    std::uint64_t epoch = 0;
  };
  // What ought to be reported of a save: each trouble once, however often it is tried again.
  enum class News : std::uint8_t { kNone, kFails, kWorksAgain };

  explicit SaveSchedule(std::chrono::nanoseconds period) : period_ns_(period.count()) {}

  // To be saved now. Each counts as being saved until saved(), failed() or put_off().
  [[nodiscard]] std::vector<Model> take_due(std::span<const Model> models, std::int64_t now_ns);

  News saved(const Model& model);
  // It is tried again in the next period: what made it fail lasts, a full disk most of all.
  News failed(const Model& model);
  // Nobody had time for it: due at once.
  void put_off(const Model& model);
  // What was commanded is not undone by a process that ends within the period.
  void commanded(std::uint32_t gyro_id) { gyros_[gyro_id].round = 0; }
  // What a checkpoint that was resumed from holds.
  void resumed(const Model& model) { gyros_[model.gyro_id].saved_epoch = model.epoch; }

 private:
  struct Gyro {
    std::uint64_t saved_epoch = 0;  // 0: nothing was learned, nothing is lost
    std::uint64_t round = 0;        // in which it was taken last; 0: none
    bool is_being_saved = false;
    bool fails = false;
  };

  std::int64_t period_ns_;
  std::int64_t round_ns_ = 0;  // the begin of this round, which lasts a period
  std::uint64_t rounds_ = 1;
  std::map<std::uint32_t, Gyro> gyros_;
};

}  // namespace zerodrift::checkpoint
