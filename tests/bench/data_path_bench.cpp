// SPDX-License-Identifier: Apache-2.0
// What a sample costs the compensation's thread, ingress to egress without the middleware, at a
// full window of 500 labels, and what the learner's state does to it:
//
//   idle     learning is frozen, the learner's thread sleeps
//   busy     the learner's thread learns and chooses kernels all the time: the stream is faster
//            than real time, so a label is always waiting
//   starved  the learner's thread gets no turn; labels queue up
//   flooded  nor has it had one for long: the queue is full, each label is skipped
//
// Rounds of the four are interleaved, so that what else the machine does hits all; figures are
// medians over the rounds, ratios are of one round to the same round's idle one. Temperatures come
// ten times a second of sensor time: 5 % of the samples evaluate the models of three axes, 0.1 %
// confirm a label.
//
// What a label costs the learner's thread, with three axes, is told of those that fill the window.
//
//   data_path_bench [rounds] [samples a round] [samples a second; 0: as fast as it goes] [scheme]
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "common/compensation/compensator.h"
#include "common/compensation/option_keys.h"
#include "common/core/units.h"
#include "common/dds/conversions.h"
#include "common/service/monotonic_clock.h"

namespace zerodrift {
namespace {

using compensation::Compensator;
using compensation::Readiness;
using service::monotonic_ns;

constexpr std::size_t kWindow = 500;
constexpr int kRateHz = 200;
constexpr int kTemperatureEvery = 20;                            // samples
constexpr std::uint64_t kTaught = (kWindow + 40) * 5 * kRateHz;  // samples of as many labels
// A snapshot at most is ready and one comes into force with each sample: enough for a full queue.
constexpr std::uint64_t kToCatchUp = 200;
constexpr double kTargetUs = 20.0;
constexpr double kTargetRatio = 1.10;

enum class State : std::uint8_t { kIdle, kBusy, kStarved, kFlooded };
constexpr std::array kStates{State::kIdle, State::kBusy, State::kStarved, State::kFlooded};
constexpr std::array kNames{"idle", "busy", "starved", "flooded"};

compensation::CompensationOptions options(compensation::Scheme scheme) {
  compensation::CompensationOptions options;
  options.scheme = scheme;
  options.model.capacity = kWindow;
  options.earth_rate.mode = compensation::EarthRateMode::kIncluded;
  return options;
}

// A gyro in a chamber that goes up and down between 10 and 50 °C at 1 °C/min.
class Stream {
 public:
  void next(Compensator& compensator, msg::AngularRate& message) {
    ++sequence_;
    const double time_s = static_cast<double>(sequence_) / kRateHz;
    const double phase = std::fmod(time_s / 60.0, 80.0);
    const double coil_degc = 10.0 + (phase < 40.0 ? phase : 80.0 - phase);
    if (sequence_ % kTemperatureEvery == 0) {
      reading_.probe = "coil";
      reading_.sequence = sequence_;
      reading_.time = core::from_seconds(time_s);
      reading_.temperature_degc = coil_degc;
      reading_.clock = core::ClockSource::kHardware;
      compensator.push(reading_);
    }
    core::AngularRateSample sample;
    sample.sequence = sequence_;
    sample.time = core::from_seconds(time_s);
    sample.interval_s = 1.0 / kRateHz;
    sample.valid = {true, true, true};
    sample.clock = core::ClockSource::kHardware;
    const double drift_deg_h = 0.05 * coil_degc + 0.3 * std::sin(0.2 * coil_degc);
    for (double& rate : sample.rate_radps)
      rate = core::radps_from_deg_h(drift_deg_h + 0.02 * noise_(random_));
    message = dds::to_message(sample, 1, monotonic_ns());
  }

 private:
  std::mt19937_64 random_{20260101};
  std::normal_distribution<double> noise_;
  std::uint64_t sequence_ = 0;
  core::TemperatureSample reading_;
};

// What CompensationNode does with a rate, without its write.
std::int64_t answer_ns(Compensator& compensator, const msg::AngularRate& message,
                       msg::CompensatedRate& answer) {
  const std::int64_t ingress_ns = monotonic_ns();
  compensator.push(dds::from_message(message), message.publish_time_ns(), ingress_ns);
  while (compensator.readiness() != Readiness::kNothing)
    dds::to_message(compensator.answer_next(), 1, 0, answer);
  const std::int64_t egress_ns = monotonic_ns();
  answer.egress_time_ns(egress_ns);
  return egress_ns - ingress_ns;
}

struct Figures {
  double p50_us = 0.0;
  double p99_us = 0.0;
  double p999_us = 0.0;
  double max_us = 0.0;
};

Figures figures_of(std::vector<std::int64_t>& times_ns) {
  std::sort(times_ns.begin(), times_ns.end());
  const auto at = [&](double share) {
    return 1e-3 * static_cast<double>(times_ns[static_cast<std::size_t>(
                      share * static_cast<double>(times_ns.size() - 1))]);
  };
  return {at(0.5), at(0.99), at(0.999), at(1.0)};
}

// The learner's thread, as in the service: it sleeps until it is woken.
class LearnerThread {
 public:
  explicit LearnerThread(Compensator& compensator) : compensator_(compensator) {
    thread_ = std::thread([this] { run(); });
  }
  ~LearnerThread() {
    stopping_ = true;
    notify();
    thread_.join();
  }
  LearnerThread(const LearnerThread&) = delete;
  LearnerThread& operator=(const LearnerThread&) = delete;
  void notify() {
    ++notifications_;
    notifications_.notify_one();
  }

 private:
  void run() {
    while (!stopping_) {
      const std::uint32_t seen = notifications_;
      bool learned = false;
      while (!stopping_ && compensator_.learner().run_one()) learned = true;
      if (!learned && !stopping_) notifications_.wait(seen);
    }
  }
  Compensator& compensator_;
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint32_t> notifications_{0};
  std::thread thread_;
};

class Subject {
 public:
  Subject(State state, compensation::Scheme scheme) : state_(state), compensator_(options(scheme)) {
    teach(kTaught);
    if (state_ == State::kIdle) compensator_.freeze();
  }

  Figures round(std::size_t samples, double samples_per_s) {
    std::vector<std::int64_t> times_ns;
    times_ns.reserve(samples);
    std::unique_ptr<LearnerThread> learner;
    if (state_ == State::kStarved) teach(kToCatchUp);
    if (state_ == State::kIdle || state_ == State::kBusy)
      learner = std::make_unique<LearnerThread>(compensator_);
    const auto begin = std::chrono::steady_clock::now();
    for (std::size_t k = 0; k < samples; ++k) {
      if (samples_per_s > 0.0) {
        const std::chrono::duration<double> due(static_cast<double>(k) / samples_per_s);
        std::this_thread::sleep_until(begin +
                                      std::chrono::duration_cast<std::chrono::nanoseconds>(due));
      }
      stream_.next(compensator_, message_);
      const std::uint64_t labels = compensator_.counts().labels;
      times_ns.push_back(answer_ns(compensator_, message_, answer_));
      if (learner && compensator_.counts().labels != labels) learner->notify();
    }
    return figures_of(times_ns);
  }
  [[nodiscard]] std::uint64_t skipped() const { return compensator_.counts().labels_skipped; }
  // The median and the largest, us.
  [[nodiscard]] Figures label_figures() { return figures_of(label_ns_); }
  [[nodiscard]] std::uint64_t learned() { return compensator_.learner().labels_learned(); }
  [[nodiscard]] std::size_t support_vectors() const {
    return compensator_.support_vectors(core::Axis::kX);
  }

 private:
  void teach(std::uint64_t samples) {
    for (std::uint64_t k = 0; k < samples; ++k) {
      stream_.next(compensator_, message_);
      answer_ns(compensator_, message_, answer_);
      const std::int64_t begin_ns = monotonic_ns();
      if (compensator_.learner().run_one()) label_ns_.push_back(monotonic_ns() - begin_ns);
    }
  }

  std::vector<std::int64_t> label_ns_;
  State state_;
  Compensator compensator_;
  Stream stream_;
  msg::AngularRate message_;
  msg::CompensatedRate answer_;
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

int run(std::size_t rounds, std::size_t samples, double samples_per_s,
        compensation::Scheme scheme) {
  std::array<std::unique_ptr<Subject>, kStates.size()> subjects;
  for (std::size_t s = 0; s < kStates.size(); ++s)
    subjects[s] = std::make_unique<Subject>(kStates[s], scheme);
  // The queue of 64 labels of 1000 samples.
  subjects.back()->round(70 * 5 * kRateHz, 0.0);
  for (auto& subject : subjects) subject->round(samples / 4, 0.0);  // warm

  std::array<std::array<std::vector<double>, 5>, kStates.size()> all;
  for (std::size_t round = 0; round < rounds; ++round) {
    double idle_us = 0.0;
    for (std::size_t s = 0; s < kStates.size(); ++s) {
      const Figures figures = subjects[s]->round(samples, samples_per_s);
      if (kStates[s] == State::kIdle) idle_us = figures.p999_us;
      all[s][0].push_back(figures.p50_us);
      all[s][1].push_back(figures.p99_us);
      all[s][2].push_back(figures.p999_us);
      all[s][3].push_back(figures.max_us);
      all[s][4].push_back(figures.p999_us / idle_us);
    }
  }
  std::printf("compute at W = %zu (%zu support vectors), us; medians of %zu rounds of %zu samples",
              kWindow, subjects[0]->support_vectors(), rounds, samples);
  std::printf(samples_per_s > 0.0 ? " at %.0f a second\n" : "\n", samples_per_s);
  std::printf("%-8s %8s %8s %8s %8s %12s %9s %9s\n", "learner", "p50", "p99", "p99.9", "max",
              "p99.9/idle", "learned", "skipped");
  bool is_met = true;
  for (std::size_t s = 0; s < kStates.size(); ++s) {
    const double p999_us = median(all[s][2]);
    const double ratio = median(all[s][4]);
    std::printf("%-8s %8.2f %8.2f %8.2f %8.1f %12.3f %9llu %9llu\n", kNames[s], median(all[s][0]),
                median(all[s][1]), p999_us, median(all[s][3]), ratio,
                static_cast<unsigned long long>(subjects[s]->learned()),
                static_cast<unsigned long long>(subjects[s]->skipped()));
    is_met = is_met && p999_us <= kTargetUs && ratio <= kTargetRatio;
  }
  const Figures label = subjects[0]->label_figures();
  std::printf("a label of three axes, us: p50 %.0f, p99 %.0f, most %.0f\n", label.p50_us,
              label.p99_us, label.max_us);
  std::printf("%s: p99.9 at most %.0f us, and at most %.2f times that of an idle learner\n",
              is_met ? "met" : "not met", kTargetUs, kTargetRatio);
  return is_met ? 0 : 1;
}

}  // namespace
}  // namespace zerodrift

int main(int argc, char** argv) {
  const auto argument = [&](int k, double otherwise) {
    return argc > k ? std::atof(argv[k]) : otherwise;
  };
  return zerodrift::run(static_cast<std::size_t>(argument(1, 9.0)),
                        static_cast<std::size_t>(argument(2, 60000.0)), argument(3, 0.0),
                        argc > 4 ? zerodrift::compensation::scheme_named(argv[4])
                                 : zerodrift::compensation::CompensationOptions{}.scheme);
}
