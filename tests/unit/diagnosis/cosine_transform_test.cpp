// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/cosine_transform.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace zerodrift::diagnosis {
namespace {

std::vector<double> random_series(std::size_t n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> x(n);
  for (double& v : x) v = normal(random);
  return x;
}

double defined_coefficient(const std::vector<double>& x, std::size_t k) {
  const double n = static_cast<double>(x.size());
  double sum = 0.0;
  for (std::size_t j = 0; j < x.size(); ++j) {
    sum += x[j] *
           std::cos(std::numbers::pi * (static_cast<double>(j) + 0.5) * static_cast<double>(k) / n);
  }
  return sum * std::sqrt((k == 0 ? 1.0 : 2.0) / n);
}

// Lengths that are a power of two, smooth, odd, prime (through the convolution) and degenerate.
class CosineTransformLengths : public testing::TestWithParam<std::size_t> {};

TEST_P(CosineTransformLengths, EqualsItsDefinition) {
  const std::vector<double> x = random_series(GetParam(), 1);
  CosineTransform transform(x.size());
  const Eigen::VectorXd c = transform.forward(x);
  for (std::size_t k = 0; k < x.size(); k += 1 + x.size() / 50) {
    // Rounding of n terms of order 1, on either side.
    EXPECT_NEAR(c(static_cast<Eigen::Index>(k)), defined_coefficient(x, k), 1e-11) << k;
  }
}

TEST_P(CosineTransformLengths, KeepsInnerProducts) {
  const std::size_t n = GetParam();
  const std::vector<double> a = random_series(n, 2);
  const std::vector<double> b = random_series(n, 3);
  CosineTransform transform(n);
  Eigen::VectorXd ca;
  Eigen::VectorXd cb;
  transform.forward(a, b, ca, cb);
  const auto size = static_cast<Eigen::Index>(n);
  const Eigen::Map<const Eigen::VectorXd> va(a.data(), size);
  const Eigen::Map<const Eigen::VectorXd> vb(b.data(), size);
  const double tolerance = 1e-13 * static_cast<double>(n);  // rounding, n terms of order 1
  EXPECT_NEAR(ca.squaredNorm(), va.squaredNorm(), tolerance + 1e-13);
  EXPECT_NEAR(ca.dot(cb), va.dot(vb), tolerance + 1e-13);
}

INSTANTIATE_TEST_SUITE_P(Lengths, CosineTransformLengths,
                         testing::Values(1u, 2u, 3u, 10u, 64u, 225u, 509u, 1021u, 1800u));

TEST(CosineTransform, TwoColumnsAtOnceAreTheSameAsOneByOne) {
  const std::vector<double> a = random_series(300, 4);
  const std::vector<double> b = random_series(300, 5);
  CosineTransform transform(300);
  Eigen::VectorXd ca;
  Eigen::VectorXd cb;
  transform.forward(a, b, ca, cb);
  EXPECT_LT((ca - transform.forward(a)).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_LT((cb - transform.forward(b)).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(CosineTransform, ARampFallsOffAsTheSquareOfTheIndexAndAConstantIsOneCoefficient) {
  constexpr std::size_t kN = 1000;
  std::vector<double> ramp(kN);
  for (std::size_t j = 0; j < kN; ++j) ramp[j] = static_cast<double>(j);
  CosineTransform transform(kN);
  const Eigen::VectorXd c = transform.forward(ramp);
  // c_k ~ 1/k² for odd k while k << n: (9/3)² = 9 but for (pi k / 2n)² terms below 1e-3.
  EXPECT_NEAR(c(3) / c(9), 9.0, 9e-3);
  const Eigen::VectorXd flat = transform.forward(std::vector<double>(kN, 2.0));
  EXPECT_NEAR(flat(0), 2.0 * std::sqrt(1000.0), 1e-10);
  EXPECT_LT(flat.tail(kN - 1).cwiseAbs().maxCoeff(), 1e-11);
}

TEST(SmoothLength, HasSmallPrimesOnlyAndNoneIsNearer) {
  const auto is_smooth = [](std::size_t length) {
    for (const std::size_t prime : {2U, 3U, 5U}) {
      while (length % prime == 0) length /= prime;
    }
    return length == 1;
  };
  for (const std::size_t n : {1U, 7U, 97U, 17'989U, 18'000U, 35'953U}) {
    const std::size_t below = smooth_length_up_to(n);
    const std::size_t above = smooth_length_from(n);
    ASSERT_LE(below, n);
    ASSERT_GE(above, n);
    for (std::size_t length = below; length <= above; ++length)
      EXPECT_EQ(is_smooth(length), length == below || length == above) << length;
  }
}

}  // namespace
}  // namespace zerodrift::diagnosis
