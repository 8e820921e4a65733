// SPDX-License-Identifier: Apache-2.0
// The labels that a scheme of batch training waits for, and what every scheme asks of a label.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/regression/drift_scheme.h"
#include "common/regression/kernel.h"

namespace zerodrift::regression {

// Finite, of positive duration and variance, with 1..kMaxDimension features. Others must not reach
// a scheme.
[[nodiscard]] bool is_learnable(const DriftLabel& label) noexcept;

// Complete with label number `labels` or with the first label at or after `until_s`, whichever
// comes first; that label belongs to it.
struct InitialSetOptions {
  std::size_t labels = 600;  // >= 2
  double until_s = std::numeric_limits<double>::infinity();

  // The first wrong key and what would be right; empty if all is well.
  [[nodiscard]] std::optional<std::string> validate() const;

  friend bool operator==(const InitialSetOptions&, const InitialSetOptions&) = default;
};

class InitialSet {
 public:
  explicit InitialSet(const InitialSetOptions& options) : options_(options) {}

  // True if the set is complete with this label. The number of features must not change.
  [[nodiscard]] bool add(const DriftLabel& label);

  // Gives the memory back; size() is 0 then.
  void release() noexcept;

  [[nodiscard]] std::size_t size() const noexcept { return drifts_.size(); }
  [[nodiscard]] std::size_t dimension() const noexcept { return dimension_; }
  [[nodiscard]] std::span<const double> features(std::size_t i) const noexcept {
    return {features_.data() + i * dimension_, dimension_};
  }
  [[nodiscard]] const std::vector<double>& drifts() const noexcept { return drifts_; }
  [[nodiscard]] const std::vector<double>& variances() const noexcept { return variances_; }

  // Of the drifts; 0 for the empty set.
  [[nodiscard]] double mean() const noexcept;
  // Population standard deviation of the drifts; 1 where they are all equal, so that it can always
  // divide.
  [[nodiscard]] double scale() const noexcept;

 private:
  InitialSetOptions options_;
  std::size_t dimension_ = 0;
  std::vector<double> features_;  // label by label
  std::vector<double> drifts_, variances_;
};

}  // namespace zerodrift::regression
