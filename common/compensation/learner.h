// SPDX-License-Identifier: Apache-2.0
// The learner's side: one online SVR an axis, fed with confirmed labels, giving immutable snapshots
// to the data path. Labels go one way and snapshots the other through bounded queues without a
// lock, so that learning never delays a sample. Nothing here starts a thread: the owner calls
// Learner::run_one() wherever it wants learning to happen.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/compensation/label_builder.h"
#include "common/compensation/options.h"
#include "common/core/spsc_queue.h"
#include "common/regression/online_svr.h"
#include "common/regression/svr_predictor.h"

namespace zerodrift::compensation {

// What one axis's model knows, frozen: prediction = offset + scale * svr(features), valid within
// [low, high].
class AxisModel {
 public:
  AxisModel(std::size_t dimension, std::size_t capacity) : predictor_(dimension, capacity) {}

  [[nodiscard]] bool ready() const noexcept { return ready_; }
  [[nodiscard]] bool within_domain(const FeatureArray& features) const noexcept;
  // Drift, rad/s. O(support vectors * dimension).
  [[nodiscard]] double predict(const FeatureArray& features) const noexcept;
  [[nodiscard]] std::size_t support_vectors() const noexcept { return predictor_.support_size(); }

 private:
  friend class AxisLearner;

  bool ready_ = false;
  std::size_t dimension_ = 0;
  double offset_radps_ = 0.0;
  double scale_radps_ = 1.0;
  FeatureArray low_{};
  FeatureArray high_{};
  regression::SvrPredictor predictor_;
};

// Learns one axis.
class AxisLearner {
 public:
  AxisLearner(const CompensationOptions& options, std::size_t dimension);

  // One label; the first `initial_labels` make the initial set, whose level and noise fix offset
  // and scale.
  void learn(double drift_radps, double variance_radps2, const FeatureArray& features) noexcept;
  void write(AxisModel& model) const noexcept;
  void reset() noexcept;

 private:
  struct InitialLabel {
    double drift_radps;
    double variance_radps2;
    FeatureArray features;
  };
  void begin() noexcept;
  void add(double drift_radps, const FeatureArray& features) noexcept;

  regression::OnlineSvrOptions svr_options_;
  std::size_t initial_labels_;
  double margin_;
  std::vector<InitialLabel> initial_;
  regression::OnlineSvr svr_;
  double offset_radps_ = 0.0;
  double scale_radps_ = 1.0;
  FeatureArray low_{};
  FeatureArray high_{};
  bool started_ = false;
};

struct ModelSnapshot {
  std::uint64_t job = 0;  // the training job this answers
  std::uint64_t epoch = 0;
  core::PerAxis<AxisModel> axes;
};

struct TrainingJob {
  enum class Kind : std::uint8_t { kLabel, kReset };
  std::uint64_t number = 0;
  Kind kind = Kind::kLabel;
  Label label;
};

// The two lock-free queues between data path and learner, and the snapshots that travel through
// them. Exactly one data-path thread and one learner thread.
class ModelExchange {
 public:
  explicit ModelExchange(const CompensationOptions& options);

  // --- data path
  // False: the queue is full, the label is skipped.
  bool submit(const TrainingJob& job) noexcept { return jobs_.push(job); }
  // True once the snapshot that answers `job` (or a later one) lies ready.
  [[nodiscard]] bool delivered(std::uint64_t job) noexcept;
  // Makes the oldest ready snapshot the active one.
  void activate_next() noexcept;
  [[nodiscard]] const ModelSnapshot* active() const noexcept {
    return active_ ? &snapshots_[*active_] : nullptr;
  }

  // --- learner
  [[nodiscard]] TrainingJob* next_job() noexcept { return jobs_.front(); }
  void job_done() noexcept { jobs_.pop(); }
  [[nodiscard]] ModelSnapshot* free_snapshot() noexcept;
  void deliver() noexcept;  // hands the free snapshot over

 private:
  static constexpr std::size_t kSnapshots = 4;
  static constexpr std::size_t kJobs = 64;

  std::vector<ModelSnapshot> snapshots_;
  core::SpscQueue<TrainingJob> jobs_{kJobs};
  core::SpscQueue<std::size_t> ready_{kSnapshots};
  core::SpscQueue<std::size_t> free_{kSnapshots};
  std::optional<std::size_t> active_;
};

class Learner {
 public:
  Learner(const CompensationOptions& options, ModelExchange& exchange);

  // Does one job if there is one and a snapshot is free to answer it with. True if it did.
  bool run_one() noexcept;
  [[nodiscard]] std::uint64_t labels_learned() const noexcept {
    return labels_.load(std::memory_order_relaxed);
  }

 private:
  ModelExchange& exchange_;
  std::vector<AxisLearner> axes_;
  std::uint64_t epoch_ = 0;
  std::atomic<std::uint64_t> labels_{0};
};

}  // namespace zerodrift::compensation
