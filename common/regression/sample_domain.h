// SPDX-License-Identifier: Apache-2.0
// Where a learner has been: the feature vectors it holds, to ask how far another one is from them.
// A box of smallest and largest features would call (hot, cooling) known to a learner that met hot
// only while heating.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/core/state_archive.h"

namespace zerodrift::regression {

class OnlineSvr;

class SampleDomain {
 public:
  // All memory is allocated here.
  SampleDomain(std::size_t dimension, std::size_t capacity);

  // Copies the features of all samples in the learner's window, whose dimension and capacity must
  // be these. O(slots).
  void assign(const OnlineSvr& svr) noexcept;

  // Its state (core/state_archive.h), for one of this dimension and capacity.
  void carry(core::StateArchive& archive);

  // Whether a sample lies within this squared Euclidean distance: mostly found early. O(samples) at
  // worst.
  [[nodiscard]] bool has_within(std::span<const double> x, double squared) const noexcept;

 private:
  [[nodiscard]] double squared_distance_of_block(std::span<const double> x,
                                                 std::size_t begin) const noexcept;

  std::size_t dimension_;
  std::size_t stride_;
  std::size_t size_ = 0;          // samples
  std::vector<double> features_;  // by column
};

}  // namespace zerodrift::regression
