// SPDX-License-Identifier: Apache-2.0
#include "common/regression/sample_domain.h"

#include <algorithm>
#include <array>
#include <limits>

#include "common/regression/kernel.h"
#include "common/regression/online_svr.h"
#include "common/regression/vector_operations.h"

namespace zerodrift::regression {

SampleDomain::SampleDomain(std::size_t dimension, std::size_t capacity)
    : dimension_(dimension),
      stride_(padded(capacity + 1)),  // a sample that is still leaving counts as well
      features_(dimension * stride_, 0.0) {}

// Vacant slots are put out of reach instead of being left out, so that columns are copied whole.
void SampleDomain::assign(const OnlineSvr& svr) noexcept {
  size_ = svr.slot_count();
  for (std::size_t d = 0; d < dimension_; ++d) {
    const auto column = svr.feature_column(d);
    std::copy(column.begin(), column.end(),
              features_.begin() + static_cast<std::ptrdiff_t>(d * stride_));
  }
  for (std::size_t slot = 0; slot < size_; ++slot) {
    if (svr.set_of(slot) == SampleSet::kVacant)
      features_[slot] = std::numeric_limits<double>::infinity();
  }
}

double SampleDomain::squared_distance(std::span<const double> x) const noexcept {
  double nearest = std::numeric_limits<double>::infinity();
  std::array<double, kExpansionBlock> distance{};
  for (std::size_t begin = 0; begin < size_; begin += kExpansionBlock) {
    const std::size_t count = std::min(kExpansionBlock, size_ - begin);
    squared_distance_row({features_.data() + begin, stride_, dimension_, count}, x.data(),
                         distance.data());
    nearest = std::min(nearest, minimum_of_nonnegative(distance.data(), count));
  }
  return nearest;
}

}  // namespace zerodrift::regression
