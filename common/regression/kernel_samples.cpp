// SPDX-License-Identifier: Apache-2.0
#include "common/regression/kernel_samples.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/regression/online_svr.h"

namespace zerodrift::regression {
namespace {

bool is_acceptable(double value) {
  return std::fabs(value) <= kLargestMagnitude;  // false for NaN
}

}  // namespace

bool is_acceptable(const SampleColumns& samples, std::span<const double> targets) {
  if (samples.dimension < 1 || samples.dimension > kMaxDimension ||
      samples.count != targets.size() || samples.stride < samples.count) {
    return false;
  }
  for (std::size_t d = 0; d < samples.dimension; ++d) {
    const double* column = samples.data + d * samples.stride;
    if (!std::all_of(column, column + samples.count, [](double v) { return is_acceptable(v); })) {
      return false;
    }
  }
  return std::all_of(targets.begin(), targets.end(), [](double v) { return is_acceptable(v); });
}

Cells sorted(const SampleColumns& samples, std::span<const double> targets) {
  std::vector<std::size_t> order(samples.count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    for (std::size_t d = 0; d < samples.dimension; ++d) {
      const double* column = samples.data + d * samples.stride;
      if (column[a] != column[b]) return column[a] < column[b];
    }
    return targets[a] < targets[b];
  });
  Cells singles{samples.dimension, {}, {}, std::vector<double>(samples.count, 1.0)};
  for (std::size_t d = 0; d < samples.dimension; ++d) {
    for (const std::size_t i : order) {
      singles.features.push_back(samples.data[d * samples.stride + i]);
    }
  }
  for (const std::size_t i : order) singles.targets.push_back(targets[i]);
  return singles;
}

Partition spread_partition(const Cells& samples, std::size_t capacity) {
  Partition partition{std::vector<std::size_t>(samples.size(), 0), 0};
  if (samples.size() == 0) return partition;
  std::vector<double> nearest(samples.size(), std::numeric_limits<double>::infinity());
  std::vector<double> distances(samples.size());
  std::size_t centre = 0;
  double x[kMaxDimension];
  do {
    samples.gather(centre, x);
    squared_distance_row(samples.columns(), x, distances.data());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (!(distances[i] < nearest[i])) continue;
      nearest[i] = distances[i];
      partition.cell_of[i] = partition.cell_count;
    }
    ++partition.cell_count;
    const auto farthest = std::max_element(nearest.begin(), nearest.end());
    centre = static_cast<std::size_t>(farthest - nearest.begin());
  } while (partition.cell_count < capacity && nearest[centre] > 0.0);
  return partition;
}

Cells condensed(const Cells& samples, const Partition& partition) {
  const std::size_t count = partition.cell_count;
  Cells cells{samples.dimension, std::vector<double>(count * samples.dimension),
              std::vector<double>(count), std::vector<double>(count)};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const std::size_t cell = partition.cell_of[i];
    cells.targets[cell] += samples.targets[i];
    cells.weights[cell] += 1.0;
    for (std::size_t d = 0; d < samples.dimension; ++d) {
      cells.features[d * count + cell] += samples.features[d * samples.size() + i];
    }
  }
  for (std::size_t cell = 0; cell < count; ++cell) {
    cells.targets[cell] /= cells.weights[cell];
    for (std::size_t d = 0; d < samples.dimension; ++d) {
      cells.features[d * count + cell] /= cells.weights[cell];
    }
  }
  return cells;
}

}  // namespace zerodrift::regression
