// SPDX-License-Identifier: Apache-2.0
// The forecast of one axis's drift from its newest label to any later instant:
//
//   drift(t) = held + change (f(x_t) - f_held) + level (f_held - held)
//
//   held    mean of the labels of the last stationary minute ("persistence")
//   f       the online SVR; f_held is its mean over the features of the same labels
//   change  0: what was measured last is held; 1: all that the model says has changed is believed
//   level   0: the gap between measurement and model stays; 1: it closes
//
// Nobody sets the two weights. They are learned test-then-train, for each age of the newest label
// on its own: models kept back for 8 s to an hour forecast every new label before it is learned,
// and the weights are those that would have served best (ridge regression towards the next shorter
// horizon's, in [0, 1]). A weight is used only where it has proved itself against holding, so that
// a forecast over a horizon is no worse than persistence over that horizon was found to be. Beyond
// what was learned (no sample within kDomainRadius) experience is kept apart and more of it is
// asked for.
//
// Everything here is one axis's, SI units, deterministic, without allocation after construction.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "common/compensation/label_builder.h"
#include "common/core/state_archive.h"
#include "common/core/time.h"
#include "common/regression/sample_domain.h"
#include "common/regression/svr_predictor.h"

namespace zerodrift::compensation {

// A feature vector this near to a learned one, in scaled features (7 °C, 0.7 °C/min), lies within
// what was learned.
inline constexpr double kDomainRadius = 0.7;

inline constexpr std::size_t kHorizons = 6;

// What an axis had learned by the end of its newest label.
struct DriftModel {
  DriftModel(std::size_t dimension, std::size_t capacity)
      : predictor(dimension, capacity), domain(dimension, capacity) {}

  [[nodiscard]] bool holds() const noexcept { return time != core::kNever; }
  // The clock was set back since its newest label, or the gyro was off: time has gone by, and
  // nobody knows how much.
  [[nodiscard]] bool is_of_unknown_age(core::SensorTime now) const noexcept { return now < time; }
  // Drift by the SVR alone, rad/s; only where trained. O(support vectors * dimension).
  [[nodiscard]] double predict(const FeatureArray& features) const noexcept;
  // O(samples * dimension).
  [[nodiscard]] bool has_learned_near(const FeatureArray& features) const noexcept;

  // Its state (core/state_archive.h) but for predictor and domain, and all of it.
  void carry_level(core::StateArchive& archive);
  void carry(core::StateArchive& archive);

  // End of the newest label; a later one than what it forecasts means that the label's age isn't
  // known.
  core::SensorTime time{core::kNever};
  double held_radps = 0.0;
  std::optional<double> held_slope_radps2{};  // of the labels of that minute; two are needed
  double held_variance = 0.0;                 // of held as a measurement, (rad/s)²
  // Of that what experience, which is of means of a whole minute, knows nothing of: the mean has
  // just begun. It follows from the learner's labels and is no part of the state.
  double unsettled_variance = 0.0;
  double predicted_held_radps = 0.0;  // f_held
  bool trained = false;               // the initial set is complete: f is there
  double offset_radps = 0.0;
  double scale_radps = 1.0;
  regression::SvrPredictor predictor;
  regression::SampleDomain domain;
};

struct ForecastWeights {
  double change = 0.0;
  double level = 0.0;

  [[nodiscard]] bool are_proved() const noexcept { return change > 0.0 || level > 0.0; }
  void carry(core::StateArchive& archive);
};

// Sums over judged labels of change², change * level, level², and of both times holding's error.
struct WeightEvidence {
  double change_change = 0.0, change_level = 0.0, level_level = 0.0;
  double change_error = 0.0, level_error = 0.0;
};

// The likeliest weights in [0, 1]², for a prior of (prior_change, 0) that counts for `ridge` in the
// sums' unit: the inner optimum if it lies there, else the best of the four edges.
[[nodiscard]] ForecastWeights likeliest_weights(const WeightEvidence& evidence, double ridge,
                                                double prior_change) noexcept;

// What experience says of forecasts at one horizon, within or beyond what was learned.
struct ForecastTrust {
  ForecastWeights weights;        // zeros unless proved
  double forecast_variance = -1;  // of such a forecast, (rad/s)²; negative: no experience
  double held_variance = -1;      // of holding

  void carry(core::StateArchive& archive);
};

// By horizon, shortest first.
struct TrustTable {
  std::array<ForecastTrust, kHorizons> learned;
  std::array<ForecastTrust, kHorizons> beyond;
  std::array<double, kHorizons> horizon_s{};  // at which the entries stand
  // Most that a forecast may differ from holding, rad/s: drift that never moved so far over such a
  // horizon is not believed to do it now. 0 without experience.
  std::array<double, kHorizons> largest_change_radps{};

  void carry(core::StateArchive& archive);
};

enum class ForecastKind : std::uint8_t {
  kModel,     // the model's change is in it
  kBeyond,    // held: the features lie beyond what was learned
  kStack,     // of several experts (axis_model.h)
  kUnproved,  // held: at this horizon the model did not predict better than holding
};

struct Forecast {
  ForecastKind kind = ForecastKind::kUnproved;
  bool beyond_learned = false;
  double drift_radps = 0.0;
  double variance = 0.0;  // (rad/s)²
};

// `model` must be trained, `now` not before its time. O(samples * dimension).
[[nodiscard]] Forecast forecast(const DriftModel& model, const TrustTable& trust,
                                const FeatureArray& features, core::SensorTime now) noexcept;

// Whether forecast() would say more than what is held.
[[nodiscard]] bool is_in_force(const DriftModel& model, const TrustTable& trust,
                               bool beyond_learned, core::SensorTime now) noexcept;

// Variance of holding the last stationary minute until `now`: as experienced, else growing like a
// random walk from the label's own.
[[nodiscard]] double held_variance(const DriftModel& model, const TrustTable& trust,
                                   core::SensorTime now) noexcept;
// The same for the longest time that is known of, as after a power-on.
[[nodiscard]] double longest_held_variance(const DriftModel& model,
                                           const TrustTable& trust) noexcept;

// One label of one axis, features ready.
struct JudgedLabel {
  core::SensorTime time;
  double drift_radps;
  double variance;  // of the label as a measurement, (rad/s)²
  const FeatureArray& features;
};

// Keeps old models back, lets them forecast new labels, and learns how far to trust them.
class ForecastJudge {
 public:
  // The shortest horizon is that of compensation at rest: about a label and its confirmation.
  ForecastJudge(double shortest_horizon_s, std::size_t dimension, std::size_t capacity);

  // The label is not yet known to any model. A horizon judges one label in an eighth of itself.
  // O(samples) for each horizon that does.
  void judge(const JudgedLabel& label) noexcept;

  // The model after the label: kept back where an older one has served its time. O(samples).
  void keep(const DriftModel& model) noexcept;

  [[nodiscard]] const TrustTable& trust() const noexcept { return table_; }
  // The clock was set back: models kept back no longer have an age. What was experienced stays.
  void restart() noexcept;
  void reset() noexcept;

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) {
    for (Horizon& horizon : horizons_) archive(horizon);
    archive(table_);
  }

  // Sums over the labels judged, fading over kMemoryWindows windows; a window is as long as the
  // horizon, for within it errors are one and the same.
  struct Experience {
    double windows = 0.0;
    double error_scale = 0.0;  // mean square of holding's error over the last window
    double scale_windows = 0.0;
    // Weighted by 1 / error_scale, so that one rough stretch does not outvote all others.
    double change_change = 0.0, change_level = 0.0, level_level = 0.0;
    double change_error = 0.0, level_error = 0.0;
    double forecast_loss = 0.0, held_loss = 0.0, model_loss = 0.0;
    // In (rad/s)², over a shorter memory.
    double forecast_square = 0.0, held_square = 0.0, square_weight = 0.0, label_variance = 0.0;
    ForecastWeights weights{};  // the best so far, proved or not

    void carry(core::StateArchive& archive);
  };

 private:
  struct Horizon {
    double age_s;  // a model is judged from this age to twice it
    DriftModel judged;
    DriftModel waiting;  // too young to be judged
    Experience learned{};
    Experience beyond{};
    double moved_square = 0.0;  // of holding's error, over a long memory
    double moved_weight = 0.0;
    double aged = 0.0;  // sum of the ages at which models were judged, s
    core::SensorTime last_judged{core::kNever};

    void carry(core::StateArchive& archive);
  };

  void judge(std::size_t horizon, const JudgedLabel& label) noexcept;
  void place_horizons() noexcept;
  [[nodiscard]] static ForecastTrust trust_of(const Experience& experience, bool proved) noexcept;

  std::vector<Horizon> horizons_;
  TrustTable table_;
};

}  // namespace zerodrift::compensation
