// SPDX-License-Identifier: Apache-2.0
#include "common/regression/margin_factor.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "common/core/require.h"

namespace zerodrift::regression {
namespace {

constexpr std::uint64_t kSeed = 3;

using Points = std::vector<Eigen::VectorXd>;

Eigen::MatrixXd reduced_gram(const Points& points) {
  const auto n = static_cast<Eigen::Index>(points.size()) - 1;
  Eigen::MatrixXd gram(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index k = 0; k < n; ++k) {
      gram(j, k) = (points[static_cast<std::size_t>(j) + 1] - points[0])
                       .dot(points[static_cast<std::size_t>(k) + 1] - points[0]);
    }
  }
  return gram;
}

void append_point(MarginFactor& factor, const Points& points) {
  const Eigen::MatrixXd gram = reduced_gram(points);
  const Eigen::Index n = gram.rows() - 1;
  Eigen::VectorXd lower = gram.row(n).head(n).transpose();
  factor.solve_lower(lower.data());
  factor.append(lower.data(), gram(n, n) - lower.squaredNorm());
}

std::vector<double> packed(MarginFactor& factor) {
  std::string bytes;
  core::StateArchive archive(bytes);
  factor.carry(archive, factor.rows());
  std::vector<double> rows(bytes.size() / sizeof(double));
  if (!rows.empty()) std::memcpy(rows.data(), bytes.data(), bytes.size());
  return rows;
}

double largest_difference(MarginFactor& factor, const Points& points) {
  const Eigen::MatrixXd gram = reduced_gram(points);
  const std::vector<double> rows = packed(factor);
  Eigen::MatrixXd l = Eigen::MatrixXd::Zero(gram.rows(), gram.cols());
  std::size_t next = 0;
  for (Eigen::Index i = 0; i < l.rows(); ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) l(i, j) = rows[next++];
  }
  return l.rows() == 0 ? 0.0 : (l * l.transpose() - gram).cwiseAbs().maxCoeff();
}

// Points of norm about 5 in 30 dimensions: a Gram matrix of entries up to 1e2, so one update errs
// by about 1e-14 and 2000 of them, adding up at worst linearly, by less than 1e-10.
TEST(MarginFactorLaws, FactorStaysThatOfItsGramMatrixWhateverEntersAndLeaves) {
  constexpr std::size_t kCapacity = 20;
  std::mt19937_64 engine(kSeed);
  std::normal_distribution<double> normal;
  const auto random_point = [&] {
    Eigen::VectorXd point(30);
    for (double& coordinate : point) coordinate = normal(engine);
    return point;
  };
  MarginFactor factor(kCapacity);
  Points points{random_point()};
  for (int i = 0; i < 2000; ++i) {
    if (points.size() < 2 || (points.size() <= kCapacity && engine() % 2 == 0)) {
      points.push_back(random_point());
      append_point(factor, points);
    } else {
      const std::size_t leaving = engine() % points.size();
      points.erase(points.begin() + static_cast<std::ptrdiff_t>(leaving));
      leaving == 0 ? factor.remove_reference() : factor.remove_row(leaving - 1);
    }
    ASSERT_EQ(factor.rows(), points.size() - 1);
    ASSERT_LE(largest_difference(factor, points), 1e-10) << "update " << i << " seed " << kSeed;
  }
}

TEST(MarginFactorLaws, SolveInvertsTheGramMatrix) {
  std::mt19937_64 engine(kSeed);
  std::normal_distribution<double> normal;
  MarginFactor factor(8);
  Points points;
  for (int i = 0; i < 8; ++i) {
    Eigen::VectorXd point(30);
    for (double& coordinate : point) coordinate = normal(engine);
    points.push_back(point);
    if (i > 0) append_point(factor, points);
  }
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(7, -1.0, 1.0);
  Eigen::VectorXd x = b;
  factor.solve(x.data());
  EXPECT_LE((reduced_gram(points) * x - b).cwiseAbs().maxCoeff(), 1e-13);  // condition below 1e2
}

TEST(MarginFactorAbuse, RowsThatAreNotThereOrDoNotFitEndTheProcessInEveryBuild) {
  MarginFactor factor(1);
  EXPECT_DEATH(factor.remove_row(0), "a row that leaves a margin factor is in it");
  factor.append(nullptr, 1.0);
  const std::vector<double> lower{0.5};
  EXPECT_DEATH(factor.append(lower.data(), 1.0), "a margin factor has room for the row");
  std::string bytes;
  core::StateArchive archive(bytes);
  EXPECT_THROW(factor.carry(archive, 2), core::BrokenPromise);
}

}  // namespace
}  // namespace zerodrift::regression
