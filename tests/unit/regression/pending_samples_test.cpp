// SPDX-License-Identifier: Apache-2.0
// Near-dependent samples: with a polynomial kernel the margin set can't be larger than the space of
// polynomials, and a sample more displaces one of it. Such displacements must come to an end.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "common/regression/online_svr.h"
#include "tests/unit/regression/test_records.h"

namespace zerodrift::regression::testing {
namespace {

constexpr std::uint64_t kSeed = 51;

OnlineSvrOptions polynomial_options(std::size_t dimension, std::size_t capacity, double c) {
  OnlineSvrOptions options = options_of(dimension, capacity, c, KernelKind::kPolynomial);
  options.kernel.gamma = 1.0;
  options.epsilon = 0.01;
  options.event_budget = 5000;  // far beyond what a test here allows for
  return options;
}

struct WeightedSample {
  std::vector<double> x;
  double y;
  double weight;
};

// Labels of a slow cooling: temperature and its rate, drift. With the last one a sample whose
// residual rate counts as zero was driven to its bound, past its margin by 2e-10, and back again
// without end.
const std::vector<WeightedSample>& slow_cooling() {
  static const std::vector<WeightedSample> kSamples{
      {{3.6105, 0.0887672}, -0.0127714, 1},        {{3.6115, 0.106629}, -0.00358243, 1},
      {{3.6142, 0.0835635}, 0.0132436, 0.880085},  {{3.6165, 0.062419}, -0.0145584, 0.973374},
      {{3.6187, 0.0665317}, 0.0116753, 0.894493},  {{3.6207, 0.0892256}, -0.0211727, 0.887136},
      {{3.6303, 0.095382}, 0.0261289, 0.75679},    {{3.6336, 0.0916496}, 0.0365241, 0.73669},
      {{3.6369, 0.105431}, 0.0265639, 0.69676},    {{3.6405, 0.101775}, 0.0275679, 0.73913},
      {{3.6447, 0.117388}, 0.0365194, 0.696488},   {{3.6459, 0.109485}, 0.00948151, 0.647129},
      {{3.6477, 0.101015}, 0.0026086, 0.618021},   {{3.6496, 0.108607}, 0.0361667, 0.58609},
      {{3.7292, 0.106752}, 0.0357669, 0.56562},    {{3.7313, 0.119013}, 0.0353249, 0.580926},
      {{3.7353, 0.0823399}, 0.0283297, 0.622026},  {{3.7372, 0.0916756}, 0.0303918, 0.620982},
      {{3.7407, 0.0982882}, 0.0592707, 0.613155},  {{3.7636, 0.0871141}, 0.0653489, 0.62509},
      {{3.7647, 0.0748233}, 0.0574132, 0.646478},  {{3.7661, 0.065187}, 0.0673076, 0.639373},
      {{3.7675, 0.0788469}, 0.0385368, 0.647832},  {{3.7686, 0.0387801}, 0.0220775, 0.651838},
      {{3.7689, 0.00108794}, 0.0410598, 0.661866}, {{3.3586, -1.17632}, -0.347689, 0.571801},
  };
  return kSamples;
}

TEST(PendingSamples, ADriverThatCannotReachItsMarginIsNotSentBackAndForthBetweenItsBounds) {
  OnlineSvr svr(polynomial_options(2, 100, 1000.0));
  for (const WeightedSample& sample : slow_cooling()) {
    const UpdateReport report = svr.add(sample.x, sample.y, sample.weight);
    ASSERT_TRUE(svr.has_finished()) << "sample " << svr.size() - 1;
    // As many as there are samples: each changes set once.
    EXPECT_LE(report.events, slow_cooling().size()) << "sample " << svr.size() - 1;
    EXPECT_LE(svr.max_kkt_violation(), svr.options().kkt_bound());
  }
}

struct Chamber {
  double level;  // of the temperature
  double resolution;
  std::size_t dimension;
  int degree;
  double c;
};

void PrintTo(const Chamber& chamber, std::ostream* out) {
  *out << "level " << chamber.level << " resolution " << chamber.resolution << " dimension "
       << chamber.dimension << " degree " << chamber.degree << " C " << chamber.c << " seed "
       << kSeed;
}

class PendingSamplesTest : public ::testing::TestWithParam<Chamber> {};

// A temperature that changes slowly, its rate, and a second probe that is nearly a combination of
// the two; every third sample comes again.
TEST_P(PendingSamplesTest, EveryNearlyDependentSampleSettlesWithinTwiceTheWindowsEvents) {
  const Chamber& chamber = GetParam();
  constexpr std::size_t kCapacity = 120, kRecords = 8;
  for (std::size_t seed = kSeed; seed < kSeed + kRecords; ++seed) {
    std::mt19937_64 engine(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> weight(0.5, 1.0);
    OnlineSvrOptions options = polynomial_options(chamber.dimension, kCapacity, chamber.c);
    options.kernel.degree = chamber.degree;
    OnlineSvr svr(options);
    double temperature = chamber.level, rate = 0.0;
    std::vector<double> x(chamber.dimension);
    for (std::size_t i = 0; i < 3 * kCapacity; ++i) {
      if (i % 3 != 2) {
        rate = std::clamp(rate + 0.05 * normal(engine), -1.3, 1.3);
        temperature += 0.02 * rate;
        const double probes[] = {temperature, rate, temperature + 0.1 * rate};
        for (std::size_t d = 0; d < x.size(); ++d) x[d] = quantised(probes[d], chamber.resolution);
      }
      const double y = 0.3 * std::sin(1.5 * temperature) + 0.2 * rate + 0.02 * normal(engine);
      const UpdateReport report = svr.add(x, y, weight(engine));
      ASSERT_TRUE(svr.has_finished()) << "seed " << seed << " sample " << i;
      ASSERT_LE(report.events, 2 * kCapacity) << "seed " << seed << " sample " << i;
      ASSERT_LE(std::fabs(svr.theta_sum()), theta_sum_bound(svr));
    }
  }
}

std::vector<Chamber> chambers() {
  std::vector<Chamber> all;
  for (const double level : {1.0, 4.0}) {
    for (const double resolution : {1e-4, 1e-2}) {
      for (const std::size_t dimension : {1u, 2u, 3u}) {
        for (const int degree : {3, 4}) {
          for (const double c : {10.0, 1000.0}) {
            all.push_back({level, resolution, dimension, degree, c});
          }
        }
      }
    }
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(Chambers, PendingSamplesTest, ::testing::ValuesIn(chambers()));

}  // namespace
}  // namespace zerodrift::regression::testing
