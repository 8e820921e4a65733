// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/learner.h"

#include <algorithm>
#include <cmath>

namespace zerodrift::compensation {

using core::index;
using core::kAxes;

namespace {

constexpr double kScaleInSigmas = 100.0;
constexpr int kSettleRounds = 8;
constexpr double kSmallestScaleRadps =
    1e-10;  // 2e-5 deg/h: keeps a noise-free record from dividing by zero

regression::OnlineSvrOptions svr_options(const CompensationOptions& options,
                                         std::size_t dimension) {
  regression::OnlineSvrOptions svr;
  svr.dimension = dimension;
  svr.capacity = options.model.capacity;
  svr.kernel = options.model.kernel;
  svr.epsilon = options.model.epsilon;
  svr.box_constraint = options.model.box_constraint;
  svr.window = options.model.window;
  svr.recent_capacity = options.model.capacity / 2;
  return svr;
}

}  // namespace

bool AxisModel::within_domain(const FeatureArray& features) const noexcept {
  for (std::size_t i = 0; i < dimension_; ++i) {
    if (features[i] < low_[i] || features[i] > high_[i]) return false;
  }
  return true;
}

double AxisModel::predict(const FeatureArray& features) const noexcept {
  return offset_radps_ + scale_radps_ * predictor_.predict({features.data(), dimension_});
}

AxisLearner::AxisLearner(const CompensationOptions& options, std::size_t dimension)
    : svr_options_(svr_options(options, dimension)),
      initial_labels_(std::max<std::size_t>(1, options.learning.initial_labels)),
      margin_(options.model.domain_margin),
      svr_(svr_options_) {
  initial_.reserve(initial_labels_);
}

void AxisLearner::learn(double drift_radps, double variance_radps2,
                        const FeatureArray& features) noexcept {
  if (started_) return add(drift_radps, features);
  initial_.push_back({drift_radps, variance_radps2, features});
  if (initial_.size() == initial_labels_) begin();
}

void AxisLearner::begin() noexcept {
  double drift = 0.0;
  double variance = 0.0;
  for (const auto& label : initial_) {
    drift += label.drift_radps;
    variance += label.variance_radps2;
  }
  const auto n = static_cast<double>(initial_.size());
  offset_radps_ = drift / n;
  scale_radps_ = std::max(kScaleInSigmas * std::sqrt(variance / n), kSmallestScaleRadps);
  low_ = high_ = initial_.front().features;
  started_ = true;
  for (const auto& label : initial_) add(label.drift_radps, label.features);
}

void AxisLearner::add(double drift_radps, const FeatureArray& features) noexcept {
  const std::span x(features.data(), svr_options_.dimension);
  const double y = (drift_radps - offset_radps_) / scale_radps_;
  // A label in some seconds leaves time to finish what an event budget cut short; the bound keeps
  // one job bounded.
  auto outcome = svr_.add(x, y).outcome;
  for (int round = 0; round < kSettleRounds && !svr_.is_settled(); ++round) svr_.settle();
  if (outcome == regression::UpdateOutcome::kBusy) outcome = svr_.add(x, y).outcome;
  if (outcome == regression::UpdateOutcome::kRefused || outcome == regression::UpdateOutcome::kBusy)
    return;
  for (std::size_t i = 0; i < svr_options_.dimension; ++i) {
    low_[i] = std::min(low_[i], features[i]);
    high_[i] = std::max(high_[i], features[i]);
  }
}

void AxisLearner::write(AxisModel& model) const noexcept {
  model.ready_ = started_;
  model.dimension_ = svr_options_.dimension;
  if (!started_) return;
  model.offset_radps_ = offset_radps_;
  model.scale_radps_ = scale_radps_;
  for (std::size_t i = 0; i < model.dimension_; ++i) {
    model.low_[i] = low_[i] - margin_;
    model.high_[i] = high_[i] + margin_;
  }
  model.predictor_.assign(svr_);
}

void AxisLearner::reset() noexcept {
  started_ = false;
  initial_.clear();
  svr_.clear();
}

ModelExchange::ModelExchange(const CompensationOptions& options) {
  const std::size_t dimension = options.features.size();
  snapshots_.reserve(kSnapshots);
  for (std::size_t i = 0; i < kSnapshots; ++i) {
    const AxisModel model(dimension, options.model.capacity);
    snapshots_.push_back({0, 0, {model, model, model}});
    free_.push(i);
  }
}

bool ModelExchange::delivered(std::uint64_t job) noexcept {
  const std::size_t* slot = ready_.front();
  return slot != nullptr && snapshots_[*slot].job <= job;
}

void ModelExchange::activate_next() noexcept {
  const std::size_t* slot = ready_.front();
  if (slot == nullptr) return;
  if (active_) free_.push(*active_);
  active_ = *slot;
  ready_.pop();
}

ModelSnapshot* ModelExchange::free_snapshot() noexcept {
  const std::size_t* slot = free_.front();
  return slot ? &snapshots_[*slot] : nullptr;
}

void ModelExchange::deliver() noexcept {
  const std::size_t* slot = free_.front();
  if (slot == nullptr) return;
  ready_.push(*slot);
  free_.pop();
}

Learner::Learner(const CompensationOptions& options, ModelExchange& exchange)
    : exchange_(exchange) {
  axes_.reserve(core::kAxisCount);
  for (std::size_t i = 0; i < core::kAxisCount; ++i)
    axes_.emplace_back(options, options.features.size());
}

bool Learner::run_one() noexcept {
  TrainingJob* job = exchange_.next_job();
  if (job == nullptr) return false;
  ModelSnapshot* snapshot = exchange_.free_snapshot();
  if (snapshot == nullptr) return false;
  for (const auto axis : kAxes) {
    AxisLearner& learner = axes_[index(axis)];
    if (job->kind == TrainingJob::Kind::kReset) {
      learner.reset();
    } else if (job->label.valid[index(axis)] && job->label.features_ready[index(axis)]) {
      learner.learn(job->label.drift_radps[index(axis)], job->label.variance_radps2[index(axis)],
                    job->label.features[index(axis)]);
    }
    learner.write(snapshot->axes[index(axis)]);
  }
  snapshot->job = job->number;
  snapshot->epoch = ++epoch_;
  labels_.fetch_add(job->kind == TrainingJob::Kind::kLabel ? 1 : 0, std::memory_order_relaxed);
  exchange_.deliver();
  exchange_.job_done();
  return true;
}

}  // namespace zerodrift::compensation
