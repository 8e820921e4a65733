// SPDX-License-Identifier: Apache-2.0
// A small dictionary of samples that grows by one only for a sample whose feature vector doesn't
// lie in the span of those held, with the Cholesky factor of its regularised Gram matrix and the
// ridge solution's norm kept up to date: O(n²) a sample, no batch factorisation.
//
// How Mao, Xu, He & Wu (2022), section 2.2, eq. (5)-(11), map to it. With one sample i fixed and
// alpha_k = Phi(x_i) y_k - Phi(x_k) y_i, an exact fit w (w.Phi(x_k) = y_k) is orthogonal to every
// alpha.
//
// - Eq. (5), Gram-Schmidt of the alphas to beta_1..beta_d, is the Cholesky factor: row k of L holds
//   the coordinates of Phi(x_k) in an orthonormal basis of the samples so far.
// - Eq. (7), ||w||² = y_i² / (K_ii - sum_j gamma_j²) with gamma_j = Phi(x_i).beta_j, is y' K^-1 y:
//   squared_norm() with ridge 0. It interpolates the labels' noise too; a ridge mends that.
// - Eq. (8)-(11), the recursions in kernel values that find the part of alpha_{l+1} outside the
//   span, are the triangular solve and the pivot of one append. alpha_{l+1} lies in the span
//   exactly if Phi(x_{l+1}) does (here novelty <= novelty_tolerance: no growth) and the target
//   agrees (|prior_residual| small). With a tube the second half is |h| <= epsilon; it and the box
//   constraint are the learner's (online_svr.h).
//
// The bias is profiled out: samples enter as contrasts to the first one,
//   A_jk = K_jk - K_0k - K_j0 + K_00 + ridge (1 + delta_jk),   c_j = y_j - y_0,   j, k = 1..n-1,
// so a constant on the kernel or on the targets changes nothing, and kernels less 1 (kernel.h) may
// be used as they are. c' A^-1 c = min over mu of (y - mu)' (K + ridge I)^-1 (y - mu), and
// |A| = |K + ridge I| 1' (K + ridge I)^-1 1.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/regression/kernel.h"
#include "common/regression/margin_factor.h"

namespace zerodrift::regression {

struct GramDictionaryOptions {
  std::size_t dimension = 2;   // features per sample, 1..kMaxDimension
  std::size_t capacity = 100;  // samples held at most, 2..kLargestDictionary
  Kernel kernel;
  double ridge = 1e-4;  // noise variance over signal variance, >= 0, unit of the kernel
  // A sample grows the dictionary if its novelty is above this, unit of the kernel. Above the
  // ridge: a sample met again has a novelty of up to the ridge. >= 1e-10.
  double novelty_tolerance = 1e-2;

  // The first wrong key and what would be right; empty if all is well.
  [[nodiscard]] std::optional<std::string> validate() const;
};

// O(n²) memory and time: past this a dictionary isn't small.
inline constexpr std::size_t kLargestDictionary = 1000;

enum class GrowthOutcome : std::uint8_t {
  kGrown,
  kSpanned,  // in the span of the samples held; nothing changed
  kFull,     // not in the span, but no room; nothing changed
  kRefused,  // not finite, beyond kLargestMagnitude or wrong dimension; nothing changed
};

struct GrowthReport {
  GrowthOutcome outcome = GrowthOutcome::kRefused;
  // Squared distance of the sample's feature vector from the span, the bias counted in, ridge and
  // all: the variance of the prediction in units of the signal variance. 1 + ridge for the first.
  double novelty = 0.0;
  double prior_residual = 0.0;  // prediction - y before the sample, unit of the targets
};

// One thread. Everything is allocated in the constructor.
class GramDictionary {
 public:
  // Throws std::invalid_argument with options.validate()'s sentence.
  explicit GramDictionary(const GramDictionaryOptions& options);

  // O(n²).
  GrowthReport offer(std::span<const double> x, double y) noexcept;

  // The ridge solution at x, 0 while empty. O(n²).
  [[nodiscard]] double predict(std::span<const double> x) noexcept;

  [[nodiscard]] std::size_t size() const noexcept { return size_; }

  // c' A^-1 c: eq. (7) with ridge and bias.
  [[nodiscard]] double squared_norm() const noexcept { return squared_norm_; }

  // log |A|.
  [[nodiscard]] double log_determinant() const noexcept { return log_determinant_; }

 private:
  struct Projection {
    double prediction;
    double pivot;  // novelty + ridge
  };

  [[nodiscard]] Projection project(const double* x) noexcept;
  void append(const double* x, double y, const Projection& projection) noexcept;

  GramDictionaryOptions options_;
  MarginFactor factor_;
  std::size_t size_ = 0;
  std::vector<double> features_;         // by column, stride capacity
  std::vector<double> reference_row_;    // k(x_j, x_0)
  std::vector<double> whitened_;         // L^-1 c, by row of the factor
  std::vector<double> row_, contrasts_;  // scratch; contrasts_ is L^-1 a after project()
  double reference_target_ = 0.0;
  double squared_norm_ = 0.0;
  double log_determinant_ = 0.0;
};

}  // namespace zerodrift::regression
