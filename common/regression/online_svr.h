// SPDX-License-Identifier: Apache-2.0
// Exact online epsilon-SVR over a bounded window: after every change the model is the optimum of
// the samples now held.
//
//   f(x) = sum_i theta_i k(x_i, x) + b,   sum theta = 0,   |theta_i| <= C_i = weight_i C
//   h_i = f(x_i) - y_i                    margin residual
//
//   remaining set R   theta = 0             |h| <= epsilon
//   margin set S      0 <= |theta| <= C_i   h = -epsilon sgn theta
//   error set E       |theta| = C_i         -h sgn theta >= epsilon
//
// The weight of a sample, 1 if not given, bounds how hard it may pull: C_i is its price for each
// unit that it lies outside the tube (weighted epsilon-SVR). A label of larger variance gets a
// smaller one.
//
// Method: J. Ma, J. Theiler, S. Perkins, "Accurate On-line Support Vector Regression", Neural
// Computation 15 (2003). A change of one coefficient theta_c moves the margin coefficients and the
// bias linearly, so that S stays on its margin (margin_system.h), up to the first sample that meets
// the border of its set. That sample changes set (one "event"), and so on. Learning drives h_c to
// its margin or theta_c to C_c; forgetting drives theta_c to 0. With S empty only b moves.
//
// How this stands to Mao, Xu, He & Wu, Laser & Optoelectronics Progress 59(1), 0106002 (2022),
// section 2.2:
//
// - Eq. (8)-(11), the test that alpha_{l+1} lies in the span of the basis, "so the model stays", is
//   here |h_c| <= epsilon: the sample joins R with theta = 0 and the model stays to the bit
//   (kFitsAlready).
// - Eq. (5), the Gram-Schmidt basis of span{Phi(x_i) y_j - Phi(x_j) y_i} that grows by one for each
//   sample that doesn't fit, is here the basis of the margin set, phi_j - phi_0 by Cholesky
//   (margin_factor.h). It grows and shrinks; its recursions are the triangular solves of one event.
// - Eq. (7), ||w||² = y_i² / (K_ii - sum_j gamma_j²), is the optimum of a fit without tube, box and
//   bias. The exact optimum with epsilon, C and b takes its place; as a criterion for choosing
//   kernels eq. (7) is no part of this class.
//
// What keeps it exact:
//
// - kernels less 1 (kernel.h), so that near samples keep the digits of their distance;
// - the bias eliminated by a reference sample, no stored inverse, and every solve checked: where
//   it leaves the margin residual rates that are more than rounding, it is refined;
// - a sample whose feature vector lies in the span of S, or too near, first displaces a margin
//   sample before it enters: S stays regular with identical, quantised or low-rank samples, and no
//   ridge is needed; a driver that can't reach its margin never turns back for having passed it;
// - ties broken by a hash-made jitter of the targets, 1e-4 of the KKT bound;
// - residuals computed anew round-robin, one every eighth sample.
//
// Features and targets should be scaled to the order of 1. Cost of an event: O(W n_margin); of a
// call: typically five events, never more than the event budget. Everything is allocated in the
// constructor. One thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/core/state_archive.h"
#include "common/regression/kernel_rows.h"
#include "common/regression/margin_system.h"
#include "common/regression/online_svr_options.h"
#include "common/regression/sample_window.h"
#include "common/regression/vector_operations.h"

namespace zerodrift::regression {

enum class UpdateOutcome : std::uint8_t {
  kFitsAlready,  // the sample lay inside the tube; it is in the window with theta = 0
  kLearned,      // the sample is in the window and the model is its new optimum
  kForgotten,    // the sample is gone and the model is the optimum without it
  kUnfinished,   // accepted, but the event budget ran out; the model is usable, the next call
                 // finishes
  kBusy,         // not accepted: the whole budget went into finishing earlier calls
  kRefused,  // not accepted, nothing changed: not finite, out of range, wrong dimension, no weight
             // or no such sample
};

struct UpdateReport {
  UpdateOutcome outcome = UpdateOutcome::kRefused;
  std::size_t slot = SampleWindow::kNoSlot;  // where the sample is or was
  std::size_t events = 0;
  // f(x) - y before the sample was learned, after the evicted one was forgotten; add() only.
  double prior_residual = 0.0;
};

enum class SampleSet : std::uint8_t {
  kVacant = 0,
  kRemaining = 1,
  kMargin = 2,
  kError = 3,
  kPending = 4,  // being learned or forgotten
};

struct SetCounts {
  std::size_t remaining = 0, margin = 0, error = 0, pending = 0;
};

class OnlineSvr {  // More members than other classes: its columns by slot are one state.
 public:
  // Throws std::invalid_argument with options.validate()'s sentence.
  explicit OnlineSvr(const OnlineSvrOptions& options);

  // All that decides future results (core/state_archive.h): one of the same options that has read
  // it continues to the bit.
  void carry(core::StateArchive& archive);

  OnlineSvr(OnlineSvr&&) noexcept = default;
  OnlineSvr& operator=(OnlineSvr&&) noexcept = default;
  OnlineSvr(const OnlineSvr&) = delete;
  OnlineSvr& operator=(const OnlineSvr&) = delete;
  ~OnlineSvr() = default;

  // Takes a sample in and, if the window is full, first forgets the one the window policy names.
  // Refuses values beyond kLargestMagnitude and what options().is_weight() doesn't hold for.
  UpdateReport add(std::span<const double> x, double y, double weight = 1.0) noexcept;

  // Takes the sample in `slot` out, exactly.
  UpdateReport forget(std::size_t slot) noexcept;

  // Spends one budget on whatever earlier calls left unfinished. True if nothing is pending.
  bool finish_pending() noexcept;

  // Back to the empty window.
  void clear() noexcept;

  // f(x); 0 for an empty window. x.size() must be the dimension. O(support vectors).
  [[nodiscard]] double predict(std::span<const double> x) const noexcept;

  [[nodiscard]] const OnlineSvrOptions& options() const noexcept { return options_; }
  [[nodiscard]] std::size_t size() const noexcept { return window_.size(); }
  // capacity + 1: a sample that is still leaving doesn't block a new one.
  [[nodiscard]] std::size_t slot_count() const noexcept { return rows_.slot_count(); }
  [[nodiscard]] SetCounts set_counts() const noexcept;
  [[nodiscard]] bool has_finished() const noexcept { return pending_.empty(); }
  [[nodiscard]] double bias() const noexcept { return bias_; }
  [[nodiscard]] double theta_sum() const noexcept;

  // The sample in a slot; x(d) is feature d.
  [[nodiscard]] SampleSet set_of(std::size_t slot) const noexcept { return set_[slot]; }
  // The first vacant slot from `slot` on, else slot_count().
  [[nodiscard]] std::size_t next_vacant(std::size_t slot) const noexcept;
  [[nodiscard]] double theta(std::size_t slot) const noexcept { return theta_[slot]; }
  [[nodiscard]] double target(std::size_t slot) const noexcept { return target_[slot]; }
  [[nodiscard]] double weight(std::size_t slot) const noexcept { return weight_[slot]; }
  // f of the sample's features, from its residual: O(1).
  [[nodiscard]] double fitted(std::size_t slot) const noexcept {
    return target_[slot] + residual_[slot];
  }
  // The slots that hold a sample, the earliest first. O(W log W), allocates.
  [[nodiscard]] std::vector<std::size_t> slots_by_arrival() const;
  // Number of the sample in the order of insertion.
  [[nodiscard]] std::uint64_t arrival(std::size_t slot) const noexcept {
    return window_.arrival(slot);
  }
  [[nodiscard]] double feature(std::size_t slot, std::size_t d) const noexcept {
    return rows_.feature(slot, d);
  }
  // Feature d of all slots.
  [[nodiscard]] const double* features(std::size_t d) const noexcept {
    return rows_.columns().data + d * rows_.columns().stride;
  }

  // Largest violation of the KKT conditions by any sample that is not pending, from residuals
  // computed anew. O(W²), for checks.
  [[nodiscard]] double max_kkt_violation() const noexcept;

 private:
  // How the driven sample's coefficient has to move.
  struct Drive {
    double sign;             // of the change of theta
    double theta_limit;      // 0 or the box constraint of either sign
    double residual_target;  // h of its margin
    bool stops_at_margin;    // false while forgetting
  };

  struct Event {
    enum class Kind : std::uint8_t { kDriverAtMargin, kDriverAtLimit, kMarginLeaves, kSampleMeets };
    Kind kind = Kind::kDriverAtLimit;
    double step = 0.0;
    std::size_t position = 0;  // kMarginLeaves: margin position; kSampleMeets: slot
  };

  // C_i.
  [[nodiscard]] double box_of(std::size_t slot) const noexcept {
    return weight_[slot] * options_.box_constraint;
  }

  [[nodiscard]] bool accepts(std::span<const double> x, double y, double weight) const noexcept;
  [[nodiscard]] std::size_t insert(std::span<const double> x, double y, double weight) noexcept;
  [[nodiscard]] UpdateOutcome learn(std::size_t slot, std::size_t& events) noexcept;
  void evict(std::size_t slot, std::size_t& events) noexcept;
  void vacate(std::size_t slot) noexcept;

  void begin_call() noexcept;
  bool resolve(std::size_t& events) noexcept;
  void advance(std::size_t driver) noexcept;
  void keep_before_margin(std::size_t driver, const Drive& drive) noexcept;
  [[nodiscard]] bool try_to_finish(std::size_t driver) noexcept;
  [[nodiscard]] Drive plan(std::size_t slot) const noexcept;
  [[nodiscard]] MarginSample take_driver(std::size_t driver) noexcept;
  void release_driver() noexcept;
  [[nodiscard]] bool reaches_margin(std::size_t driver, const Direction& direction) const noexcept;
  [[nodiscard]] Event next_event(std::size_t driver, const Drive& drive,
                                 const Direction& direction) const noexcept;
  [[nodiscard]] double step_to_bound(std::size_t slot, double rate) const noexcept;
  void apply(std::size_t driver, const Drive& drive, const Direction& direction,
             double step) noexcept;
  void handle(const Event& event, std::size_t driver, const Drive& drive) noexcept;
  void meet_border(std::size_t slot) noexcept;
  void put_past_border(std::size_t slot, double border, double side) noexcept;

  [[nodiscard]] bool enter_margin(std::size_t slot) noexcept;
  void detach_from_margin(std::size_t position) noexcept;
  void leave_margin(std::size_t position) noexcept;
  void assign_set(std::size_t slot, SampleSet set) noexcept;
  void await(std::size_t slot) noexcept;
  void push_pending(std::size_t slot) noexcept;
  void erase_pending(std::size_t slot) noexcept;

  void carry_sample(core::StateArchive& archive, std::size_t slot);
  void carry_sets(core::StateArchive& archive);

  void maintain() noexcept;
  void refresh_one_residual() noexcept;
  void balance_thetas() noexcept;
  void recentre_margin() noexcept;

  OnlineSvrOptions options_;
  KernelRows rows_;
  MarginSystem margin_;
  SampleWindow window_;

  // By slot, padded.
  Column target_, weight_, theta_, residual_;
  Column upper_, lower_;  // residuals at which the sample changes set
  std::vector<SampleSet> set_;
  std::vector<char> is_leaving_;
  std::vector<char> was_driven_;  // to a bound or its margin, in this call

  std::vector<std::size_t> pending_;             // a stack; the last is driven
  std::size_t driver_ = SampleWindow::kNoSlot;   // whose row is taken
  std::size_t refused_ = SampleWindow::kNoSlot;  // the driver that the present margin didn't take
  double bias_ = 0.0;
  std::uint64_t arrival_count_ = 0;
  std::size_t refresh_cursor_ = 0;

  // Scratch.
  Column residual_rate_;               // by slot
  std::vector<double> margin_offset_;  // by margin position
};

}  // namespace zerodrift::regression
