// SPDX-License-Identifier: Apache-2.0
// Where a learner has been: the feature vectors it holds, to ask how far another one is from them.
// A box of smallest and largest features would call (hot, cooling) known to a learner that met hot
// only while heating.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace zerodrift::regression {

class OnlineSvr;

class SampleDomain {
 public:
  // All memory is allocated here.
  SampleDomain(std::size_t dimension, std::size_t capacity);

  // Copies the features of all samples in the learner's window, whose dimension and capacity must
  // be these. O(slots).
  void assign(const OnlineSvr& svr) noexcept;

  // The samples, one after the other; and back. restore() throws std::invalid_argument where they
  // can't belong to this dimension and capacity.
  [[nodiscard]] std::vector<double> export_samples() const;
  void restore(std::span<const double> samples);

  // Squared Euclidean distance from x to the nearest sample; infinity while there is none.
  // O(samples).
  [[nodiscard]] double squared_distance(std::span<const double> x) const noexcept;

  // Whether a sample lies within the distance: mostly found early. O(samples) at worst.
  [[nodiscard]] bool has_within(std::span<const double> x, double squared) const noexcept;

 private:
  [[nodiscard]] double squared_distance_of_block(std::span<const double> x,
                                                 std::size_t begin) const noexcept;

  std::size_t dimension_;
  std::size_t stride_;
  std::size_t size_ = 0;          // slots
  std::vector<double> features_;  // by column
};

}  // namespace zerodrift::regression
