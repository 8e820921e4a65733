// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/model_schedule.h"

#include <utility>

namespace zerodrift::compensation {
namespace {

constexpr std::size_t kDue = 64;

}  // namespace

PriorChange::PriorChange(const CompensationOptions& options,
                         const std::optional<twin::Model>& model)
    : learner(std::make_shared<RestoredLearner>(options)) {
  if (model) prior = std::make_unique<DriftPrior>(*model, options.probes());
}

ModelSchedule::ModelSchedule(const CompensationOptions& options)
    : exchange_(options), learner_(options, exchange_), due_(kDue) {}

bool ModelSchedule::submit(TrainingJob job, core::SensorTime due,
                           std::shared_ptr<PriorChange> change) noexcept {
  job.number = jobs_ + 1;
  if (due_.full() || !exchange_.submit(job)) return false;
  ++jobs_;
  due_.push({.time = due, .job = jobs_, .change = std::move(change)});
  return true;
}

bool ModelSchedule::is_awaited(core::SensorTime now) noexcept {
  return !due_.empty() && due_.front().time <= now && !exchange_.delivered(due_.front().job);
}

ModelSchedule::Step ModelSchedule::step(core::SensorTime now) noexcept {
  if (due_.empty() || due_.front().time > now) return {};
  if (exchange_.delivered(due_.front().job)) return activate_next();
  Step late{.is_late = !due_.front().reported_late};
  due_.front().reported_late = true;
  return late;
}

std::optional<ModelSchedule::Step> ModelSchedule::finish_next() noexcept {
  if (due_.empty()) return std::nullopt;
  if (!exchange_.delivered(due_.front().job) && !learner_.run_one()) return std::nullopt;
  return activate_next();
}

ModelSchedule::Step ModelSchedule::activate_next() noexcept {
  exchange_.activate_next();
  // Moved out: the queue keeps what was popped, and nothing may live on in it.
  Step step{.in_force = true, .change = std::move(due_.front().change)};
  due_.pop();
  return step;
}

void ModelSchedule::forget_time() noexcept {
  for (std::size_t i = 0; i < due_.size(); ++i) due_[i].time = core::kNever;
}

core::SensorTime ModelSchedule::late_by(core::SensorTime now) noexcept {
  if (due_.empty() || due_.front().time == core::kNever || now <= due_.front().time ||
      exchange_.delivered(due_.front().job)) {
    return core::SensorTime{0};
  }
  return now - due_.front().time;
}

}  // namespace zerodrift::compensation
