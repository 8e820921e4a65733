// SPDX-License-Identifier: Apache-2.0
#include "common/regression/svr_predictor.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "common/core/require.h"
#include "common/regression/online_svr.h"
#include "common/regression/vector_operations.h"

namespace zerodrift::regression {
SvrPredictor::SvrPredictor(std::size_t dimension, std::size_t capacity)
    : dimension_(dimension), stride_(padded(capacity + 1)) {
  if (dimension < 1 || dimension > kMaxDimension) {
    throw std::invalid_argument("SVR predictor: dimension: found " + std::to_string(dimension) +
                                ", expected 1 to " + std::to_string(kMaxDimension));
  }
  features_.resize(dimension_ * stride_);
  weights_.resize(stride_);
}

void SvrPredictor::assign(const OnlineSvr& svr) noexcept {
  core::require(svr.options().dimension == dimension_ && padded(svr.slot_count()) == stride_,
                "a predictor is as large as the online SVR that it copies");
  kernel_ = svr.options().kernel;
  bias_ = svr.bias();
  support_size_ = 0;
  for (std::size_t slot = 0; slot < svr.slot_count(); ++slot) {
    if (svr.theta(slot) == 0.0) continue;
    for (std::size_t d = 0; d < dimension_; ++d) {
      features_[d * stride_ + support_size_] = svr.feature(slot, d);
    }
    weights_[support_size_++] = svr.theta(slot);
  }
  std::fill(weights_.begin() + static_cast<std::ptrdiff_t>(support_size_),
            weights_.begin() + static_cast<std::ptrdiff_t>(padded(support_size_)), 0.0);
}

SvrPredictor& SvrPredictor::operator=(const SvrPredictor& other) noexcept {
  core::require(other.dimension_ == dimension_ && other.stride_ == stride_,
                "a predictor is as large as the one that it copies");
  kernel_ = other.kernel_;
  bias_ = other.bias_;
  support_size_ = other.support_size_;
  const std::size_t used = padded(support_size_);
  for (std::size_t d = 0; d < dimension_; ++d)
    std::copy_n(&other.features_[d * stride_], used, &features_[d * stride_]);
  std::copy_n(other.weights_.data(), used, weights_.data());
  return *this;
}

void SvrPredictor::carry(core::StateArchive& archive) {
  archive(kernel_, support_size_);
  archive.sums(bias_);
  archive.require(support_size_ <= stride_);
  if (!archive.ok()) return;
  for (std::size_t d = 0; d < dimension_; ++d)
    archive.numbers(&features_[d * stride_], support_size_, kLargestMagnitude);
  archive.numbers(weights_.data(), support_size_, core::StateArchive::kLargestSum);
  if (!archive.reads()) return;
  std::fill(weights_.begin() + static_cast<std::ptrdiff_t>(support_size_), weights_.end(), 0.0);
}

double SvrPredictor::predict(std::span<const double> x) const noexcept {
  core::require(x.size() == dimension_, "features are as many as the predictor learned");
  KernelExpansion expansion(kernel_, x.data());
  for (std::size_t begin = 0; begin < support_size_; begin += kExpansionBlock) {
    const std::size_t count = std::min(kExpansionBlock, padded(support_size_ - begin));
    expansion.add_block({features_.data() + begin, stride_, dimension_, count},
                        weights_.data() + begin);
  }
  return expansion.total() + bias_;
}

}  // namespace zerodrift::regression
