// SPDX-License-Identifier: Apache-2.0
// Tells when the noise of a stream grew, or exceeds that of another stream, at any cluster time,
// with a stated rate of false alarms however often one looks.
//
// Each look compares estimates at many taus by the variance ratio test (comparison_test.h). Alarm
// spending: a look that comes after T hours of measured time may use up a false-alarm probability
// of T * false_alarms_per_hour, shared equally by the taus it compares. The expected number of
// false alarms in a time is the sum of the probabilities spent in it (Boole's inequality, whatever
// depends on what), so it is at most false_alarms_per_hour times that time: 1e-3 is at most one in
// 1000 h of each watch.
//
// Two corrections make the p-values hold so far out in the tail. `degrees_of_freedom_share`: the
// estimator's tail is heavier than that of the chi-square of its equivalent degrees of freedom, and
// the noise type behind these may be taken for its neighbour (white for random walk: 1.6 times too
// many). `min_degrees_of_freedom`: below, no statement. Both are checked by simulation
// (noise_watch_test.cpp, ZERODRIFT_ALLAN_RUNS=120): alarms in 120 streams of 1000 looks, of which
// each was allowed one,
//
//   share   white   walk   flicker   mixture of the three
//   1.0       30      9       22        31
//   0.8        6      0        2         5
//   0.6        1      0        0         0
//
// Boole's inequality is generous where taus and looks depend on each other, so that 1.0 would do
// here, at p of some 1e-4. The default allowance needs p of 1e-7 and less, where the tail of the
// estimator is heavier still and no simulation of this size reaches: hence 0.6.
//
// Hysteresis: an alarm ends when no tau has a p below clear_p_value and a ratio beyond half of the
// least growth.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/allan/allan_point.h"

namespace zerodrift::allan {

struct NoiseWatchOptions {
  double false_alarms_per_hour = 1e-3;
  double least_growth = 0.05;   // of the deviation; less is no news, however certain
  double clear_p_value = 1e-3;  // for each tau
  double degrees_of_freedom_share = 0.6;
  double min_degrees_of_freedom = 10.0;

  // Names the first wrong key.
  [[nodiscard]] std::optional<std::string> validate() const;
};

// One tau of a look: `watched` should not exceed `reference`.
struct ComparedPoints {
  AllanPoint watched;
  AllanPoint reference;
};

enum class Excess : std::uint8_t { kNone, kBegan, kLasts, kEnded };

struct Finding {
  Excess excess = Excess::kNone;
  // Of the tau with the smallest p; when it ended, of the tau at which it began.
  double tau_s = 0.0;
  double watched_radps = 0.0;
  double reference_radps = 0.0;
  double p_value = 1.0;
  double threshold = 0.0;  // that p had to be below
};

// Pairs of points of two curves at the same taus; both ascending.
[[nodiscard]] std::vector<ComparedPoints> paired(std::span<const AllanPoint> watched,
                                                 std::span<const AllanPoint> reference);

class ExcessWatch {
 public:
  // Throws std::invalid_argument with validate()'s sentence.
  explicit ExcessWatch(const NoiseWatchOptions& options = {});

  // `observed_s`: time measured so far, samples times interval; a look without new samples finds
  // what the one before found. O(points).
  Finding look(std::span<const ComparedPoints> points, double observed_s);

  [[nodiscard]] bool exceeds() const noexcept { return exceeds_; }

 private:
  NoiseWatchOptions options_;
  bool exceeds_ = false;
  double looked_s_ = 0.0;
  double began_tau_s_ = 0.0;
};

// Watches rolling deviations against what was there before the window: since start less rolling,
// independent of the window but for what reaches over its beginning. What leaves the window while
// an alarm lasts, or up to a window after its end, does not enter the reference: the end of an
// alarm is a return to the noise from before it. Nothing is said before the reference has degrees
// of freedom, about a window and 10 tau after the start.
class GrowthWatch {
 public:
  // Throws std::invalid_argument with validate()'s sentence.
  explicit GrowthWatch(const NoiseWatchOptions& options = {});

  // Both curves of one RollingAllan, at one time.
  Finding look(std::span<const AllanPoint> since_start, std::span<const AllanPoint> rolling,
               double observed_s, double window_s);

  [[nodiscard]] bool grown() const noexcept { return watch_.exceeds(); }
  // What the last look compared with.
  [[nodiscard]] std::vector<AllanPoint> reference() const;

 private:
  // Of one tau: squares are pairs * deviation².
  struct Before {
    double tau_s = 0.0;
    double left_squares = 0.0;  // of all that ever left the window
    double left_pairs = 0.0;
    double squares = 0.0;  // of what entered the reference
    double pairs = 0.0;
    double degrees_of_freedom = 0.0;
  };
  void learn(std::span<const AllanPoint> since_start, std::span<const AllanPoint> rolling,
             bool enters);

  ExcessWatch watch_;
  std::vector<Before> before_;
  double closed_until_s_ = 0.0;  // observed time from which on the reference learns again
};

}  // namespace zerodrift::allan
