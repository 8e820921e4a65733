// SPDX-License-Identifier: Apache-2.0
// What the data paths of the services make of a stream, however wrong: the compensator and its
// learner, then the statistics that the monitor keeps of what comes out; and what is left of it
// all can be handed to a standby.
// Input: one byte whose lowest bit takes a prior, then steps of one byte and what it asks for. The
// byte modulo 8: 0 a good rate sample and 1 a good temperature (each is followed by a byte, the
// value), 2 a run of good samples (a byte modulo 64: how many), 3 an order to the compensator (a
// byte), 4 a sample skipped; 5 a rate, 6 a temperature, 7 a reference with every field from the
// input.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>

#include "common/allan/stream_statistics.h"
#include "common/allan/stream_timing.h"
#include "common/checkpoint/checkpoint_error.h"
#include "common/compensation/compensator.h"
#include "tests/fuzz/expectations.h"
#include "tests/fuzz/running_compensator.h"

namespace zerodrift::fuzz {
namespace {

using compensation::Compensator;
using core::CompensatedSample;

constexpr double kWindowS = 60.0;
constexpr std::uint64_t kMostSamples = 300;  // of an input: a fuzzer lives on many short ones

// The input's front; zeros once it is used up.
class Reader {
 public:
  explicit Reader(Bytes input) : rest_(input) {}

  template <typename T>
  T take() {
    T value{};
    const std::size_t size = std::min(sizeof value, rest_.size());
    if (size > 0) std::memcpy(&value, rest_.data(), size);
    rest_ = rest_.subspan(size);
    return value;
  }
  [[nodiscard]] bool done() const { return rest_.empty(); }

 private:
  Bytes rest_;
};

bool is_known(double variance) {
  return std::isfinite(variance) && (variance >= 0.0 || variance == -1.0);
}

void check(const CompensatedSample& sample) {
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    demand(std::isfinite(sample.applied_drift_radps[i]), "what is taken off is a number");
    demand(is_known(sample.drift_variance[i]) && is_known(sample.sensor_variance[i]),
           "a variance is a number that is not negative, or -1");
    const double back = sample.rate_radps[i] + sample.applied_drift_radps[i];
    const double raw = sample.raw.rate_radps[i];
    // Two roundings, each of half a unit in the last place of the larger term.
    const double rounding = 3e-16 * (std::abs(raw) + std::abs(sample.applied_drift_radps[i]));
    demand(!sample.raw.valid[i] || !(std::abs(back - raw) > rounding),
           "a correction can be undone");
  }
}

// As services/allan_monitor places and feeds samples, one axis.
class Monitor {
 public:
  void take(const CompensatedSample& sample) {
    if (sample.late) return;
    const auto placement = timing_.place(sample.raw.time, sample.raw.interval_s);
    using allan::Arrival;
    if (placement.arrival == Arrival::kFirst || placement.arrival == Arrival::kNewRate) {
      statistics_.emplace(allan::StreamStatisticsOptions{.sample_interval_s = timing_.interval_s(),
                                                         .window_s = kWindowS,
                                                         .longest_tau_s = 0.1 * kWindowS});
    } else if (placement.arrival != Arrival::kNext &&
               placement.arrival != Arrival::kTimeRestarted) {
      return;
    }
    statistics_->begin_blocks();
    statistics_->gap(placement.missing);
    statistics_->add(sample.raw.valid[0] ? sample.rate_radps[0]
                                         : std::numeric_limits<double>::quiet_NaN());
  }

  void report() const {
    if (!statistics_ || statistics_->samples() < 32) return;
    for (const auto& point : statistics_->report(timing_.mean_interval_s()).since_start)
      demand(point.deviation_radps >= 0.0, "a deviation is not negative");
  }

 private:
  allan::StreamTiming timing_;
  std::optional<allan::StreamStatistics> statistics_;
};

class Pipeline {
 public:
  explicit Pipeline(bool with_prior)
      : options_(small_compensation(with_prior)), compensator_(options_) {}

  void step(Reader& input) {
    switch (input.take<std::uint8_t>() % 8) {
      case 0: return next_rate(input.take<std::int8_t>());
      case 1: return next_temperature(input.take<std::int8_t>());
      case 2: return good_run(input.take<std::uint8_t>() % 64);
      case 3: return order(input.take<std::uint8_t>());
      case 4: return skip();
      case 5: return any_rate(input);
      case 6: return any_temperature(input);
      default: return any_reference(input);
    }
  }

  [[nodiscard]] std::uint64_t admitted() const { return admitted_; }

  void finish() {
    answer_all();
    const auto counts = compensator_.counts();
    demand(counts.samples_out == admitted_, "each sample that was admitted is answered once");
    monitor_.report();
    if (compensator_.is_quiescent()) hand_over();
  }

 private:
  void hand_over() {
    const zerodrift::checkpoint::Owner owner{kRunningGyro, options_};
    try {
      static_cast<void>(
          zerodrift::checkpoint::decode_running(state_of(compensator_, owner), owner));
    } catch (const zerodrift::checkpoint::CheckpointError& error) {
      throw Broken(std::string("a state that was written is read, found ") + error.what());
    }
  }

  void push(const core::AngularRateSample& sample) {
    const auto admission = compensator_.push(sample);
    demand(admission != compensation::Admission::kQueueFull, "the queue was drained");
    if (admission == compensation::Admission::kInOrder ||
        admission == compensation::Admission::kLate) {
      ++admitted_;
    }
    answer_all();
  }

  void skip() {
    ++sequence_;
    time_ += kSmallInterval;
  }

  void next_rate(std::int8_t value) {
    skip();
    push(good_rate(sequence_, time_, value));
  }

  void next_temperature(std::int8_t value) { compensator_.push(good_temperature(time_, value)); }

  void good_run(std::uint8_t count) {
    for (int i = 0; i < count; ++i) {
      next_temperature(static_cast<std::int8_t>(i % 16));
      next_rate(static_cast<std::int8_t>(i % 7));
    }
  }

  void order(std::uint8_t which) {
    switch (which % 5) {
      case 0: answer_all(); return compensator_.restart_stream();
      case 1: return compensator_.freeze();
      case 2: return compensator_.learn();
      case 3: return static_cast<void>(compensator_.reset_models());
      default: return compensator_.give_up_waiting();
    }
  }

  void any_rate(Reader& input) {
    core::AngularRateSample sample;
    sample.sequence = input.take<std::uint64_t>();
    sample.time = core::SensorTime{input.take<std::int64_t>()};
    sample.interval_s = input.take<double>();
    if (!(std::isfinite(sample.interval_s) && sample.interval_s > 0.0)) sample.interval_s = 0.0;
    for (double& rate : sample.rate_radps) rate = input.take<double>();
    const auto bits = input.take<std::uint8_t>();
    for (unsigned i = 0; i < core::kAxisCount; ++i) {
      sample.valid[i] = (bits >> i & 1U) != 0 && std::isfinite(sample.rate_radps[i]);
      sample.clipped[i] = (bits >> (3 + i) & 1U) != 0;
    }
    sample.clock = static_cast<core::ClockSource>(input.take<std::uint8_t>() % 5);
    push(sample);
  }

  void any_temperature(Reader& input) {
    core::TemperatureSample sample{.probe = "coil"};
    sample.time = core::SensorTime{input.take<std::int64_t>()};
    sample.temperature_degc = input.take<double>();
    sample.measured = input.take<std::uint8_t>() % 4 != 0;
    compensator_.push(sample);
  }

  void any_reference(Reader& input) {
    core::RateReferenceSample sample;
    sample.time = core::SensorTime{input.take<std::int64_t>()};
    for (double& rate : sample.rate_radps) rate = input.take<double>();
    sample.variance.fill(std::abs(input.take<double>()));
    const bool finite = std::isfinite(sample.variance[0]);
    for (std::size_t i = 0; i < core::kAxisCount; ++i)
      sample.valid[i] = finite && std::isfinite(sample.rate_radps[i]);
    sample.kind = static_cast<core::ReferenceKind>(input.take<std::uint8_t>() % 5);
    sample.model_epoch = input.take<std::uint8_t>();
    compensator_.push(sample);
  }

  void answer_all() {
    fuzz::answer_all(compensator_, [&](const CompensatedSample& sample) {
      check(sample);
      monitor_.take(sample);
    });
  }

  compensation::CompensationOptions options_;
  Compensator compensator_;
  Monitor monitor_;
  std::uint64_t sequence_ = 0;
  core::SensorTime time_{0};
  std::uint64_t admitted_ = 0;
};

}  // namespace

void sample_stream(Bytes input) {
  Reader reader(input);
  Pipeline pipeline((reader.take<std::uint8_t>() & 1U) != 0);
  while (!reader.done() && pipeline.admitted() < kMostSamples) pipeline.step(reader);
  pipeline.finish();
}

}  // namespace zerodrift::fuzz
