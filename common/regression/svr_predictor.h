// SPDX-License-Identifier: Apache-2.0
// A snapshot of an OnlineSvr for the real-time data path: support vectors only, packed. The
// learner's thread fills it, hands it over and doesn't touch it while another thread predicts; how
// it is handed over is the caller's business.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/core/state_archive.h"
#include "common/regression/kernel.h"

namespace zerodrift::regression {

class OnlineSvr;

class SvrPredictor {
 public:
  // Predicts 0 until assigned. Capacity: the capacity of the learner. All memory is allocated here.
  // Throws std::invalid_argument for a dimension outside 1..kMaxDimension.
  SvrPredictor(std::size_t dimension, std::size_t capacity);

  SvrPredictor(const SvrPredictor&) = default;
  SvrPredictor(SvrPredictor&&) noexcept = default;
  // Of one of the same dimension and capacity. O(support vectors), no allocation.
  SvrPredictor& operator=(const SvrPredictor& other) noexcept;
  SvrPredictor& operator=(SvrPredictor&&) noexcept = default;
  ~SvrPredictor() = default;

  // Copies the learner's present model; dimension and capacity must be the learner's. O(slots).
  void assign(const OnlineSvr& svr) noexcept;

  // Equal to the bit to the learner's predict() at the time of assign(). O(support vectors).
  [[nodiscard]] double predict(std::span<const double> x) const noexcept;

  // Its state (core/state_archive.h), for one of this dimension and capacity.
  void carry(core::StateArchive& archive);

  [[nodiscard]] std::size_t dimension() const noexcept { return dimension_; }
  [[nodiscard]] std::size_t support_size() const noexcept { return support_size_; }
  [[nodiscard]] double bias() const noexcept { return bias_; }

 private:
  std::size_t dimension_;
  std::size_t stride_;
  std::size_t support_size_ = 0;
  Kernel kernel_;
  double bias_ = 0.0;
  std::vector<double> features_;  // by column
  std::vector<double> weights_;   // theta, then zeros up to a multiple of kLane
};

}  // namespace zerodrift::regression
