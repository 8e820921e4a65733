// SPDX-License-Identifier: Apache-2.0
#include "common/regression/sample_domain.h"

#include <algorithm>
#include <array>

#include "common/regression/kernel.h"
#include "common/regression/online_svr.h"
#include "common/regression/vector_operations.h"

namespace zerodrift::regression {

SampleDomain::SampleDomain(std::size_t dimension, std::size_t capacity)
    : dimension_(dimension),
      stride_(padded(capacity + 1)),  // a sample that is still leaving counts as well
      features_(dimension * stride_, 0.0) {}

void SampleDomain::assign(const OnlineSvr& svr) noexcept {
  size_ = 0;
  // Runs of samples between vacant slots: few, if any, are vacant but behind the last sample.
  for (std::size_t slot = 0; slot < svr.slot_count();) {
    const std::size_t end = svr.next_vacant(slot);
    for (std::size_t d = 0; d < dimension_; ++d)
      std::copy(svr.features(d) + slot, svr.features(d) + end, &features_[d * stride_ + size_]);
    size_ += end - slot;
    slot = end + 1;
  }
}

void SampleDomain::carry(core::StateArchive& archive) {
  archive(size_);
  archive.require(size_ <= stride_);
  if (!archive.ok()) return;
  for (std::size_t d = 0; d < dimension_; ++d)
    archive.numbers(&features_[d * stride_], size_, kLargestMagnitude);
}

double SampleDomain::squared_distance_of_block(std::span<const double> x,
                                               std::size_t begin) const noexcept {
  std::array<double, kExpansionBlock> distance{};
  const std::size_t count = std::min(kExpansionBlock, size_ - begin);
  squared_distance_row({features_.data() + begin, stride_, dimension_, count}, x.data(),
                       distance.data());
  return minimum_of_nonnegative(distance.data(), count);
}

bool SampleDomain::has_within(std::span<const double> x, double squared) const noexcept {
  for (std::size_t begin = 0; begin < size_; begin += kExpansionBlock) {
    if (squared_distance_of_block(x, begin) <= squared) return true;
  }
  return false;
}

}  // namespace zerodrift::regression
