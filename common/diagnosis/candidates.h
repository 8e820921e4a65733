// SPDX-License-Identifier: Apache-2.0
// What could be missing from a model: every deterministic effect of the catalogue that the model
// lacks and the record can show, in all its variants (which temperature, which lag, which shape),
// as columns of a regression made by running the twin's own effect with unit amplitudes.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/finding.h"
#include "common/diagnosis/measured_series.h"
#include "common/diagnosis/needs.h"
#include "common/diagnosis/oscillation_scan.h"
#include "common/diagnosis/playback.h"
#include "common/diagnosis/step_scan.h"
#include "common/twin/effect.h"
#include "common/twin/effect_catalogue.h"
#include "common/twin/model.h"

namespace zerodrift::diagnosis {

// One choice of an effect's inner parameters.
struct Variant {
  std::vector<twin::TemperaturePoint> inputs{};
  twin::Parameters shapes{};  // kShape parameters by name
  // Natural logarithm of its share among all that were looked at; of a scan only the peaks are
  // here.
  double log_prior = 0.0;
};

struct Candidate {
  twin::DefinitionPtr definition{};
  core::Axis axis = core::Axis::kX;
  // Names of the kAmplitude parameters, one a column. None: the effect has a size of its own and
  // makes one column, whose amplitude must come out near 1.
  std::vector<std::string> amplitudes{};
  twin::Parameters conventions{};  // kConvention parameters taken from the model
  std::vector<Variant> variants{};
  bool is_listed = false;  // in the model, without coefficients yet
};

struct Candidates {
  std::vector<Candidate> testable{};
  std::vector<NotTestable> not_testable{};
};

// Where the residual oscillates and where it steps: which frequencies, periods and times are worth
// a variant.
struct Scans {
  OscillationPeaks lines{};                    // Hz
  std::vector<Cycle> cycles{};                 // one or two at each of these
  twin::PerPoint<OscillationPeaks> fringes{};  // cycles per °C, of measured places
  OscillationPeaks resets{};                   // cycles per rad turned through
  StepPlaces steps{};                          // intervals since the record's start
};

// `weighted`: residual of the axis divided by its noise covariance, 0 where it isn't valid;
// `variances`: that covariance's eigenvalues in the cosine transform, of the record or its
// beginning. O(samples * some thousand frequencies).
[[nodiscard]] Scans scan_residual(std::span<const double> weighted,
                                  std::span<const double> variances, const Playback& playback,
                                  core::Axis axis);

// Effects that the model lists for the axis with parameters are left out: they are refitted, not
// named. Those listed without are among the candidates, but their needs are not stated a second
// time. What an effect takes from another one of the model (T_ref, b') comes from there.
[[nodiscard]] Candidates candidates(const MeasuredSeries& series, const Playback& playback,
                                    const twin::Model& model, core::Axis axis, const Scans& scans);

// An effect that the model lists without coefficients, at the temperatures that it is listed with
// if there are any. Nothing where the record can't test it or the search needs a scan for its
// shape.
[[nodiscard]] std::optional<Candidate> listed_candidate(const twin::EffectSpec& spec,
                                                        const MeasuredSeries& series,
                                                        const Playback& playback,
                                                        const twin::Model& model);

// Half of the width of the widest loop that a temperature with this course goes through, °C: wider
// ones hardly turn, and look like a straight line.
[[nodiscard]] double widest_loop_degc(const std::vector<double>& course_degc);

// A found effect as a model lists it, without standard errors and origin.
[[nodiscard]] twin::EffectSpec spec_of(const NamedEffect& effect, core::Axis axis);

// One column for each amplitude: what the effect adds for an amplitude of 1 in its own unit, rad/s;
// without amplitudes one column, the effect as it is.
[[nodiscard]] std::vector<std::vector<double>> columns_of(const Playback& playback,
                                                          const twin::EffectDefinition& definition,
                                                          const twin::EffectContext& context);
// That of one amplitude.
[[nodiscard]] std::vector<double> column_of(const Playback& playback,
                                            const twin::EffectDefinition& definition,
                                            twin::EffectContext context,
                                            const std::string& amplitude);
[[nodiscard]] twin::EffectContext context_of(const Candidate& candidate, const Variant& variant,
                                             double interval_s);

}  // namespace zerodrift::diagnosis
