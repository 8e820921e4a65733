// SPDX-License-Identifier: Apache-2.0
// The factory calibration's form, learned on the fly: a cubic in temperature with rate terms.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>

#include "common/regression/drift_scheme.h"

namespace zerodrift::regression {

struct PolynomialOptions {
  std::size_t temperature_feature = 0;  // index, < kMaxDimension
  std::size_t rate_feature = 1;         // index, < kMaxDimension
  // Standard deviation of every coefficient but the constant before the first label, in standard
  // deviations of that label as a measurement; > 0. Keeps T and T² bounded while the record has
  // seen one temperature only.
  double prior_deviation = 100.0;
  // Weight of what was learned, the prior included, after one more label; (0, 1], 1 forgets
  // nothing. Below 1 the fit follows a wandering drift, and forgets the temperatures that it does
  // not see.
  double forgetting = 1.0;

  // The first wrong key and what would be right; empty if all is well.
  [[nodiscard]] std::optional<std::string> validate() const;

  friend bool operator==(const PolynomialOptions&, const PolynomialOptions&) = default;
};

// Recursive least squares of drift on {1, T, T², T³, rate, T rate}, labels weighted by 1/variance.
//
// The square root of the information matrix is kept, R'R = sum phi phi' / variance + prior, and
// each label is rotated into it (Givens; Golub & Van Loan, section 5.2.3): equal to batch least
// squares by QR at every step, and no difference of large matrices as in the covariance form.
// Predictive variance: phi' (R'R)^-1 phi s², s² the mean square of the weighted residuals, which is
// taken as 1 until there are more labels than coefficients. O(36) a label.
class PolynomialScheme final : public DriftScheme {
 public:
  static constexpr int kTerms = 6;
  using Coefficients = Eigen::Matrix<double, kTerms, 1>;

  // Throws std::invalid_argument with options.validate()'s sentence.
  explicit PolynomialScheme(const PolynomialOptions& options = {});

  void learn(const DriftLabel& label) override;
  [[nodiscard]] DriftPrediction predict(double time_s,
                                        std::span<const double> features) const override;

  // Of {1, T, T², T³, rate, T rate}; zeros before the first label.
  [[nodiscard]] const Coefficients& coefficients() const noexcept { return coefficients_; }

 private:
  [[nodiscard]] Coefficients terms(std::span<const double> features) const noexcept;
  void start(double variance) noexcept;
  void forget() noexcept;
  void rotate_in(Coefficients row, double target) noexcept;

  PolynomialOptions options_;
  Eigen::Matrix<double, kTerms, kTerms> root_;  // R, upper triangular
  Coefficients rotated_target_ = Coefficients::Zero();
  Coefficients coefficients_ = Coefficients::Zero();
  double residual_square_ = 0.0;  // weighted sum of squared residuals, the prior's included
  double weight_ = 0.0;           // number of labels, forgotten ones counting less
};

}  // namespace zerodrift::regression
