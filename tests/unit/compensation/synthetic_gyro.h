// SPDX-License-Identifier: Apache-2.0
// A small deterministic gyro with thermal drift for the tests of this folder: known truth at every
// sample.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "common/compensation/compensator.h"
#include "common/core/units.h"

// The tests' own language.
namespace zerodrift::compensation {
using core::Axis;
using core::from_seconds;
using core::index;
using core::kAxes;
using core::seconds;
}  // namespace zerodrift::compensation

namespace zerodrift::compensation::testing {

// SplitMix64 (Steele, Lea, Flood 2014) and Box-Muller: the same numbers on every platform.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed * 0x9E3779B97F4A7C15ULL + 1) {}

  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15ULL);
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31U);
  }
  std::uint64_t below(std::uint64_t n) { return next() % n; }
  // (0, 1]
  double uniform() { return (static_cast<double>(next() >> 11U) + 1.0) * 0x1p-53; }
  double gaussian() {
    return std::sqrt(-2.0 * std::log(uniform())) * std::cos(2.0 * std::numbers::pi * uniform());
  }

 private:
  std::uint64_t state_;
};

inline constexpr double kDegH = core::kRadPerSecPerDegPerHour;

// True angular rate of one axis over time.
using Motion = std::function<double(double time_s, core::Axis axis)>;
inline double at_rest(double, core::Axis) {
  return 0.0;
}
// About z at `rate_radps` from begin_s on for duration_s.
inline Motion turn(double begin_s, double duration_s, double rate_radps) {
  return [=](double time_s, core::Axis axis) {
    const bool turning = time_s > begin_s && time_s <= begin_s + duration_s;
    return turning && axis == core::Axis::kZ ? rate_radps : 0.0;
  };
}

struct GyroSpec {
  double rate_hz = 20.0;
  double duration_s = 600.0;
  double noise_deg_h_1s = 0.056;  // standard deviation of a one-second mean
  // Chamber: between low and high at +-ramp_degc_per_min on average; constant where both are equal.
  double low_degc = 20.0;
  double high_degc = 20.0;
  double ramp_degc_per_min = 1.0;
  double offset_deg_h = 2.0;
  double per_degc_deg_h = 0.05;   // bias over temperature, linear
  double per_degc2_deg_h = 1e-3;  // and quadratic
  double shupe_deg_h_per_degc_min = 0.5;
  double scale_error = 0.0;  // at 25 °C, part of neither drift nor noise
  double scale_error_per_degc = 0.0;
  double temperature_interval_s = 1.0;
  core::ClockSource clock = core::ClockSource::kSimulation;
  std::vector<std::string> probes{"coil"};
  std::uint64_t seed = 1;
  Motion motion = at_rest;
};

// Everything of one record, with the truth beside it.
struct Record {
  std::vector<core::AngularRateSample> rates;
  std::vector<core::TemperatureSample> temperatures;
  std::vector<core::RateReferenceSample> references;
  std::vector<core::PerAxis<double>> true_radps;   // by rate sample
  std::vector<core::PerAxis<double>> drift_radps;  // without noise
  std::vector<core::PerAxis<double>> noise_radps;
};

// Between low and high as a raised cosine: smooth, as the coil inside a chamber is; the mean of
// |dT/dt| is the ramp.
struct Chamber {
  explicit Chamber(const GyroSpec& spec) : spec_(spec) {}
  [[nodiscard]] double temperature_degc(double time_s) const {
    return spec_.low_degc + 0.5 * travel_degc() * (1.0 - std::cos(phase(time_s)));
  }
  [[nodiscard]] double rate_degc_per_min(double time_s) const {
    return 0.5 * std::numbers::pi * spec_.ramp_degc_per_min * std::sin(phase(time_s));
  }

 private:
  [[nodiscard]] double travel_degc() const { return spec_.high_degc - spec_.low_degc; }
  [[nodiscard]] double phase(double time_s) const {
    if (travel_degc() <= 0.0) return 0.0;
    return std::numbers::pi * time_s * spec_.ramp_degc_per_min / 60.0 / travel_degc();
  }
  GyroSpec spec_;
};

inline double drift_deg_h(const GyroSpec& spec, double time_s, core::Axis axis) {
  const Chamber chamber(spec);
  const double t = chamber.temperature_degc(time_s) - 25.0;
  const double sign = axis == core::Axis::kY ? -1.0 : 1.0;
  return sign * (spec.offset_deg_h + spec.per_degc_deg_h * t + spec.per_degc2_deg_h * t * t +
                 spec.shupe_deg_h_per_degc_min * chamber.rate_degc_per_min(time_s));
}

inline Record make_record(const GyroSpec& spec) {
  Record record;
  Random random(spec.seed);
  const Chamber chamber(spec);
  const double sigma = spec.noise_deg_h_1s * kDegH * std::sqrt(spec.rate_hz);
  const auto n = static_cast<std::size_t>(std::llround(spec.duration_s * spec.rate_hz));
  for (std::size_t k = 1; k <= n; ++k) {
    const double time_s = static_cast<double>(k) / spec.rate_hz;
    core::AngularRateSample sample;
    sample.sequence = k;
    sample.time = core::from_seconds(time_s);
    sample.interval_s = 1.0 / spec.rate_hz;
    sample.valid = {true, true, true};
    sample.clock = spec.clock;
    const double scale_error =
        spec.scale_error + spec.scale_error_per_degc * (chamber.temperature_degc(time_s) - 25.0);
    core::PerAxis<double> truth{}, drift{}, noise{};
    for (const auto axis : core::kAxes) {
      const std::size_t i = core::index(axis);
      truth[i] = spec.motion(time_s, axis);
      drift[i] = drift_deg_h(spec, time_s, axis) * kDegH;
      noise[i] = sigma * random.gaussian();
      sample.rate_radps[i] = truth[i] + drift[i] + noise[i] + scale_error * truth[i];
    }
    record.rates.push_back(sample);
    record.true_radps.push_back(truth);
    record.drift_radps.push_back(drift);
    record.noise_radps.push_back(noise);
  }
  std::uint64_t sequence = 0;
  for (double time_s = 0.0; time_s <= spec.duration_s + 2.0;
       time_s += spec.temperature_interval_s) {
    for (const auto& probe : spec.probes) {
      core::TemperatureSample reading;
      reading.probe = probe;
      reading.sequence = ++sequence;
      reading.time = core::from_seconds(time_s);
      reading.temperature_degc = chamber.temperature_degc(time_s);
      reading.clock = spec.clock;
      record.temperatures.push_back(reading);
    }
  }
  return record;
}

// References that give the true rate at each sample.
inline void add_true_rates(Record& record,
                           core::ReferenceKind kind = core::ReferenceKind::kRecord) {
  for (std::size_t k = 0; k < record.rates.size(); ++k) {
    core::RateReferenceSample reference;
    reference.time = record.rates[k].time;
    reference.rate_radps = record.true_radps[k];
    reference.valid = {true, true, true};
    reference.kind = kind;
    record.references.push_back(reference);
  }
}

// The settings that the figures in these tests are derived from, whatever the defaults become.
inline CompensationOptions options() {
  CompensationOptions options;
  options.learning.label_interval_s = 10.0;
  options.learning.confirm_s = 5.0;
  options.learning.handover_s = 1.0;
  options.learning.initial_labels = 6;
  options.model.epsilon = 0.01;
  options.temperature_delay_s = 0.05;
  options.temperature_stale_s = 30.0;
  return options;
}
// The same with the online SVR alone.
inline CompensationOptions svr_options() {
  CompensationOptions svr = options();
  svr.scheme = Scheme::kOnlineSvr;
  return svr;
}

// When a learner gets to work: both give the same output to the bit.
enum class LearnerTiming { kAtOnce, kOnlyWhenAwaited };

// Answers everything that is ready; `take(const CompensatedSample&)`.
template <typename Take>
void answer_ready(Compensator& compensator, LearnerTiming timing, Take&& take) {
  for (;;) {
    if (timing == LearnerTiming::kAtOnce) {
      while (compensator.learner().run_one()) {
      }
    }
    const Readiness readiness = compensator.readiness();
    if (readiness == Readiness::kAwaitsModel && compensator.learner().run_one()) continue;
    if (readiness != Readiness::kReady) return;
    take(compensator.answer_next());
  }
}

// Feeds the record by sensor time and answers all of it; at its end waiting is given up.
template <typename Take>
void run(Compensator& compensator, const Record& record, Take&& take,
         LearnerTiming timing = LearnerTiming::kAtOnce) {
  std::size_t t = 0;
  std::size_t r = 0;
  for (const auto& sample : record.rates) {
    for (; t < record.temperatures.size() && record.temperatures[t].time <= sample.time; ++t) {
      compensator.push(record.temperatures[t]);
    }
    for (; r < record.references.size() && record.references[r].time <= sample.time; ++r) {
      compensator.push(record.references[r]);
    }
    compensator.push(sample);
    if (t == record.temperatures.size()) compensator.give_up_waiting();  // that stream has ended
    answer_ready(compensator, timing, take);
  }
  for (; t < record.temperatures.size(); ++t) compensator.push(record.temperatures[t]);
  answer_ready(compensator, timing, take);
  for (;;) {
    compensator.give_up_waiting();
    answer_ready(compensator, timing, take);
    if (compensator.readiness() == Readiness::kNothing) return;
  }
}

inline std::vector<core::CompensatedSample> run(Compensator& compensator, const Record& record,
                                                LearnerTiming timing = LearnerTiming::kAtOnce) {
  std::vector<core::CompensatedSample> answers;
  answers.reserve(record.rates.size());
  run(
      compensator, record,
      [&](const core::CompensatedSample& answer) { answers.push_back(answer); }, timing);
  return answers;
}

}  // namespace zerodrift::compensation::testing

namespace zerodrift::compensation {
using testing::GyroSpec;
using testing::kDegH;
using testing::make_record;
using testing::Random;
using testing::Record;
}  // namespace zerodrift::compensation
