// SPDX-License-Identifier: Apache-2.0
// Chooses the online SVR's kernel and its gamma from a batch of labelled samples, off the data
// path.
//
// Model of a criterion: y = mu + f(x) + noise, cov f = s² K, variance of the noise s² ridge. With
// A = K + ridge I and the mean profiled out (generalised least squares),
//   P = A^-1 - A^-1 1 (1' A^-1 1)^-1 1' A^-1,
// every criterion below depends on P alone, so it doesn't see a constant added to the kernel or to
// the targets, exactly like an SVR with a bias; kernels less 1 (kernel.h) are used as they are.
//
//   paper                ||w||² = y' P y at a fixed ridge, the known label noise over the targets'
//                        variance. Mao, Xu, He & Wu (2022), eq. (7), is its limit without ridge,
//                        which charges the labels' noise to w and therefore prefers the largest
//                        gamma.
//   marginal likelihood  (n-1) log s² + log |A| + log (1' A^-1 1) + y' P y / s²: the restricted
//                        likelihood of Gaussian-process regression (Rasmussen & Williams 2006,
//                        section 2.7), with s² = y' P y / (n-1) and the ridge at its optimum.
//   leave one out        the mean square of the errors of each target predicted from the others, in
//                        closed form (P y)_i / P_ii (ibid., eq. 5.12, with the mean), at the
//                        marginal likelihood's ridge: its own choice of a ridge is flat, and gamma
//                        ran to the lower edge on four drift records out of six.
//
// In the last two, s² ridge is not allowed below the known label noise. All three are stated as
// costs in nats (half the likelihood's expression; half the logarithm times n-1 or n for the
// others), of targets scaled to unit variance, so that one margin suits all and scaled targets give
// the same figures.
//
// Samples are condensed to at most dictionary_capacity cells, each the mean of the samples nearest
// to one of a spread set of centres (farthest-point traversal), with its number of labels as its
// weight. That is exact for samples of the same features, and elsewhere ignores the drift's
// curvature inside a cell, which then counts as noise. The samples are sorted first, so that their
// order doesn't matter. Measured on synthetic drift (two heat/cool cycles, 500 samples, ten
// records), error of the resulting SVR over the drift's amplitude, for an amplitude of 100, 20 and
// 5 label sigmas: one sample a cell, the rest unused, .0033 .0079 .039; cell means .0029 .0076
// .031; all 500 samples uncondensed .0032 .0075 .030, at eighty times the time.
//
// Numerics: weights and mean are taken out by one reflection, the Gram matrix of the contrasts is
// made tridiagonal, and then a ridge costs O(n) (O(n²) leave one out). Search by a fixed grid and,
// for what may still beat the RBF and a kernel in use and is best inside of it, golden section: the
// same result for the same samples.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>

#include "common/regression/kernel.h"

namespace zerodrift::regression {

enum class SelectionCriterion : std::uint8_t {
  kPaper = 0,
  kMarginalLikelihood = 1,
  kLeaveOneOut = 2,
};

struct KernelSelectionOptions {
  SelectionCriterion criterion = SelectionCriterion::kMarginalLikelihood;
  double label_noise = 0.01;  // standard deviation, unit of the targets, >= 0
  // Cells the criterion sees, kFewestSamples..1000. Cost of a selection: its cube.
  std::size_t dictionary_capacity = 100;
  // Range of gamma, in (scaled features)^-2. 0.01 is a length scale of 7 scaled units: over
  // features of the order of 1 that is a polynomial of low degree already. At 100, samples 0.2
  // apart, the spacing of 100 samples in a square of side 2, are as good as independent
  // (exp(-4) = 0.02): beyond it no criterion has anything to go by.
  double gamma_lowest = 0.01;
  double gamma_highest = 100.0;
  // Nats by which another member of the family must beat the RBF, and a new choice the present
  // kernel, >= 0. As a Bayes factor 3 nats are 20, "strong" (Kass & Raftery 1995). Twice the gain
  // of a parameter fitted again to an independent record of an unchanged truth is twice a
  // chi-squared of one degree of freedom: above 3 nats in 8 % of records at most. On 60 synthetic
  // records it was never above 2.1 with the marginal likelihood, and above 3 on 5 with leave one
  // out, which is no likelihood. Records that share labels differ less.
  double margin_nats = 3.0;

  // The first wrong key and what would be right; empty if all is well.
  [[nodiscard]] std::optional<std::string> validate() const;
};

inline constexpr std::size_t kFewestSamples = 20;  // with features of their own

struct KernelChoice {
  Kernel kernel;
  double ridge = 0.0;         // noise variance over signal variance, unit of the kernel
  double signal_sigma = 0.0;  // s, unit of the targets over the root of the kernel's
  double noise_sigma = 0.0;   // s sqrt(ridge), unit of the targets
  // Nats, less is better; comparable only on the same samples and options. Infinity: this kernel
  // can't be scored on these samples.
  double score = std::numeric_limits<double>::infinity();
};

enum class SelectionStatus : std::uint8_t {
  kSelected,
  kTooFewSamples,      // fewer than kFewestSamples with features of their own
  kDegenerateTargets,  // all the same
  kNoSignal,  // no kernel beats a constant by the margin; the choices are there but mean little
  kRefused,   // not finite, beyond kLargestMagnitude, sizes that don't match or wrong options
};

// RBF, Matérn 3/2, Matérn 5/2, polynomial of degree 2 and 3, linear.
inline constexpr std::size_t kFamilySize = 6;

struct KernelSelection {
  SelectionStatus status = SelectionStatus::kRefused;
  KernelChoice best;  // of the family, the RBF unless beaten by the margin
  // Each at its best gamma, of the grid alone where that is an end of the range, or is the margin
  // and more behind the RBF, or behind the present kernel.
  std::array<KernelChoice, kFamilySize> family;
  KernelChoice present;  // the kernel in use, scored on the same samples; of none the score is
                         // infinite
  double constant_score = std::numeric_limits<double>::infinity();  // of no kernel at all
  std::size_t dictionary_size = 0;
};

// O(dictionary_capacity³), some 30 to 80 factorisations over four decades of gamma. Never NaN in
// the result. With the kernel in use those of the family that the grid shows behind it aren't
// refined: half the time where it still is the best one.
[[nodiscard]] KernelSelection select_kernel(const KernelSelectionOptions& options,
                                            const SampleColumns& samples,
                                            std::span<const double> targets,
                                            const std::optional<Kernel>& present = {});

// Whether a running model should be rebuilt: the selection succeeded and its best choice beats the
// present kernel by the margin.
[[nodiscard]] bool is_materially_better(const KernelSelectionOptions& options,
                                        const KernelSelection& selection) noexcept;

}  // namespace zerodrift::regression
