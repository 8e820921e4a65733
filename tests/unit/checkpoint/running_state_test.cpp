// SPDX-License-Identifier: Apache-2.0
// A compensator handed over while it runs: the one made from its state goes on to the bit.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "common/checkpoint/checkpoint_bytes.h"
#include "common/checkpoint/checkpoint_error.h"
#include "tests/unit/compensation/prior_models.h"
#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::checkpoint {
namespace {

using compensation::CompensationOptions;
using compensation::Compensator;
using compensation::Readiness;
using compensation::testing::GyroSpec;
using compensation::testing::make_record;
using compensation::testing::Record;
using core::CompensatedSample;

constexpr std::uint32_t kGyro = 3;

GyroSpec chamber(double duration_s = 900.0) {
  GyroSpec spec;
  spec.duration_s = duration_s;
  spec.low_degc = 20.0;
  spec.high_degc = 30.0;
  spec.motion = compensation::testing::turn(400.0, 30.0, 0.01);
  return spec;
}

CompensationOptions small_options() {
  CompensationOptions options = compensation::testing::options();
  options.model.capacity = 40;  // smaller than the run: the window forgets
  return options;
}

std::string data_path_of(Compensator& compensator) {
  std::string path;
  core::StateArchive archive(path);
  compensator.carry(archive);
  return path;
}

std::string running_state(Compensator& compensator, const CompensationOptions& options) {
  EXPECT_TRUE(compensator.is_quiescent());
  EXPECT_EQ(compensator.newest_job(), compensator.learner().newest_job());
  return encode_running({kGyro, options}, compensator.learner().export_state(),
                        data_path_of(compensator));
}

// Feeds the record to `running`; with the first sample at or after `cut` at which it is settled,
// another takes over from its state. The stand-in hears the inputs of the last `overlap` rate
// samples' time again, as a standby does that kept a log.
std::vector<CompensatedSample> run_with_handover(const Record& record,
                                                 const CompensationOptions& options,
                                                 std::size_t cut) {
  auto running = std::make_unique<Compensator>(options);
  std::vector<CompensatedSample> answers;
  const auto take = [&](const CompensatedSample& answer) { answers.push_back(answer); };
  std::size_t t = 0;
  std::size_t r = 0;
  bool handed_over = false;
  for (std::size_t k = 0; k < record.rates.size(); ++k) {
    const auto& sample = record.rates[k];
    for (; t < record.temperatures.size() && record.temperatures[t].time <= sample.time; ++t) {
      if (!running->has_received(record.temperatures[t])) running->push(record.temperatures[t]);
    }
    for (; r < record.references.size() && record.references[r].time <= sample.time; ++r) {
      if (!running->has_received(record.references[r])) running->push(record.references[r]);
    }
    running->push(sample);
    compensation::testing::answer_ready(*running, compensation::testing::LearnerTiming::kAtOnce,
                                        take);
    if (handed_over || k < cut || !running->is_quiescent()) continue;
    running = decode_running(running_state(*running, options), {kGyro, options});
    handed_over = true;
    t = t > 5 ? t - 5 : 0;  // heard already
    r = r > 5 ? r - 5 : 0;
  }
  EXPECT_TRUE(handed_over);
  return answers;
}

std::vector<std::uint64_t> bits_of(const CompensatedSample& sample) {
  std::vector<std::uint64_t> bits{sample.raw.sequence, sample.model_epoch};
  for (const auto axis : core::kAxes) {
    const std::size_t i = core::index(axis);
    bits.push_back(std::bit_cast<std::uint64_t>(sample.rate_radps[i]));
    bits.push_back(std::bit_cast<std::uint64_t>(sample.applied_drift_radps[i]));
    bits.push_back(std::bit_cast<std::uint64_t>(sample.drift_variance[i]));
    bits.push_back(std::bit_cast<std::uint64_t>(sample.sensor_variance[i]));
    bits.push_back(static_cast<std::uint64_t>(sample.mode[i]));
    bits.push_back(static_cast<std::uint64_t>(sample.reason[i]));
    bits.push_back(static_cast<std::uint64_t>(sample.rung[i]));
  }
  return bits;
}

void expect_no_difference(const Record& record, const CompensationOptions& options) {
  Compensator undisturbed(options);
  std::vector<CompensatedSample> expected;
  std::size_t t = 0;
  std::size_t r = 0;
  for (const auto& sample : record.rates) {
    for (; t < record.temperatures.size() && record.temperatures[t].time <= sample.time; ++t)
      undisturbed.push(record.temperatures[t]);
    for (; r < record.references.size() && record.references[r].time <= sample.time; ++r)
      undisturbed.push(record.references[r]);
    undisturbed.push(sample);
    compensation::testing::answer_ready(
        undisturbed, compensation::testing::LearnerTiming::kAtOnce,
        [&](const CompensatedSample& answer) { expected.push_back(answer); });
  }
  bool learned = false;
  const core::Rung learned_rung =
      options.scheme == compensation::Scheme::kStack ? core::Rung::kStack : core::Rung::kOnlineSvr;
  for (const auto& answer : expected) learned = learned || answer.rung[0] == learned_rung;
  EXPECT_TRUE(learned) << "nothing was learned: the test shows nothing";
  // In the first block, while labels gather, in mid-turn, settling after it, late.
  for (const std::size_t cut : {std::size_t{3}, record.rates.size() / 7, record.rates.size() / 3,
                                std::size_t{8200}, std::size_t{8700}, record.rates.size() - 900}) {
    const auto answers = run_with_handover(record, options, cut);
    ASSERT_EQ(answers.size(), expected.size()) << "cut at " << cut;
    for (std::size_t k = 0; k < answers.size(); ++k) {
      ASSERT_EQ(bits_of(answers[k]), bits_of(expected[k]))
          << "cut at " << cut << ", sample " << answers[k].raw.sequence;
    }
  }
}

TEST(RunningState, GoesOnToTheBitWhereverItIsCut) {
  expect_no_difference(make_record(chamber()), small_options());
}

TEST(RunningState, GoesOnToTheBitWithTheOnlineSvrAlone) {
  CompensationOptions options = small_options();
  options.scheme = compensation::Scheme::kOnlineSvr;
  expect_no_difference(make_record(chamber()), options);
}

TEST(RunningState, GoesOnToTheBitWithTheSlidingMeanRate) {
  CompensationOptions options = small_options();
  options.track.rate_method = thermal::RateMethod::kSlidingMean;
  options.track.sliding_mean = {.window_samples = 600, .sample_rate_hz = 20.0};
  expect_no_difference(make_record(chamber()), options);
}

TEST(RunningState, GoesOnToTheBitWithEveryPriorThatHasAState) {
  GyroSpec spec = chamber();
  spec.probes = {"coil", "coil_inner", "coil_outer"};
  CompensationOptions options = small_options();
  options.prior = compensation::testing::model_with_states();
  expect_no_difference(make_record(spec), options);
}

// Each sample has its true rate.
Record referenced(const GyroSpec& spec) {
  Record record = make_record(spec);
  for (std::size_t k = 0; k < record.rates.size(); ++k) {
    core::RateReferenceSample reference;
    reference.time = record.rates[k].time;
    reference.rate_radps = record.true_radps[k];
    reference.variance = {1e-16, 1e-16, 1e-16};
    reference.valid = {true, true, true};
    reference.kind = core::ReferenceKind::kRateTable;
    record.references.push_back(reference);
  }
  return record;
}

TEST(RunningState, GoesOnToTheBitAgainstReferences) {
  expect_no_difference(referenced(chamber()), small_options());
}

// Turns about z from 350 s on, so that windows come into force before, between and after the cuts,
// which lie within a block and a window.
TEST(RunningState, GoesOnToTheBitWhileTheScaleFactorIsLearned) {
  GyroSpec spec = chamber();
  spec.scale_error = 300e-6;
  spec.motion = [](double time_s, core::Axis axis) {
    const bool turns = axis == core::Axis::kZ && time_s > 350.0 && std::fmod(time_s, 60.0) > 20.0;
    return turns ? 0.1 * std::sin(time_s / 5.0) : 0.0;
  };
  CompensationOptions options = small_options();
  options.learning.scale_factor = true;
  const Record record = referenced(spec);
  Compensator compensator(options);
  (void)compensation::testing::run(compensator, record);
  ASSERT_GT(compensator.scale_factor(core::Axis::kZ)->windows, 5U) << "nothing was learned";
  expect_no_difference(record, options);
}

// At rest a navigation filter's references, in the turn its residuals.
TEST(RunningState, GoesOnToTheBitWithANavigationFiltersFeedback) {
  CompensationOptions options = small_options();
  options.earth_rate.mode = compensation::EarthRateMode::kUnknown;
  options.reference.navigation_residual = compensation::ReferencePolicy::kAccept;
  Record record = make_record(chamber());
  const auto add = [](Record& to, std::uint64_t epoch) {
    to.references.clear();
    for (std::size_t k = 0; k < to.rates.size(); k += 2) {
      core::RateReferenceSample reference;
      reference.time = to.rates[k].time;
      reference.valid = {true, true, true};
      reference.variance = {1e-17, 1e-17, 1e-17};
      reference.kind = core::ReferenceKind::kRest;
      const double time_s = core::seconds(reference.time);
      const bool turns = time_s > 400.0 && time_s < 430.0;
      if (turns) reference.valid = {};
      to.references.push_back(reference);
      if (!turns || k % 20 != 0) continue;
      reference.valid = {true, true, true};
      reference.kind = core::ReferenceKind::kNavigationResidual;
      reference.rate_radps = to.drift_radps[k];
      reference.model_epoch = epoch;
      to.references.push_back(reference);
    }
  };
  add(record, 0);
  Compensator first(options);
  const auto answers = compensation::testing::run(first, record);
  add(record, answers[8400].model_epoch);  // in force at 420 s
  Compensator second(options);
  (void)compensation::testing::run(second, record);
  const auto taken = [](const Compensator& compensator) {
    return compensator.counts()
        .references[static_cast<std::size_t>(compensation::ReferenceVerdict::kTaken)];
  };
  ASSERT_GT(taken(second), taken(first) + 5) << "residuals must be at work";
  expect_no_difference(record, options);
}

TEST(RunningState, OfOtherOptionsIsRefusedByName) {
  const Record record = make_record(chamber());
  const CompensationOptions options = small_options();
  Compensator running(options);
  const std::string state = running_state(running, options);
  CompensationOptions other = options;
  other.learning.confirm_s = 6.0;
  try {
    (void)decode_running(state, {kGyro, other});
    FAIL() << "taken";
  } catch (const CheckpointError& error) {
    EXPECT_EQ(std::string(error.what()),
              "found a state made with learning.confirm_s '5', expected '6' as configured");
  }
}

TEST(RunningState, OfAFileIsNoStateOfARunningCompensator) {
  const CompensationOptions options = small_options();
  Compensator running(options);
  const std::string file = encode({kGyro, options}, running.learner().export_state());
  EXPECT_THROW((void)decode_running(file, {kGyro, options}), CheckpointError);
}

// The envelope's CRC finds what the wire did; what somebody made up must not do harm either.
TEST(RunningState, WithADataPathCutAnywhereIsRefused) {
  const CompensationOptions options = small_options();
  Compensator running(options);
  const std::string path = data_path_of(running);
  for (std::size_t size = 0; size < path.size(); size += 1 + size / 50) {
    const std::string bytes =
        encode_running({kGyro, options}, running.learner().export_state(), path.substr(0, size));
    EXPECT_THROW((void)decode_running(bytes, {kGyro, options}), CheckpointError) << size;
  }
}

void expect_finite(const CompensatedSample& answer) {
  for (const auto axis : core::kAxes) {
    EXPECT_TRUE(std::isfinite(answer.applied_drift_radps[core::index(axis)]));
    EXPECT_LE(answer.mode[core::index(axis)], core::Mode::kHolding);
  }
}

TEST(RunningState, WithNumbersThatNoStateHoldsIsRefusedOrDoesNoHarm) {
  const CompensationOptions options = small_options();
  const Record record = make_record(chamber(200.0));
  Compensator running(options);
  (void)compensation::testing::run(running, record);
  const std::string path = data_path_of(running);
  const auto learner = running.learner().export_state();
  std::size_t refused = 0;
  std::size_t tried = 0;
  for (const std::uint64_t number :
       {std::uint64_t{0x7ff8000000000000}, std::uint64_t{0x7fefffffffffffff},
        std::uint64_t{0x8000000000000001}}) {
    for (std::size_t at = 0; at + sizeof number < path.size(); at += 1 + path.size() / 300) {
      std::string changed = path;
      std::memcpy(changed.data() + at, &number, sizeof number);
      ++tried;
      try {
        const auto other =
            decode_running(encode_running({kGyro, options}, learner, changed), {kGyro, options});
        core::AngularRateSample sample = record.rates.back();
        for (int i = 0; i < 200; ++i) {
          ++sample.sequence;
          sample.time += core::from_seconds(sample.interval_s);
          other->push(sample);
          compensation::testing::answer_ready(*other, compensation::testing::LearnerTiming::kAtOnce,
                                              expect_finite);
        }
      } catch (const CheckpointError&) {
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, tried / 2);
}

TEST(RunningState, OfACompensatorThatHeardNonsenseIsTaken) {
  using Doubles = std::numeric_limits<double>;
  const CompensationOptions options = small_options();
  const Record record = make_record(chamber(100.0));
  Compensator running(options);
  (void)compensation::testing::run(running, record);
  for (const core::SensorTime time :
       {core::kNever, core::SensorTime::max(), record.rates.back().time}) {
    for (const double number : {Doubles::quiet_NaN(), Doubles::infinity(), Doubles::max()}) {
      for (const bool measured : {true, false}) {
        core::TemperatureSample temperature = record.temperatures.back();
        temperature.time = time;
        temperature.temperature_degc = number;
        temperature.measured = measured;
        running.push(temperature);
      }
      for (const bool valid : {true, false}) {
        core::RateReferenceSample reference;
        reference.time = time;
        reference.rate_radps.fill(number);
        reference.variance.fill(number);
        reference.valid.fill(valid);
        reference.valid[0] = true;
        reference.kind = core::ReferenceKind::kRateTable;
        running.push(reference);
      }
      core::AngularRateSample rate = record.rates.back();
      rate.sequence += 5;
      rate.time = time;
      rate.interval_s = number;
      rate.rate_radps.fill(number);
      running.push(rate);
      compensation::testing::answer_ready(running, compensation::testing::LearnerTiming::kAtOnce,
                                          [](const CompensatedSample&) {});
    }
  }
  running.give_up_waiting();
  compensation::testing::answer_ready(running, compensation::testing::LearnerTiming::kAtOnce,
                                      [](const CompensatedSample&) {});
  running.finish_learning();
  EXPECT_NO_THROW((void)decode_running(running_state(running, options), {kGyro, options}));
}

}  // namespace
}  // namespace zerodrift::checkpoint
