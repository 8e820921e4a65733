// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/bench_svr_measure.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <limits>
#include <span>

#include "common/regression/online_svr.h"
#include "common/regression/svr_predictor.h"
#include "common/service/host.h"
#include "services/zerodrift/progress_bar.h"
#include "tests/bench/bench_svr_peers.h"

namespace zerodrift::bench {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

double least(double a, double b) {
  return std::min(a, b);
}

template <typename Call>
double time_us(Call&& call) {
  const auto begin = Clock::now();
  call();
  return std::chrono::duration<double, std::micro>(Clock::now() - begin).count();
}

// Spent by this thread; a reading costs too much for the steps of an online learner.
double processor_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

// --- where and at what the learners are compared

// A learner at step i has taken in the points up to i.
std::vector<std::size_t> compared_steps(const SvrWorkload& workload) {
  const std::size_t first = workload.window;
  const std::size_t last = workload.points.size() - 2;  // one point stays, to predict
  std::vector<std::size_t> steps;
  for (std::size_t k = 0; k < kComparedSteps; ++k) {
    steps.push_back(first + k * (last - first) / (kComparedSteps - 1));
  }
  return steps;
}

std::span<const DriftPoint> window_at(const SvrWorkload& workload, std::size_t step) {
  return std::span(workload.points).subspan(step + 1 - workload.window, workload.window);
}

// Spread over the window; the last is the point to come.
std::array<DriftFeatures, kProbes> probes_at(const SvrWorkload& workload, std::size_t step) {
  const auto window = window_at(workload, step);
  std::array<DriftFeatures, kProbes> probes{};
  for (std::size_t k = 0; k + 1 < kProbes; ++k) {
    probes[k] = window[k * window.size() / (kProbes - 1)].x;
  }
  probes.back() = workload.points[step + 1].x;
  return probes;
}

template <typename Learner>
void compare_at(const SvrWorkload& workload, std::size_t step, const Learner& learner,
                SvrMeasurement& measured) {
  const auto probes = probes_at(workload, step);
  std::array<double, kProbes> f{};
  double batch_us = std::numeric_limits<double>::infinity();
  for (std::size_t repeat = 0; repeat < workload.repeats; ++repeat) {
    batch_us = least(batch_us, time_us([&] {
                       for (std::size_t k = 0; k < kProbes; ++k) f[k] = learner.predict(probes[k]);
                     }));
  }
  measured.predict_us.push_back(batch_us / static_cast<double>(kProbes));
  measured.error.push_back(f.back() - workload.points[step + 1].truth);
  measured.f.push_back(f);
}

// --- the learners

class WindowedSvr {
 public:
  WindowedSvr(std::size_t window, regression::WindowPolicy policy)
      : svr_(options_of(window, policy)), predictor_(kDriftFeatures, window) {}

  // False if the step was left unfinished.
  bool learn(const DriftPoint& point) {
    const auto outcome = svr_.add(point.x, point.label).outcome;
    return outcome == regression::UpdateOutcome::kLearned ||
           outcome == regression::UpdateOutcome::kFitsAlready;
  }
  void publish() { predictor_.assign(svr_); }
  [[nodiscard]] double predict(const DriftFeatures& x) const { return predictor_.predict(x); }

 private:
  static regression::OnlineSvrOptions options_of(std::size_t window,
                                                 regression::WindowPolicy policy) {
    regression::OnlineSvrOptions options;
    options.dimension = kDriftFeatures;
    options.capacity = window;
    options.recent_capacity = window / 2;
    options.kernel.gamma = kRbfGamma;
    options.epsilon = kTubeHalfWidth;
    options.box_constraint = kBoxConstraint;
    options.window = policy;
    return options;
  }

  regression::OnlineSvr svr_;
  regression::SvrPredictor predictor_;
};

class Krls {
 public:
  bool learn(const DriftPoint& point) {
    krls_.learn(point);
    return true;
  }
  void publish() {}
  [[nodiscard]] double predict(const DriftFeatures& x) const { return krls_.predict(x); }

 private:
  DlibKrls krls_;
};

// --- measuring

// Work done so far, as a bar; and whether the user has had enough.
class Progress {
 public:
  Progress(const std::string& what, double total) : bar_(what), total_(total) {}

  void advance(double work) {
    done_ += work;
    bar_.show(done_ / total_);
    is_stopped_ = is_stopped_ || service::wait_for_stop(0ms);
  }
  [[nodiscard]] bool is_stopped() const { return is_stopped_; }

 private:
  services::ProgressBar bar_;
  double total_;
  double done_ = 0.0;
  bool is_stopped_ = false;
};

// In the unit of one term of a LIBSVM matrix; roughly what a run and a training take.
double run_work(const SvrWorkload& workload) {
  return static_cast<double>(workload.points.size() * workload.window);
}
double training_work(const SvrWorkload& workload) {
  return static_cast<double>(workload.window * workload.window);
}

template <typename MakeLearner>
void time_updates(const SvrWorkload& workload, MakeLearner&& make, SvrMeasurement& measured) {
  auto learner = make();
  for (std::size_t i = 0; i < workload.points.size(); ++i) {
    const double us = time_us([&] { learner.learn(workload.points[i]); });
    if (i < workload.window) continue;
    double& slot = measured.update_us[i - workload.window];
    slot = least(slot, us);
  }
}

template <typename MakeLearner>
void take_answers(const SvrWorkload& workload, MakeLearner&& make, SvrMeasurement& measured) {
  const auto steps = compared_steps(workload);
  auto learner = make();
  auto next = steps.begin();
  for (std::size_t i = 0; i < workload.points.size(); ++i) {
    if (!learner.learn(workload.points[i])) ++measured.unfinished_steps;
    if (next == steps.end() || i != *next) continue;
    learner.publish();
    compare_at(workload, i, learner, measured);
    ++next;
  }
}

template <typename MakeLearner>
SvrMeasurement measure_online(const std::string& name, const SvrWorkload& workload,
                              MakeLearner&& make, Progress& progress) {
  SvrMeasurement measured{.learner = name};
  measured.update_us.assign(workload.points.size() - workload.window,
                            std::numeric_limits<double>::infinity());
  take_answers(workload, make, measured);
  progress.advance(run_work(workload));
  for (std::size_t repeat = 0; repeat < workload.repeats && !progress.is_stopped(); ++repeat) {
    time_updates(workload, make, measured);
    progress.advance(run_work(workload));
  }
  return measured;
}

SvrMeasurement measure_libsvm(const std::string& name, double tolerance,
                              const SvrWorkload& workload, Progress& progress) {
  SvrMeasurement measured{.learner = name};
  LibsvmRegression libsvm(tolerance);
  for (const std::size_t step : compared_steps(workload)) {
    libsvm.load(window_at(workload, step));
    double us = std::numeric_limits<double>::infinity();
    for (std::size_t repeat = 0; repeat < workload.repeats; ++repeat) {
      const double begin_us = processor_us();
      libsvm.train();
      us = least(us, processor_us() - begin_us);
      progress.advance(training_work(workload));
      if (progress.is_stopped()) return measured;
    }
    measured.update_us.push_back(us);
    compare_at(workload, step, libsvm, measured);
  }
  return measured;
}

// All that is going to be done, in the unit of run_work().
double whole_work(const SvrWorkload& workload) {
  const double online_learners = DlibKrls::is_built_in() ? 3.0 : 2.0;
  const auto repeats = static_cast<double>(workload.repeats);
  return online_learners * (repeats + 1.0) * run_work(workload) +
         2.0 * static_cast<double>(kComparedSteps) * repeats * training_work(workload);
}

}  // namespace

SvrComparison compare_svrs(const SvrWorkload& workload) {
  Progress progress(std::string(name(workload.record)) + ", W = " + std::to_string(workload.window),
                    whole_work(workload));
  const auto ours = [&](const std::string& learner, regression::WindowPolicy policy) {
    return measure_online(
        learner, workload, [&] { return WindowedSvr(workload.window, policy); }, progress);
  };
  SvrComparison all;
  all.ours_fifo = ours("ours, fifo", regression::WindowPolicy::kFifo);
  all.ours_two_tier = ours("ours, two tiers", regression::WindowPolicy::kTwoTier);
  all.libsvm_default = measure_libsvm("LIBSVM, tolerance 1e-3", 1e-3, workload, progress);
  all.libsvm_tight = measure_libsvm("LIBSVM, tolerance 1e-6", 1e-6, workload, progress);
  if (DlibKrls::is_built_in()) {
    all.dlib_krls = measure_online(
        "dlib::krls, no window", workload, [] { return Krls(); }, progress);
  }
  all.is_stopped = progress.is_stopped();
  return all;
}

}  // namespace zerodrift::bench
