// SPDX-License-Identifier: Apache-2.0
#include "common/regression/margin_system.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace zerodrift::regression {
namespace {

constexpr double kEpsilonOfDouble = std::numeric_limits<double>::epsilon();

// Rates and pivots below this share of the kernel's magnitude count as zero.
constexpr double kNegligible = 1e-13;
// What rounding may make of a refined pivot, as a share of the terms it is the sum of.
constexpr double kPivotRounding = 8.0 * kEpsilonOfDouble;
// Residual rates of margin samples, as a share of the terms they are the sum of, that are rounding.
constexpr double kRounding = 1e-14;
// Pivots below this share of the kernel's magnitude lose digits when computed as a difference.
constexpr double kSmallPivot = 1e-8;
// A refinement that corrects more than this share of a solution says that the factor has worn out;
// one that corrects less than the other share leaves nothing to correct, for the next would
// correct the square of it.
constexpr double kWornOut = 1e-6;
constexpr double kRefined = 1e-8;
constexpr int kMaxRefinements = 4;

}  // namespace

MarginSystem::MarginSystem(std::size_t slot_count)
    : factor_(slot_count),
      rates_(slot_count),
      reduced_(slot_count),
      correction_(slot_count),
      row_pointers_(slot_count + 1),
      row_rates_(slot_count + 1) {
  samples_.reserve(slot_count);
}

std::size_t MarginSystem::position_of(std::size_t slot) const noexcept {
  std::size_t position = 0;
  while (position < size() && samples_[position].slot != slot) ++position;
  return position;
}

void MarginSystem::begin_call() noexcept {
  may_refactor_ = true;
  is_factor_fresh_ = false;
}

void MarginSystem::clear() noexcept {
  samples_.clear();
  factor_.clear();
  is_factor_fresh_ = false;
}

// ---- Solutions ----

// <phi_i - phi_0, phi_c - phi_0> for the sample i in the slot and the sample c that the row belongs
// to.
double MarginSystem::reduced_product(const double* row, std::size_t slot) const noexcept {
  const MarginSample& reference = samples_[0];
  return (row[slot] - row[reference.slot]) - (reference.row[slot] - reference.row[reference.slot]);
}

// The reference takes what makes the sum of all coefficients zero.
void MarginSystem::balance_rates() noexcept {
  double total = 1.0;
  for (std::size_t p = 1; p < size(); ++p) total += rates_[p];
  rates_[0] = -total;
}

// dh at a slot, less the bias, for a unit change of the coefficient that the kernel row belongs to.
double MarginSystem::expansion_rate(const double* row, std::size_t slot) const noexcept {
  double rate = row[slot];
  for (std::size_t p = 0; p < size(); ++p) rate += rates_[p] * samples_[p].row[slot];
  return rate;
}

// Writes to rates_ how the margin coefficients follow a unit change of the coefficient that the
// kernel row belongs to: A beta = -reduced products.
void MarginSystem::solve_rates(const double* row) noexcept {
  for (std::size_t p = 1; p < size(); ++p) {
    reduced_[p] = reduced_product(row, samples_[p].slot);
    rates_[p] = -reduced_[p];
  }
  factor_.solve(rates_.data() + 1);
  balance_rates();
}

// One refinement of rates_ by the residual of dh_p = dh_0, computed from the kernel rows. Returns
// the size of the correction relative to the rates. O(n²).
double MarginSystem::refine_rates(const double* row) noexcept {
  const double reference_rate = expansion_rate(row, samples_[0].slot);
  for (std::size_t p = 1; p < size(); ++p) {
    correction_[p] = expansion_rate(row, samples_[p].slot) - reference_rate;
  }
  factor_.solve(correction_.data() + 1);
  double largest = std::numeric_limits<double>::min(), largest_correction = 0.0;
  for (std::size_t p = 1; p < size(); ++p) {
    rates_[p] -= correction_[p];
    largest = std::max(largest, std::fabs(rates_[p]));
    largest_correction = std::max(largest_correction, std::fabs(correction_[p]));
  }
  balance_rates();
  return largest_correction / largest;
}

// The same as solve_rates(), refined until nothing is left to correct.
void MarginSystem::solve_rates_refined(const double* row) noexcept {
  solve_rates(row);
  for (int i = 0; size() > 1 && i < kMaxRefinements; ++i) {
    const double correction = refine_rates(row);
    if (correction > kWornOut && may_refactor_) {
      may_refactor_ = false;
      renew_factor();
      return solve_rates_refined(row);
    }
    if (correction < kRefined) break;
  }
}

// The direction given by rates_.
Direction MarginSystem::direction_of(const MarginSample& driver) const noexcept {
  if (size() == 0) return {1.0, 1.0, 0.0, 0.0};  // only the bias moves
  double magnitude = driver.magnitude;
  for (std::size_t p = 0; p < size(); ++p) {
    magnitude += std::fabs(rates_[p]) * samples_[p].magnitude;
  }
  const double reference_rate = expansion_rate(driver.row, samples_[0].slot);
  return {-reference_rate, expansion_rate(driver.row, driver.slot) - reference_rate,
          kNegligible * driver.magnitude + kEpsilonOfDouble * magnitude, magnitude};
}

// The solution is refined only if the margin's own residual rates, which should be zero, show more
// than rounding. A Schur complement below zero says that refining didn't converge, because removals
// have worn the factor out: with such a direction samples enter the margin and leave it at once,
// for ever.
Direction MarginSystem::solve(const MarginSample& driver, double sign,
                              Column& residual_rates) noexcept {
  solve_rates(driver.row);
  Direction direction = direction_of(driver);
  write_residual_rates(driver, sign, direction, residual_rates);
  if (largest_rate_of_margin(residual_rates) > kRounding * direction.magnitude) {
    solve_rates_refined(driver.row);
    direction = direction_of(driver);
    if (direction.own_residual_rate < -direction.threshold && !is_factor_fresh_) {
      renew_factor();
      solve_rates_refined(driver.row);
      direction = direction_of(driver);
    }
    write_residual_rates(driver, sign, direction, residual_rates);
  }
  return direction;
}

double MarginSystem::largest_rate_of_margin(const Column& residual_rates) const noexcept {
  double largest = 0.0;
  for (const MarginSample& sample : samples_) {
    largest = std::max(largest, std::fabs(residual_rates[sample.slot]));
  }
  return largest;
}

void MarginSystem::write_residual_rates(const MarginSample& driver, double sign,
                                        const Direction& direction,
                                        Column& residual_rates) noexcept {
  if (size() == 0) {
    std::fill(residual_rates.begin(), residual_rates.end(), sign);
    return;
  }
  row_pointers_[0] = driver.row;
  row_rates_[0] = sign;
  for (std::size_t p = 0; p < size(); ++p) {
    row_pointers_[p + 1] = samples_[p].row;
    row_rates_[p + 1] = sign * rates_[p];
  }
  combine_rows(row_pointers_.data(), row_rates_.data(), size() + 1, sign * direction.bias_rate,
               residual_rates.data(), residual_rates.size());
}

// A delta = -(r_p - r_0).
double MarginSystem::solve_shift(std::span<const double> offsets,
                                 Column& residual_changes) noexcept {
  const double reference = offsets[0];
  rates_[0] = 0.0;
  for (std::size_t p = 1; p < size(); ++p) rates_[p] = reference - offsets[p];
  factor_.solve(rates_.data() + 1);
  for (std::size_t p = 1; p < size(); ++p) rates_[0] -= rates_[p];
  for (std::size_t p = 0; p < size(); ++p) row_pointers_[p] = samples_[p].row;
  combine_rows(row_pointers_.data(), rates_.data(), size(), 0.0, residual_changes.data(),
               residual_changes.size());
  const double bias_change = -reference - residual_changes[samples_[0].slot];
  for (double& change : residual_changes) change += bias_change;
  return bias_change;
}

// ---- The set ----

bool MarginSystem::enter(const MarginSample& sample, bool takes_any_pivot) noexcept {
  if (size() > 0 && !append_to_factor(sample, takes_any_pivot)) return false;
  samples_.push_back(sample);
  return true;
}

void MarginSystem::leave(std::size_t position) noexcept {
  is_factor_fresh_ = false;
  samples_.erase(samples_.begin() + static_cast<std::ptrdiff_t>(position));
  if (position == 0) {
    factor_.remove_reference();
  } else {
    factor_.remove_row(position - 1);
  }
}

double MarginSystem::smallest_pivot(const Direction& direction, bool takes_any_pivot) noexcept {
  return takes_any_pivot ? kPivotRounding * direction.magnitude : direction.threshold;
}

// False, and nothing changed, if the sample's pivot is lost in rounding. A small pivot is computed
// with care, as the residual rate of a refined solution.
bool MarginSystem::append_to_factor(const MarginSample& sample, bool takes_any_pivot) noexcept {
  const std::size_t n = size();
  for (std::size_t p = 1; p < n; ++p) reduced_[p] = reduced_product(sample.row, samples_[p].slot);
  factor_.solve_lower(reduced_.data() + 1);
  double pivot = reduced_product(sample.row, sample.slot) -
                 dot(reduced_.data() + 1, reduced_.data() + 1, n - 1);
  if (pivot < kSmallPivot * (sample.magnitude + samples_[0].magnitude)) {
    solve_rates_refined(sample.row);
    const Direction direction = direction_of(sample);
    pivot = direction.own_residual_rate;
    if (!(pivot > smallest_pivot(direction, takes_any_pivot))) return false;
    factor_.solve_lower(reduced_.data() + 1);
  }
  factor_.append(reduced_.data() + 1, pivot);
  return true;
}

// Computes the factor anew from the kernel rows.
void MarginSystem::renew_factor() noexcept {
  is_factor_fresh_ = true;
  factor_.clear();
  for (std::size_t p = 1; p < size(); ++p) {
    const MarginSample& sample = samples_[p];
    for (std::size_t q = 1; q < p; ++q)
      correction_[q] = reduced_product(sample.row, samples_[q].slot);
    factor_.solve_lower(correction_.data() + 1);
    const double pivot = reduced_product(sample.row, sample.slot) -
                         dot(correction_.data() + 1, correction_.data() + 1, p - 1);
    factor_.append(correction_.data() + 1, std::max(pivot, kNegligible * sample.magnitude));
  }
}

}  // namespace zerodrift::regression
