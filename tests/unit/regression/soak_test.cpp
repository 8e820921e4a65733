// SPDX-License-Identifier: Apache-2.0
// Long runs over all hard records, kernels and windows with C up to 1000, half of them with weights
// down to 1e-6, and with samples forgotten out of turn. ZERODRIFT_SOAK_STEPS sets the number of
// steps.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "common/regression/online_svr.h"
#include "tests/support/allocation_count.h"
#include "tests/unit/regression/test_records.h"

namespace zerodrift::regression::testing {

namespace {

std::size_t soak_steps() {
  const char* steps = std::getenv("ZERODRIFT_SOAK_STEPS");
  return steps ? static_cast<std::size_t>(std::strtoull(steps, nullptr, 10)) : 200000;
}

OnlineSvrOptions draw_options(std::mt19937_64& engine) {
  const auto draw = [&](std::size_t count) { return static_cast<std::size_t>(engine() % count); };
  constexpr double kC[] = {0.1, 1.0, 10.0, 100.0, 1000.0};
  constexpr double kGamma[] = {0.1, 1.0, 3.0, 30.0};
  constexpr double kEpsilon[] = {0.001, 0.02, 0.1};
  OnlineSvrOptions options =
      options_of(1 + draw(4), 5 + draw(80), kC[draw(5)], kAllKernelKinds[draw(5)]);
  if (options.kernel.is_stationary()) options.kernel.gamma = kGamma[draw(4)];
  options.epsilon = kEpsilon[draw(3)];
  options.window = draw(2) == 0 ? WindowPolicy::kFifo : WindowPolicy::kTwoTier;
  return options;
}

TEST(Soak, HardRecordsNeverBreakTheLaws) {
  constexpr std::size_t kStepsPerRun = 1000;
  const std::size_t steps = soak_steps();
  for (std::size_t run = 0; run * kStepsPerRun < steps; ++run) {
    std::mt19937_64 engine(run);
    const OnlineSvrOptions options = draw_options(engine);
    const RecordKind kind = kAllRecordKinds[engine() % std::size(kAllRecordKinds)];
    SCOPED_TRACE(::testing::Message()
                 << "seed " << run << " " << name(kind) << " " << name(options.kernel.kind)
                 << " gamma " << options.kernel.gamma << " C " << options.box_constraint
                 << " epsilon " << options.epsilon << " W " << options.capacity << " dimension "
                 << options.dimension);
    RecordGenerator record(kind, options.dimension, run);
    const bool has_weights = engine() % 2 == 0;
    OnlineSvr svr(options);
    for (std::size_t i = 0; i < kStepsPerRun; ++i) {
      const Sample sample = record.next();
      const double weight = has_weights ? std::pow(10.0, -static_cast<double>(engine() % 7)) : 1.0;
      const std::size_t allocations = allocation_count();
      const UpdateReport report = svr.add(sample.x, sample.y, weight);
      if (i % 20 == 19) svr.forget(engine() % svr.slot_count());  // refused if vacant
      ASSERT_EQ(allocation_count(), allocations) << "step " << i;
      ASSERT_TRUE(std::isfinite(report.prior_residual)) << "step " << i;
      ASSERT_TRUE(svr.has_finished()) << "step " << i;
      ASSERT_TRUE(report.outcome == UpdateOutcome::kLearned ||
                  report.outcome == UpdateOutcome::kFitsAlready)
          << "step " << i << " outcome " << static_cast<int>(report.outcome);
      ASSERT_LE(std::fabs(svr.theta_sum()), theta_sum_bound(svr)) << "step " << i;
      if (i % 50 == 49) {
        ASSERT_LE(svr.max_kkt_violation(), options.kkt_bound()) << "step " << i;
      }
    }
  }
}

}  // namespace
}  // namespace zerodrift::regression::testing
