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
// bias linearly, so that S stays on its margin,
//
//   [db; dtheta_S] = -[0 1'; 1 K_SS]^-1 [1; K_Sc] dtheta_c
//   dh_i = K_ic dtheta_c + K_iS dtheta_S + db
//
// up to the first sample that meets the border of its set. That sample changes set (one "event"),
// and so on. Learning drives h_c to its margin or theta_c to C_c; forgetting drives theta_c to 0.
// With S empty only b moves.
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
// - residuals computed anew round-robin, one a call.
//
// Features and targets should be scaled to the order of 1. Cost of an event: O(W n_margin); of a
// call: typically five events, never more than the event budget. Everything is allocated in the
// constructor. One thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/regression/kernel.h"
#include "common/regression/margin_factor.h"
#include "common/regression/sample_window.h"
#include "common/regression/vector_operations.h"

namespace zerodrift::regression {

// Features, targets and k(x, x) beyond this are refused: double can't hold the KKT tolerance there.
inline constexpr double kLargestMagnitude = 1e6;
// Largest residual, bias, weight or factor entry of a saved state: products of them stay finite.
inline constexpr double kLargestSum = 1e100;

struct OnlineSvrOptions {
  std::size_t dimension = 2;   // features per sample, 1..kMaxDimension
  std::size_t capacity = 500;  // W, samples held at most, >= 2
  Kernel kernel;
  double epsilon = 0.02;         // tube half-width, unit of the targets, > kkt_bound()
  double box_constraint = 10.0;  // C, bound of |theta| of a sample of weight 1, > 0
  // Bound held on every KKT violation, relative to max(1, C); unit of the targets.
  double kkt_tolerance = 1e-9;
  // Events one call may spend. What is left is finished by the next call.
  std::size_t event_budget = 200;
  WindowPolicy window = WindowPolicy::kFifo;
  std::size_t recent_capacity = 250;  // kTwoTier only: size of the recent tier, 1..capacity-1

  // The bound on KKT violations, unit of the targets.
  [[nodiscard]] double kkt_bound() const noexcept;

  // Whether a sample may have this weight: above 0, at most 1, and weight x C a normal number.
  [[nodiscard]] bool is_weight(double weight) const noexcept;

  // The first wrong key and what would be right; empty if all is well.
  [[nodiscard]] std::optional<std::string> validate() const;

  friend bool operator==(const OnlineSvrOptions&, const OnlineSvrOptions&) = default;
};

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
  kUnsettled = 4,  // being learned or forgotten
};

struct SetCounts {
  std::size_t remaining = 0, margin = 0, error = 0, unsettled = 0;
};

// All that decides future results; a learner made from it continues to the bit. Vectors are
// indexed by slot unless noted.
struct OnlineSvrState {
  std::vector<double> features;  // slot-major: feature d of slot i is features[i * dimension + d]
  std::vector<double> targets;   // jitter included
  std::vector<double> weights;
  std::vector<double> thetas;
  std::vector<double> residuals;  // h
  std::vector<std::uint64_t> arrivals;
  std::vector<SampleSet> sets;
  std::vector<WindowTier> tiers;
  std::vector<std::size_t> margin_slots;     // by margin position, the reference first
  std::vector<double> margin_factor;         // packed rows, by margin position
  std::vector<std::size_t> unsettled_slots;  // the last is driven first
  std::vector<std::size_t>
      forgotten_slots;  // those of unsettled_slots that are to leave the window
  double bias = 0.0;
  std::uint64_t arrival_count = 0;
  std::size_t refresh_cursor = 0;
};

class OnlineSvr {
 public:
  // Throws std::invalid_argument with options.validate()'s sentence.
  explicit OnlineSvr(const OnlineSvrOptions& options);

  // Continues a saved learner. Throws std::invalid_argument, naming the field, if the state can't
  // belong to the options.
  [[nodiscard]] static OnlineSvr from_state(const OnlineSvrOptions& options,
                                            const OnlineSvrState& state);
  [[nodiscard]] OnlineSvrState export_state() const;

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

  // Spends one budget on whatever earlier calls left unfinished. True if all is settled.
  bool settle() noexcept;

  // Back to the empty window.
  void clear() noexcept;

  // f(x); 0 for an empty window. x.size() must be the dimension. O(support vectors).
  [[nodiscard]] double predict(std::span<const double> x) const noexcept;

  [[nodiscard]] const OnlineSvrOptions& options() const noexcept { return options_; }
  [[nodiscard]] std::size_t size() const noexcept { return window_.size(); }
  [[nodiscard]] std::size_t slot_count() const noexcept { return slot_count_; }
  [[nodiscard]] SetCounts set_counts() const noexcept;
  [[nodiscard]] bool is_settled() const noexcept { return unsettled_.empty(); }
  [[nodiscard]] double bias() const noexcept { return bias_; }
  [[nodiscard]] double theta_sum() const noexcept;

  // The sample in a slot; x(d) is feature d.
  [[nodiscard]] SampleSet set_of(std::size_t slot) const noexcept { return set_[slot]; }
  [[nodiscard]] double theta(std::size_t slot) const noexcept { return theta_[slot]; }
  [[nodiscard]] double target(std::size_t slot) const noexcept { return target_[slot]; }
  [[nodiscard]] double weight(std::size_t slot) const noexcept { return weight_[slot]; }
  // f of the sample's features, from its residual: O(1).
  [[nodiscard]] double fitted(std::size_t slot) const noexcept {
    return target_[slot] + residual_[slot];
  }
  // Number of the sample in the order of insertion.
  [[nodiscard]] std::uint64_t arrival(std::size_t slot) const noexcept {
    return window_.arrival(slot);
  }
  [[nodiscard]] double feature(std::size_t slot, std::size_t d) const noexcept {
    return features_[d * stride_ + slot];
  }
  // Feature d of all slots, vacant ones included.
  [[nodiscard]] std::span<const double> feature_column(std::size_t d) const noexcept {
    return {features_.data() + d * stride_, slot_count_};
  }

  // Largest violation of the KKT conditions by any settled sample, from residuals computed anew.
  // O(W²), for checks.
  [[nodiscard]] double max_kkt_violation() const noexcept;

 private:
  // How the driven sample's coefficient has to move.
  struct Drive {
    double sign;             // of the change of theta
    double theta_limit;      // 0 or the box constraint of either sign
    double residual_target;  // h of its margin
    bool stops_at_margin;    // false while forgetting
  };

  // Rates per unit of the driven coefficient; those of the margin coefficients are in rates_.
  struct Direction {
    double bias_rate;
    double own_residual_rate;  // dh_c / dtheta_c: the Schur complement, >= 0
    double threshold;          // residual rates below this are rounding
    double magnitude;          // of the kernel terms that a residual rate is the sum of
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
  [[nodiscard]] SampleColumns columns() const noexcept;
  void gather(std::size_t slot, double* x) const noexcept;
  [[nodiscard]] std::size_t margin_size() const noexcept { return margin_slots_.size(); }
  [[nodiscard]] double* row(std::size_t index) const noexcept {
    return rows_.get() + index * stride_;
  }
  [[nodiscard]] const double* margin_row(std::size_t p) const noexcept {
    return row(margin_rows_[p]);
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
  [[nodiscard]] bool try_to_settle(std::size_t driver) noexcept;
  [[nodiscard]] Drive plan(std::size_t slot) const noexcept;
  void load_driver_row(std::size_t driver) noexcept;
  void release_driver_row() noexcept;
  [[nodiscard]] std::size_t take_row(std::size_t slot) noexcept;
  void park_row(std::size_t slot, std::size_t kernel_row) noexcept;
  bool unpark_row(std::size_t slot) noexcept;
  void evaluate(std::size_t slot, std::size_t kernel_row) noexcept;
  void solve_rates(const double* kernel_row) noexcept;
  void solve_rates_refined(const double* kernel_row) noexcept;
  [[nodiscard]] Direction direction_of(const double* kernel_row, std::size_t slot) const noexcept;
  [[nodiscard]] Direction solve_direction(const Drive& drive, std::size_t driver) noexcept;
  [[nodiscard]] double largest_margin_rate() const noexcept;
  void balance_rates() noexcept;
  [[nodiscard]] double expansion_rate(const double* kernel_row, std::size_t slot) const noexcept;
  [[nodiscard]] double refine_rates(const double* kernel_row) noexcept;
  [[nodiscard]] double reduced_product(const double* kernel_row, std::size_t slot) const noexcept;
  void write_residual_rates(const Drive& drive, const Direction& direction) noexcept;
  [[nodiscard]] Event next_event(std::size_t driver, const Drive& drive,
                                 const Direction& direction) noexcept;
  [[nodiscard]] double step_to_bound(std::size_t slot, double rate) const noexcept;
  void apply(std::size_t driver, const Drive& drive, const Direction& direction,
             double step) noexcept;
  void handle(const Event& event, std::size_t driver, const Drive& drive) noexcept;
  void meet_border(std::size_t slot) noexcept;
  void put_past_border(std::size_t slot, double border, double side) noexcept;

  [[nodiscard]] bool enter_margin(std::size_t slot) noexcept;
  [[nodiscard]] bool append_to_factor(const double* kernel_row, std::size_t slot) noexcept;
  std::size_t detach_from_margin(std::size_t position) noexcept;
  void leave_margin(std::size_t position) noexcept;
  [[nodiscard]] double smallest_pivot(std::size_t slot, const Direction& direction) const noexcept;
  [[nodiscard]] bool reaches_margin(std::size_t driver, const Direction& direction) const noexcept;
  [[nodiscard]] bool refactor() noexcept;
  void renew_factor() noexcept;
  void assign_set(std::size_t slot, SampleSet set) noexcept;
  void await(std::size_t slot) noexcept;
  void push_unsettled(std::size_t slot) noexcept;
  void erase_unsettled(std::size_t slot) noexcept;

  void maintain() noexcept;
  void refresh_one_residual() noexcept;
  void balance_thetas() noexcept;
  void recentre_margin() noexcept;
  [[nodiscard]] double margin_residual(std::size_t position) const noexcept;
  [[nodiscard]] double kernel_magnitude(std::size_t slot) const noexcept;

  OnlineSvrOptions options_;
  std::size_t slot_count_;  // capacity + 1: a sample that is still leaving doesn't block a new one
  std::size_t stride_;      // padded slot count
  SampleWindow window_;
  MarginFactor factor_;

  // By slot, padded.
  Column features_;  // by column
  Column target_, weight_, theta_, residual_, self_;
  Column upper_, lower_;  // residuals at which the sample changes set
  std::vector<SampleSet> set_;
  std::vector<char> is_leaving_;
  std::vector<char> was_driven_;  // to a bound or its margin, in this call

  // By margin position; the reference is at 0.
  std::vector<std::size_t> margin_slots_, margin_rows_;

  std::vector<std::size_t> unsettled_;  // a stack; the last is driven

  // Kernel rows: one spare for passing use, those of the margin samples and the driver, and those
  // parked, the last parked at the end. Reserved for the worst case, committed only as far as used.
  struct FreeRows {
    void operator()(double* rows) const noexcept { ::operator delete[](rows, kCacheLine); }
  };
  std::unique_ptr<double[], FreeRows> rows_;
  std::vector<std::size_t> free_rows_;
  std::vector<std::size_t> parked_slots_, parked_rows_;
  std::size_t driver_row_ = 0;
  std::size_t driver_row_slot_ = SampleWindow::kNoSlot;

  // Scratch.
  std::vector<double> rates_, reduced_, correction_;  // by margin position
  std::vector<const double*> row_pointers_;
  std::vector<double> row_rates_;
  Column residual_rate_;  // by slot

  double bias_ = 0.0;
  std::uint64_t arrival_count_ = 0;
  std::size_t refresh_cursor_ = 0;
  bool may_refactor_ = true;      // once a call
  bool is_factor_fresh_ = false;  // no row was removed since it was renewed in this call
  std::size_t refused_ = SampleWindow::kNoSlot;  // the driver that the present margin didn't take
};

}  // namespace zerodrift::regression
