// SPDX-License-Identifier: Apache-2.0
#include "common/regression/sample_domain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "common/regression/kernel.h"
#include "common/regression/online_svr.h"
#include "common/regression/vector_operations.h"

namespace zerodrift::regression {

SampleDomain::SampleDomain(std::size_t dimension, std::size_t capacity)
    : dimension_(dimension),
      stride_(padded(capacity + 1)),  // a sample that is still leaving counts as well
      features_(dimension * stride_, 0.0) {}

// Vacant slots are put out of reach instead of being left out, so that columns stay whole.
void SampleDomain::assign(const OnlineSvr& svr) noexcept {
  size_ = svr.slot_count();
  for (std::size_t d = 0; d < dimension_; ++d) {
    for (std::size_t slot = 0; slot < size_; ++slot)
      features_[d * stride_ + slot] = svr.feature(slot, d);
  }
  for (std::size_t slot = 0; slot < size_; ++slot) {
    if (svr.set_of(slot) == SampleSet::kVacant)
      features_[slot] = std::numeric_limits<double>::infinity();
  }
}

std::vector<double> SampleDomain::export_samples() const {
  std::vector<double> samples;
  for (std::size_t i = 0; i < size_; ++i) {
    if (std::isinf(features_[i])) continue;  // a vacant slot
    for (std::size_t d = 0; d < dimension_; ++d) samples.push_back(features_[d * stride_ + i]);
  }
  return samples;
}

void SampleDomain::restore(std::span<const double> samples) {
  const bool fits = samples.size() % dimension_ == 0 && samples.size() / dimension_ <= stride_;
  const bool in_range = std::all_of(samples.begin(), samples.end(),
                                    [](double v) { return std::fabs(v) <= kLargestMagnitude; });
  if (!fits || !in_range) {
    throw std::invalid_argument(
        "sample domain: expected at most capacity + 1 samples of dimension numbers within "
        "kLargestMagnitude");
  }
  size_ = samples.size() / dimension_;
  for (std::size_t i = 0; i < size_; ++i) {
    for (std::size_t d = 0; d < dimension_; ++d)
      features_[d * stride_ + i] = samples[i * dimension_ + d];
  }
}

double SampleDomain::squared_distance_of_block(std::span<const double> x,
                                               std::size_t begin) const noexcept {
  std::array<double, kExpansionBlock> distance{};
  const std::size_t count = std::min(kExpansionBlock, size_ - begin);
  squared_distance_row({features_.data() + begin, stride_, dimension_, count}, x.data(),
                       distance.data());
  return minimum_of_nonnegative(distance.data(), count);
}

double SampleDomain::squared_distance(std::span<const double> x) const noexcept {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t begin = 0; begin < size_; begin += kExpansionBlock)
    nearest = std::min(nearest, squared_distance_of_block(x, begin));
  return nearest;
}

bool SampleDomain::has_within(std::span<const double> x, double squared) const noexcept {
  for (std::size_t begin = 0; begin < size_; begin += kExpansionBlock) {
    if (squared_distance_of_block(x, begin) <= squared) return true;
  }
  return false;
}

}  // namespace zerodrift::regression
