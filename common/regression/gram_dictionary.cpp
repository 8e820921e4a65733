// SPDX-License-Identifier: Apache-2.0
#include "common/regression/gram_dictionary.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/regression/online_svr.h"
#include "common/regression/vector_operations.h"

namespace zerodrift::regression {
namespace {

// Digits lost by taking a pivot as a difference: below this it is rounding.
constexpr double kSmallestTolerance = 1e-10;

bool is_acceptable(double value) noexcept {
  return std::fabs(value) <= kLargestMagnitude;  // false for NaN
}

const GramDictionaryOptions& checked(const GramDictionaryOptions& options) {
  if (const auto error = options.validate()) throw std::invalid_argument(*error);
  return options;
}

}  // namespace

std::optional<std::string> GramDictionaryOptions::validate() const {
  if (dimension < 1 || dimension > kMaxDimension) {
    return "dimension: found " + std::to_string(dimension) + ", expected 1 to " +
           std::to_string(kMaxDimension);
  }
  if (capacity < 2 || capacity > kLargestDictionary) {
    return "capacity: found " + std::to_string(capacity) + ", expected 2 to " +
           std::to_string(kLargestDictionary);
  }
  if (auto error = kernel.validate()) return error;
  if (!(std::isfinite(ridge) && ridge >= 0.0)) {
    return "ridge: found " + std::to_string(ridge) + ", expected a number of at least 0";
  }
  if (!(std::isfinite(novelty_tolerance) && novelty_tolerance >= kSmallestTolerance &&
        novelty_tolerance > ridge)) {
    return "novelty_tolerance: found " + std::to_string(novelty_tolerance) +
           ", expected a number of at least 1e-10 and above the ridge, " + std::to_string(ridge);
  }
  return std::nullopt;
}

GramDictionary::GramDictionary(const GramDictionaryOptions& options)
    : options_(checked(options)),
      factor_(options.capacity),
      features_(options.dimension * options.capacity),
      reference_row_(options.capacity),
      whitened_(options.capacity),
      row_(options.capacity),
      contrasts_(options.capacity) {}

GramDictionary::Projection GramDictionary::project(const double* x) noexcept {
  const double ridge = options_.ridge;
  if (size_ == 0) return {0.0, 1.0 + 2.0 * ridge};
  evaluate_row(options_.kernel, {features_.data(), options_.capacity, options_.dimension, size_}, x,
               row_.data());
  const double offset = reference_row_[0] - row_[0] + ridge;
  for (std::size_t j = 1; j < size_; ++j) {
    contrasts_[j - 1] = row_[j] - reference_row_[j] + offset;
  }
  factor_.solve_lower(contrasts_.data());
  const std::size_t rows = factor_.rows();
  const double own = (self_value(options_.kernel, x, options_.dimension) - row_[0]) +
                     (reference_row_[0] - row_[0]) + 2.0 * ridge;
  return {reference_target_ + dot(contrasts_.data(), whitened_.data(), rows),
          own - dot(contrasts_.data(), contrasts_.data(), rows)};
}

void GramDictionary::append(const double* x, double y, const Projection& projection) noexcept {
  if (size_ == 0) {
    reference_target_ = y;
    reference_row_[0] = self_value(options_.kernel, x, options_.dimension);
  } else {
    factor_.append(contrasts_.data(), projection.pivot);
    const double residual = y - projection.prediction;
    whitened_[size_ - 1] = residual / std::sqrt(projection.pivot);
    squared_norm_ += residual * residual / projection.pivot;
    log_determinant_ += std::log(projection.pivot);
    reference_row_[size_] = row_[0];
  }
  for (std::size_t d = 0; d < options_.dimension; ++d) {
    features_[d * options_.capacity + size_] = x[d];
  }
  ++size_;
}

GrowthReport GramDictionary::offer(std::span<const double> x, double y) noexcept {
  GrowthReport report;
  if (x.size() != options_.dimension || !is_acceptable(y) ||
      !std::all_of(x.begin(), x.end(), is_acceptable)) {
    return report;
  }
  const Projection projection = project(x.data());
  report.novelty = projection.pivot - options_.ridge;
  report.prior_residual = projection.prediction - y;
  if (size_ > 0 && !(report.novelty > options_.novelty_tolerance)) {
    report.outcome = GrowthOutcome::kSpanned;
    return report;
  }
  if (size_ == options_.capacity) {
    report.outcome = GrowthOutcome::kFull;
    return report;
  }
  append(x.data(), y, projection);
  report.outcome = GrowthOutcome::kGrown;
  return report;
}

double GramDictionary::predict(std::span<const double> x) noexcept {
  return project(x.data()).prediction;
}

}  // namespace zerodrift::regression
