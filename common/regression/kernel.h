// SPDX-License-Identifier: Apache-2.0
// Kernels of the online SVR, evaluated for one sample against a block of samples stored by column.
//
// The dual coefficients of an SVR with a bias add up to zero, so a constant may be taken off a
// kernel without changing the optimum. The stationary kernels are therefore evaluated as k - 1
// (expm1 for the RBF): near samples keep all the digits of their distance, and k(x, x) is exactly
// 0.
//
// All results are bit-identical on every processor (vector_clones.h) and symmetric to the bit in
// their two samples.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "common/core/state_archive.h"

namespace zerodrift::regression {

// Most features a sample can have.
inline constexpr std::size_t kMaxDimension = 16;

// d is the Euclidean distance of the two samples, x.y their scalar product.
enum class KernelKind : std::uint8_t {
  kRbf = 0,         // exp(-gamma d²)
  kMatern32 = 1,    // (1 + s) exp(-s), s = sqrt(6 gamma) d
  kMatern52 = 2,    // (1 + s + s²/3) exp(-s), s = sqrt(10 gamma) d
  kPolynomial = 3,  // (gamma x.y + offset)^degree
  kLinear = 4,      // x.y
};

// gamma has the same meaning for the RBF and the Matérn kernels: 1 / (2 length_scale²), in the
// features' units^-2.
struct Kernel {
  KernelKind kind = KernelKind::kRbf;
  double gamma = 1.0;   // > 0
  int degree = 3;       // 1..8, kPolynomial only
  double offset = 1.0;  // >= 0, kPolynomial only

  // The first wrong key and what would be right; empty if all is well.
  [[nodiscard]] std::optional<std::string> validate() const;
  [[nodiscard]] bool is_stationary() const noexcept;

  void carry(core::StateArchive& archive) {
    archive(kind, gamma, degree, offset);
    archive.require(!validate());
  }

  friend bool operator==(const Kernel&, const Kernel&) = default;
};

// Samples by column: feature d of sample i is data[d * stride + i].
struct SampleColumns {
  const double* data;
  std::size_t stride;
  std::size_t dimension;
  std::size_t count;
};

// out[i] = k(samples_i, x) for i < samples.count, less 1 for a stationary kernel.
void evaluate_row(const Kernel& kernel, const SampleColumns& samples, const double* x,
                  double* out) noexcept;

// k(x, x), less 1 (so 0) for a stationary kernel.
[[nodiscard]] double self_value(const Kernel& kernel, const double* x,
                                std::size_t dimension) noexcept;

// out[i] = |samples_i - x|².
void squared_distance_row(const SampleColumns& samples, const double* x, double* out) noexcept;

// Partial sums of sum_i weights[i] k(samples_i, x). Samples may come in several blocks; every
// block but the last must hold kExpansionBlock samples, so that the order of the sum doesn't
// depend on where the blocks come from.
inline constexpr std::size_t kExpansionBlock = 64;

class KernelExpansion {
 public:
  KernelExpansion(const Kernel& kernel, const double* x) noexcept : kernel_(kernel), x_(x) {}

  // Adds samples.count <= kExpansionBlock samples.
  void add_block(const SampleColumns& samples, const double* weights) noexcept;
  [[nodiscard]] double total() const noexcept { return total_; }

 private:
  const Kernel& kernel_;
  const double* x_;
  double total_ = 0.0;
};

}  // namespace zerodrift::regression
