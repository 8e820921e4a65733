// SPDX-License-Identifier: Apache-2.0
// Several experts for the drift of one axis under one roof: each is judged at several ages of the
// newest label, and the forecast for an age is their mean with weights that this age has earned.
// Never a switch: who was best is rarely so for long.
//
// For each horizon h the forecasts made h ago are compared with each new label, before it is
// learned. With e_k the error of expert k, dt between two labels:
//   S_k <- a S_k + m e_k^2,  N <- a N + m,  a = exp(-m dt / (8 max(h, 30 dt)))
//   L_k(h) = -n/2 ln S_k,  n = 1 + N dt / h   (errors overlap), one ahead 1 + N / 2
//   weight_k ~ exp(sum of L_k over h and all shorter horizons)
// with m = 1, and behind a pause the labels that might have come in it, of a horizon at most,
// which is exponential weighting by the log-likelihood of errors whose variance is S_k / N. Shorter
// horizons count too, since of a long one eight independent errors are all that is remembered, and
// who is right a minute ahead is rarely wrong a quarter of an hour ahead. A horizon that was never
// judged borrows the weights that the longest one below it has by itself. Holding the last minute
// has one nat of credit.
//
// At the longest horizon two or three independent errors are ever seen. They alone decide between
// experts in time and those that map the temperature, since the former are good at short horizons
// by what they are; among each of the two all horizons count. The SVR has two nats there: far
// beyond what was seen it goes back to holding, where linear terms go on. Where the temperature is
// one that it has learned, maps have more (StackMean).
//
// The interval of a horizon is the 95 % quantile of the stack's own errors at it, less what the
// doubt of the temperature's effect makes room for (StackForecast::doubt), over the last eight
// horizons, wider by as much as Student's t is where few of them are independent: as many as there
// are horizons between them, two stops' two. It stands at the mean age that the forecasts had,
// which behind a pause is more than the horizon (StatedIntervals). All that times a factor that
// follows the share of labels which the intervals as they were stated missed (adaptive conformal
// inference: Gibbs & Candes, NeurIPS 2021):
//   ln factor += step (missed - 0.05),  step = dt / h, at most 0.02
// so that a horizon's worth of misses, which are one, weighs as one. Whatever the errors' law, the
// share of misses over n horizons is then within |change of ln factor| / n of 5 %.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/core/ring_buffer.h"
#include "common/core/state_archive.h"
#include "common/experts/expert.h"
#include "common/experts/kalman_bank.h"
#include "common/experts/linear_forecast.h"
#include "common/experts/past_forecasts.h"
#include "common/experts/stack_forecast.h"
#include "common/experts/stated_intervals.h"

namespace zerodrift::experts {

struct StackLabel {
  double time_s = 0.0;      // end of the label; strictly increasing but for restart()
  double duration_s = 0.0;  // > 0
  double drift = 0.0;
  double variance = 0.0;   // of the label as a measurement, > 0
  ThermalState thermal{};  // the mean over the label, or that of its end
};

// The mean of the labels of the last minute.
class Hold {
 public:
  void learn(const Labelled& label);
  [[nodiscard]] const LinearForecast& forecast() const noexcept { return forecast_; }
  void restart() noexcept { held_.clear(); }

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive);

 private:
  static constexpr double kWindowS = 60.0;
  struct Held {
    double time_s = 0.0;
    double drift = 0.0;

    void carry(core::StateArchive& archive) { archive(time_s, drift); }
  };
  void average() noexcept;

  core::RingBuffer<Held> held_{256};
  LinearForecast forecast_{};
};

// What the online SVR, which is not linear and is kept elsewhere, foretold of a label when its
// newest label was as old as each horizon; nothing where it did not know or is left out.
using Foretold = std::array<std::optional<SvrForecast>, kHorizons>;

// What the experts of a stack go by.
enum class GoesBy : std::uint8_t {
  kTimeAndTemperature,  // all of them
  kTime,                // those before kFirstMap: a label's thermal state is never read, no SVR
};

// One thread. 0.3 MB; learn() is O(banks), some microseconds, without allocation.
class ExpertStack {
 public:
  explicit ExpertStack(GoesBy goes_by = GoesBy::kTimeAndTemperature);

  void learn(const StackLabel& label, const Foretold& by_svr = {});
  // What it knows after its newest label.
  [[nodiscard]] const StackForecast& forecast() const noexcept { return forecast_; }
  // `expert` is one of its linear ones.
  [[nodiscard]] const LinearForecast& forecast(Expert expert) const noexcept;

  // The clock was set back, so that past forecasts have no age: the level is learned anew, what
  // drift owes to temperature and which expert is to be trusted stays.
  void restart() noexcept;
  // Forgets everything.
  void reset() noexcept;

  // Its state (core/state_archive.h): one that has read it goes on to the bit.
  void carry(core::StateArchive& archive);

 private:
  static constexpr std::size_t kKept = 31;  // past forecasts over a horizon
  static constexpr std::size_t kErrors = 256;
  struct Snapshot {
    std::vector<LinearForecast> expert;  // the linear ones
    StackMean mean{};
    StatedIntervals stated{};
    ThermalDoubt doubt{};

    void carry(core::StateArchive& archive) {
      for (LinearForecast& one : expert) archive(one);
      archive(mean, stated, doubt);
    }
  };
  struct Error {
    double size = 0.0;
    double independent = 0.0;  // how much of it doesn't overlap with the one before
    double log_age = 0.0;      // of the forecast, in s

    void carry(core::StateArchive& archive) { archive(size, independent, log_age); }
  };
  struct Judged {
    Judged(double horizon_s, std::size_t linear)
        : made(horizon_s, kKept, {.expert = std::vector<LinearForecast>(linear)}) {
      sorted.reserve(kErrors);
    }

    PastForecasts<Snapshot> made;
    std::array<double, kExperts> squares{};
    double count = 0.0;
    std::optional<double> noted_s{};          // end of the label of the newest error that was kept
    core::RingBuffer<Error> errors{kErrors};  // the stack's own, as they came
    std::vector<double> sorted{};             // their sizes
    double independent = 0.0;                 // of them
    double log_ages = 0.0;                    // of them, the sum
    double log_factor = 0.0;                  // of the interval's width
  };
  [[nodiscard]] bool is_of_horizon(std::size_t h, double age_s) const;
  void note_level(const StackLabel& label);
  void note_doubt();
  [[nodiscard]] double evidence_step_s(std::size_t h, double since_last_s) const;
  void judge(std::size_t h, const Snapshot& made, const StackLabel& label, const Basis& basis,
             const std::optional<SvrForecast>& by_svr);
  void note_error(std::size_t h, double time_s, double error, double age_s);
  void follow_misses(std::size_t h, double error, double stated_half_width);
  [[nodiscard]] static double error_room_s(std::size_t h);
  void measure_width(std::size_t h);
  [[nodiscard]] bool has_maps() const noexcept { return linear_ == kSvr; }
  [[nodiscard]] std::size_t experts() const noexcept { return has_maps() ? kExperts : linear_; }
  [[nodiscard]] std::array<double, kExperts> log_likelihood(std::size_t h) const;
  void weigh();
  void average(std::size_t h);
  void keep(std::size_t h);

  std::size_t linear_;  // linear experts that it has, the first of kLinearExperts
  std::uint64_t labels_ = 0;
  Hold hold_;
  std::vector<KalmanBank> banks_;  // of all but the first
  std::vector<Judged> judged_;     // by horizon
  StackForecast forecast_{};
};

}  // namespace zerodrift::experts
