// SPDX-License-Identifier: Apache-2.0
// Records for the tests of the online SVR: smooth drifts and the sets on which public
// implementations abort.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "common/regression/online_svr.h"

namespace zerodrift::regression::testing {

struct Sample {
  std::vector<double> x;
  double y;
};

enum class RecordKind { kSmooth, kQuantised, kIdentical, kStuck, kRedelivered, kJumps };

inline constexpr RecordKind kAllRecordKinds[] = {RecordKind::kSmooth,      RecordKind::kQuantised,
                                                 RecordKind::kIdentical,   RecordKind::kStuck,
                                                 RecordKind::kRedelivered, RecordKind::kJumps};

inline const char* name(RecordKind kind) {
  constexpr const char* kNames[] = {"smooth", "quantised",   "identical",
                                    "stuck",  "redelivered", "jumps"};
  return kNames[static_cast<std::size_t>(kind)];
}

inline double drift_of(const std::vector<double>& x) {
  double drift = 0.0;
  for (std::size_t d = 0; d < x.size(); ++d) {
    drift += std::sin(2.5 * x[d] + static_cast<double>(d)) / static_cast<double>(d + 1);
  }
  return 0.5 * drift;
}

inline double quantised(double value, double step) {
  return std::round(value / step) * step;
}

// Features in [-1, 1], targets of the order of 1 with noise of 0.03.
class RecordGenerator {
 public:
  RecordGenerator(RecordKind kind, std::size_t dimension, std::uint64_t seed)
      : kind_(kind), dimension_(dimension), engine_(seed) {}

  Sample next() {
    Sample sample = fresh();
    const std::uint64_t phase = count_++;
    switch (kind_) {
      case RecordKind::kSmooth: break;
      case RecordKind::kQuantised:  // ties everywhere
        for (double& feature : sample.x) feature = quantised(feature, 0.25);
        sample.y = quantised(sample.y, 0.01);
        break;
      case RecordKind::kIdentical: sample = {std::vector<double>(dimension_, 0.5), 0.25}; break;
      case RecordKind::kStuck:  // features freeze for 30 samples in every 50
        if (phase % 50 >= 20 && !last_.x.empty()) sample.x = last_.x;
        break;
      case RecordKind::kRedelivered:  // every third sample comes again
        if (phase % 3 == 2) sample = last_;
        break;
      case RecordKind::kJumps:  // a step, and outliers that end at the box constraint
        sample.y += phase % 100 < 50 ? 0.0 : 2.0;
        if (phase % 7 == 0) sample.y += 10.0;
        break;
    }
    last_ = sample;
    return sample;
  }

  std::vector<Sample> take(std::size_t count) {
    std::vector<Sample> samples;
    for (std::size_t i = 0; i < count; ++i) samples.push_back(next());
    return samples;
  }

 private:
  Sample fresh() {
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    std::normal_distribution<double> noise(0.0, 0.03);
    Sample sample{std::vector<double>(dimension_), 0.0};
    for (double& feature : sample.x) feature = uniform(engine_);
    sample.y = drift_of(sample.x) + noise(engine_);
    return sample;
  }

  RecordKind kind_;
  std::size_t dimension_;
  std::mt19937_64 engine_;
  std::uint64_t count_ = 0;
  Sample last_{};
};

inline const char* name(KernelKind kind) {
  constexpr const char* kNames[] = {"rbf", "matern32", "matern52", "polynomial", "linear"};
  return kNames[static_cast<std::size_t>(kind)];
}

inline Kernel kernel_of(KernelKind kind) {
  Kernel kernel;
  kernel.kind = kind;
  kernel.gamma = kind == KernelKind::kPolynomial ? 0.5 : 3.0;
  kernel.degree = 3;
  return kernel;
}

inline constexpr KernelKind kAllKernelKinds[] = {KernelKind::kRbf, KernelKind::kMatern32,
                                                 KernelKind::kMatern52, KernelKind::kPolynomial,
                                                 KernelKind::kLinear};

inline OnlineSvrOptions options_of(std::size_t dimension, std::size_t capacity, double c,
                                   KernelKind kind = KernelKind::kRbf) {
  OnlineSvrOptions options;
  options.dimension = dimension;
  options.capacity = capacity;
  options.recent_capacity = capacity / 2;
  options.kernel = kernel_of(kind);
  options.epsilon = 0.02;
  options.box_constraint = c;
  // Laws are about the settled model; what happens at the budget has tests of its own.
  options.event_budget = 100000;
  return options;
}

// What the class promises.
inline double theta_sum_bound(const OnlineSvr& svr) {
  return 1e-10 * svr.options().box_constraint;
}

}  // namespace zerodrift::regression::testing
