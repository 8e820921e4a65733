// SPDX-License-Identifier: Apache-2.0
#include "common/regression/sample_window.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "common/regression/online_svr.h"
#include "tests/unit/regression/test_records.h"

namespace zerodrift::regression::testing {
namespace {

std::vector<double> targets_of(const OnlineSvr& svr) {
  std::vector<double> targets;
  for (std::size_t slot = 0; slot < svr.slot_count(); ++slot) {
    if (svr.set_of(slot) != SampleSet::kVacant) targets.push_back(svr.target(slot));
  }
  std::sort(targets.begin(), targets.end());
  return targets;
}

TEST(WindowLaws, FifoKeepsExactlyTheLastSamples) {
  constexpr std::size_t kCapacity = 20;
  OnlineSvr svr(options_of(2, kCapacity, 10.0));
  for (int i = 0; i < 95; ++i) {
    const double y = 0.1 * i;
    svr.add(std::vector<double>{0.01 * i, 0.0}, y);
  }
  const std::vector<double> targets = targets_of(svr);
  ASSERT_EQ(targets.size(), kCapacity);
  // The jitter moves targets by at most 1e-12 at C = 10.
  for (std::size_t i = 0; i < kCapacity; ++i) {
    EXPECT_NEAR(targets[i], 0.1 * static_cast<double>(75 + i), 1e-11);
  }
}

// A direct, quadratic statement of the two-tier rule.
class SlowTwoTier {
 public:
  SlowTwoTier(std::size_t capacity, std::size_t recent) : capacity_(capacity), recent_(recent) {}

  void add(const Sample& sample) {
    if (samples_.size() == capacity_) samples_.erase(samples_.begin() + victim());
    samples_.push_back(sample);
  }
  [[nodiscard]] const std::vector<Sample>& samples() const { return samples_; }

 private:
  [[nodiscard]] std::ptrdiff_t victim() const {
    const std::size_t old = samples_.size() - recent_;
    double closest = std::numeric_limits<double>::infinity();
    std::ptrdiff_t earliest = 0;
    for (std::size_t i = 0; i < old; ++i) {
      for (std::size_t j = 0; j < old; ++j) {
        if (i == j) continue;
        double squared = 0.0;
        for (std::size_t d = 0; d < samples_[i].x.size(); ++d) {
          const double difference = samples_[i].x[d] - samples_[j].x[d];
          squared += difference * difference;
        }
        if (squared < closest) {
          closest = squared;
          earliest = static_cast<std::ptrdiff_t>(i);
        }
      }
    }
    return earliest;
  }

  std::size_t capacity_, recent_;
  std::vector<Sample> samples_;
};

// 29 recent samples of 30 leave one old sample, which has no neighbour.
std::vector<std::pair<RecordKind, std::size_t>> kinds_and_recent_capacities() {
  std::vector<std::pair<RecordKind, std::size_t>> all;
  for (const RecordKind kind : kAllRecordKinds) {
    for (const std::size_t recent : {1u, 12u, 29u}) all.emplace_back(kind, recent);
  }
  return all;
}

TEST(WindowLaws, TwoTiersKeepTheRecentAndThinTheOldByTheirNearestNeighbours) {
  for (const auto& [kind, recent] : kinds_and_recent_capacities()) {
    OnlineSvrOptions options = options_of(2, 30, 1.0);
    options.window = WindowPolicy::kTwoTier;
    options.recent_capacity = recent;
    OnlineSvr svr(options);
    SlowTwoTier slow(30, recent);
    RecordGenerator record(kind, 2, 9);
    for (int i = 0; i < 400; ++i) {
      const Sample sample = record.next();
      svr.add(sample.x, sample.y);
      slow.add(sample);
      std::vector<double> expected;
      for (const Sample& kept : slow.samples()) expected.push_back(kept.y);
      std::sort(expected.begin(), expected.end());
      const std::vector<double> targets = targets_of(svr);
      ASSERT_EQ(targets.size(), expected.size());
      for (std::size_t k = 0; k < expected.size(); ++k) {
        ASSERT_NEAR(targets[k], expected[k], 1e-11) << name(kind) << " step " << i;
      }
    }
  }
}

TEST(WindowScenario, TwoTiersRememberATemperatureThatFifoForgets) {
  OnlineSvrOptions options = options_of(1, 60, 10.0);
  OnlineSvr fifo(options);
  options.window = WindowPolicy::kTwoTier;
  options.recent_capacity = 30;
  OnlineSvr two_tier(options);
  const auto drift = [](double temperature) { return std::sin(2.0 * temperature); };
  const auto learn = [&](double temperature) {
    const std::vector<double> x{temperature};
    fifo.add(x, drift(temperature));
    two_tier.add(x, drift(temperature));
  };
  for (int i = 0; i < 100; ++i) learn(-1.0 + 0.02 * i);                // a ramp up to 1
  for (int i = 0; i < 300; ++i) learn(1.0 + 1e-4 * ((i * 37) % 100));  // then a long soak
  const std::vector<double> cold{-0.5};
  EXPECT_GT(std::fabs(fifo.predict(cold) - drift(-0.5)), 0.5);
  EXPECT_LT(std::fabs(two_tier.predict(cold) - drift(-0.5)), 2.0 * options.epsilon);
}

}  // namespace
}  // namespace zerodrift::regression::testing
