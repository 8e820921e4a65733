// SPDX-License-Identifier: Apache-2.0
// The drift that is taken off one axis: of the ladder's rungs the best one that has an estimate,
// stack or online SVR > stationary bias > prior > factory polynomial > nothing. Without a
// temperature the stack is of those experts that need none. With a prior, what a learner knows is
// the remainder, and the prior's value is added to it.
//
// noexcept, no allocation, O(samples * dimension) an estimate once the online SVR is trained, else
// O(terms).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/compensation/axis_model.h"
#include "common/compensation/label_builder.h"
#include "common/compensation/options.h"
#include "common/core/compensated_sample.h"
#include "common/core/state_archive.h"

namespace zerodrift::compensation {

// What the statistics of the labels say of an estimate, test-then-train: each label was predicted
// by what was in force while it was measured, from labels at least confirm + handover seconds
// older.
struct TestThenTrain {
  std::uint64_t labels = 0;
  double applied_mse = 0.0;  // (rad/s)², exponential mean over about 12 labels
  double held_mse = 0.0;     // of holding the last stationary minute, on the same labels

  void carry(core::StateArchive& archive) { archive(labels, applied_mse, held_mse); }
};

// What an estimate of one axis is made of. The pointers are the caller's, for the call.
struct AxisInputs {
  core::SensorTime now{0};
  const AxisModel* model = nullptr;  // null: no label was learned yet
  const FeatureArray* features = nullptr;
  const experts::ThermalState* thermal = nullptr;
  core::Reason gate = core::Reason::kNone;   // why nothing is learned now
  core::Reason input = core::Reason::kNone;  // what is wrong with the temperatures or the prior
  bool prior_covers = false;                 // the axis, with a value or without
  std::optional<double> factory_radps{};     // of the factory polynomial
};

class AxisDrift {
 public:
  void estimate(Scheme scheme, const AxisInputs& inputs) noexcept;
  // The prior's value before an estimate; nothing where it has none.
  void note_prior(std::optional<double> drift_radps) noexcept;
  // The prior's value between estimates: what is applied goes with it, the remainder stays. False:
  // the value came or went, and another estimate is wanted.
  bool follow_prior(std::optional<double> drift_radps) noexcept;
  // A label of this axis judges what was predicted for its time before it was known.
  void judge(double label_radps, std::optional<double> applied_radps,
             std::optional<double> held_radps) noexcept;

  void forget_record() noexcept { record_ = {}; }
  // Time begins anew: what was last safe is of no known age.
  void forget_time() noexcept { safe_time_ = core::kNever; }

  [[nodiscard]] const AxisContext& context() const noexcept { return context_; }
  [[nodiscard]] const TestThenTrain& record() const noexcept { return record_; }
  [[nodiscard]] double applied_radps() const noexcept { return applied_radps_; }
  [[nodiscard]] double variance() const noexcept { return variance_; }  // (rad/s)²; < 0: unknown
  [[nodiscard]] core::Mode mode() const noexcept { return mode_; }
  [[nodiscard]] core::Reason reason() const noexcept { return reason_; }
  [[nodiscard]] core::Rung rung() const noexcept { return rung_; }

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) {
    archive(context_, safe_radps_, safe_time_, record_, applied_radps_, variance_, mode_, reason_,
            rung_, on_prior_, adds_prior_, remainder_radps_);
    archive.require(static_cast<std::size_t>(mode_) < core::kModes &&
                    static_cast<std::size_t>(reason_) < core::kReasons &&
                    static_cast<std::size_t>(rung_) < core::kRungs);
  }

 private:
  void apply_forecast(Scheme scheme, const AxisInputs& inputs) noexcept;
  void apply_without_labels(const AxisInputs& inputs) noexcept;
  void apply(core::Rung rung, core::Mode mode, core::Reason reason, double drift_radps,
             double variance) noexcept;

  AxisContext context_{};
  std::optional<double> safe_radps_{};  // last estimate within the domain
  core::SensorTime safe_time_{core::kNever};
  TestThenTrain record_{};
  double applied_radps_ = 0.0;
  double variance_ = -1.0;
  core::Mode mode_ = core::Mode::kPassthrough;
  core::Reason reason_ = core::Reason::kNoEstimateYet;
  core::Rung rung_ = core::Rung::kNone;
  bool on_prior_ = false;         // the prior has a value
  bool adds_prior_ = false;       // which is part of the applied drift
  double remainder_radps_ = 0.0;  // of the applied drift, without the prior
};

}  // namespace zerodrift::compensation
