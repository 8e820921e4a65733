// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/model_schedule.h"

#include <gtest/gtest.h>

namespace zerodrift::compensation {
namespace {

using core::SensorTime;

constexpr SensorTime kSecond{1'000'000'000};

TrainingJob reset() {
  return {.kind = TrainingJob::Kind::kReset, .label = {}};
}

struct Scheduled {
  CompensationOptions options{};
  ModelSchedule models{options};

  // Of the model in force; 0: none.
  [[nodiscard]] std::uint64_t job() const {
    const auto* model = models.active();
    return model == nullptr ? 0 : model->job;
  }
};

// Law: a model is in force from its due time on, however early the learner delivered it.
TEST(ModelScheduleLaws, AModelTakesEffectAtItsTimeAndNotBefore) {
  Scheduled s;
  ASSERT_TRUE(s.models.submit(reset(), 5 * kSecond));
  ASSERT_TRUE(s.models.learner().run_one());
  EXPECT_FALSE(s.models.step(5 * kSecond - SensorTime{1}).in_force);
  EXPECT_EQ(s.models.active(), nullptr);
  EXPECT_TRUE(s.models.step(5 * kSecond).in_force);
  EXPECT_EQ(s.job(), 1U);
  EXPECT_TRUE(s.models.is_quiescent());
}

// Law: several that are due come into force one a sample, in the order of their jobs.
TEST(ModelScheduleLaws, OneModelASampleInTheOrderOfTheJobs) {
  Scheduled s;
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(s.models.submit(reset(), kSecond));
  while (s.models.learner().run_one()) {
  }
  for (std::uint64_t job = 1; job <= 3; ++job) {
    EXPECT_TRUE(s.models.step(kSecond).in_force);
    EXPECT_EQ(s.job(), job);
  }
  EXPECT_FALSE(s.models.step(kSecond).in_force);
}

// Rule: a learner that is behind is told of once for each model, and by how much.
TEST(ModelScheduleLaws, ALateModelIsToldOnceAndStillComes) {
  Scheduled s;
  ASSERT_TRUE(s.models.submit(reset(), kSecond));
  EXPECT_FALSE(s.models.is_awaited(kSecond - SensorTime{1}));
  EXPECT_TRUE(s.models.is_awaited(kSecond));
  EXPECT_TRUE(s.models.step(2 * kSecond).is_late);
  EXPECT_FALSE(s.models.step(3 * kSecond).is_late);
  EXPECT_EQ(s.models.late_by(3 * kSecond), 2 * kSecond);
  ASSERT_TRUE(s.models.learner().run_one());
  EXPECT_EQ(s.models.late_by(3 * kSecond), SensorTime{0});
  EXPECT_TRUE(s.models.step(4 * kSecond).in_force);
}

TEST(ModelScheduleLaws, WhereTimeBeginsAnewWhatIsDueIsDueAtOnce) {
  Scheduled s;
  ASSERT_TRUE(s.models.submit(reset(), 1000 * kSecond));
  ASSERT_TRUE(s.models.learner().run_one());
  s.models.forget_time();
  EXPECT_EQ(s.models.late_by(2000 * kSecond), SensorTime{0}) << "of no time, so not late by any";
  EXPECT_TRUE(s.models.step(kSecond).in_force);
}

TEST(ModelScheduleLaws, WhatIsLeftIsLearnedOnThisThread) {
  Scheduled s;
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(s.models.submit(reset(), (i + 1) * kSecond));
  int in_force = 0;
  while (const auto step = s.models.finish_next()) in_force += step->in_force ? 1 : 0;
  EXPECT_EQ(in_force, 5);
  EXPECT_EQ(s.job(), 5U);
  EXPECT_TRUE(s.models.is_quiescent());
}

// A queue that is full takes nothing, and what was taken still comes.
TEST(ModelScheduleAbuse, AFullQueueTakesNothingAndLosesNothing) {
  Scheduled s;
  std::uint64_t taken = 0;
  while (s.models.submit(reset(), kSecond)) ++taken;
  ASSERT_GT(taken, 0U);
  ASSERT_LT(taken, 1000U);
  EXPECT_EQ(s.models.newest_job(), taken);
  std::uint64_t came = 0;
  while (s.models.finish_next()) ++came;
  EXPECT_EQ(came, taken);
}

// A change of the prior is handed over with its model, once, and nothing of it stays behind.
TEST(ModelScheduleLaws, AChangeOfThePriorComesWithItsModelAndIsLetGo) {
  Scheduled s;
  auto change = std::make_shared<PriorChange>(s.options, std::nullopt);
  TrainingJob job{.kind = TrainingJob::Kind::kExchange, .label = {}, .restored = change->learner};
  ASSERT_TRUE(s.models.submit(job, kSecond, change));
  job.restored.reset();
  ASSERT_TRUE(s.models.learner().run_one());
  auto step = s.models.step(kSecond);
  EXPECT_TRUE(step.in_force);
  EXPECT_EQ(step.change, change);
  step.change.reset();
  EXPECT_EQ(change.use_count(), 1);
}

}  // namespace
}  // namespace zerodrift::compensation
