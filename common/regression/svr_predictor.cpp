// SPDX-License-Identifier: Apache-2.0
#include "common/regression/svr_predictor.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "common/core/require.h"
#include "common/regression/online_svr.h"
#include "common/regression/vector_operations.h"

namespace zerodrift::regression {
namespace {

void require(bool condition, const char* field, const char* expected) {
  if (condition) return;
  throw std::invalid_argument(std::string("SVR predictor state: ") + field + ": expected " +
                              expected);
}

bool are_in_range(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(),
                     [](double v) { return std::fabs(v) <= kLargestMagnitude; });
}

}  // namespace

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

SvrPredictorState SvrPredictor::export_state() const {
  SvrPredictorState state{.kernel = kernel_, .bias = bias_, .features = {}, .weights = {}};
  for (std::size_t i = 0; i < support_size_; ++i) {
    for (std::size_t d = 0; d < dimension_; ++d)
      state.features.push_back(features_[d * stride_ + i]);
    state.weights.push_back(weights_[i]);
  }
  return state;
}

void SvrPredictor::restore(const SvrPredictorState& state) {
  const std::size_t size = state.weights.size();
  require(!state.kernel.validate(), "kernel", "a usable kernel");
  require(std::fabs(state.bias) <= kLargestSum, "bias", "a number within 1e100");
  require(size <= stride_, "weights", "at most capacity + 1 numbers");
  require(std::all_of(state.weights.begin(), state.weights.end(),
                      [](double w) { return std::fabs(w) <= kLargestSum; }),
          "weights", "numbers within 1e100");
  require(state.features.size() == size * dimension_, "features", "dimension numbers a weight");
  require(are_in_range(state.features), "features", "numbers within kLargestMagnitude");
  kernel_ = state.kernel;
  bias_ = state.bias;
  support_size_ = size;
  for (std::size_t i = 0; i < size; ++i) {
    for (std::size_t d = 0; d < dimension_; ++d)
      features_[d * stride_ + i] = state.features[i * dimension_ + d];
  }
  std::fill(weights_.begin(), weights_.end(), 0.0);
  std::copy(state.weights.begin(), state.weights.end(), weights_.begin());
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
