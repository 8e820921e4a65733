// SPDX-License-Identifier: Apache-2.0
#include "common/regression/schemes/krls_t.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/core/require.h"
#include "common/regression/schemes/option_error.h"
#include "common/regression/vector_operations.h"

namespace zerodrift::regression {
namespace {

using Index = Eigen::Index;

// Added to k(x, x) = 1 of the basis vectors. Interpolation weights then stay below its square
// root's inverse, so that rounding in k is worth no more than 1e-16 / kNugget = 1e-8 of novelty:
// without it the novelty of a sample beyond a cluster of basis vectors is lost in rounding, and
// never seen.
constexpr double kNugget = 1e-8;
// A sample of which the basis leaves less than this unexplained doesn't join it. Far above that
// rounding, and the variance left out is far below any noise.
constexpr double kLeastNovelty = 1e-5;
// Bounds of noise over signal variance. Below, the Kalman update would lose its digits; above, the
// initial labels show no signal, and the prior must still leave room for one.
constexpr double kLeastNoise = 1e-8;
constexpr double kMostNoise = 0.01;

// Mean square of half the differences of successive labels: the variance of what changes from one
// to the next (von Neumann).
double successive_variance(const std::vector<double>& drifts) {
  double sum = 0.0;
  for (std::size_t i = 1; i < drifts.size(); ++i) {
    sum += (drifts[i] - drifts[i - 1]) * (drifts[i] - drifts[i - 1]);
  }
  return drifts.size() < 2 ? 0.0 : sum / (2.0 * static_cast<double>(drifts.size() - 1));
}

double mean_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

KrlsT::Prior prior_of(const InitialSet& set) {
  const double stated = mean_of(set.variances());
  const double noise = std::max(stated, successive_variance(set.drifts()));
  const double scale = set.scale();
  const auto [lowest, highest] = std::minmax_element(set.drifts().begin(), set.drifts().end());
  const double spread = *lowest == *highest ? 0.0 : scale * scale;
  return {.offset = set.mean(),
          .signal_variance = std::max(spread - noise, noise / kMostNoise),
          .extra_noise_variance = noise - stated};
}

}  // namespace

std::optional<std::string> KrlsTOptions::validate() const {
  if (auto error = initial.validate()) return error;
  if (budget < 1) return wrong_option("budget", "0", "at least 1");
  if (!is_positive(gamma)) return wrong_option("gamma", std::to_string(gamma), "a number above 0");
  if (!(lambda > 0.0 && lambda <= 1.0)) {
    return wrong_option("lambda", std::to_string(lambda), "a number above 0, at most 1");
  }
  return std::nullopt;
}

KrlsT::KrlsT(const KrlsTOptions& options)
    : options_(checked_options("krls-t", options)),
      initial_(options.initial),
      stride_(padded(options.budget + 1)) {
  const auto most = static_cast<Index>(options.budget + 1);
  factor_ = Eigen::MatrixXd::Zero(most, most);
  mean_ = Eigen::VectorXd::Zero(most);
  covariance_ = Eigen::MatrixXd::Zero(most, most);
}

void KrlsT::learn(const DriftLabel& label) {
  assert(is_learnable(label) && "a label must be finite, with positive duration and variance");
  if (is_started_) {
    update(label.features, label.drift, label.variance);
    return;
  }
  const bool is_complete = initial_.add(label);
  prior_.offset = initial_.mean();
  if (is_complete) start();
}

DriftPrediction KrlsT::predict(double /*time_s*/, std::span<const double> features) const {
  if (!is_started_) return {.drift = prior_.offset, .variance = -1.0};
  const Projection projection = project(features);
  const auto& weights = projection.weights;
  const double variance =
      std::max(0.0, weights.dot(covariance_.topLeftCorner(size_, size_) * weights));
  return {
      .drift = prior_.offset + std::sqrt(prior_.signal_variance) * weights.dot(mean_.head(size_)),
      .variance = prior_.signal_variance * (projection.novelty + variance)};
}

void KrlsT::start() {
  prior_ = prior_of(initial_);
  is_started_ = true;
  basis_.assign(initial_.dimension() * stride_, 0.0);
  for (std::size_t i = 0; i < initial_.size(); ++i) {
    update(initial_.features(i), initial_.drifts()[i], initial_.variances()[i]);
  }
  initial_.release();
}

void KrlsT::update(std::span<const double> features, double drift, double variance) {
  const double target = (drift - prior_.offset) / std::sqrt(prior_.signal_variance);
  const double noise =
      std::max(kLeastNoise, (variance + prior_.extra_noise_variance) / prior_.signal_variance);

  if (options_.lambda < 1.0) {
    mean_.head(size_) *= std::sqrt(options_.lambda);
    covariance_.topLeftCorner(size_, size_) *= options_.lambda;
    covariance_.diagonal().head(size_).array() += 1.0 - options_.lambda;
  }

  Projection projection = project(features);
  if (projection.novelty > kLeastNovelty) {
    join(features, projection);
    projection.weights.conservativeResize(size_);
    projection.weights(size_ - 1) = std::sqrt(projection.novelty);
    projection.novelty = 0.0;
  }
  auto covariance = covariance_.topLeftCorner(size_, size_);
  const Eigen::VectorXd with_target = covariance * projection.weights;
  const double total =
      noise + projection.novelty + std::max(0.0, projection.weights.dot(with_target));
  const double surprise = target - projection.weights.dot(mean_.head(size_));
  mean_.head(size_) += with_target * (surprise / total);
  const Eigen::VectorXd root = with_target / std::sqrt(total);
  covariance.noalias() -= root * root.transpose();  // symmetric to the bit

  if (basis_size() > options_.budget) leave(least_missed());
}

KrlsT::Projection KrlsT::project(std::span<const double> features) const {
  core::require(features.size() == initial_.dimension(), "features are as many as the labels had");
  Projection projection{.weights = Eigen::VectorXd(size_), .novelty = 1.0};
  if (size_ == 0) return projection;
  const Kernel kernel{.kind = KernelKind::kRbf, .gamma = options_.gamma};
  evaluate_row(kernel, basis(), features.data(), projection.weights.data());
  projection.weights.array() += 1.0;  // the row holds k - 1
  factor_.topLeftCorner(size_, size_)
      .triangularView<Eigen::Lower>()
      .solveInPlace(projection.weights);
  projection.novelty = std::max(0.0, 1.0 + kNugget - projection.weights.squaredNorm());
  return projection;
}

void KrlsT::join(std::span<const double> features, const Projection& projection) {
  for (std::size_t d = 0; d < features.size(); ++d) {
    basis_[d * stride_ + basis_size()] = features[d];
  }
  factor_.row(size_).head(size_) = projection.weights.transpose();
  factor_(size_, size_) = std::sqrt(projection.novelty);
  mean_(size_) = 0.0;
  covariance_.row(size_).head(size_).setZero();
  covariance_.col(size_).head(size_).setZero();
  covariance_(size_, size_) = 1.0;
  ++size_;
}

// The basis vector whose loss moves the mean least: smallest (K^-1 f)_i² / (K^-1)_ii, their section
// III-D. K^-1 = L^-T L^-1.
Eigen::Index KrlsT::least_missed() const {
  const auto factor = factor_.topLeftCorner(size_, size_).triangularView<Eigen::Lower>();
  const Eigen::MatrixXd inverse = factor.solve(Eigen::MatrixXd::Identity(size_, size_));
  const Eigen::VectorXd loss = (inverse.transpose() * mean_.head(size_)).array().square() /
                               inverse.colwise().squaredNorm().transpose().array();
  Index least = 0;
  loss.minCoeff(&least);
  return least;
}

// Without row `row`, L has one entry above the diagonal in each later row. Rotating neighbouring
// coordinates removes them; the last coordinate then belongs to no basis vector and is dropped.
void KrlsT::leave(Eigen::Index row) {
  for (std::size_t d = 0; d < initial_.dimension(); ++d) {
    double* column = basis_.data() + d * stride_;
    std::copy(column + row + 1, column + size_, column + row);
  }
  const Index last = size_ - 1;
  for (Index i = row; i < last; ++i) factor_.row(i) = factor_.row(i + 1);
  factor_.row(last).setZero();
  const auto rotate = [](auto&& a, auto&& b, double cosine, double sine) {
    const auto before = a.eval();
    a = cosine * before + sine * b;
    b = cosine * b - sine * before;
  };
  for (Index j = row; j < last; ++j) {
    const double length = std::hypot(factor_(j, j), factor_(j, j + 1));
    const double cosine = factor_(j, j) / length;
    const double sine = factor_(j, j + 1) / length;
    rotate(factor_.col(j), factor_.col(j + 1), cosine, sine);
    rotate(covariance_.col(j), covariance_.col(j + 1), cosine, sine);
    rotate(covariance_.row(j), covariance_.row(j + 1), cosine, sine);
    rotate(mean_.segment<1>(j), mean_.segment<1>(j + 1), cosine, sine);
    factor_(j, j + 1) = 0.0;
  }
  size_ = last;
  auto covariance = covariance_.topLeftCorner(size_, size_);
  covariance.triangularView<Eigen::StrictlyUpper>() = covariance.transpose();
}

SampleColumns KrlsT::basis() const noexcept {
  return {basis_.data(), stride_, initial_.dimension(), basis_size()};
}

}  // namespace zerodrift::regression
