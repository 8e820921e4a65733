// SPDX-License-Identifier: Apache-2.0
// A learner saved in mid-run and restored elsewhere goes on as if nothing had happened.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/compensation/learner.h"
#include "tests/support/state_bytes.h"
#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

using zerodrift::testing::read_state;
using zerodrift::testing::state_of;
using zerodrift::testing::with;

constexpr double kSigma = 1e-7;
constexpr std::size_t kLabels = 400;
constexpr std::size_t kPauseAt = 120;
constexpr std::size_t kResetAt = 260;
constexpr std::size_t kClockSetBackAt = 330;

CompensationOptions small_options() {
  CompensationOptions options = testing::options();
  options.model.capacity = 60;       // smaller than the run: the window forgets
  options.model.kernel.gamma = 3.0;  // so poor a choice that the learner makes another
  return options;
}

CompensationOptions svr_alone(CompensationOptions options) {
  options.scheme = Scheme::kOnlineSvr;
  return options;
}

// What a gyro's life may hold: labels of unequal certainty, axes not measured, temperatures
// missing, drift that breaks its ways, a pause longer than the judge's shorter horizons, a reset
// and a clock set back.
std::vector<TrainingJob> life() {
  std::vector<TrainingJob> jobs;
  Random random(7);
  double time_s = 0.0;
  for (std::size_t n = 0; n < kLabels; ++n) {
    time_s += n == kPauseAt ? 900.0 : 10.0;
    if (n == kClockSetBackAt) time_s = 5.0;
    if (n == kResetAt) {
      jobs.push_back({.kind = TrainingJob::Kind::kReset, .label = {}});
      continue;
    }
    Label label;
    label.begin = core::from_seconds(time_s - 10.0);
    label.end = core::from_seconds(time_s);
    const double t = 2.0 * std::sin(time_s / 700.0);
    const double rate = 2.0 * std::cos(time_s / 700.0);
    label.thermal = {.temperature = t, .rate = rate, .memory = {0.1 * t, 0.2 * t, 0.3 * t, rate}};
    for (std::size_t i = 0; i < core::kAxisCount; ++i) {
      const double sigma = kSigma * (random.below(5) == 0 ? 4.0 : 1.0);
      const double sign = i == 1 ? -1.0 : 1.0;
      label.valid[i] = random.below(40) != 0;
      label.features_ready[i] = random.below(30) != 0;
      label.features[i][0] = t + 0.01 * random.gaussian();
      label.features[i][1] = rate;
      label.drift_radps[i] = sign * (1e-5 + 4e-6 * t + 2e-6 * t * t + 3e-6 * std::sin(2.0 * rate)) +
                             sigma * random.gaussian();
      label.variance_radps2[i] = sigma * sigma;
    }
    jobs.push_back({.kind = TrainingJob::Kind::kLabel, .label = label});
  }
  return jobs;
}

class Print {
 public:
  void add(double value) { bits_.push_back(std::bit_cast<std::uint64_t>(value)); }
  void add(core::SensorTime time) { bits_.push_back(static_cast<std::uint64_t>(time.count())); }
  void add(const ForecastTrust& trust) {
    add(trust.weights.change);
    add(trust.weights.level);
    add(trust.forecast_variance);
    add(trust.held_variance);
  }
  void add(const experts::StackForecast& stack) {
    for (const double age_s : {1.0, 20.0, 200.0, 2000.0}) {
      for (const bool interpolates : {false, true}) {
        const experts::SvrForecast by_svr{.drift = 1e-5, .interpolates = interpolates};
        const auto made = stack.predict(stack.time_s + age_s, {.temperature = 0.3}, by_svr);
        add(made.drift);
        add(made.variance);
        for (const double share : stack.shares(age_s, by_svr)) add(share);
      }
    }
  }
  void add(DriftModel model) {
    add(model.time);
    add(model.held_radps);
    add(model.held_slope_radps2.value_or(-1.0));
    add(model.held_variance);
    add(model.predicted_held_radps);
    add(model.trained ? 1.0 : 0.0);
    if (!model.trained) return;  // nobody may ask for the rest
    add(model.offset_radps);
    add(model.scale_radps);
    for (const char byte : state_of(model)) bits_.push_back(static_cast<unsigned char>(byte));
  }
  void add(const ModelSnapshot& snapshot) {
    bits_.push_back(snapshot.epoch);
    for (const auto& axis : snapshot.axes) {
      add(axis.drift);
      for (const auto& trust : axis.trust.learned) add(trust);
      for (const auto& trust : axis.trust.beyond) add(trust);
      for (const double horizon : axis.trust.horizon_s) add(horizon);
      for (const double change : axis.trust.largest_change_radps) add(change);
      add(axis.stack);
    }
  }
  friend bool operator==(const Print&, const Print&) = default;

 private:
  std::vector<std::uint64_t> bits_;
};

// A learner with its queues, worked by one thread.
class Bench {
 public:
  explicit Bench(const CompensationOptions& options)
      : exchange_(options), learner_(options, exchange_) {}

  const ModelSnapshot& work(TrainingJob job) {
    job.number = ++jobs_;
    exchange_.submit(job);
    learner_.run_one();
    exchange_.activate_next();
    if (exchange_.active() == nullptr) throw std::logic_error("no active snapshot");
    return *exchange_.active();
  }
  Print print(const TrainingJob& job) {
    Print made;
    made.add(work(job));
    return made;
  }
  [[nodiscard]] LearnerState state() { return learner_.export_state(); }
  [[nodiscard]] const Learner& learner() const { return learner_; }

 private:
  ModelExchange exchange_;
  Learner learner_;
  std::uint64_t jobs_ = 0;
};

TrainingJob restore_job(const std::shared_ptr<RestoredLearner>& restored) {
  return {.kind = TrainingJob::Kind::kRestore, .label = {}, .restored = restored};
}

LearnerState state_after(const CompensationOptions& options, std::size_t labels) {
  Bench bench(options);
  const auto jobs = life();
  for (std::size_t n = 0; n < labels; ++n) bench.work(jobs[n]);
  return bench.state();
}

// Rule: saved after any label and restored in a new learner, every later snapshot is the same to
// the bit, epoch and count of labels included. Cuts: all through the initial set, about each choice
// of a kernel (from 36 labels on), the pause, the reset and the clock set back, and all along.
void expect_the_same_bits_after_any_cut(const CompensationOptions& options) {
  const auto jobs = life();
  Bench whole(options);
  std::vector<Print> expected;
  std::vector<LearnerState> saved{whole.state()};
  std::set<std::string> kernels;
  for (const auto& job : jobs) {
    expected.push_back(whole.print(job));
    saved.push_back(whole.state());
    const auto& kernel = saved.back().kernels[0].kernel;
    kernels.insert(std::to_string(static_cast<int>(kernel.kind)) + std::to_string(kernel.gamma));
  }
  ASSERT_GT(kernels.size(), 1U) << "the kernel must have been chosen anew for this to say anything";

  std::set<std::size_t> cuts{kLabels - 1};
  for (std::size_t cut = 0; cut < kLabels; cut += cut < 9 ? 1 : 29) cuts.insert(cut);
  for (const std::size_t event :
       {std::size_t{38}, std::size_t{77}, kPauseAt, std::size_t{156}, kResetAt, kClockSetBackAt}) {
    for (std::size_t cut = event - 1; cut <= event + 2; ++cut) cuts.insert(cut);
  }
  for (const std::size_t cut : cuts) {
    Bench resumed(options);
    resumed.work(restore_job(std::make_shared<RestoredLearner>(options, saved[cut])));
    for (std::size_t n = cut; n < kLabels; ++n) {
      ASSERT_TRUE(resumed.print(jobs[n]) == expected[n]) << "cut " << cut << ", label " << n;
    }
    EXPECT_EQ(resumed.learner().labels_learned(), whole.learner().labels_learned());
  }
}

TEST(LearnerStateLaws, RestoredAtAnyCutEveryLaterSnapshotIsTheSameToTheBit) {
  expect_the_same_bits_after_any_cut(small_options());
}

TEST(LearnerStateLaws, RestoredAtAnyCutTheOnlineSvrAloneGoesOnToTheBit) {
  expect_the_same_bits_after_any_cut(svr_alone(small_options()));
}

// Rule: the snapshot that answers a restore is the one that was last given before saving.
TEST(LearnerStateLaws, TheRestoredModelIsTheSavedOneToTheBit) {
  const auto options = small_options();
  const auto jobs = life();
  Bench whole(options);
  for (std::size_t n = 0; n < 200; ++n) {
    const Print last = whole.print(jobs[n]);
    if (n % 40 != 3) continue;
    Bench resumed(options);
    EXPECT_TRUE(resumed.print(
                    restore_job(std::make_shared<RestoredLearner>(options, whole.state()))) == last)
        << n;
  }
}

// Rule: that an age isn't known is part of what a learner knows; its next label ends it.
TEST(LearnerStateLaws, AnUnknownAgeOutlivesAnotherSave) {
  const auto options = small_options();
  const auto jobs = life();
  constexpr std::size_t kSavedAt = 100;
  const auto restored = std::make_shared<RestoredLearner>(options, state_after(options, kSavedAt));
  restored->forget_age();
  Bench first(options);
  const core::SensorTime next = jobs[kSavedAt].label.end;
  EXPECT_TRUE(first.work(restore_job(restored)).axes[0].drift.is_of_unknown_age(next));
  Bench second(options);
  second.work(restore_job(std::make_shared<RestoredLearner>(options, first.state())));
  for (std::size_t n = kSavedAt; n < kSavedAt + 60; ++n)
    ASSERT_TRUE(second.print(jobs[n]) == first.print(jobs[n])) << n;
  EXPECT_FALSE(first.work(jobs[kSavedAt + 60])
                   .axes[0]
                   .drift.is_of_unknown_age(jobs[kSavedAt + 61].label.end));
}

// Rule: into a learner at work, a restore is a new model: its epoch was given neither here nor
// there before. Whoever gave it is told the epoch, and what the learner knew before is gone.
TEST(LearnerState, IntoALearnerAtWorkTheEpochCountsUp) {
  const auto options = small_options();
  const LearnerState early = state_after(options, 20);
  const auto jobs = life();
  Bench bench(options);
  for (std::size_t n = 0; n < 50; ++n) bench.work(jobs[n]);
  const auto restored = std::make_shared<RestoredLearner>(options, early);
  EXPECT_EQ(restored->installed_as, RestoredLearner::kNotYet);
  EXPECT_EQ(bench.work(restore_job(restored)).epoch, 51U);
  EXPECT_EQ(restored->installed_as, 51U);
  EXPECT_EQ(bench.learner().labels_learned(), 20U);
  EXPECT_EQ(bench.work(jobs[20]).epoch, 52U);

  Bench young(options);
  for (std::size_t n = 0; n < 5; ++n) young.work(jobs[n]);
  EXPECT_EQ(young.work(restore_job(std::make_shared<RestoredLearner>(options, early))).epoch, 20U);
}

// Rule: a state that is handed over and kept holds no more room than it has bytes: one that grew
// by doubling keeps up to as much again in every gyro.
TEST(LearnerState, KeepsNoRoomBeyondItsBytes) {
  for (const std::size_t labels : {20U, 100U}) {
    const LearnerState state = state_after(small_options(), labels);
    EXPECT_EQ(state.bytes.capacity(), state.bytes.size()) << labels;
  }
}

bool is_taken(const CompensationOptions& options, const LearnerState& state) {
  try {
    const RestoredLearner restored(options, state);
    return true;
  } catch (const std::invalid_argument&) {
    return false;
  }
}

// Rule: a state that can't belong to the options is refused.
TEST(LearnerState, WhatCannotBelongToTheOptionsIsRefused) {
  const auto options = small_options();
  const LearnerState good = state_after(options, 100);
  EXPECT_TRUE(is_taken(options, good));
  const auto is_taken_with = [&](auto&& spoil) {
    LearnerState bad = good;
    spoil(bad);
    return is_taken(options, bad);
  };
  EXPECT_FALSE(is_taken_with([](auto& s) { s.kernels[1].epsilon = -1.0; }));
  EXPECT_FALSE(is_taken_with([](auto& s) { s.kernels[1].kernel.gamma = 0.0; }));
  EXPECT_FALSE(is_taken_with([](auto& s) { s.epoch = RestoredLearner::kNotYet; }));
  EXPECT_FALSE(is_taken_with([](auto& s) { s.bytes += '\0'; }));
  for (std::size_t size = 1; size < good.bytes.size(); size += 1 + size / 30)
    EXPECT_FALSE(is_taken_with([&](auto& s) { s.bytes.resize(size); })) << size;

  CompensationOptions other = options;
  other.model.capacity = 30;
  EXPECT_FALSE(is_taken(other, good)) << "more samples than its window holds";
  other = options;
  other.features.pop_back();
  EXPECT_FALSE(is_taken(other, good));
}

template <typename T, typename Spoil>
bool is_read_back(const T& good, const Spoil& spoil) {
  T bad = good;
  spoil(bad);
  const std::string bytes = state_of(bad);
  T read = good;
  return read_state(read, bytes);
}

// Rule: what no learner ever holds is refused with the part that holds it.
TEST(LearnerStateAbuse, ValuesThatNoLearnerHoldsAreRefused) {
  const double nan = std::nan("");
  const AxisLabel label{.time = core::from_seconds(5.0), .drift_radps = 1e-5, .variance = 1e-14};
  EXPECT_TRUE(is_read_back(label, [](auto&) {}));
  EXPECT_FALSE(is_read_back(label, [](auto& l) { l.time = core::kNever; }));
  EXPECT_FALSE(is_read_back(label, [](auto& l) { l.drift_radps = -2e6; }));
  EXPECT_FALSE(is_read_back(label, [&](auto& l) { l.variance = nan; }));
  EXPECT_FALSE(is_read_back(label, [](auto& l) { l.variance = -1e-14; }));

  DriftModel model(2, 60);
  EXPECT_TRUE(is_read_back(model, [](auto&) {})) << "one that holds nothing";
  model.time = core::from_seconds(5.0);
  model.trained = true;
  EXPECT_TRUE(is_read_back(model, [](auto&) {}));
  EXPECT_FALSE(is_read_back(model, [](auto& m) { m.trained = false; }));
  EXPECT_FALSE(is_read_back(model, [](auto& m) { m.scale_radps = 0.0; }));
  EXPECT_FALSE(is_read_back(model, [&](auto& m) { m.held_radps = nan; }));
  EXPECT_FALSE(is_read_back(model, [](auto& m) { m.predicted_held_radps = 2e6; }));
  EXPECT_FALSE(is_read_back(model, [](auto& m) { m.held_variance = -1.0; }));
  EXPECT_FALSE(is_read_back(model, [&](auto& m) { m.held_slope_radps2 = nan; }));
  DriftModel narrow(2, 4);
  regression::OnlineSvrOptions svr_options;
  svr_options.capacity = 60;
  regression::OnlineSvr svr(svr_options);
  for (int i = 0; i < 60; ++i) svr.add(std::vector<double>{0.1 * i, 0.0}, i % 2);
  model.domain.assign(svr);
  EXPECT_FALSE(read_state(narrow, state_of(model))) << "more samples than there is room for";

  TrustTable table;
  for (std::size_t k = 0; k < kHorizons; ++k) table.horizon_s[k] = 8.0 * static_cast<double>(k + 1);
  EXPECT_TRUE(is_read_back(table, [](auto&) {}));
  EXPECT_FALSE(is_read_back(table, [](auto& t) { t.horizon_s[3] = 0.0; }));
  EXPECT_FALSE(is_read_back(table, [](auto& t) { t.learned[0].weights.change = 2.0; }));
  EXPECT_FALSE(is_read_back(table, [&](auto& t) { t.beyond[5].weights.level = nan; }));
  EXPECT_FALSE(is_read_back(table, [](auto& t) { t.learned[1].held_variance = -2.0; }));
  EXPECT_FALSE(is_read_back(table, [](auto& t) { t.largest_change_radps[0] = -1.0; }));

  ForecastJudge::Experience seen{.windows = 1.0};
  EXPECT_TRUE(is_read_back(ForecastJudge::Experience{}, [](auto&) {}));
  EXPECT_TRUE(is_read_back(seen, [](auto& e) { e.change_change = 1e99; }));
  EXPECT_FALSE(is_read_back(seen, [](auto& e) { e.change_change = 1e101; }));
  EXPECT_FALSE(is_read_back(seen, [](auto& e) { e.held_loss = -1.0; }));
  EXPECT_FALSE(is_read_back(seen, [&](auto& e) { e.weights.level = nan; }));
}

// Rule: whatever is written over a state, it is refused or makes a learner that learns.
void expect_no_harm_by_what_is_written_over(const CompensationOptions& options) {
  const auto jobs = life();
  const LearnerState good = state_after(options, 60);
  std::size_t taken = 0;
  std::size_t tried = 0;
  for (const std::uint64_t number :
       {std::uint64_t{0x7ff8000000000000}, std::uint64_t{2}, std::uint64_t{0xbfe0000000000000}}) {
    for (std::size_t at = 0; at + 8 <= good.bytes.size(); at += 1 + good.bytes.size() / 300) {
      LearnerState changed = good;
      changed.bytes = with(good.bytes, at, number);
      ++tried;
      if (!is_taken(options, changed)) continue;
      ++taken;
      Bench bench(options);
      bench.work(restore_job(std::make_shared<RestoredLearner>(options, changed)));
      for (std::size_t n = 60; n < 70; ++n) {
        for (const auto& axis : bench.work(jobs[n]).axes) {
          ASSERT_TRUE(std::isfinite(axis.drift.held_radps)) << at;
          if (!axis.stack.knows()) continue;
          const auto made = stack_forecast(axis, {0.1, 0.2}, jobs[n].label.thermal,
                                           jobs[n].label.end + core::from_seconds(100.0));
          ASSERT_TRUE(std::isfinite(made.drift_radps)) << at;
          ASSERT_TRUE(std::isfinite(made.variance)) << at;
        }
      }
    }
  }
  EXPECT_GT(tried - taken, tried / 8);
  EXPECT_GT(taken, tried / 20);
}

TEST(LearnerStateAbuse, WhatIsWrittenOverAStateIsRefusedOrDoesNoHarm) {
  expect_no_harm_by_what_is_written_over(small_options());
}

TEST(LearnerStateAbuse, WhatIsWrittenOverTheOnlineSvrAloneIsRefusedOrDoesNoHarm) {
  expect_no_harm_by_what_is_written_over(svr_alone(small_options()));
}

// Rule: kernels alone begin a learner that knows nothing else and learns with them.
TEST(LearnerState, KernelsAloneAreLearnedWithFromTheFirstLabelOn) {
  auto options = small_options();
  const LearnerState all = state_after(options, 100);
  LearnerState kernels{.epoch = all.epoch, .kernels = all.kernels};
  ASSERT_NE(kernels.kernels[0].kernel, options.model.kernel) << "or nothing was chosen";
  Bench bench(options);
  const auto restored = std::make_shared<RestoredLearner>(options, kernels);
  EXPECT_FALSE(bench.work(restore_job(restored)).axes[0].drift.trained);
  EXPECT_EQ(restored->installed_as, all.epoch);
  EXPECT_EQ(bench.learner().labels_learned(), 0U);
  const auto jobs = life();
  for (std::size_t n = 0; n < 20; ++n) bench.work(jobs[n]);
  EXPECT_EQ(bench.state().kernels[0].kernel, kernels.kernels[0].kernel);

  options.model.selection.reset();
  EXPECT_FALSE(is_taken(options, kernels)) << "the configuration leaves no choice";
}

// Rule: another layout has another number. Where this fails, what a learner carries has changed:
// count kLearnerLayout up and write the new sizes here.
TEST(LearnerState, AnotherLayoutHasAnotherNumber) {
  const auto options = small_options();
  EXPECT_EQ(kLearnerLayout, 9U);
  EXPECT_EQ(state_after(svr_alone(options), 0).bytes.size(), 4646U);
  EXPECT_EQ(state_after(svr_alone(options), 30).bytes.size(), 29702U);
  EXPECT_EQ(state_after(options, 0).bytes.size(), 75500U);
  EXPECT_EQ(state_after(options, 30).bytes.size(), 453796U);
}

// Rule: given before the first sample, a saved learner is in force from that sample on; and the
// labels of the second stream are learned as one learner would have learned those of both.
TEST(LearnerStateLaws, ACompensatorThatResumesLearnsAsOneLearnerOfBothStreams) {
  testing::GyroSpec spec;
  spec.duration_s = 1500.0;
  spec.high_degc = 40.0;
  const auto options = testing::options();
  Bench both(options);
  const auto compensate = [&](Compensator& compensator, const testing::Record& record) {
    std::vector<core::CompensatedSample> answers;
    testing::run(compensator, record, [&](const core::CompensatedSample& answer) {
      answers.push_back(answer);
      if (const Label* label = compensator.confirmed_label()) {
        both.work({.kind = TrainingJob::Kind::kLabel, .label = *label});
      }
    });
    compensator.finish_learning();
    return answers;
  };
  const auto print = [](const LearnerState& state, const CompensationOptions& with) {
    Bench reader(with);
    return reader.print(restore_job(std::make_shared<RestoredLearner>(with, state)));
  };

  Compensator first(options);
  const auto answers = compensate(first, testing::make_record(spec));
  ASSERT_EQ(answers.back().rung[0], core::Rung::kStack)
      << "nothing was learned that could be saved";
  const LearnerState saved = first.learner().export_state();
  EXPECT_TRUE(print(saved, options) == print(both.state(), options));

  // The second stream goes on in time, a minute later, with temperatures of its own.
  testing::Record record = testing::make_record(spec);
  const core::SensorTime later = core::from_seconds(spec.duration_s + 60.0);
  for (auto& sample : record.rates) sample.time += later;
  for (auto& reading : record.temperatures) reading.time += later;
  Compensator second(options);
  ASSERT_TRUE(second.restore_models(std::make_shared<RestoredLearner>(options, saved)));
  const auto resumed = compensate(second, record);
  EXPECT_EQ(resumed.front().model_epoch, saved.epoch);
  // Its temperature rate needs a minute; until then the last stationary minute is held.
  EXPECT_EQ(resumed.front().rung[0], core::Rung::kStationaryBias);
  EXPECT_EQ(resumed[static_cast<std::size_t>(70.0 * spec.rate_hz)].rung[0], core::Rung::kStack);
  EXPECT_TRUE(print(second.learner().export_state(), options) == print(both.state(), options));
}

// Rule: what was confirmed and isn't due yet is learned at the end, however long the handover.
TEST(LearnerState, AtTheEndEverythingConfirmedIsLearned) {
  auto options = testing::options();
  options.learning.handover_s = 120.0;  // twelve labels on their way
  testing::GyroSpec spec;
  spec.duration_s = 400.0;
  Compensator compensator(options);
  testing::run(compensator, testing::make_record(spec));
  EXPECT_LT(compensator.learner().labels_learned(), compensator.counts().labels);
  compensator.finish_learning();
  EXPECT_EQ(compensator.learner().labels_learned(), compensator.counts().labels);
}

}  // namespace
}  // namespace zerodrift::compensation
