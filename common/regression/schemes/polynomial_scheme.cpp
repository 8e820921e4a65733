// SPDX-License-Identifier: Apache-2.0
#include "common/regression/schemes/polynomial_scheme.h"

#include <cassert>
#include <cmath>

#include "common/core/require.h"
#include "common/regression/kernel.h"
#include "common/regression/schemes/initial_set.h"
#include "common/regression/schemes/option_error.h"

namespace zerodrift::regression {

std::optional<std::string> PolynomialOptions::validate() const {
  const std::string index = "an index below " + std::to_string(kMaxDimension);
  if (temperature_feature >= kMaxDimension) {
    return wrong_option("temperature_feature", std::to_string(temperature_feature), index);
  }
  if (rate_feature >= kMaxDimension) {
    return wrong_option("rate_feature", std::to_string(rate_feature), index);
  }
  if (!is_positive(prior_deviation)) {
    return wrong_option("prior_deviation", std::to_string(prior_deviation), "a number above 0");
  }
  if (!(forgetting > 0.0 && forgetting <= 1.0)) {
    return wrong_option("forgetting", std::to_string(forgetting), "a number above 0, at most 1");
  }
  return std::nullopt;
}

PolynomialScheme::PolynomialScheme(const PolynomialOptions& options)
    : options_(checked_options("polynomial", options)) {
  root_.setZero();
}

void PolynomialScheme::learn(const DriftLabel& label) {
  assert(is_learnable(label) && "a label must be finite, with positive duration and variance");
  if (weight_ == 0.0) start(label.variance);
  if (options_.forgetting < 1.0) forget();
  weight_ += 1.0;
  const double deviation = std::sqrt(label.variance);
  rotate_in(terms(label.features) / deviation, label.drift / deviation);
  coefficients_ = root_.triangularView<Eigen::Upper>().solve(rotated_target_);
}

DriftPrediction PolynomialScheme::predict(double /*time_s*/,
                                          std::span<const double> features) const {
  if (weight_ == 0.0) return {};
  const Coefficients phi = terms(features);
  const Coefficients whitened = root_.transpose().triangularView<Eigen::Lower>().solve(phi);
  const double excess = weight_ - static_cast<double>(kTerms);
  const double misfit = excess > 0.0 ? residual_square_ / excess : 1.0;
  return {.drift = phi.dot(coefficients_), .variance = whitened.squaredNorm() * misfit};
}

PolynomialScheme::Coefficients PolynomialScheme::terms(
    std::span<const double> features) const noexcept {
  core::require(
      options_.temperature_feature < features.size() && options_.rate_feature < features.size(),
      "temperature_feature and rate_feature name features that the labels have");
  const double t = features[options_.temperature_feature];
  const double rate = features[options_.rate_feature];
  return {1.0, t, t * t, t * t * t, rate, t * rate};
}

void PolynomialScheme::start(double variance) noexcept {
  // The constant is as good as free: it must take up an offset of any size.
  constexpr double kConstantIsFreerBy = 1e6;
  root_.setZero();
  root_.diagonal().setConstant(1.0 / (options_.prior_deviation * std::sqrt(variance)));
  root_(0, 0) /= kConstantIsFreerBy;
}

void PolynomialScheme::forget() noexcept {
  const double root = std::sqrt(options_.forgetting);
  root_ *= root;
  rotated_target_ *= root;
  residual_square_ *= options_.forgetting;
  weight_ *= options_.forgetting;
}

// Row by row the new equation's leading entry is rotated away; what is left of its target is the
// part that no coefficient can explain.
void PolynomialScheme::rotate_in(Coefficients row, double target) noexcept {
  for (int i = 0; i < kTerms; ++i) {
    const double length = std::hypot(root_(i, i), row(i));
    const double cosine = root_(i, i) / length;
    const double sine = row(i) / length;
    for (int j = i; j < kTerms; ++j) {
      const double upper = root_(i, j);
      root_(i, j) = cosine * upper + sine * row(j);
      row(j) = cosine * row(j) - sine * upper;
    }
    const double upper = rotated_target_(i);
    rotated_target_(i) = cosine * upper + sine * target;
    target = cosine * target - sine * upper;
  }
  residual_square_ += target * target;
}

}  // namespace zerodrift::regression
