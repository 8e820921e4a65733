// SPDX-License-Identifier: Apache-2.0
// The samples that a kernel is selected on: in an order of their own, and condensed to as many as a
// dictionary holds.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/regression/kernel_selection.h"

namespace zerodrift::regression {

// As many targets as samples, every figure within kLargestMagnitude.
[[nodiscard]] bool is_acceptable(const SampleColumns& samples, std::span<const double> targets);

// A batch by column, stride size(). A cell's weight is the number of labels it is the mean of.
struct Cells {
  std::size_t dimension = 0;
  std::vector<double> features;
  std::vector<double> targets;
  std::vector<double> weights;

  [[nodiscard]] std::size_t size() const { return targets.size(); }
  [[nodiscard]] SampleColumns columns() const {
    return {features.data(), size(), dimension, size()};
  }
  void gather(std::size_t cell, double* x) const {
    for (std::size_t d = 0; d < dimension; ++d) x[d] = features[d * size() + cell];
  }
};

// By features, then by target: from here on the order of the samples doesn't matter.
[[nodiscard]] Cells sorted(const SampleColumns& samples, std::span<const double> targets);

// Which of `cell_count` cells each sample belongs to: the one whose centre is nearest.
struct Partition {
  std::vector<std::size_t> cell_of;
  std::size_t cell_count = 0;
};

// Centres by farthest-point traversal from the first sample, ties to the earlier one, until the
// capacity is used up or every sample is at a centre. O(n capacity).
[[nodiscard]] Partition spread_partition(const Cells& samples, std::size_t capacity);

// The mean of every cell.
[[nodiscard]] Cells condensed(const Cells& samples, const Partition& partition);

}  // namespace zerodrift::regression
