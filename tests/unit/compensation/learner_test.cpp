// SPDX-License-Identifier: Apache-2.0
// The two queues between data path and learner.
#include "common/compensation/learner.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

CompensationOptions small_options() {
  CompensationOptions options = testing::options();
  options.model.capacity = 50;
  options.features = {{.kind = thermal::FeatureKind::kTemperature, .probe = "coil"}};
  return options;
}

const ModelSnapshot& active(const ModelExchange& exchange) {
  const ModelSnapshot* snapshot = exchange.active();
  if (snapshot == nullptr) throw std::logic_error("no active snapshot");
  return *snapshot;
}

constexpr double kSigma = 1e-7;

Label label(double feature, double drift_radps) {
  Label made;
  made.valid = {true, true, true};
  made.features_ready = {true, true, true};
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    made.drift_radps[i] = drift_radps;
    made.variance_radps2[i] = kSigma * kSigma;
    made.features[i][0] = feature;
  }
  return made;
}

AxisLabel axis_label(int number, double feature, double drift_radps) {
  AxisLabel made;
  made.time = core::from_seconds(10.0 * number);
  made.drift_radps = drift_radps;
  made.variance = kSigma * kSigma;
  made.features.emplace();
  (*made.features)[0] = feature;
  return made;
}

// Labels end 10 s apart.
TrainingJob job(std::uint64_t number, Label what) {
  what.end = core::from_seconds(10.0 * static_cast<double>(number));
  return {.number = number, .kind = TrainingJob::Kind::kLabel, .label = what};
}

// Rule: snapshots come out in the order of their jobs, one for each, with growing epochs.
TEST(ModelExchange, SnapshotsArriveInOrder) {
  const auto options = small_options();
  ModelExchange exchange(options);
  Learner learner(options, exchange);
  EXPECT_EQ(exchange.active(), nullptr);
  EXPECT_FALSE(learner.run_one());
  std::uint64_t submitted = 0;
  std::uint64_t activated = 0;
  Random random(3);
  while (activated < 200) {
    if (random.below(2) == 0 && submitted < activated + 20) {
      ++submitted;
      ASSERT_TRUE(
          exchange.submit(job(submitted, label(0.01 * static_cast<double>(submitted), 0.0))));
    }
    if (random.below(2) == 0) learner.run_one();
    if (random.below(2) == 0 && exchange.delivered(activated + 1)) {
      exchange.activate_next();
      ++activated;
      ASSERT_EQ(active(exchange).job, activated);
      ASSERT_EQ(active(exchange).epoch, activated);
    }
  }
  EXPECT_GE(learner.labels_learned(), 200U);
}

// Rule: the job queue holds 64; one more is refused and nothing of it is kept.
TEST(ModelExchange, AFullJobQueueRefuses) {
  ModelExchange exchange(small_options());
  for (std::uint64_t n = 1; n <= 64; ++n) ASSERT_TRUE(exchange.submit(job(n, label(0.0, 0.0))));
  EXPECT_FALSE(exchange.submit(job(65, label(0.0, 0.0))));
  const auto* const first = exchange.next_job();
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(first->number, 1U);
}

// Rule: without a free snapshot the learner does nothing and loses no job; it goes on once the data
// path takes one. Four snapshots: with none active four are made, afterwards one is in use.
TEST(ModelExchange, WithoutAFreeSnapshotTheLearnerWaitsAndLosesNothing) {
  const auto options = small_options();
  ModelExchange exchange(options);
  Learner learner(options, exchange);
  for (std::uint64_t n = 1; n <= 10; ++n) exchange.submit(job(n, label(0.0, 0.0)));
  int made = 0;
  while (learner.run_one()) ++made;
  EXPECT_EQ(made, 4);
  const auto* const next = exchange.next_job();
  ASSERT_NE(next, nullptr);
  EXPECT_EQ(next->number, 5U);
  exchange.activate_next();
  EXPECT_FALSE(learner.run_one());  // the one activated is in use
  exchange.activate_next();
  EXPECT_TRUE(learner.run_one());
  EXPECT_EQ(active(exchange).job, 2U);
  EXPECT_EQ(learner.labels_learned(), 5U);
}

// Rule: the active snapshot is immutable: learning goes on beside it.
TEST(ModelExchange, TheActiveSnapshotDoesNotChangeWhileTheLearnerWorks) {
  const auto options = small_options();
  ModelExchange exchange(options);
  Learner learner(options, exchange);
  std::uint64_t n = 0;
  for (int i = 0; i < 10; ++i) {
    exchange.submit(job(++n, label(0.1 * i, 1e-5 * i)));
    ASSERT_TRUE(learner.run_one());
    exchange.activate_next();
  }
  const AxisModel& model = active(exchange).axes[0];
  ASSERT_TRUE(model.drift.trained);
  FeatureArray x{};
  x[0] = 0.45;
  const double before = model.drift.predict(x);
  const double held = model.drift.held_radps;
  for (int i = 0; i < 3; ++i) {
    exchange.submit(job(++n, label(0.45, -1e-3)));
    ASSERT_TRUE(learner.run_one());
  }
  EXPECT_EQ(model.drift.predict(x), before);
  EXPECT_EQ(model.drift.held_radps, held);
}

// Rule: the initial set makes the first model; each label then lies within its tube. A straight
// line: epsilon is 0.01 of a scale of 100 sigma, so 1 sigma; the KKT tolerance is far below.
TEST(AxisLearner, AfterTheInitialSetLabelsAreFittedToTheTube) {
  const auto options = small_options();
  AxisLearner learner(options, 1);
  AxisModel model(1, options.model.capacity);
  const auto drift = [](double x) { return 1e-5 + 3e-6 * x; };
  for (int i = 0; i < 30; ++i) {
    const double x = 0.1 * i;
    learner.learn(axis_label(i, x, drift(x)));
    learner.write(model);
    EXPECT_EQ(model.drift.trained, i + 1 >= static_cast<int>(options.learning.initial_labels));
  }
  for (int i = 0; i < 30; ++i) {
    const double x = 0.1 * i;
    EXPECT_NEAR(model.drift.predict(label(x, 0.0).features[0]), drift(x), 1.001 * kSigma) << x;
  }
}

// Rule: what is held is the mean of the labels of the last stationary minute: six of 10 s.
TEST(AxisLearner, TheLastStationaryMinuteIsHeld) {
  const auto options = small_options();
  AxisLearner learner(options, 1);
  AxisModel model(1, options.model.capacity);
  learner.write(model);
  EXPECT_FALSE(model.drift.holds());
  for (int i = 0; i < 20; ++i) learner.learn(axis_label(i, 0.0, 1e-5 * i));
  learner.write(model);
  EXPECT_EQ(model.drift.time, core::from_seconds(190.0));
  EXPECT_NEAR(model.drift.held_radps, 1e-5 * 16.5, 1e-18);
  EXPECT_NEAR(*model.drift.held_slope_radps2, 1e-6, 1e-18);
  // After a pause, the labels before it are older than a minute.
  learner.learn(axis_label(100, 0.0, -3e-5));
  learner.write(model);
  EXPECT_EQ(model.drift.held_radps, -3e-5);
  EXPECT_FALSE(model.drift.held_slope_radps2);
}

// Rule: without features the held level still moves, and the experts in time learn, through pauses
// as well; the SVR and the experts that map the temperature learn nothing.
// Rule: what is predicted at the held level is the mean of the model over the labels of the last
// minute, whatever kernel was chosen in between, and which samples were left out since.
TEST(AxisLearner, WhatIsPredictedAtTheHeldLevelIsTheModelsOverTheLastMinute) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    CompensationOptions options = small_options();
    AxisLearner learner(options, options.features.size());
    AxisModel model(options.features.size(), options.model.capacity);
    Random random(seed);
    std::vector<AxisLabel> labels;
    int kernels = 0;
    for (int k = 1; k <= 600; ++k) {
      const double gamma = learner.kernel().kernel.gamma;
      const double feature = std::sin(0.03 * k) + 0.02 * random.gaussian();
      const double drift = 20.0 * kSigma * std::tanh(6.0 * feature) + kSigma * random.gaussian();
      // Pauses longer than a minute, so that some minutes hold one label.
      const int number = k + 20 * (k / 36);
      labels.push_back(axis_label(number, feature, drift));
      learner.learn(labels.back());
      learner.write(model);
      kernels += learner.kernel().kernel.gamma != gamma ? 1 : 0;
      if (!model.drift.trained) continue;
      double sum = 0.0;
      int n = 0;
      for (const AxisLabel& held : labels) {
        if (core::seconds(labels.back().time - held.time) >= 60.0) continue;
        sum += model.drift.predict(*held.features);
        ++n;
      }
      ASSERT_NEAR(model.drift.predicted_held_radps, sum / n, 0.05 * kSigma) << seed << ' ' << k;
    }
    EXPECT_GT(kernels, 0) << seed;
  }
}

TEST(AxisLearner, WithoutFeaturesTheHeldLevelAndTheExpertsInTimeLearnAlone) {
  const auto options = small_options();
  AxisLearner learner(options, 1);
  AxisModel model(1, options.model.capacity);
  for (int i = 0; i < 20; ++i) {
    AxisLabel bare = axis_label(i, 0.0, 2e-5);
    bare.features.reset();
    learner.learn(bare);
  }
  learner.write(model);
  EXPECT_FALSE(model.drift.trained);
  EXPECT_NEAR(model.drift.held_radps, 2e-5, 1e-19);
  EXPECT_FALSE(model.stack.knows());
  ASSERT_TRUE(model.in_time.knows());
  EXPECT_NEAR(model.in_time.predict(200.0, {}).drift, 2e-5, 1e-9);
  // A drive of ten minutes, twice: the forecasts made before it are judged by the labels behind it.
  for (const int first : {80, 160}) {
    for (int i = 0; i < 4; ++i) {
      AxisLabel bare = axis_label(first + i, 0.0, 2e-5);
      bare.features.reset();
      learner.learn(bare);
    }
  }
  learner.write(model);
  EXPECT_GE(model.in_time.horizons[2].half_width, 0.0);
}

// Rule: the temperature of what is held is the mean over the same labels, with features or without;
// nothing is said of it where a label had none.
TEST(AxisLearner, TheTemperatureOfWhatIsHeldIsThatOfItsLabels) {
  const auto options = small_options();
  AxisLearner learner(options, 1);
  AxisModel model(1, options.model.capacity);
  learner.write(model);
  EXPECT_FALSE(model.held_thermal);
  for (int i = 0; i < 20; ++i) {
    AxisLabel own = axis_label(i, 0.0, 1e-5);
    if (i % 2 == 0) own.features.reset();
    if (i > 0) own.thermal = {.temperature = 0.1 * i, .rate = 0.2};
    learner.learn(own);
    learner.write(model);
    if (i > 5) {
      ASSERT_TRUE(model.held_thermal) << i;
      EXPECT_NEAR(model.held_thermal->temperature, 0.1 * (i - 2.5), 1e-12);
      EXPECT_NEAR(model.held_thermal->rate, 0.2, 1e-12);
    } else {
      EXPECT_FALSE(model.held_thermal) << i;
    }
  }
}

// Rule: within the domain is what lies within 0.7 of a learned sample, in scaled features; a hole
// between two far ones is outside.
TEST(AxisLearner, TheDomainIsWhatLiesNearALearnedSample) {
  const auto options = small_options();
  AxisLearner learner(options, 1);
  AxisModel model(1, options.model.capacity);
  for (int i = 0; i <= 10; ++i) learner.learn(axis_label(i, i < 5 ? 0.0 : 3.0, 1e-5));
  learner.write(model);
  const auto near = [&](double x) {
    return model.drift.has_learned_near(label(x, 0.0).features[0]);
  };
  EXPECT_TRUE(near(-0.699));
  EXPECT_FALSE(near(-0.701));
  EXPECT_TRUE(near(0.699));
  EXPECT_FALSE(near(1.5));
  EXPECT_TRUE(near(3.699));
  EXPECT_FALSE(near(3.701));
}

// Rule: a reset forgets; what is learned afterwards is as from a new learner, to the bit.
TEST(LearnerLaws, AfterAResetItLearnsAsIfNew) {
  const auto options = small_options();
  const auto teach = [](Learner& learner, ModelExchange& exchange, std::uint64_t& n) {
    for (int i = 0; i < 12; ++i) {
      exchange.submit(job(++n, label(0.1 * i, 1e-5 * std::sin(i))));
      learner.run_one();
      exchange.activate_next();
    }
  };
  ModelExchange fresh_exchange(options), used_exchange(options);
  Learner fresh(options, fresh_exchange), used(options, used_exchange);
  std::uint64_t n = 0;
  for (int i = 0; i < 20; ++i) {
    used_exchange.submit(job(++n, label(-0.2 * i, 4e-5)));
    used.run_one();
    used_exchange.activate_next();
  }
  used_exchange.submit({.number = ++n, .kind = TrainingJob::Kind::kReset, .label = {}});
  ASSERT_TRUE(used.run_one());
  used_exchange.activate_next();
  EXPECT_FALSE(active(used_exchange).axes[0].drift.trained);
  EXPECT_FALSE(active(used_exchange).axes[0].drift.holds());
  std::uint64_t m = 0;
  teach(used, used_exchange, n);
  teach(fresh, fresh_exchange, m);
  for (int i = -20; i < 20; ++i) {
    const auto x = label(0.1 * i, 0.0).features[0];
    const DriftModel& used_model = active(used_exchange).axes[1].drift;
    const DriftModel& fresh_model = active(fresh_exchange).axes[1].drift;
    EXPECT_EQ(used_model.predict(x), fresh_model.predict(x));
    EXPECT_EQ(used_model.has_learned_near(x), fresh_model.has_learned_near(x));
  }
}

// Rule: an axis without a valid label or features learns nothing from the job; the others do.
TEST(Learner, AnAxisWithoutFeaturesLearnsNothing) {
  const auto options = small_options();
  ModelExchange exchange(options);
  Learner learner(options, exchange);
  for (std::uint64_t n = 1; n <= 6; ++n) {
    Label partial = label(0.1 * static_cast<double>(n), 1e-5);
    partial.features_ready[1] = false;
    partial.valid[2] = false;
    exchange.submit(job(n, partial));
    learner.run_one();
    exchange.activate_next();
  }
  EXPECT_TRUE(active(exchange).axes[0].drift.trained);
  EXPECT_FALSE(active(exchange).axes[1].drift.trained);
  EXPECT_FALSE(active(exchange).axes[2].drift.holds());
}

}  // namespace
}  // namespace zerodrift::compensation
