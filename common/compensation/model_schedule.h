// SPDX-License-Identifier: Apache-2.0
// Which learned model is in force when: jobs go to the learner in order, and what each gives takes
// effect at its due sensor time, however fast the learner was. That is what makes equal inputs give
// equal outputs to the bit.
//
// The data path's thread, but for learner(); noexcept, no allocation, O(1).
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>

#include "common/compensation/drift_prior.h"
#include "common/compensation/learner.h"
#include "common/compensation/options.h"
#include "common/core/ring_buffer.h"

namespace zerodrift::compensation {

// Another prior and a learner of what it leaves, on their way into force. Afterwards it holds those
// that were in force before: given again, it brings them back as they were.
struct PriorChange {
  // `model` may be nothing: no prior. `options` are the compensator's. Throws std::invalid_argument
  // with one line where the model can't be a prior or reads a probe that options.probes() doesn't
  // name.
  PriorChange(const CompensationOptions& options, const std::optional<twin::Model>& model);

  std::unique_ptr<DriftPrior> prior;         // the data path's, from giving it to in_force
  std::shared_ptr<RestoredLearner> learner;  // installed_as is the model epoch
  std::uint64_t stream = 0;                  // in which `prior` was stepped last
  std::atomic<bool> in_force{false};
};

class ModelSchedule {
 public:
  explicit ModelSchedule(const CompensationOptions& options);

  // Gives the learner a job, which it numbers; the model that comes of it is due at `due`, kNever:
  // at once, with `change` if there is one. False: a queue is full, and nothing was done.
  bool submit(TrainingJob job, core::SensorTime due,
              std::shared_ptr<PriorChange> change = {}) noexcept;
  // A model is due by then that the learner hasn't delivered.
  [[nodiscard]] bool is_awaited(core::SensorTime now) noexcept;

  // At most one model a sample comes into force, even if several are due: the learner can't have
  // more than three ready.
  struct Step {
    bool in_force = false;  // another model is
    bool is_late = false;   // it is due and not delivered; said once of each
    std::shared_ptr<PriorChange> change{};
  };
  Step step(core::SensorTime now) noexcept;
  // As step(), but of the next model, due or not, and the learner runs on this thread where it has
  // to. Nothing where none is left, or where the learner has nothing to do.
  std::optional<Step> finish_next() noexcept;
  // Sensor time began anew: what is due is due at once.
  void forget_time() noexcept;

  [[nodiscard]] const ModelSnapshot* active() const noexcept { return exchange_.active(); }
  [[nodiscard]] std::uint64_t epoch() const noexcept { return active() ? active()->epoch : 0; }
  [[nodiscard]] bool is_quiescent() const noexcept { return due_.empty(); }
  [[nodiscard]] std::uint64_t newest_job() const noexcept { return jobs_; }
  // Sensor time by which the model due first is late; 0 where none is.
  [[nodiscard]] core::SensorTime late_by(core::SensorTime now) noexcept;
  [[nodiscard]] Learner& learner() noexcept { return learner_; }

 private:
  struct DueModel {
    core::SensorTime time{0};
    std::uint64_t job = 0;
    bool reported_late = false;
    std::shared_ptr<PriorChange> change{};
  };
  Step activate_next() noexcept;

  ModelExchange exchange_;
  Learner learner_;
  core::RingBuffer<DueModel> due_;
  std::uint64_t jobs_ = 0;
};

}  // namespace zerodrift::compensation
