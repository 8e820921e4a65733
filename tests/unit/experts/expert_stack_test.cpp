// SPDX-License-Identifier: Apache-2.0
#include "common/experts/expert_stack.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "common/experts/thermal_basis.h"

namespace zerodrift::experts {
namespace {

constexpr double kSpacingS = 5.0;

struct Series {
  std::vector<Labelled> labels;
};

// Drift by what only heat on its way explains, on a walk; labels with noise of 1.
Series with_thermal_memory(std::uint64_t seed, int count) {
  Series series;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  ThermalBasis thermal;
  double walk = 0.0;
  for (int k = 1; k <= count; ++k) {
    const double t = kSpacingS * k;
    const double temperature = 2.0 * std::sin(t / 2500.0) + 0.7 * std::sin(t / 700.0);
    const double rate =
        (2.0 * std::cos(t / 2500.0) / 2500.0 + std::cos(t / 700.0) / 1000.0) * 600.0;
    const Basis& basis = thermal.advance(t, temperature, rate);
    walk += 0.02 * normal(random);
    const double drift = 30.0 * basis[kTemperature] + 80.0 * basis[kFirstMemory + 2] + walk;
    series.labels.push_back({t, kSpacingS, drift + normal(random), 1.0, basis});
  }
  return series;
}

// No label learned that is younger than `age` when its successor is foretold.
struct Judged {
  double stack = 0.0;
  double best = 0.0;
  double held = 0.0;
  double covered = 0.0;
};
Judged judge(const Series& series, std::size_t age, std::size_t from) {
  ExpertStack stack;
  std::array<double, kLinearExperts.size()> squares{};
  double own = 0.0, covered = 0.0, count = 0.0;
  for (std::size_t i = 0; i < series.labels.size(); ++i) {
    if (i >= age) stack.learn(series.labels[i - age]);
    if (i < from) continue;
    const std::size_t next = i + 1;
    if (next >= series.labels.size()) break;
    const Labelled& label = series.labels[next];
    const auto made = stack.predict(label.time_s, label.basis);
    own += std::pow(label.drift - made.drift, 2);
    covered += std::pow(label.drift - made.drift, 2) < 3.84 * made.variance ? 1.0 : 0.0;
    for (const Expert expert : kLinearExperts) {
      const double error = label.drift - stack.forecast(expert).at(label.time_s, label.basis);
      squares[static_cast<std::size_t>(expert)] += error * error;
    }
    count += 1.0;
  }
  return {std::sqrt(own / count),
          std::sqrt(*std::min_element(squares.begin(), squares.end()) / count),
          std::sqrt(squares[0] / count), covered / count};
}

TEST(ExpertStackScenario, IsAsGoodAsItsBestExpertAtEveryAge) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Series series = with_thermal_memory(seed, 3000);
    for (const std::size_t age : {0U, 12U, 60U, 180U}) {
      const Judged judged = judge(series, age, 1500);
      std::printf("seed %d, %3zu labels old: stack %.2f, best %.2f, holding %.2f, covered %.3f\n",
                  static_cast<int>(seed), age, judged.stack, judged.best, judged.held,
                  judged.covered);
      EXPECT_LE(judged.stack, 1.05 * judged.best) << "seed " << seed << ", age " << age;
    }
  }
}

// Errors of one minute overlap, so the share is of fewer than 1500 independent ones.
TEST(ExpertStackScenario, IntervalsHoldAtTheAgesThatWereJudged) {
  double share = 0.0;
  for (const std::uint64_t seed : {4U, 5U, 6U}) {
    const Series series = with_thermal_memory(seed, 3000);
    for (const std::size_t age : {0U, 12U, 60U}) {
      const Judged judged = judge(series, age, 1500);
      EXPECT_GE(judged.covered, 0.88) << "seed " << seed << ", age " << age;
      share += judged.covered / 9.0;
    }
  }
  EXPECT_GE(share, 0.93);
  EXPECT_LE(share, 0.98);
}

TEST(ExpertStackLaws, SharesSumToOneAtEveryAge) {
  const Series series = with_thermal_memory(7, 1200);
  ExpertStack stack;
  for (const Labelled& label : series.labels) {
    stack.learn(label);
    for (const double age_s : {0.0, 5.0, 30.0, 60.0, 200.0, 900.0, 1e5}) {
      const auto shares = stack.shares(age_s);
      ASSERT_NEAR(std::accumulate(shares.begin(), shares.end(), 0.0), 1.0, 1e-9);
    }
  }
}

TEST(ExpertStackLaws, NothingIsStatedOfAnAgeThatWasNeverJudged) {
  const Series series = with_thermal_memory(8, 30);  // 150 s
  ExpertStack stack;
  for (const Labelled& label : series.labels) stack.learn(label);
  const Labelled& last = series.labels.back();
  EXPECT_GE(stack.predict(last.time_s + 5.0, last.basis).variance, 0.0);
  EXPECT_LT(stack.predict(last.time_s + 900.0, last.basis).variance, 0.0);
}

// An SVR that knows the future takes over, one that errs is left out.
TEST(ExpertStackScenario, TheSvrGetsTheShareItEarns) {
  const Series series = with_thermal_memory(9, 1500);
  for (const bool is_right : {true, false}) {
    ExpertStack stack;
    for (const Labelled& label : series.labels) {
      Foretold foretold;
      foretold.fill(is_right ? label.drift : label.drift + 500.0);
      stack.learn(label, foretold);
    }
    for (const double age_s : {5.0, 60.0, 300.0}) {
      const double share = stack.shares(age_s)[static_cast<std::size_t>(Expert::kOnlineSvr)];
      if (is_right) {
        EXPECT_GT(share, 0.95) << age_s;
      } else {
        EXPECT_LT(share, 0.05) << age_s;
      }
    }
  }
}

TEST(ExpertStackLaws, ACopyGoesOnToTheBit) {
  const Series series = with_thermal_memory(10, 800);
  ExpertStack stack;
  for (std::size_t i = 0; i < 400; ++i) stack.learn(series.labels[i]);
  ExpertStack copy = stack;
  for (std::size_t i = 400; i < series.labels.size(); ++i) {
    stack.learn(series.labels[i]);
    copy.learn(series.labels[i]);
    const auto a = stack.predict(series.labels[i].time_s + 70.0, series.labels[i].basis);
    const auto b = copy.predict(series.labels[i].time_s + 70.0, series.labels[i].basis);
    ASSERT_EQ(a.drift, b.drift);
    ASSERT_EQ(a.variance, b.variance);
  }
}

TEST(ExpertStackAbuse, GapsJumpsAndExpertsThatExplodeLeaveNumbers) {
  ExpertStack stack;
  std::mt19937_64 random(19);
  double t = 0.0;
  for (int k = 0; k < 4000; ++k) {
    t += k % 500 == 499 ? 2e5 : 1.0 + static_cast<double>(random() % 20);
    Basis basis{};
    basis.fill(k % 300 == 0 ? 50.0 : 0.1 * static_cast<double>(k % 3));
    stack.learn({t, 5.0, k % 400 == 0 ? -1e5 : static_cast<double>(k % 11), 1.0, basis});
    for (const double ahead_s : {0.0, 77.0, 1e6})
      ASSERT_TRUE(std::isfinite(stack.predict(t + ahead_s, basis).drift)) << k;
  }
}

TEST(ExpertNames, AreEachTheirOwn) {
  for (const Expert one : kLinearExperts) {
    for (const Expert other : kLinearExperts) EXPECT_EQ(one == other, name(one) == name(other));
  }
}

}  // namespace
}  // namespace zerodrift::experts
