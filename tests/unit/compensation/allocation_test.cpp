// SPDX-License-Identifier: Apache-2.0
// The data path takes no memory after its construction, and neither does the learner. Own program:
// it replaces operator new.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/support/allocation_count.h"
#include "tests/unit/compensation/prior_models.h"
#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

// Twenty minutes of ramp with a turn; the window of 40 labels fills and forgets.
Record busy_record() {
  return make_record({.duration_s = 1200.0,
                      .low_degc = 20.0,
                      .high_degc = 30.0,
                      .motion = testing::turn(500.0, 20.0, 0.1)});
}

// Choosing a kernel anew takes memory, in the learner alone; without it the learner takes none.
CompensationOptions busy_options() {
  CompensationOptions options = testing::options();
  options.model.selection.reset();
  options.model.capacity = 40;
  options.features.push_back(
      {.kind = thermal::FeatureKind::kLaggedTemperature, .probe = "coil", .lag_s = 60.0});
  return options;
}

// Rule: the counter counts.
TEST(CompensatorAllocationLaws, TheCounterCounts) {
  EXPECT_EQ(allocated_by([] { ::operator delete(::operator new(10)); }), 1U);
}

// Rule: no memory is taken in push, answer_next, learning, freeze and reset, from the first sample
// on.
void expect_no_memory_taken(const CompensationOptions& options,
                            const Record& record = busy_record()) {
  Compensator compensator{options};
  std::size_t answers = 0;
  const std::size_t taken = allocated_by([&] {
    testing::run(compensator, record, [&](const core::CompensatedSample&) {
      ++answers;
      if (answers == 20'000) compensator.freeze();
      if (answers == 20'400) compensator.learn();
      if (answers == 20'800) compensator.reset_models();
    });
    compensator.restart_stream();
  });
  EXPECT_EQ(taken, 0U);
  EXPECT_EQ(answers, record.rates.size());
  EXPECT_GT(compensator.learner().labels_learned(), 80U);  // more than the window holds
}

TEST(CompensatorAllocationLaws, DataPathAndLearnerTakeNoMemoryAfterConstruction) {
  expect_no_memory_taken(busy_options());
}

TEST(CompensatorAllocationLaws, NorDoesTheOnlineSvrAlone) {
  CompensationOptions options = busy_options();
  options.scheme = Scheme::kOnlineSvr;
  expect_no_memory_taken(options);
}

// Rule: nor where the scale factor is learned against true rates.
TEST(CompensatorAllocationLaws, NorDoesTheScaleFactor) {
  CompensationOptions options = busy_options();
  options.learning.scale_factor = true;
  Record record = busy_record();
  for (std::size_t k = 0; k < record.rates.size(); ++k) {
    record.references.push_back({.time = record.rates[k].time,
                                 .rate_radps = record.true_radps[k],
                                 .valid = {true, true, true},
                                 .kind = core::ReferenceKind::kRateTable});
  }
  expect_no_memory_taken(options, record);
}

// Rule: nor with a prior whose effects have states, when these begin anew, and when another prior
// comes into force and goes again.
TEST(CompensatorAllocationLaws, APriorAndItsChangesTakeNoMemory) {
  const Record record = busy_record();
  CompensationOptions options = busy_options();
  options.prior = testing::model_with_states();
  options.prior->effects.resize(4);  // those that read the coil's temperature alone
  Compensator compensator{options};
  auto change = std::make_shared<PriorChange>(options, testing::model_of(GyroSpec{}));
  std::size_t answers = 0;
  std::size_t on_prior = 0;
  const std::size_t taken = allocated_by([&] {
    testing::run(compensator, record, [&](const core::CompensatedSample& answer) {
      ++answers;
      if (answer.rung[0] == core::Rung::kPrior) ++on_prior;
      if (answers == 12'000 || answers == 16'000) compensator.change_prior(change);
    });
    compensator.restart_stream();
  });
  EXPECT_EQ(taken, 0U);
  EXPECT_EQ(answers, record.rates.size());
  EXPECT_GT(on_prior, 100U);
  EXPECT_TRUE(change->in_force);
}

// What a run with the learner in a thread of its own takes and answers.
struct TwoThreads {
  std::size_t taken_by_data_path = 0;
  std::size_t taken_by_learner = 0;
  std::size_t answers = 0;
};

TwoThreads run_beside(Compensator& compensator, const Record& record, bool count_learner) {
  TwoThreads run;
  std::atomic<bool> stop{false};
  const auto learn = [&] {
    while (!stop) {
      if (!compensator.learner().run_one()) std::this_thread::yield();
    }
  };
  std::thread learner([&] {
    if (count_learner) {
      run.taken_by_learner = allocated_by(learn);
    } else {
      learn();
    }
  });
  std::size_t t = 0;
  run.taken_by_data_path = allocated_by([&] {
    for (const auto& sample : record.rates) {
      for (; record.temperatures[t].time <= sample.time; ++t)
        compensator.push(record.temperatures[t]);
      compensator.push(sample);
      for (;;) {
        const Readiness readiness = compensator.readiness();
        if (readiness == Readiness::kAwaitsModel) {
          std::this_thread::yield();
          continue;
        }
        if (readiness != Readiness::kReady) break;
        compensator.answer_next();
        ++run.answers;
      }
    }
  });
  stop = true;
  learner.join();
  return run;
}

// Rule: nor while the learner runs in another thread, whose own work takes none either; and every
// label that was submitted is learned, each snapshot activated.
TEST(CompensatorAllocationLaws, NeitherThreadTakesMemoryWhileTheyRunBesideEachOther) {
  const Record record = busy_record();
  Compensator compensator{busy_options()};
  const TwoThreads run = run_beside(compensator, record, true);
  EXPECT_EQ(run.taken_by_data_path, 0U);
  EXPECT_EQ(run.taken_by_learner, 0U);
  EXPECT_GT(run.answers,
            record.rates.size() - 100);  // the last wait for a temperature that doesn't come
  EXPECT_EQ(compensator.counts().late_models, 0U);
  EXPECT_GE(compensator.learner().labels_learned() + 1, compensator.counts().labels);
}

// Rule: a learner that chooses its kernel anew, which takes memory, leaves the data path without.
TEST(CompensatorAllocationLaws, TheDataPathTakesNoMemoryWhileAKernelIsChosen) {
  const Record record = busy_record();
  CompensationOptions options = busy_options();
  options.model.selection = regression::SelectionCriterion::kMarginalLikelihood;
  Compensator compensator{options};
  EXPECT_EQ(run_beside(compensator, record, false).taken_by_data_path, 0U);
  EXPECT_GT(compensator.learner().labels_learned(), 36U);  // the first choice is made at 36
}

}  // namespace
}  // namespace zerodrift::compensation
