// SPDX-License-Identifier: Apache-2.0
// Runs the learners of `zerodrift_bench svr` over one record with one window.
//
// A step learns the next point and forgets one. The sequence is deterministic and is run several
// times; a step's time is its least over the repeats, so that a preemption of one run is no outlier
// of the learner. Answers are taken in a further run, which isn't timed, at a few steps spread over
// the record. LIBSVM can only be trained anew, so it is trained at those steps alone; a training is
// longer than a time slice of a busy machine, so it is processor time that is taken there, which is
// never more than the time on the clock.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "tests/bench/synthetic_drift.h"

namespace zerodrift::bench {

inline constexpr std::size_t kComparedSteps = 100;
inline constexpr std::size_t kProbes = 16;  // points of the window answered at a compared step

struct SvrWorkload {
  DriftRecord record = DriftRecord::kRamp;
  std::vector<DriftPoint> points{};  // at least window + kComparedSteps + 1
  std::size_t window = 500;          // W, points
  std::size_t repeats = 3;
};

struct SvrMeasurement {
  std::string learner{};
  std::vector<double> update_us{};   // a point learned and one forgotten, least of the repeats
  std::size_t unfinished_steps = 0;  // whose event budget ran out
  // At the compared steps:
  std::vector<double> predict_us{};              // one prediction, least of the repeats
  std::vector<double> error{};                   // of the next point's prediction, against truth
  std::vector<std::array<double, kProbes>> f{};  // at the probes
};

struct SvrComparison {
  SvrMeasurement ours_fifo{}, ours_two_tier{};
  SvrMeasurement libsvm_default{}, libsvm_tight{};  // stopping tolerance 1e-3 and 1e-6
  SvrMeasurement dlib_krls{};                       // empty if dlib isn't built in
  bool is_stopped = false;                          // by a signal: incomplete
};

SvrComparison compare_svrs(const SvrWorkload& workload);

}  // namespace zerodrift::bench
