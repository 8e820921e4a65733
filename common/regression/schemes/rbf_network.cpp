// SPDX-License-Identifier: Apache-2.0
#include "common/regression/schemes/rbf_network.h"

#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "common/core/require.h"
#include "common/regression/schemes/option_error.h"
#include "common/regression/vector_operations.h"

namespace zerodrift::regression {
namespace {

using Points = Eigen::MatrixXd;  // one column a point
using Index = Eigen::Index;

constexpr int kMostPasses = 100;  // of k-means; it converges in far fewer

Points points_of(const InitialSet& set) {
  Points points(static_cast<Index>(set.dimension()), static_cast<Index>(set.size()));
  for (std::size_t i = 0; i < set.size(); ++i) {
    for (std::size_t d = 0; d < set.dimension(); ++d) {
      points(static_cast<Index>(d), static_cast<Index>(i)) = set.features(i)[d];
    }
  }
  return points;
}

// Starts with the point nearest the mean, then always takes the one farthest from all taken; ends
// early where only copies are left.
Points farthest_points(const Points& points, Index most) {
  const Eigen::VectorXd mean = points.rowwise().mean();
  Index next = 0;
  (points.colwise() - mean).colwise().squaredNorm().minCoeff(&next);
  Eigen::RowVectorXd distance = Eigen::RowVectorXd::Constant(
      points.cols(), std::numeric_limits<double>::infinity());  // squared, to the nearest taken
  Points taken(points.rows(), most);
  for (Index count = 0; count < most; ++count) {
    taken.col(count) = points.col(next);
    distance = distance.cwiseMin((points.colwise() - points.col(next)).colwise().squaredNorm());
    if (distance.maxCoeff(&next) == 0.0) return taken.leftCols(count + 1);
  }
  return taken;
}

Points k_means(const Points& points, Points centres) {
  std::vector<Index> owner(static_cast<std::size_t>(points.cols()), -1);
  for (int pass = 0; pass < kMostPasses; ++pass) {
    Points sums = Points::Zero(centres.rows(), centres.cols());
    Eigen::RowVectorXd counts = Eigen::RowVectorXd::Zero(centres.cols());
    bool moved = false;
    for (Index i = 0; i < points.cols(); ++i) {
      Index nearest = 0;
      (centres.colwise() - points.col(i)).colwise().squaredNorm().minCoeff(&nearest);
      moved = moved || owner[static_cast<std::size_t>(i)] != nearest;
      owner[static_cast<std::size_t>(i)] = nearest;
      sums.col(nearest) += points.col(i);
      counts(nearest) += 1.0;
    }
    if (!moved) break;
    for (Index j = 0; j < centres.cols(); ++j) {
      if (counts(j) > 0.0) centres.col(j) = sums.col(j) / counts(j);
    }
  }
  return centres;
}

// Mean distance of a centre to its two nearest neighbours; 1 for a single centre.
double neighbour_distance(const Points& centres) {
  if (centres.cols() < 2) return 1.0;
  const auto neighbours = static_cast<std::size_t>(std::min<Index>(centres.cols() - 1, 2));
  double sum = 0.0;
  for (Index j = 0; j < centres.cols(); ++j) {
    const Eigen::VectorXd distance = (centres.colwise() - centres.col(j)).colwise().norm();
    std::vector<double> sorted(distance.data(), distance.data() + distance.size());
    std::sort(sorted.begin(), sorted.end());  // the first is its own, 0
    for (std::size_t k = 1; k <= neighbours; ++k) sum += sorted[k];
  }
  return sum / static_cast<double>(neighbours * static_cast<std::size_t>(centres.cols()));
}

}  // namespace

std::optional<std::string> RbfNetworkOptions::validate() const {
  if (auto error = initial.validate()) return error;
  if (centres < 1) return wrong_option("centres", "0", "at least 1");
  if (!is_positive(overlap)) {
    return wrong_option("overlap", std::to_string(overlap), "a number above 0");
  }
  if (!is_positive(ridge)) return wrong_option("ridge", std::to_string(ridge), "a number above 0");
  return std::nullopt;
}

RbfNetwork::RbfNetwork(const RbfNetworkOptions& options)
    : options_(checked_options("rbf network", options)), initial_(options.initial) {}

void RbfNetwork::learn(const DriftLabel& label) {
  assert(is_learnable(label) && "a label must be finite, with positive duration and variance");
  if (is_trained_) return;
  const bool is_complete = initial_.add(label);
  offset_ = initial_.mean();
  if (is_complete) train();
}

DriftPrediction RbfNetwork::predict(double /*time_s*/, std::span<const double> features) const {
  if (!is_trained_) return {.drift = offset_, .variance = -1.0};
  core::require(features.size() == initial_.dimension(), "features are as many as the labels had");
  std::vector<double> row(weights_.size());
  evaluate_row(kernel_, centres(), features.data(), row.data());
  for (double& value : row) value += 1.0;  // the row holds k - 1
  return {.drift = offset_ + dot(row.data(), weights_.data(), row.size()), .variance = -1.0};
}

void RbfNetwork::train() {
  const Points points = points_of(initial_);
  const auto most = static_cast<Index>(std::min(options_.centres, initial_.size()));
  const Points found = k_means(points, farthest_points(points, most));
  const double width = options_.overlap * neighbour_distance(found);
  kernel_ = {.kind = KernelKind::kRbf, .gamma = 0.5 / (width * width)};
  weights_.assign(static_cast<std::size_t>(found.cols()), 0.0);
  centres_.resize(static_cast<std::size_t>(found.size()));
  Eigen::Map<Eigen::MatrixXd>(centres_.data(), found.cols(), found.rows()) = found.transpose();

  // [1 Phi; 0 sqrt(ridge n) I] [w_0; w] = [y; 0], targets about their mean in units of their
  // spread. w_0 bears no ridge.
  const Index labels = points.cols(), count = found.cols();
  const double mean = initial_.mean(), scale = initial_.scale();
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(labels + count, 1 + count);
  Eigen::VectorXd target = Eigen::VectorXd::Zero(labels + count);
  std::vector<double> row(weights_.size());
  for (Index i = 0; i < labels; ++i) {
    evaluate_row(kernel_, centres(), points.col(i).data(), row.data());
    system(i, 0) = 1.0;
    for (Index j = 0; j < count; ++j) system(i, 1 + j) = 1.0 + row[static_cast<std::size_t>(j)];
    target(i) = (initial_.drifts()[static_cast<std::size_t>(i)] - mean) / scale;
  }
  system.bottomRightCorner(count, count)
      .diagonal()
      .setConstant(std::sqrt(options_.ridge * static_cast<double>(labels)));
  const Eigen::VectorXd solution = system.householderQr().solve(target);

  offset_ = mean + scale * solution(0);
  for (Index j = 0; j < count; ++j) weights_[static_cast<std::size_t>(j)] = scale * solution(1 + j);
  is_trained_ = true;
  initial_.release();
}

}  // namespace zerodrift::regression
