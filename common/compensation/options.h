// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/compensation/mounting.h"
#include "common/compensation/reference_screen.h"
#include "common/compensation/rest_gate.h"
#include "common/core/axis.h"
#include "common/core/units.h"
#include "common/navigation/earth_rate.h"
#include "common/regression/kernel_selection.h"
#include "common/regression/online_svr.h"
#include "common/thermal/features.h"
#include "common/thermal/temperature_track.h"
#include "common/twin/model.h"

namespace zerodrift::compensation {

enum class Scheme : std::uint8_t {
  kNone,
  kOnlineSvr,
  kStack,  // the online SVR and banks of Kalman filters, weighed by the age of the newest label
};

// What becomes of Earth's rotation while the gyro stands still and no reference is there.
enum class EarthRateMode : std::uint8_t {
  kAuto,  // kIncluded for records and simulations (whose format says: no reference column, no true
          // rate), kUnknown for real sensors
  kIncluded,  // counts as drift: a static test in one attitude
  kKnown,     // taken off with latitude and attitude
  kUnknown,   // an uncertainty; only a gyro noisier than Earth rate learns at rest
};

struct EarthRateOptions {
  EarthRateMode mode = EarthRateMode::kAuto;
  // For kKnown: where and how the gyro stands, as configured, and what follows from it in frame b.
  std::optional<double> latitude_deg{};
  std::optional<double> roll_deg{};
  std::optional<double> pitch_deg{};
  std::optional<double> heading_deg{};
  navigation::BodyFrame frame = navigation::BodyFrame::kForwardLeftUp;  // of b, behind the mounting
  core::PerAxis<double> rate_radps{};
};

inline constexpr double kUsualLabelS = 5.0;
inline constexpr double kSlowestSpacingS = 1800.0;  // of samples that can be learned from

struct LearningOptions {
  // A label is the mean over this long; 0: kUsualLabelS, or nine tenths of the samples' spacing
  // where that is longer (CompensationOptions::for_samples_every).
  double label_interval_s = 0.0;
  double confirm_s = 5.0;   // stillness after a label before it may be learned: its last second may
                            // already have held the beginning of a turn
  double handover_s = 1.0;  // sensor time from a label's confirmation to the model's taking effect
  std::size_t initial_labels = 12;  // the initial set
  bool scale_factor = false;        // learn it in motion against true rates, and take it off
  RestGateOptions rest;
};

// The model's units: a label is (drift - offset) / scale with scale = 100 standard deviations of a
// label, so that the tube half-width epsilon is in hundredths of them and one setting serves every
// class of gyro.
struct ModelOptions {
  std::size_t capacity = 500;
  double epsilon = 0.01;
  double box_constraint = 1000.0;
  regression::Kernel kernel{};  // the first one; options.cpp sets the defaults
  // By which the learner chooses kernel and gamma anew from time to time; nothing: they stay.
  std::optional<regression::SelectionCriterion> selection =
      regression::SelectionCriterion::kMarginalLikelihood;
  regression::WindowPolicy window = regression::WindowPolicy::kTwoTier;
};

struct CompensationOptions {
  Scheme scheme = Scheme::kStack;
  std::vector<thermal::FeatureSpec>
      features;  // default: temperature and temperature rate of probe coil
  thermal::TemperatureTrackOptions track;  // default: local polynomial over 60 s
  ModelOptions model;
  LearningOptions learning;
  EarthRateOptions earth_rate;
  ReferenceOptions reference;
  MountingOptions mounting;
  core::PerAxis<std::vector<double>>
      factory_polynomial_radps;  // coefficients of 1, T, T², ... (T in °C); may be empty
  // The twin's model that drift is predicted by before anything is learned (drift_prior.h); what is
  // learned is then the remainder.
  std::optional<twin::Model> prior{};
  // To be listened to besides those that features and prior read: for a model adopted later.
  std::vector<std::string> more_probes{};
  double temperature_delay_s = 0.05;  // a rate sample at t uses temperatures stamped up to t -
                                      // this, so that jitter below it never changes a result
  double temperature_stale_s = 30.0;
  double probe_stuck_s = 900.0;

  CompensationOptions();
  // Nothing when usable, else one line that names the wrong key.
  [[nodiscard]] std::optional<std::string> validate() const;
  // These options for a stream with a sample every `interval_s`, as its first one says. What is
  // given holds; a label interval left open gets its value. Where samples are further apart than a
  // usual label, what spans several of them is as long as that takes: the window and the gaps of
  // the temperature rate, the age of a temperature, and the change of level in a block that is
  // drift. An interval that is no number from 0 to kSlowestSpacingS counts as a usual one.
  [[nodiscard]] CompensationOptions for_samples_every(double interval_s) const;
  // Names of the probes that features need, in order of first use; then more_probes, then those
  // that only the prior reads.
  [[nodiscard]] std::vector<std::string> probes() const;
};

}  // namespace zerodrift::compensation
