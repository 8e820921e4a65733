// SPDX-License-Identifier: Apache-2.0
#include "common/regression/kernel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/regression/vector_operations.h"
#include "tests/unit/regression/test_records.h"

namespace zerodrift::regression::testing {
namespace {

// k(x, 0) for one feature x.
double value_at(const Kernel& kernel, double x) {
  const double zero = 0.0;
  double value = 0.0;
  evaluate_row(kernel, {&x, 1, 1, 1}, &zero, &value);
  return value;
}

TEST(KernelLaws, RbfEqualsExpm1ToTheLastDigits) {
  const Kernel kernel;  // gamma 1
  for (double x = 1e-9; x < 40.0; x *= 1.01) {
    const double expected = std::expm1(-(x * x));
    // 4 units in the last place: the claim of the function, against a library good to 1.
    EXPECT_NEAR(value_at(kernel, x), expected, 4.0 * 2.3e-16 * std::fabs(expected)) << x;
  }
}

TEST(KernelLaws, MaternKernelsEqualTheirFormulas) {
  Kernel kernel;
  kernel.gamma = 0.7;
  for (double x = 1e-4; x < 30.0; x *= 1.05) {
    const double s3 = std::sqrt(6.0 * 0.7) * x, s5 = std::sqrt(10.0 * 0.7) * x;
    kernel.kind = KernelKind::kMatern32;
    // A handful of roundings of numbers up to 1.
    EXPECT_NEAR(value_at(kernel, x), (1.0 + s3) * std::exp(-s3) - 1.0, 1e-15);
    kernel.kind = KernelKind::kMatern52;
    EXPECT_NEAR(value_at(kernel, x), (1.0 + s5 + s5 * s5 / 3.0) * std::exp(-s5) - 1.0, 1e-15);
  }
}

TEST(KernelLaws, PolynomialAndLinearEqualTheirFormulas) {
  const std::vector<double> a{0.3, -0.8}, b{1.1, 0.4};
  const double product = 0.3 * 1.1 - 0.8 * 0.4;
  Kernel kernel{KernelKind::kPolynomial, 0.5, 4, 2.0};
  double value = 0.0;
  evaluate_row(kernel, {a.data(), 1, 2, 1}, b.data(), &value);
  EXPECT_NEAR(value, std::pow(0.5 * product + 2.0, 4), 1e-14);  // value near 16, ulp 2e-15
  kernel.kind = KernelKind::kLinear;
  evaluate_row(kernel, {a.data(), 1, 2, 1}, b.data(), &value);
  EXPECT_NEAR(value, product, 1e-16);
}

TEST(KernelLaws, FarSamplesGiveFiniteValues) {
  for (const KernelKind kind : {KernelKind::kRbf, KernelKind::kMatern32, KernelKind::kMatern52}) {
    for (const double x : {1e3, 1e6, 1e150, 1e200}) EXPECT_EQ(value_at(kernel_of(kind), x), -1.0);
  }
}

TEST(KernelLaws, IdenticalSamplesHaveExactlyNoDistance) {
  const std::vector<double> x{0.1, 0.7, -0.3};
  for (const KernelKind kind : {KernelKind::kRbf, KernelKind::kMatern32, KernelKind::kMatern52}) {
    EXPECT_EQ(self_value(kernel_of(kind), x.data(), 3), 0.0);
  }
}

// Vector body and scalar tail of a loop, and the position in a row, must not show in the value.
TEST(KernelLaws, ValueIsSymmetricAndIndependentOfThePositionInTheRowToTheBit) {
  constexpr std::size_t kCount = 61, kDimension = 3;
  RecordGenerator generator(RecordKind::kSmooth, kDimension, 5);
  const auto samples = generator.take(kCount);
  std::vector<double> columns(kDimension * kCount);
  for (std::size_t i = 0; i < kCount; ++i) {
    for (std::size_t d = 0; d < kDimension; ++d) columns[d * kCount + i] = samples[i].x[d];
  }
  for (const KernelKind kind : kAllKernelKinds) {
    const Kernel kernel = kernel_of(kind);
    std::vector<double> row(kCount), transposed(kCount);
    for (std::size_t i = 0; i < kCount; ++i) {
      evaluate_row(kernel, {columns.data(), kCount, kDimension, kCount}, samples[i].x.data(),
                   row.data());
      for (std::size_t j = 0; j < kCount; ++j) {
        double alone = 0.0;
        evaluate_row(kernel, {samples[i].x.data(), 1, kDimension, 1}, samples[j].x.data(), &alone);
        ASSERT_EQ(row[j], alone) << name(kind) << " " << i << " " << j;
      }
    }
  }
}

// The same constants hold in every build: the release build runs the widest vector clone of the
// processor, the sanitizer builds run the plain one. Inputs come from integers alone, so no
// library function can move them.
TEST(KernelGolden, BitsAreTheSameOnEveryProcessorAndInEveryBuild) {
  constexpr std::size_t kCount = 203, kDimension = 3;
  std::uint64_t lcg = 1;
  const auto next = [&] {
    lcg = lcg * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(static_cast<std::int64_t>(lcg) >> 11) * 0x1p-52;
  };
  std::vector<double> columns(kDimension * kCount), row(kCount), weights(kCount);
  for (double& feature : columns) feature = next();
  for (double& weight : weights) weight = next();
  std::vector<std::uint64_t> hashes;
  for (const KernelKind kind : kAllKernelKinds) {
    std::uint64_t hash = 14695981039346656037ULL;  // FNV-1a over the doubles' bits
    const auto mix = [&](double value) {
      hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 1099511628211ULL;
    };
    const double x[kDimension] = {0.25, -0.5, 0.125};
    evaluate_row(kernel_of(kind), {columns.data(), kCount, kDimension, kCount}, x, row.data());
    for (const double value : row) mix(value);
    mix(dot(row.data(), weights.data(), kCount));
    mix(sum(row.data(), kCount));
    hashes.push_back(hash);
  }
  const std::vector<std::uint64_t> expected{11176229977259778540ULL, 4105747488829709034ULL,
                                            6675443234506828729ULL, 8495573868084625556ULL,
                                            3580347348653468300ULL};
  EXPECT_EQ(hashes, expected);
}

// The vectorised loops against their plain statements, to the bit.
class VectorOperationLaws : public ::testing::Test {
 protected:
  // From an integer generator alone; every seventh number is 0, so that there are ties.
  Column draw(std::size_t count) {
    Column values(count);
    for (std::size_t i = 0; i < count; ++i) {
      lcg_ = lcg_ * 6364136223846793005ULL + 1442695040888963407ULL;
      values[i] =
          (i + draws_) % 7 == 3 ? 0.0 : static_cast<double>(static_cast<std::int64_t>(lcg_) >> 11);
      values[i] *= 0x1p-52;
    }
    ++draws_;
    return values;
  }

 private:
  std::uint64_t lcg_ = 7;
  std::size_t draws_ = 0;
};

TEST_F(VectorOperationLaws, CombinedRowsAreTheSumInTheOrderOfTheRows) {
  for (const std::size_t count : {8u, 40u, 64u, 200u}) {
    for (const std::size_t row_count : {0u, 1u, 3u, 9u}) {
      std::vector<Column> rows;
      std::vector<const double*> pointers;
      for (std::size_t j = 0; j < row_count; ++j) rows.push_back(draw(count));
      for (const Column& row : rows) pointers.push_back(row.data());
      const Column rates = draw(row_count);
      Column combined(count);
      combine_rows(pointers.data(), rates.data(), row_count, 0.25, combined.data(), count);
      for (std::size_t i = 0; i < count; ++i) {
        double expected = 0.25;
        for (std::size_t j = 0; j < row_count; ++j) expected += rates[j] * rows[j][i];
        ASSERT_EQ(combined[i], expected) << count << " " << row_count << " " << i;
      }
    }
  }
}

// Rows of a packed triangle begin anywhere.
TEST_F(VectorOperationLaws, ResultsDoNotDependOnWhereTheVectorsBegin) {
  constexpr std::size_t kCount = 72;
  const Column x = draw(kCount), y = draw(kCount), rates = draw(1);
  Column room_x(kCount + kLane), room_y(kCount + kLane), room_out(kCount + kLane), out(kCount);
  const double* row = x.data();
  combine_rows(&row, rates.data(), 1, 0.5, out.data(), kCount);
  for (std::size_t begin = 0; begin < kLane; ++begin) {
    double* x_there = room_x.data() + begin;
    double* y_there = room_y.data() + kLane - begin;
    double* out_there = room_out.data() + begin;
    std::copy(x.begin(), x.end(), x_there);
    std::copy(y.begin(), y.end(), y_there);
    EXPECT_EQ(dot(x_there, y_there, kCount), dot(x.data(), y.data(), kCount)) << begin;
    EXPECT_EQ(sum(x_there, kCount), sum(x.data(), kCount)) << begin;
    const double* row_there = x_there;
    combine_rows(&row_there, rates.data(), 1, 0.5, out_there, kCount);
    EXPECT_TRUE(std::equal(out.begin(), out.end(), out_there)) << begin;
  }
}

TEST_F(VectorOperationLaws, TheFirstCrossingIsTheEarliestAndOnATieTheFirst) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  for (const std::size_t count : {8u, 72u, 504u}) {
    for (int trial = 0; trial < 200; ++trial) {
      const Column value = draw(count), rate = draw(count);
      Column upper = draw(count), lower = draw(count);
      for (std::size_t i = 0; i < count; ++i) {
        upper[i] = i % 3 == 0 ? kInf : value[i] + std::fabs(upper[i]);
        lower[i] = i % 5 == 0 ? -kInf : value[i] - std::fabs(lower[i]);
      }
      const Crossings crossings{value.data(), rate.data(), upper.data(), lower.data(), 1e-3};
      for (const double limit : {kInf, 0.1, 1e-4}) {
        Crossing expected{limit, count};
        for (std::size_t i = 0; i < count; ++i) {
          if (std::fabs(rate[i]) <= crossings.threshold) continue;
          const double bound = rate[i] > 0.0 ? upper[i] : lower[i];
          const double step = std::max(0.0, (bound - value[i]) / rate[i]);
          if (step < expected.step) expected = {step, i};
        }
        const Crossing found = first_crossing(crossings, limit, count);
        ASSERT_EQ(found.step, expected.step) << count << " trial " << trial;
        ASSERT_EQ(found.index, expected.index) << count << " trial " << trial;
      }
    }
  }
}

TEST_F(VectorOperationLaws, EqualEntriesAreFoundInOrderAndInfinitiesAreEqualToNothing) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  constexpr std::size_t kCount = 150;
  Column a(kCount, 1.0), b(kCount, 2.0);
  for (const std::size_t i : {3u, 70u, 149u}) a[i] = b[i] = -4.0;
  a[10] = b[10] = kInf;
  std::vector<std::size_t> of_value, of_pairs;
  for (std::size_t i = 0; (i = next_equal(a.data(), -4.0, i, kCount)) < kCount; ++i) {
    of_value.push_back(i);
  }
  for (std::size_t i = 0; (i = next_equal_finite(a.data(), b.data(), i, kCount)) < kCount; ++i) {
    of_pairs.push_back(i);
  }
  EXPECT_EQ(of_value, (std::vector<std::size_t>{3, 70, 149}));
  EXPECT_EQ(of_pairs, of_value);
  EXPECT_EQ(next_equal(a.data(), 7.0, 0, kCount), kCount);
}

TEST(KernelAbuse, ValidateNamesTheWrongKey) {
  Kernel kernel;
  EXPECT_FALSE(kernel.validate());
  kernel.gamma = std::nan("");
  EXPECT_NE(kernel.validate().value().find("kernel.gamma"), std::string::npos);
  kernel = {KernelKind::kPolynomial, 1.0, 0, 1.0};
  EXPECT_NE(kernel.validate().value().find("kernel.degree"), std::string::npos);
  kernel = {KernelKind::kPolynomial, 1.0, 2, -1.0};
  EXPECT_NE(kernel.validate().value().find("kernel.offset"), std::string::npos);
}

}  // namespace
}  // namespace zerodrift::regression::testing
