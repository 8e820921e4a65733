// SPDX-License-Identifier: Apache-2.0
// The margin set of an online SVR: how its coefficients and the bias follow a change of another
// coefficient, so that all of its samples stay on their margin.
//
//   [db; dtheta_S] = -[0 1'; 1 K_SS]^-1 [1; K_Sc] dtheta_c
//   dh_i = K_ic dtheta_c + K_iS dtheta_S + db
//
// The bias is eliminated by a reference sample (margin_factor.h); every solution is checked by the
// margin's own residual rates, and refined where they are more than rounding.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "common/regression/margin_factor.h"
#include "common/regression/vector_operations.h"

namespace zerodrift::regression {

// A sample with its kernel row, which stays in place as long as the sample is in the margin set.
struct MarginSample {
  std::size_t slot = 0;
  const double* row = nullptr;
  double magnitude = 0.0;  // of the kernel's terms in the row
};

// Rates per unit of the driven coefficient; those of the margin coefficients are rate(p).
struct Direction {
  double bias_rate;
  double own_residual_rate;  // dh_c / dtheta_c: the Schur complement, >= 0
  double threshold;          // residual rates below this are rounding
  double magnitude;          // of the kernel terms that a residual rate is the sum of
};

// Samples are named by their position; the reference is at 0. Everything is allocated in the
// constructor.
class MarginSystem {
 public:
  explicit MarginSystem(std::size_t slot_count);

  [[nodiscard]] std::size_t size() const noexcept { return samples_.size(); }
  [[nodiscard]] std::size_t slot(std::size_t position) const noexcept {
    return samples_[position].slot;
  }
  [[nodiscard]] const double* row(std::size_t position) const noexcept {
    return samples_[position].row;
  }
  [[nodiscard]] std::size_t position_of(std::size_t slot) const noexcept;

  // A factor that has worn out is renewed at most once a call of the learner.
  void begin_call() noexcept;
  void clear() noexcept;

  // False, and nothing changed, if the factor would become singular. `takes_any_pivot`: that is
  // more than rounding.
  [[nodiscard]] bool enter(const MarginSample& sample, bool takes_any_pivot) noexcept;
  void leave(std::size_t position) noexcept;

  // The direction in which to drive a sample, and dh for a step of 1 in the sense of `sign`, by
  // slot. O(stride n).
  [[nodiscard]] Direction solve(const MarginSample& driver, double sign,
                                Column& residual_rates) noexcept;
  // The change of the margin's coefficients and of the bias that takes `offsets`, by position, off
  // the margin's residuals, and the change of all residuals. Returns that of the bias.
  [[nodiscard]] double solve_shift(std::span<const double> offsets,
                                   Column& residual_changes) noexcept;
  // As the last solution has it.
  [[nodiscard]] double rate(std::size_t position) const noexcept { return rates_[position]; }

  // The pivot above which a sample may enter. Displacing a sample that is near the span of the
  // margin's but not in it disturbs the others a little, so that two of them might displace each
  // other in turn for ever: once driven in a call, a sample enters with any pivot that is more than
  // rounding.
  [[nodiscard]] static double smallest_pivot(const Direction& direction,
                                             bool takes_any_pivot) noexcept;

  // Its state (core/state_archive.h) is its samples, put back by position, and then their factor.
  void put_back(const MarginSample& sample) noexcept { samples_.push_back(sample); }
  void carry_factor(core::StateArchive& archive) {
    factor_.carry(archive, std::max<std::size_t>(size(), 1) - 1);
  }

 private:
  void solve_rates(const double* row) noexcept;
  void solve_rates_refined(const double* row) noexcept;
  [[nodiscard]] double refine_rates(const double* row) noexcept;
  void balance_rates() noexcept;
  [[nodiscard]] Direction direction_of(const MarginSample& driver) const noexcept;
  void write_residual_rates(const MarginSample& driver, double sign, const Direction& direction,
                            Column& residual_rates) noexcept;
  [[nodiscard]] double largest_rate_of_margin(const Column& residual_rates) const noexcept;
  [[nodiscard]] double expansion_rate(const double* row, std::size_t slot) const noexcept;
  [[nodiscard]] double reduced_product(const double* row, std::size_t slot) const noexcept;
  [[nodiscard]] bool append_to_factor(const MarginSample& sample, bool takes_any_pivot) noexcept;
  void renew_factor() noexcept;

  std::vector<MarginSample> samples_;
  MarginFactor factor_;
  std::vector<double> rates_, reduced_, correction_;  // by position
  std::vector<const double*> row_pointers_;
  std::vector<double> row_rates_;
  bool may_refactor_ = true;
  bool is_factor_fresh_ = false;  // no row was removed since it was renewed in this call
};

}  // namespace zerodrift::regression
