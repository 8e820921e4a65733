// SPDX-License-Identifier: Apache-2.0
// Forecasts and how far experience trusts them: the judge on its own with made-up models, and with
// the learner on records whose truth is known.
#include "common/compensation/drift_forecast.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "common/compensation/learner.h"
#include "common/regression/online_svr.h"
#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

using core::SensorTime;

constexpr std::size_t kCapacity = 40;
constexpr double kShortestS = 8.0;
constexpr double kSigma = 1e-7;

FeatureArray features_at(double x) {
  FeatureArray features{};
  features[0] = x;
  return features;
}

// f(x) = gain x within [-5, 5], which is also what was learned; held and f_held are 0.
DriftModel linear_model(double time_s, double gain) {
  regression::OnlineSvrOptions options;
  options.dimension = 1;
  options.capacity = kCapacity;
  options.kernel.kind = regression::KernelKind::kLinear;
  options.epsilon = 1e-4;
  options.box_constraint = 1e4;
  options.window = regression::WindowPolicy::kFifo;
  regression::OnlineSvr svr(options);
  for (int i = -10; i <= 10; ++i) {
    const double x = 0.5 * i;
    svr.add({&x, 1}, x);
  }
  DriftModel model(1, kCapacity);
  model.predictor.assign(svr);
  model.domain.assign(svr);
  model.scale_radps = gain;
  model.trained = true;
  model.time = from_seconds(time_s);
  model.held_variance = kSigma * kSigma;
  model.predicted_held_radps = 0.0;
  return model;
}

TrustTable table_with(const ForecastWeights& weights) {
  TrustTable table;
  table.largest_change_radps.fill(std::numeric_limits<double>::infinity());
  double horizon_s = 10.0;
  for (std::size_t k = 0; k < kHorizons; ++k, horizon_s *= 3.0) {
    table.learned[k] = {weights, 1e-14, 2e-14};
    table.horizon_s[k] = horizon_s;
  }
  return table;
}

// ------------------------------------------------------------------------------------ the forecast

// Rule: without trust what was measured is held, to the bit.
TEST(ForecastLaws, WithBothWeightsZeroTheHeldDriftIsTheForecast) {
  DriftModel model = linear_model(100.0, 1e-5);
  model.held_radps = 1.2345e-6;
  model.predicted_held_radps = -3e-6;
  const TrustTable table = table_with({0.0, 0.0});
  for (const double x : {-4.0, 0.1, 3.0, 100.0}) {
    for (const double age_s : {0.0, 7.0, 100.0, 1e5}) {
      const Forecast made = forecast(model, table, features_at(x), from_seconds(100.0 + age_s));
      EXPECT_EQ(made.drift_radps, model.held_radps);
      EXPECT_EQ(made.kind, x > 5.7 ? ForecastKind::kBeyond : ForecastKind::kUnproved);
    }
  }
}

// Rule: with full trust in change and level held cancels: the forecast is the SVR's. Four sums of
// terms of 1e-5: a few times 1e-5 x 2^-52 = 2e-21.
TEST(ForecastLaws, WithBothWeightsOneTheModelIsTheForecast) {
  DriftModel model = linear_model(100.0, 1e-5);
  model.held_radps = 1.2345e-6;
  model.predicted_held_radps = -3e-6;
  const TrustTable table = table_with({1.0, 1.0});
  for (const double x : {-4.0, 0.1, 3.0}) {
    const Forecast made = forecast(model, table, features_at(x), from_seconds(150.0));
    EXPECT_NEAR(made.drift_radps, model.predict(features_at(x)), 2e-20);
    EXPECT_EQ(made.kind, ForecastKind::kModel);
  }
}

// Rule: between two entries weights and variance run linearly over the logarithm of the horizon;
// hence without a step at an entry and monotone between two. 1 ns of horizon moves the forecast of
// 1e-5 by 1e-5 x 1e-9 / 10 = 1e-15 at most.
TEST(ForecastLaws, BetweenHorizonsItIsContinuousAndMonotone) {
  const DriftModel model = linear_model(0.0, 1e-5);
  TrustTable table = table_with({});
  const std::array<double, kHorizons> change{0.9, 0.4, 0.6, 0.6, 0.1, 0.8};
  for (std::size_t k = 0; k < kHorizons; ++k) {
    table.learned[k].weights.change = change[k];
    table.learned[k].forecast_variance = 1e-14 * static_cast<double>(1 + k * k);
  }
  const auto at = [&](SensorTime now) { return forecast(model, table, features_at(1.0), now); };
  const double full = model.predict(features_at(1.0));
  for (std::size_t k = 0; k + 1 < kHorizons; ++k) {
    const double below_s = table.horizon_s[k];
    const double above_s = table.horizon_s[k + 1];
    EXPECT_NEAR(at(from_seconds(below_s)).drift_radps, change[k] * full, 1e-15);
    const Forecast before = at(from_seconds(above_s) - SensorTime{1});
    const Forecast after = at(from_seconds(above_s) + SensorTime{1});
    EXPECT_NEAR(before.drift_radps, after.drift_radps, 2e-15) << k;
    EXPECT_NEAR(before.variance / after.variance, 1.0, 1e-8) << k;
    const Forecast middle = at(from_seconds(std::sqrt(below_s * above_s)));
    EXPECT_NEAR(middle.drift_radps, 0.5 * (change[k] + change[k + 1]) * full, 1e-15);
    double last = at(from_seconds(below_s)).drift_radps;
    for (int i = 1; i <= 50; ++i) {
      const double now_s = below_s + (above_s - below_s) * i / 50.0;
      const double next = at(from_seconds(now_s)).drift_radps;
      ASSERT_GE((next - last) * (change[k + 1] - change[k]), 0.0) << now_s;
      last = next;
    }
  }
  EXPECT_EQ(at(from_seconds(1.0)).drift_radps, at(from_seconds(0.0)).drift_radps);
  EXPECT_EQ(at(from_seconds(1e5)).drift_radps, at(from_seconds(1e6)).drift_radps);
}

// Rule: without experience the variance is the measurement's own up to the shortest horizon, from
// there it grows in proportion to time, as a random walk's.
TEST(ForecastLaws, WithoutExperienceTheVarianceGrowsLikeARandomWalk) {
  const DriftModel model = linear_model(0.0, 1e-5);
  TrustTable table;
  table.horizon_s = {10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0};
  const double own = model.held_variance;
  const auto after = [&](double s) { return held_variance(model, table, from_seconds(s)); };
  EXPECT_NEAR(after(0.0) / own, 1.0, 1e-12);
  EXPECT_NEAR(after(10.0) / own, 1.0, 1e-12);
  for (const double s : {20.0, 100.0, 250.0, 5000.0}) EXPECT_NEAR(after(s) / own, s / 10.0, 1e-9);
  // Experience at the shortest horizon takes the place of the label's own variance.
  table.learned[0].held_variance = 3.0 * own;
  EXPECT_NEAR(after(10.0) / own, 3.0, 1e-12);
  EXPECT_NEAR(after(50.0) / own, 15.0, 1e-9);
}

// Rule: experience is of means of a whole minute. What one that has just begun is known worse by
// comes on top at every age, but for as much of it as the model's own level takes its place; where
// there is no experience the mean's own variance is all of it already.
TEST(ForecastLaws, OfAMeanThatHasJustBegunItsOwnVarianceComesOnTop) {
  DriftModel model = linear_model(0.0, 1e-5);
  const DriftModel settled = model;
  model.unsettled_variance = 5e-15;
  for (const double age_s : {0.0, 3.0, 10.0, 70.0, 2430.0, 1e5}) {
    const auto variance_of = [&](const DriftModel& held, const ForecastWeights& weights) {
      return forecast(held, table_with(weights), features_at(0.1), from_seconds(age_s)).variance;
    };
    const TrustTable table = table_with({});
    EXPECT_NEAR(
        held_variance(model, table, from_seconds(age_s)),
        held_variance(settled, table, from_seconds(age_s)) + std::min(age_s / 10.0, 1.0) * 5e-15,
        1e-20)
        << age_s;
    for (const double level : {0.0, 0.4, 1.0}) {
      if (age_s < 10.0) continue;
      EXPECT_NEAR(variance_of(model, {1.0, level}),
                  variance_of(settled, {1.0, level}) + (1.0 - level) * (1.0 - level) * 5e-15, 1e-20)
          << age_s << ' ' << level;
    }
    TrustTable without;
    without.horizon_s = table.horizon_s;
    EXPECT_EQ(held_variance(model, without, from_seconds(age_s)),
              held_variance(settled, without, from_seconds(age_s)));
  }
}

// --------------------------------------------------------------------------------------- the judge

// Rule: the weights lie in [0, 1]² and no point of a 101 x 101 grid serves better, for evidence of
// labels whose change and level are related in any way, also where one of them is absent.
TEST(WeightLaws, WeightsMinimiseTheRidgeObjectiveOverTheUnitSquare) {
  std::size_t inner = 0, on_edge = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    Random random(seed);
    WeightEvidence evidence;
    const double true_change = 3.0 * random.uniform() - 1.0;
    const double true_level = seed % 3 == 0 ? 0.0 : 3.0 * random.uniform() - 1.0;
    const double shared = random.uniform();
    double squares = 0.0;
    for (int i = 0; i < 20; ++i) {
      const double change = random.gaussian();
      const double level = seed % 3 == 0 ? 0.0 : shared * change + random.gaussian();
      const double error = true_change * change + true_level * level + 0.3 * random.gaussian();
      evidence.change_change += change * change;
      evidence.change_level += change * level;
      evidence.level_level += level * level;
      evidence.change_error += change * error;
      evidence.level_error += level * error;
      squares += error * error;
    }
    const double ridge = 3.0 * random.uniform();
    const double prior = random.uniform();
    const auto cost = [&](double change, double level) {
      return evidence.change_change * change * change +
             2.0 * evidence.change_level * change * level + evidence.level_level * level * level -
             2.0 * (evidence.change_error * change + evidence.level_error * level) +
             ridge * ((change - prior) * (change - prior) + level * level);
    };
    const ForecastWeights w = likeliest_weights(evidence, ridge, prior);
    ASSERT_TRUE(w.change >= 0.0 && w.change <= 1.0 && w.level >= 0.0 && w.level <= 1.0);
    double least = std::numeric_limits<double>::infinity();
    for (int a = 0; a <= 100; ++a) {
      for (int b = 0; b <= 100; ++b) least = std::min(least, cost(0.01 * a, 0.01 * b));
    }
    // Rounding of some twenty terms.
    EXPECT_LE(cost(w.change, w.level), least + 1e-12 * (squares + evidence.change_change + 10.0))
        << "seed " << seed;
    const bool edge = w.change == 0.0 || w.change == 1.0 || w.level == 0.0 || w.level == 1.0;
    ++(edge ? on_edge : inner);
  }
  EXPECT_GT(inner, 20U);
  EXPECT_GT(on_edge, 20U);
}

// Feeds a judge at 10 s with labels `drift(i)` at features `x(i)`, and the linear model as it would
// stand after each.
template <typename Drift>
void feed(ForecastJudge& judge, int begin, int end, Drift&& drift,
          double variance = kSigma * kSigma, double gain = 1e-6) {
  DriftModel model = linear_model(0.0, gain);
  for (int i = begin; i < end; ++i) {
    const FeatureArray features = features_at(4.0 * std::sin(0.07 * i));
    const double measured = drift(i);
    judge.judge({from_seconds(10.0 * i), measured, variance, features});
    model.time = from_seconds(10.0 * i);
    model.held_radps = measured;
    model.predicted_held_radps = model.predict(features);
    judge.keep(model);
  }
}

double followed(int i) {
  return 4e-6 * std::sin(0.07 * i);
}

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

bool same_bits(const TrustTable& a, const TrustTable& b) {
  const auto same = [](const ForecastTrust& p, const ForecastTrust& q) {
    return same_bits(p.weights.change, q.weights.change) &&
           same_bits(p.weights.level, q.weights.level) &&
           same_bits(p.forecast_variance, q.forecast_variance) &&
           same_bits(p.held_variance, q.held_variance);
  };
  for (std::size_t k = 0; k < kHorizons; ++k) {
    if (!same(a.learned[k], b.learned[k]) || !same(a.beyond[k], b.beyond[k]) ||
        !same_bits(a.horizon_s[k], b.horizon_s[k]))
      return false;
  }
  return true;
}

bool is_finite(const TrustTable& table) {
  for (const auto* entries : {&table.learned, &table.beyond}) {
    for (const ForecastTrust& trust : *entries) {
      if (!std::isfinite(trust.weights.change) || !std::isfinite(trust.weights.level) ||
          !std::isfinite(trust.forecast_variance) || !std::isfinite(trust.held_variance))
        return false;
    }
  }
  return true;
}

// Rule: same labels, same bits; and a reset leaves nothing behind.
TEST(JudgeLaws, SameLabelsGiveTheSameBitsAlsoAfterAReset) {
  ForecastJudge one(kShortestS, 1, kCapacity), other(kShortestS, 1, kCapacity);
  const TrustTable fresh = one.trust();
  feed(one, 0, 300, followed);
  feed(other, 0, 200, [](int i) { return 1e-6 * std::cos(i); });
  EXPECT_FALSE(same_bits(one.trust(), other.trust()));
  other.reset();
  EXPECT_TRUE(same_bits(other.trust(), fresh));
  feed(other, 0, 300, followed);
  EXPECT_TRUE(same_bits(one.trust(), other.trust()));
}

// Rule: what is more than three times as old as its horizon judges nothing. The youngest model old
// enough judges; a pause of 150 s makes those of 8 and 20 s too old (150 > 60) and none of the
// others (150 + 10 <= 180), a long one all.
TEST(JudgeLaws, AfterAPauseAnOldModelJudgesNothing) {
  for (const double pause_s : {150.0, 1e5, 3e9}) {
    ForecastJudge judge(kShortestS, 1, kCapacity);
    feed(judge, 0, 400, followed);
    const TrustTable before = judge.trust();
    const FeatureArray features = features_at(1.0);
    judge.judge({from_seconds(3990.0 + pause_s), 5e-5, kSigma * kSigma, features});
    for (std::size_t k = 0; k < kHorizons; ++k) {
      const bool unmoved =
          same_bits(before.learned[k].held_variance, judge.trust().learned[k].held_variance);
      ASSERT_GE(before.learned[k].held_variance, 0.0) << k;
      EXPECT_EQ(unmoved, k < 2 || pause_s > 1e4) << "pause " << pause_s << " horizon " << k;
    }
  }
}

// Rule: a clock set back loses the models' ages, not the experience.
TEST(JudgeLaws, ARestartKeepsTheExperienceAndForgetsTheModels) {
  ForecastJudge judge(kShortestS, 1, kCapacity);
  feed(judge, 0, 300, followed);
  const TrustTable before = judge.trust();
  judge.restart();
  EXPECT_TRUE(same_bits(before, judge.trust()));
  const FeatureArray features = features_at(1.0);
  judge.judge({from_seconds(5.0), 5e-5, kSigma * kSigma, features});
  EXPECT_TRUE(same_bits(before, judge.trust())) << "no model is left to judge";
  feed(judge, 1, 100, followed);
  EXPECT_FALSE(same_bits(before, judge.trust()));
}

// Rule: the variance stated is that of the forecast in use: of holding where no weight is proved.
// Drift and model are independent here, so that hardly anything ever is.
TEST(JudgeLaws, WhereNothingIsProvedTheForecastsVarianceIsThatOfHolding) {
  ForecastJudge judge(kShortestS, 1, kCapacity);
  std::size_t unproved = 0;
  DriftModel model = linear_model(0.0, 1e-6);
  Random random(5);
  for (int i = 0; i < 600; ++i) {
    const FeatureArray features = features_at(random.gaussian());
    const double measured = 1e-6 * random.gaussian();
    judge.judge({from_seconds(10.0 * i), measured, kSigma * kSigma, features});
    model.time = from_seconds(10.0 * i);
    model.held_radps = measured;
    model.predicted_held_radps = model.predict(features);
    judge.keep(model);
    for (const ForecastTrust& trust : judge.trust().learned) {
      if (trust.held_variance < 0.0 || trust.weights.change > 0.0 || trust.weights.level > 0.0)
        continue;
      ++unproved;
      ASSERT_EQ(trust.forecast_variance, trust.held_variance) << i;
    }
  }
  EXPECT_GT(unproved, 100U);
}

// Rule: experience beyond what was learned (|x| <= 5) is kept apart. A model right within and wrong
// beyond is believed within and held beyond; one right on both sides is believed on both.
TEST(JudgeLaws, BeyondWhatWasLearnedTheModelHasToProveItselfAnew) {
  for (const bool right_beyond : {false, true}) {
    ForecastJudge judge(kShortestS, 1, kCapacity);
    DriftModel model = linear_model(0.0, 1e-6);
    const FeatureArray far = features_at(8.0);
    Random random(9);
    for (int i = 0; i < 1800; ++i) {
      const SensorTime time = from_seconds(5.0 * i);
      if (random.below(3) == 0) {  // met in passing, learned by no model
        const double follows = model.predict(far);
        judge.judge({time, right_beyond ? follows : -follows, kSigma * kSigma, far});
        const Forecast made = forecast(model, judge.trust(), far, time);
        EXPECT_TRUE(made.beyond_learned);
        if (right_beyond) continue;
        const double changed = follows - model.predicted_held_radps;
        ASSERT_EQ(made.kind, ForecastKind::kBeyond) << i;
        ASSERT_EQ(made.drift_radps, model.held_radps) << i;
        ASSERT_GE(made.variance, changed * changed) << i;
        continue;
      }
      const FeatureArray features = features_at(4.0 * std::sin(0.035 * i));
      const double measured = model.predict(features);
      judge.judge({time, measured, kSigma * kSigma, features});
      model.time = time;
      model.held_radps = measured;
      model.predicted_held_radps = measured;
      judge.keep(model);
    }
    for (std::size_t k = 0; k < kHorizons; ++k) {
      EXPECT_GT(judge.trust().learned[k].weights.change, 0.9) << k;
      // Few far labels fall into the shortest's ages, and the longest has not two windows of them.
      if (right_beyond && k > 0 && k + 1 < kHorizons) {
        EXPECT_GT(judge.trust().beyond[k].weights.change, 0.5) << k;
      }
    }
  }
}

// Rule: one label is no experience: over horizons of many labels the first one judged proves no
// weight. Half a window is asked for, and labels are 10 s apart.
TEST(JudgeLaws, TheFirstLabelJudgedProvesNothing) {
  ForecastJudge judge(kShortestS, 1, kCapacity);
  std::size_t first_seen = 0;
  for (int i = 0; i < 500; ++i) {
    const TrustTable before = judge.trust();
    feed(judge, i, i + 1, followed);
    for (std::size_t k = 2; k < kHorizons; ++k) {
      if (before.learned[k].held_variance >= 0.0 || judge.trust().learned[k].held_variance < 0.0)
        continue;
      ++first_seen;
      EXPECT_EQ(judge.trust().learned[k].weights.change, 0.0) << k;
      EXPECT_EQ(judge.trust().learned[k].weights.level, 0.0) << k;
    }
  }
  EXPECT_EQ(first_seen, kHorizons - 2);
}

// Rule: labels without any noise, while nothing moves, are no evidence, neither for the model nor
// against it: afterwards it proves itself as ever. They once made an entry's sums 0 / 0 for good.
TEST(JudgeAbuse, LabelsWithoutNoiseSpoilNoExperience) {
  ForecastJudge judge(kShortestS, 1, kCapacity);
  DriftModel model = linear_model(0.0, 1e-6);
  const FeatureArray still = features_at(0.0);
  const double constant = model.predict(still);
  for (int i = 0; i < 100; ++i) {
    model.time = from_seconds(10.0 * i);
    model.held_radps = constant;
    model.predicted_held_radps = constant;
    judge.judge({model.time, constant, 0.0, still});
    judge.keep(model);
    ASSERT_TRUE(is_finite(judge.trust()));
  }
  feed(judge, 100, 400, followed, 0.0);
  ASSERT_TRUE(is_finite(judge.trust()));
  for (std::size_t k = 0; k < 4; ++k) EXPECT_GT(judge.trust().learned[k].weights.change, 0.9) << k;
}

// Rule: labels of one instant, of an hour each and of extreme size leave every entry finite.
TEST(JudgeAbuse, EqualTimesHugeGapsAndExtremeLabelsLeaveFiniteTrust) {
  for (const double interval_s : {0.0, 1e-9, 3600.0, 1e6}) {
    for (const double drift : {0.0, 1e-300, 1e-12, 1.0, 1e6}) {
      ForecastJudge judge(kShortestS, 1, kCapacity);
      DriftModel model = linear_model(0.0, drift);
      for (int i = 0; i < 50; ++i) {
        const FeatureArray features = features_at(4.0 * std::sin(0.5 * i));
        const double measured = i % 2 == 0 ? drift : -drift;
        model.time = from_seconds(interval_s * i);
        judge.judge({model.time, measured, drift * drift, features});
        model.held_radps = measured;
        model.predicted_held_radps = model.predict(features);
        judge.keep(model);
        ASSERT_TRUE(is_finite(judge.trust())) << interval_s << " s, " << drift;
        const Forecast made = forecast(model, judge.trust(), features, model.time);
        ASSERT_TRUE(std::isfinite(made.drift_radps) && std::isfinite(made.variance));
        ASSERT_GE(made.variance, 0.0);
      }
    }
  }
}

// ---------------------------------------------------------------------- learner and judge together

constexpr double kLabelS = 5.0;

CompensationOptions learner_options() {
  CompensationOptions options;
  options.learning.label_interval_s = kLabelS;
  options.learning.initial_labels = 12;
  options.model.capacity = 200;
  options.model.epsilon = 0.01;
  options.model.selection.reset();  // a fixed kernel: the figures below are derived from it
  return options;
}

AxisLabel label_of(double time_s, double drift_radps, double sigma_radps, double x0, double x1) {
  AxisLabel label;
  label.time = from_seconds(time_s);
  label.drift_radps = drift_radps;
  label.variance = sigma_radps * sigma_radps;
  label.features.emplace();
  (*label.features)[0] = x0;
  (*label.features)[1] = x1;
  return label;
}

// A chamber between 20 and 60 °C in cycles, and a drift known at every second: thermal part plus
// random walk. Features as the standard ones are scaled: 10 °C, 1 °C/min.
struct World {
  double period_s = 7200.0;
  double thermal = 1.0;               // share of the thermal drift
  double noise_radps = 0.02 * kDegH;  // of a label
  double walk_radps_sqrt_s = 0.0;
  double coloured_radps = 0.0;  // first-order, correlated over 200 s
  std::uint64_t seed = 1;
  std::vector<double> random_part{};  // by second

  void draw(double duration_s) {
    Random random(seed);
    double walk = 0.0, coloured = 0.0;
    const double kept = std::exp(-1.0 / 200.0);
    const double fresh = coloured_radps * std::sqrt(1.0 - kept * kept);
    for (double t = 0.0; t <= duration_s; t += 1.0) {
      random_part.push_back(walk + coloured);
      walk += walk_radps_sqrt_s * random.gaussian();
      coloured = kept * coloured + fresh * random.gaussian();
    }
  }
  [[nodiscard]] double phase(double t) const { return 2.0 * std::numbers::pi * t / period_s; }
  [[nodiscard]] double x0(double t) const { return 1.5 - 2.0 * std::cos(phase(t)); }
  [[nodiscard]] double x1(double t) const {
    return 20.0 * 2.0 * std::numbers::pi / (period_s / 60.0) * std::sin(phase(t));
  }
  [[nodiscard]] FeatureArray features(double t) const {
    FeatureArray features{};
    features[0] = x0(t);
    features[1] = x1(t);
    return features;
  }
  [[nodiscard]] double drift(double t) const {
    const double model = 2.0 + 0.5 * x0(t) + 0.1 * x0(t) * x0(t) + 0.4 * x1(t);
    return thermal * model * kDegH + random_part.at(static_cast<std::size_t>(t));
  }
};

// Calls take(time of the newest label, model) after each label.
template <typename Take>
void learn(AxisLearner& learner, const World& world, double duration_s, Take&& take) {
  AxisModel model(2, learner_options().model.capacity);
  Random noise(world.seed + 1000);
  for (double t = kLabelS; t <= duration_s; t += kLabelS) {
    double mean = 0.0;
    for (double s = t - kLabelS + 1.0; s <= t; s += 1.0) mean += world.drift(s) / kLabelS;
    const double middle = t - 0.5 * (kLabelS - 1.0);
    learner.learn(label_of(t, mean + world.noise_radps * noise.gaussian(), world.noise_radps,
                           world.x0(middle), world.x1(middle)));
    learner.write(model);
    take(t, model);
  }
}

constexpr double kHorizonsS[] = {11.0, 60.0, 300.0};

struct Score {
  std::size_t count = 0, covered = 0;
  double square = 0.0, held_square = 0.0, variance = 0.0;
};

// Forecasts against the truth, by horizon, from_s on; `covered` counts new labels.
std::array<Score, 3> score(World world, double duration_s, double from_s) {
  world.draw(duration_s + 400.0);
  AxisLearner learner(learner_options(), 2);
  Random noise(world.seed + 2000);
  std::array<Score, 3> scores{};
  learn(learner, world, duration_s, [&](double t, const AxisModel& model) {
    if (t < from_s || !model.drift.trained) return;
    for (std::size_t h = 0; h < 3; ++h) {
      const double now_s = t + kHorizonsS[h];
      const Forecast made =
          forecast(model.drift, model.trust, world.features(now_s), from_seconds(now_s));
      const double error = world.drift(now_s) - made.drift_radps;
      const double held_error = world.drift(now_s) - model.drift.held_radps;
      const double label_error = error + world.noise_radps * noise.gaussian();
      Score& s = scores[h];
      ++s.count;
      s.square += error * error;
      s.held_square += held_error * held_error;
      s.variance += made.variance;
      const double total = made.variance + world.noise_radps * world.noise_radps;
      if (std::abs(label_error) <= 1.96 * std::sqrt(total)) ++s.covered;
    }
  });
  return scores;
}

// Rule: where drift follows what the SVR can learn, the change is believed at every horizon that
// has experience: of ten hours all six (the longest is judged from 2000 s on). One cycle takes two
// hours, so that what came after the first lies within what was learned. Over the shorter horizons
// the SVR's own error, a fraction of the label's, is not small beside the change (0.4 x 1 °C/min at
// most: 0.3 deg/h in 40 s), so that a weight below 1 serves best and the prior counts: less is
// asked for there.
TEST(LearnerScenario, AModelThatTellsTheTruthIsBelievedAtEveryHorizon) {
  World world;
  const double duration_s = 10.0 * 3600.0;
  world.draw(duration_s);
  AxisLearner learner(learner_options(), 2);
  TrustTable last;
  learn(learner, world, duration_s, [&](double, const AxisModel& model) { last = model.trust; });
  const std::array<double, kHorizons> least_change{0.3, 0.4, 0.6, 0.8, 0.9, 0.9};
  for (std::size_t k = 0; k < kHorizons; ++k) {
    ASSERT_GE(last.learned[k].forecast_variance, 0.0) << k;
    EXPECT_GT(last.learned[k].weights.change, least_change[k]) << k;
    EXPECT_LT(last.learned[k].forecast_variance,
              (k < 2 ? 1.0 : 0.5) * last.learned[k].held_variance)
        << k;
  }
}

// Rule: no worse than holding. The drift has nothing to do with temperature (noise correlated over
// 200 s and a random walk), the SVR fits it all the same; over six hours and at each horizon the
// root mean square error against the truth is within 5 % of that of holding.
TEST(LearnerScenario, AModelWithoutMeaningIsNoWorseThanHoldingByMoreThanFivePercent) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U, 5U, 6U}) {
    World world;
    world.seed = seed;
    world.thermal = 0.0;
    world.coloured_radps = 0.05 * kDegH;
    world.walk_radps_sqrt_s = 0.002 * kDegH;
    const auto scores = score(world, 6.0 * 3600.0, 0.0);
    for (std::size_t h = 0; h < 3; ++h) {
      const double ratio = std::sqrt(scores[h].square / scores[h].held_square);
      EXPECT_LT(ratio, 1.05) << "seed " << seed << ", " << kHorizonsS[h] << " s";
      RecordProperty("rms_over_held_" + std::to_string(seed) + "_" + std::to_string(h),
                     std::to_string(ratio));
    }
  }
}

// Rule: the stated variance is the mean square error found, and an interval of 1.96 standard
// deviations around the forecast (label noise included) covers 90 to 99 % of new labels, on a
// heat/cool record with white noise and a random walk. Six hours, six seeds, after the first hour.
// The mean of the errors' squares over N independent ones scatters by sqrt(2 / N): in 6 x 5 h there
// are at least 6 x 5 x 3600 / 300 = 360 of 300 s, so +-7 %. The variance itself is learned from as
// few as two windows with an exponential memory (some four independent squares, +-70 %, which the
// mean over time averages out), and stands at ages up to 1.5 times the forecast's, so it may state
// too much: from 0.6 to 1.3 times.
TEST(LearnerScenario, StatedVariancesMatchTheErrorsFound) {
  std::array<Score, 3> all{};
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    World world;
    world.seed = seed;
    world.walk_radps_sqrt_s = 0.001 * kDegH;
    const auto scores = score(world, 6.0 * 3600.0, 3600.0);
    for (std::size_t h = 0; h < 3; ++h) {
      all[h].count += scores[h].count;
      all[h].covered += scores[h].covered;
      all[h].square += scores[h].square;
      all[h].variance += scores[h].variance;
    }
  }
  for (std::size_t h = 0; h < 3; ++h) {
    const double covered = static_cast<double>(all[h].covered) / static_cast<double>(all[h].count);
    const double ratio = all[h].square / all[h].variance;
    EXPECT_GT(covered, 0.90) << kHorizonsS[h] << " s";
    EXPECT_LT(covered, 0.99) << kHorizonsS[h] << " s";
    EXPECT_GT(ratio, 0.6) << kHorizonsS[h] << " s";
    EXPECT_LT(ratio, 1.3) << kHorizonsS[h] << " s";
    RecordProperty("covered_" + std::to_string(h), std::to_string(covered));
    RecordProperty("square_over_variance_" + std::to_string(h), std::to_string(ratio));
  }
}

// Rule: after a reset a learner, its trust included, is as new to the bit.
TEST(LearnerScenario, AResetForgetsTheTrustToo) {
  World world;
  world.draw(3600.0);
  AxisLearner used(learner_options(), 2), fresh(learner_options(), 2);
  learn(used, world, 3000.0, [](double, const AxisModel&) {});
  used.reset();
  std::vector<Forecast> expected;
  TrustTable trust;
  learn(fresh, world, 3600.0, [&](double t, const AxisModel& model) {
    trust = model.trust;
    if (model.drift.trained)
      expected.push_back(
          forecast(model.drift, model.trust, world.features(t), from_seconds(t + 60.0)));
  });
  std::size_t i = 0;
  learn(used, world, 3600.0, [&](double t, const AxisModel& model) {
    if (t == 3600.0) {
      EXPECT_TRUE(same_bits(trust, model.trust));
    }
    if (!model.drift.trained) return;
    const auto made = forecast(model.drift, model.trust, world.features(t), from_seconds(t + 60.0));
    ASSERT_LT(i, expected.size());
    ASSERT_TRUE(same_bits(made.drift_radps, expected[i].drift_radps)) << t;
    ASSERT_TRUE(same_bits(made.variance, expected[i++].variance)) << t;
  });
  EXPECT_EQ(i, expected.size());
}

// Rule: a clock set back, even to the same instant, leaves experience as it was at that label, and
// learning goes on.
TEST(LearnerScenario, AClockSetBackKeepsTheTrust) {
  for (const double back_to_s : {3600.0, 1000.0, -1e6}) {
    World world;
    world.draw(7200.0);
    AxisLearner learner(learner_options(), 2);
    TrustTable before;
    learn(learner, world, 3600.0, [&](double, const AxisModel& model) { before = model.trust; });
    AxisModel model(2, learner_options().model.capacity);
    learner.learn(label_of(back_to_s, world.drift(3600.0), world.noise_radps, world.x0(3600.0),
                           world.x1(3600.0)));
    learner.write(model);
    EXPECT_TRUE(same_bits(before, model.trust));
    EXPECT_EQ(model.drift.time, from_seconds(back_to_s));
    EXPECT_EQ(model.drift.held_radps, world.drift(3600.0)) << "the minute before is gone";
    for (int i = 1; i <= 20; ++i) {
      learner.learn(label_of(back_to_s + kLabelS * i, world.drift(3600.0 + kLabelS * i),
                             world.noise_radps, world.x0(3600.0 + kLabelS * i),
                             world.x1(3600.0 + kLabelS * i)));
    }
    learner.write(model);
    EXPECT_FALSE(same_bits(before, model.trust));
    EXPECT_TRUE(is_finite(model.trust));
    EXPECT_GT(model.trust.learned[0].weights.change, 0.5);
  }
}

// Rule: what was measured without features is not counted twice. Temperature is lost for ten
// minutes in which drift and temperature go on, by some 0.6 deg/h; the forecast a minute later,
// when it is back, is right to 0.15 deg/h: three standard deviations of the random walk over those
// 660 s, 0.026 each, the label's noise, and a third of the change of the last minute and a half,
// which the weights may not believe. The change since the last label with features, added to
// what is held now, would be wrong by 0.47. (With other seeds the level weight is larger and hides
// it.)
TEST(LearnerScenario, AfterAMinuteWithoutFeaturesNoChangeIsCountedTwice) {
  for (const std::uint64_t seed : {2U, 3U}) {
    World world;
    world.seed = seed;
    world.walk_radps_sqrt_s = 0.001 * kDegH;
    world.draw(10'000.0);
    AxisLearner learner(learner_options(), 2);
    AxisModel model(2, learner_options().model.capacity);
    double t = 8000.0;
    learn(learner, world, t, [](double, const AxisModel&) {});
    for (const double end_s = t + 600.0; t < end_s;) {
      t += kLabelS;
      AxisLabel bare = label_of(t, world.drift(t), world.noise_radps, 0.0, 0.0);
      bare.features.reset();
      learner.learn(bare);
    }
    learner.write(model);
    const double later_s = t + 60.0;
    const Forecast made =
        forecast(model.drift, model.trust, world.features(later_s), from_seconds(later_s));
    EXPECT_EQ(made.kind, ForecastKind::kModel);
    EXPECT_NEAR(made.drift_radps, world.drift(later_s), 0.15 * kDegH);
  }
}

// Rule: identical labels, constant features, no noise, the smallest capacity, an hour between
// labels: forecasts stay finite and variances not negative.
TEST(LearnerAbuse, DegenerateRecordsGiveFiniteForecasts) {
  for (const std::size_t capacity : {std::size_t{2}, std::size_t{3}, std::size_t{50}}) {
    for (const double sigma : {0.0, 1e-7}) {
      for (const double interval_s : {1e-3, 5.0, 3600.0}) {
        for (const bool moving : {false, true}) {
          CompensationOptions options = learner_options();
          options.model.capacity = capacity;
          options.learning.initial_labels = 2;
          AxisLearner learner(options, 2);
          AxisModel model(2, capacity);
          for (int i = 0; i < 200; ++i) {
            const double x = moving ? std::sin(0.3 * i) : 0.0;
            const double t = interval_s * i;
            learner.learn(label_of(t, 1e-5 + 1e-6 * x, sigma, x, 0.0));
            learner.write(model);
            if (!model.drift.trained) continue;
            const Forecast forecasts[] = {
                forecast(model.drift, model.trust, features_at(x), from_seconds(t + 10.0)),
                forecast(model.drift, model.trust, features_at(30.0), from_seconds(t + 1e5))};
            for (const Forecast& made : forecasts) {
              ASSERT_TRUE(std::isfinite(made.drift_radps) && std::isfinite(made.variance));
              ASSERT_GE(made.variance, 0.0);
            }
          }
          EXPECT_TRUE(is_finite(model.trust));
        }
      }
    }
  }
}

}  // namespace
}  // namespace zerodrift::compensation
