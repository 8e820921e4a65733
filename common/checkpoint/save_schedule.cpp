// SPDX-License-Identifier: Apache-2.0
#include "common/checkpoint/save_schedule.h"

namespace zerodrift::checkpoint {

std::vector<SaveSchedule::Model> SaveSchedule::take_due(std::span<const Model> models,
                                                        std::int64_t now_ns) {
  if (now_ns - round_ns_ >= period_ns_) {
    round_ns_ = now_ns;
    rounds_ += 1;
  }
  std::vector<Model> due;
  for (const Model& model : models) {
    Gyro& gyro = gyros_[model.gyro_id];
    if (gyro.is_being_saved || gyro.round == rounds_ || gyro.saved_epoch == model.epoch) continue;
    gyro.is_being_saved = true;
    gyro.round = rounds_;
    due.push_back(model);
  }
  return due;
}

SaveSchedule::News SaveSchedule::saved(const Model& model) {
  Gyro& gyro = gyros_[model.gyro_id];
  gyro.is_being_saved = false;
  gyro.saved_epoch = model.epoch;
  const bool failed_before = gyro.fails;
  gyro.fails = false;
  return failed_before ? News::kWorksAgain : News::kNone;
}

SaveSchedule::News SaveSchedule::failed(const Model& model) {
  Gyro& gyro = gyros_[model.gyro_id];
  gyro.is_being_saved = false;
  const bool failed_before = gyro.fails;
  gyro.fails = true;
  return failed_before ? News::kNone : News::kFails;
}

void SaveSchedule::put_off(const Model& model) {
  Gyro& gyro = gyros_[model.gyro_id];
  gyro.is_being_saved = false;
  gyro.round = 0;
}

}  // namespace zerodrift::checkpoint
