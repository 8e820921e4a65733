// SPDX-License-Identifier: Apache-2.0
// The learner's side: one online SVR an axis, with the stack as the scheme one expert of several,
// fed with confirmed labels, giving immutable snapshots to the data path. Labels go one way and
// snapshots the other through bounded queues without a lock, so that learning never delays a
// sample. Nothing here starts a thread: the owner calls Learner::run_one() wherever it wants
// learning to happen.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/compensation/axis_model.h"
#include "common/compensation/axis_stack.h"
#include "common/compensation/drift_forecast.h"
#include "common/compensation/label_builder.h"
#include "common/compensation/options.h"
#include "common/compensation/temperature_inputs.h"
#include "common/compensation/thermal_coverage.h"
#include "common/core/ring_buffer.h"
#include "common/core/spsc_queue.h"
#include "common/core/state_archive.h"
#include "common/regression/online_svr.h"

namespace zerodrift::compensation {

// What an axis has chosen for itself. It means the same to every later version: scaled features in
// their units^-2, half-width of the tube in units of the scaled targets.
struct ChosenKernel {
  regression::Kernel kernel{};
  double epsilon = 0.0;
};

// Learns one axis.
class AxisLearner {
 public:
  AxisLearner(const CompensationOptions& options, std::size_t dimension);

  // One label; takes milliseconds and allocates when it is time to choose the kernel anew, else
  // microseconds. Without features (a temperature is missing) the held level and the experts in
  // time learn alone. The first `initial_labels` with features make the initial set, whose level
  // and noise fix the SVR's offset and scale.
  void learn(const AxisLabel& label) noexcept;
  void write(AxisModel& model) const noexcept;
  void reset() noexcept;

  [[nodiscard]] ChosenKernel kernel() const noexcept {
    return {svr_.options().kernel, svr_.options().epsilon};
  }
  // Of one that knows nothing yet. Throws std::invalid_argument with one line for a kernel that is
  // none, or that the options don't leave to be chosen.
  void choose(const ChosenKernel& chosen);
  // All else that it knows (core/state_archive.h): one that has read it continues to the bit.
  void carry(core::StateArchive& archive);

  // The gyro was off since, for as long as nobody knows: until its next label, from which the bias
  // is learned anew, that label counts as of unknown age (drift_forecast.h).
  void forget_age() noexcept;

 private:
  // A label of the last stationary minute, and where the SVR keeps it.
  struct HeldLabel {
    AxisLabel label{};
    std::size_t slot = regression::SampleWindow::kNoSlot;
    std::uint64_t arrival = 0;

    void carry(core::StateArchive& archive) { archive(label, slot, arrival); }
  };

  void require_sense(core::StateArchive& archive) const;
  void begin() noexcept;
  std::size_t add(const AxisLabel& label) noexcept;
  void hold(const AxisLabel& label, std::size_t slot) noexcept;
  [[nodiscard]] double fitted(const HeldLabel& held) const noexcept;
  void update_model() noexcept;
  void note_unsettled() noexcept;
  [[nodiscard]] std::optional<experts::ThermalState> held_thermal() const noexcept;
  void reselect_kernel();

  regression::OnlineSvrOptions svr_options_;
  std::size_t initial_labels_;
  double settling_labels_;  // that a mean of the last stationary minute is of, once there is one
  std::optional<regression::SelectionCriterion> selection_;
  std::vector<AxisLabel> initial_;
  regression::OnlineSvr svr_;
  std::uint64_t labels_ = 0;          // the SVR has learned
  std::uint64_t next_selection_ = 0;  // at so many
  core::RingBuffer<HeldLabel> minute_;
  DriftModel model_;
  ForecastJudge judge_;
  std::optional<AxisStack> stack_;       // where it is the scheme
  std::optional<ThermalScales> scales_;  // where there is a thermometer
  ThermalCoverage coverage_;
};

// The layout of LearnerState::bytes; another number for every change of what a learner carries.
inline constexpr std::uint32_t kLearnerLayout = 9;

// What a learner knows: what a checkpoint holds. What follows from the options alone is not in it.
struct LearnerState {
  std::uint64_t epoch = 0;
  core::PerAxis<ChosenKernel> kernels{};
  std::string bytes{};   // all else, of kLearnerLayout; empty: only the kernels are known
  bool is_whole = true;  // false: with numbers that no learner begins with, which is a fault
  std::string boot{};    // of the computer it was saved by; empty: not said
  std::int64_t saved_unix_s = 0;  // by that computer's clock; 0: not said
};

struct ModelSnapshot {
  std::uint64_t job = 0;  // the training job this answers
  std::uint64_t epoch = 0;
  core::PerAxis<AxisModel> axes;
};

// What a saved learner knew, on its way into a learner by a job of kind kRestore or kExchange.
// Afterwards it holds what that one knew before.
struct RestoredLearner {
  static constexpr std::uint64_t kNotYet = std::numeric_limits<std::uint64_t>::max();

  // Throws std::invalid_argument with one line where the state can't belong to the options.
  RestoredLearner(const CompensationOptions& options, const LearnerState& state);
  // One that knows nothing.
  explicit RestoredLearner(const CompensationOptions& options);

  // The gyro was off since this was saved (AxisLearner::forget_age).
  void forget_age() noexcept {
    for (AxisLearner& axis : axes) axis.forget_age();
    is_of_unknown_age = true;
  }

  std::vector<AxisLearner> axes;
  core::PerAxis<bool> exchanged{true, true, true};  // by kExchange; the others learn on
  bool is_of_unknown_age = false;
  std::int64_t saved_unix_s = 0;  // as LearnerState
  std::uint64_t epoch = 0;
  std::uint64_t labels = 0;
  std::atomic<std::uint64_t> installed_as{kNotYet};  // model epoch, for whoever gave it
};

struct TrainingJob {
  // kExchange: as kRestore, but the epoch is always a new one, the count of labels goes on, and
  // axes may be left as they are.
  enum class Kind : std::uint8_t { kLabel, kReset, kRestore, kExchange };
  std::uint64_t number = 0;
  Kind kind = Kind::kLabel;
  Label label;
  std::shared_ptr<RestoredLearner> restored{};  // kRestore, kExchange; shared with whoever gave it
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
  // All it knows after its newest job, and that job's number. The learner's thread; allocates.
  [[nodiscard]] LearnerState export_state();
  [[nodiscard]] std::uint64_t newest_job() const noexcept { return job_; }

 private:
  [[nodiscard]] std::uint64_t install(RestoredLearner& restored) noexcept;
  [[nodiscard]] std::uint64_t trade(RestoredLearner& other) noexcept;

  ModelExchange& exchange_;
  std::vector<AxisLearner> axes_;
  std::uint64_t epoch_ = 0;
  std::uint64_t job_ = 0;
  std::atomic<std::uint64_t> labels_{0};
};

}  // namespace zerodrift::compensation
