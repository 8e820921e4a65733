// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/option_keys.h"

#include <algorithm>
#include <array>
#include <utility>

#include "common/core/require.h"

namespace zerodrift::compensation {
namespace {

using regression::KernelKind;
using regression::SelectionCriterion;
using regression::WindowPolicy;
using thermal::FeatureKind;
using thermal::RateMethod;

constexpr double kDegH = core::radps_from_deg_h(1.0);
constexpr OptionRange kAbove0{.low = 0.0, .above_low = true};
constexpr OptionRange kScale{.low = 1e-9, .high = 1e9};
constexpr OptionRange kDuration{.low = 0.0, .high = 1e6, .above_low = true};  // in s
constexpr double kLongestWindowS = 14400.0;                                   // of a slope
constexpr OptionRange kAnyDrift{.low = -1e6, .high = 1e6};                    // deg/h

// Names of an enum's values as the file has them, in the order of `values`.
template <typename Value, std::size_t N>
struct Names {
  std::array<std::string_view, N> names;
  std::array<Value, N> values;
};

constexpr Names<Scheme, 3> kSchemes{{"online-svr", "stack", "none"},
                                    {Scheme::kOnlineSvr, Scheme::kStack, Scheme::kNone}};
constexpr Names<FeatureKind, 7> kFeatures{
    {"temperature", "temperature_rate", "temperature_times_rate", "lagged_temperature",
     "probe_difference", "pulse_mean", "pulse_rate"},
    {FeatureKind::kTemperature, FeatureKind::kTemperatureRate, FeatureKind::kTemperatureTimesRate,
     FeatureKind::kLaggedTemperature, FeatureKind::kProbeDifference, FeatureKind::kPulseMean,
     FeatureKind::kPulseRate}};
constexpr Names<RateMethod, 2> kEstimators{
    {"sliding_mean", "local_polynomial"}, {RateMethod::kSlidingMean, RateMethod::kLocalPolynomial}};
constexpr Names<KernelKind, 5> kKernels{
    {"rbf", "matern32", "matern52", "polynomial", "linear"},
    {KernelKind::kRbf, KernelKind::kMatern32, KernelKind::kMatern52, KernelKind::kPolynomial,
     KernelKind::kLinear}};
constexpr Names<std::optional<SelectionCriterion>, 4> kSelections{
    {"marginal_likelihood", "leave_one_out", "paper", "fixed"},
    {SelectionCriterion::kMarginalLikelihood, SelectionCriterion::kLeaveOneOut,
     SelectionCriterion::kPaper, std::nullopt}};
constexpr Names<WindowPolicy, 2> kWindows{{"two_tier", "fifo"},
                                          {WindowPolicy::kTwoTier, WindowPolicy::kFifo}};
constexpr Names<EarthRateMode, 4> kEarthRates{{"auto", "included", "known", "unknown"},
                                              {EarthRateMode::kAuto, EarthRateMode::kIncluded,
                                               EarthRateMode::kKnown, EarthRateMode::kUnknown}};
constexpr Names<navigation::BodyFrame, 2> kBodyFrames{
    {"flu", "frd"},
    {navigation::BodyFrame::kForwardLeftUp, navigation::BodyFrame::kForwardRightDown}};
constexpr Names<ReferencePolicy, 2> kPolicies{{"accept", "refuse"},
                                              {ReferencePolicy::kAccept, ReferencePolicy::kRefuse}};

template <typename Value, std::size_t N>
void choose(OptionVisitor& visitor, const OptionKey& key, const Names<Value, N>& table,
            Value& value) {
  const auto found = std::find(table.values.begin(), table.values.end(), value);
  auto chosen = static_cast<std::size_t>(found - table.values.begin());
  visitor.choice(key, table.names, chosen);
  if (chosen < N) value = table.values[chosen];
}

// A key that sets more than one member; they may differ where code set them.
template <typename... Members>
void number_of_all(OptionVisitor& visitor, const OptionKey& key, double& first,
                   Members&... others) {
  double value = first;
  visitor.number(key, value);
  if (value == first) return;
  first = value;
  ((others = value), ...);
}

OptionKey internal(std::string name, Decides decides) {
  return {.name = std::move(name), .decides = decides, .internal = true};
}

void describe_features(CompensationOptions& options, OptionVisitor& visitor) {
  auto& features = options.features;
  const auto size = visitor.groups(
      "features",
      "The inputs of the regression, at most 12; a list that is given replaces the default.");
  if (size) features.assign(*size, {});
  for (std::size_t i = 0; i < features.size(); ++i) {
    thermal::FeatureSpec& feature = features[i];
    const std::string path = "features[" + std::to_string(i) + "].";
    choose(visitor,
           {.name = path + "kind",
            .decides = Decides::kModel,
            .text = "What the value is made of.",
            .required = true},
           kFeatures, feature.kind);
    const bool is_pulse =
        feature.kind == FeatureKind::kPulseMean || feature.kind == FeatureKind::kPulseRate;
    if (!is_pulse && feature.probe.empty()) feature.probe = "coil";
    visitor.text({path + "probe", Decides::kModel, "The thermometer; not for pulse terms."},
                 feature.probe);
    visitor.text({.name = path + "second_probe",
                  .decides = Decides::kModel,
                  .text = "For probe_difference: the thermometer that is taken off.",
                  .refused = feature.kind == FeatureKind::kProbeDifference
                                 ? nullptr
                                 : "expected with kind probe_difference only"},
                 feature.second_probe);
    visitor.number({path + "lag_s",
                    Decides::kModel,
                    "For lagged_temperature, which needs one: how long ago.",
                    {.low = 0.0, .high = thermal::kLongestLagS, .above_low = true},
                    1.0,
                    feature.kind == FeatureKind::kLaggedTemperature
                        ? nullptr
                        : "expected with kind lagged_temperature only"},
                   feature.lag_s);
    visitor.number(internal(path + "offset", Decides::kModel), feature.offset);
    visitor.number({path + "scale", Decides::kModel,
                    "The feature is its value over this; a kind has a usual one.", kScale},
                   feature.scale);
  }
}

void describe_temperature_rate(thermal::TemperatureTrackOptions& track, OptionVisitor& visitor) {
  visitor.section("temperature_rate", "How dT/dt is estimated.");
  choose(visitor,
         {"temperature_rate.estimator", Decides::kModel,
          "sliding_mean is the paper's and lags by half its window; local_polynomial has no lag."},
         kEstimators, track.rate_method);
  const double before_s = track.local_polynomial.window_s;
  visitor.number({"temperature_rate.window_s",
                  Decides::kModel,
                  "Readings of this long make one estimate; where samples are more than 5 s apart, "
                  "at least 8 of them.",
                  {.low = 1.0, .high = kLongestWindowS}},
                 track.local_polynomial.window_s);
  auto& mean = track.sliding_mean;
  if (track.local_polynomial.window_s != before_s) {
    // Seen before its range is checked: beyond it there is no such count.
    const double window_s =
        std::min(kLongestWindowS, std::max(1.0, track.local_polynomial.window_s));
    mean.window_samples = static_cast<std::size_t>(window_s * mean.sample_rate_hz);
  }
  auto& polynomial = track.local_polynomial;
  visitor.count(internal("temperature_rate.window_samples", Decides::kModel), mean.window_samples);
  visitor.number(internal("temperature_rate.sample_rate_hz", Decides::kModel), mean.sample_rate_hz);
  std::size_t degree = static_cast<std::size_t>(polynomial.degree);
  visitor.count(internal("temperature_rate.degree", Decides::kModel), degree);
  std::size_t bins = static_cast<std::size_t>(polynomial.bins);
  visitor.count(internal("temperature_rate.bins", Decides::kAnswers), bins);
  std::size_t min_bins = static_cast<std::size_t>(polynomial.min_bins);
  visitor.count(internal("temperature_rate.min_bins", Decides::kAnswers), min_bins);
  for (auto& [name, value] : {std::pair<const char*, double&>{"span_s", track.history_span_s},
                              {"step_s", track.history_step_s},
                              {"bridged_s", track.history_max_gap_s},
                              {"mean_gap_s", mean.max_gap_s},
                              {"polynomial_gap_s", polynomial.max_gap_s},
                              {"min_span_fraction", polynomial.min_span_fraction},
                              {"lowest_degc", track.min_temperature_degc},
                              {"highest_degc", track.max_temperature_degc}}) {
    visitor.number(internal(std::string("temperature_rate.") + name, Decides::kAnswers), value);
  }
}

void describe_model(ModelOptions& model, OptionVisitor& visitor) {
  visitor.section("svr", "The online support-vector regression of each axis.");
  visitor.count({"svr.capacity", Decides::kModel, "Samples kept an axis.", {10.0, 5000.0}},
                model.capacity);
  visitor.number({"svr.epsilon",
                  Decides::kModel,
                  "Tube half-width in units of the label scale, more than 1e-9 box_constraint.",
                  {1e-4, 1.0}},
                 model.epsilon);
  visitor.number(
      {"svr.box_constraint", Decides::kModel, "C in units of the label scale.", {1e-3, 1e6}},
      model.box_constraint);
  choose(visitor,
         {"svr.kernel", Decides::kModel, "The first kernel; selection may choose another one."},
         kKernels, model.kernel.kind);
  const bool is_linear = model.kernel.kind == KernelKind::kLinear;
  const char* only_polynomial = model.kernel.kind == KernelKind::kPolynomial
                                    ? nullptr
                                    : "expected with kernel polynomial only";
  visitor.number({"svr.gamma",
                  Decides::kModel,
                  "Per squared scaled feature; not for linear.",
                  {1e-4, 1e4},
                  1.0,
                  is_linear ? "found a gamma of kernel linear, which has none" : nullptr},
                 model.kernel.gamma);
  auto degree = static_cast<std::size_t>(model.kernel.degree);
  visitor.count(
      {"svr.degree", Decides::kModel, "For polynomial.", {1.0, 8.0}, 1.0, only_polynomial}, degree);
  model.kernel.degree = static_cast<int>(degree);
  visitor.number({"svr.offset",
                  Decides::kModel,
                  "For polynomial: from 0; offset^degree is at most 1e6.",
                  {},
                  1.0,
                  only_polynomial},
                 model.kernel.offset);
  choose(visitor,
         {"svr.selection", Decides::kModel,
          "By which kernel and gamma are chosen anew from time to time; paper is its eq. 7."},
         kSelections, model.selection);
  choose(visitor,
         {"svr.window", Decides::kModel,
          "Which sample a full window gives up: two_tier keeps the range, fifo the newest."},
         kWindows, model.window);
}

void describe_learning(LearningOptions& learning, OptionVisitor& visitor) {
  visitor.section("learning", "What is taken for drift, and when.");
  visitor.number(
      {"learning.label_interval_s",
       Decides::kModel,
       "A label is the mean over this long, stationary or against a reference; 0: 5 s, or nine "
       "tenths of the samples' spacing where that is longer.",
       {0.0, 1e6}},
      learning.label_interval_s);
  number_of_all(visitor,
                {"learning.confirm_s",
                 Decides::kAnswers,
                 "Stillness after a label before it may be learned.",
                 {0.0, 600.0}},
                learning.confirm_s, learning.rest.dwell_s);
  visitor.number({"learning.handover_s", Decides::kAnswers,
                  "Sensor time after which a learned model takes effect.", kDuration},
                 learning.handover_s);
  visitor.number({"learning.max_drift_deg_h", Decides::kAnswers,
                  "Without a reference, a larger level is taken for motion.", kAbove0, kDegH},
                 learning.rest.max_level_radps);
  visitor.number({"learning.max_drift_slew_deg_h_s", Decides::kAnswers,
                  "A faster change of the level is taken for motion; of a gyro so noisy that 0.05 "
                  "standard deviations of a one-second mean are more, one faster than these.",
                  kAbove0, kDegH},
                 learning.rest.max_slew_radps2);
  visitor.flag({"learning.scale_factor", Decides::kAnswers,
                "The scale factor's error is learned in motion against true rates, and taken off; "
                "at most 1 % of the rate."},
               learning.scale_factor);
  visitor.count(internal("learning.initial_labels", Decides::kModel), learning.initial_labels);
  auto& rest = learning.rest;
  visitor.number(internal("learning.rest.departure_sigmas", Decides::kAnswers),
                 rest.departure_sigmas);
  visitor.number(internal("learning.rest.noise_slew_per_s", Decides::kAnswers),
                 rest.noise_slew_per_s);
  visitor.number(internal("learning.rest.spread_ratio", Decides::kAnswers), rest.spread_ratio);
  visitor.count(internal("learning.rest.initial_blocks", Decides::kAnswers), rest.initial_blocks);
  visitor.number(internal("learning.rest.dwell_s", Decides::kAnswers), rest.dwell_s);
}

void describe_earth_rate(EarthRateOptions& earth, OptionVisitor& visitor) {
  visitor.section("earth_rate", "What becomes of Earth's rotation while no reference is there.");
  choose(visitor,
         {"earth_rate.mode", Decides::kModel,
          "auto: included for records and simulations, unknown for real sensors. included: Earth "
          "rate counts as drift, in one attitude. known: it is taken off with the angles below. "
          "unknown: an uncertainty of 15 deg/h."},
         kEarthRates, earth.mode);
  const char* only_known =
      earth.mode == EarthRateMode::kKnown ? nullptr : "expected with mode known only";
  visitor.number(
      {"earth_rate.latitude_deg", Decides::kAnswers, "For known.", {-90.0, 90.0}, 1.0, only_known},
      earth.latitude_deg);
  struct Angle {
    const char* name;
    OptionRange range;
    std::optional<double>& value;
  };
  for (const Angle& angle : {Angle{"roll", {-180.0, 180.0}, earth.roll_deg},
                             Angle{"pitch", {-90.0, 90.0}, earth.pitch_deg},
                             Angle{"heading", {-180.0, 360.0}, earth.heading_deg}}) {
    visitor.number({std::string("earth_rate.") + angle.name + "_deg", Decides::kAnswers,
                    "For known.", angle.range, 1.0, only_known},
                   angle.value);
  }
  choose(visitor,
         {"earth_rate.frame",
          Decides::kAnswers,
          "For known: whether the vehicle's axes, behind the mounting, are forward-left-up or "
          "forward-right-down. The angles are those of forward-right-down in either.",
          {},
          1.0,
          only_known},
         kBodyFrames, earth.frame);
  if (earth.mode != EarthRateMode::kKnown) return;
  for (const auto axis : core::kAxes) {
    visitor.number(
        internal("earth_rate." + std::string(core::name(axis)) + "_radps", Decides::kModel),
        earth.rate_radps[core::index(axis)]);
  }
}

void describe_reference(ReferenceOptions& reference, OptionVisitor& visitor) {
  visitor.section("reference", "What rate references may do.");
  choose(visitor, {"reference.truth", Decides::kAnswers, "A rate table's or a record's true rate."},
         kPolicies, reference.truth);
  choose(
      visitor,
      {"reference.rest", Decides::kAnswers, "A navigation filter's Earth rate while stationary."},
      kPolicies, reference.rest);
  choose(visitor,
         {"reference.navigation_residual", Decides::kAnswers,
          "A navigation filter's opinion of the drift in motion."},
         kPolicies, reference.navigation_residual);
  visitor.flag({"reference.await_feedback", Decides::kAnswers,
                "Records and simulations wait for rest references from the first sample on."},
               reference.await_feedback);
  struct Limit {
    const char* name;
    const char* text;
    OptionRange range;
    double si_per_unit;
    double& value;
  };
  for (const Limit& limit : {Limit{"largest_rest_sigma_deg_h",
                                   "A rest reference with a larger sigma is refused.",
                                   {0.0, 15.0},
                                   kDegH,
                                   reference.largest_rest_sigma_radps},
                             Limit{"largest_residual_sigma_deg_h",
                                   "A residual with a larger sigma is refused.",
                                   {0.0, 1e3},
                                   kDegH,
                                   reference.largest_residual_sigma_radps},
                             Limit{"innovation_sigmas",
                                   "A residual further off than this is refused.",
                                   {0.1, 100.0},
                                   1.0,
                                   reference.innovation_sigmas},
                             Limit{"largest_correction_deg_h",
                                   "Residuals shift the applied drift by at most this.",
                                   {0.0, 1e3},
                                   kDegH,
                                   reference.largest_correction_radps},
                             Limit{"correction_slew_deg_h_s",
                                   "And no faster than this.",
                                   {0.0, 1e3},
                                   kDegH,
                                   reference.correction_slew_radps2},
                             Limit{"correction_memory_s",
                                   "A shift without a new residual fades with this time.",
                                   {1.0, 1e6},
                                   1.0,
                                   reference.correction_memory_s}}) {
    visitor.number({std::string("reference.") + limit.name, Decides::kAnswers, limit.text,
                    limit.range, limit.si_per_unit},
                   limit.value);
  }
}

void describe_mounting(MountingOptions& mounting, OptionVisitor& visitor) {
  visitor.section("mounting",
                  "How the gyros sit in the vehicle; one of the three, or none. Rates, references "
                  "and the Earth's rate are then in the vehicle's frame b.");
  const auto key = [](const char* name, const char* text) {
    return OptionKey{.name = name, .decides = Decides::kModel, .text = text, .only_if_given = true};
  };
  visitor.texts(key("mounting.axes", "The gyro's axis that each of b's is, as [-y, x, z]."),
                mounting.axes);
  visitor.numbers(
      key("mounting.matrix",
          "Rate in b = matrix * the gyro's; nine numbers in one list, row by row, to 0.001."),
      mounting.matrix);
  visitor.numbers(key("mounting.general_matrix", "The same with axes not square, to 0.1."),
                  mounting.general_matrix);
}

}  // namespace

std::span<const std::string_view> scheme_names() {
  return kSchemes.names;
}

Scheme scheme_named(std::string_view name) {
  const auto found = std::find(kSchemes.names.begin(), kSchemes.names.end(), name);
  core::require(found != kSchemes.names.end(), "a scheme is one of scheme_names()");
  return kSchemes.values[static_cast<std::size_t>(found - kSchemes.names.begin())];
}

void describe(CompensationOptions& options, OptionVisitor& visitor) {
  choose(visitor,
         {"scheme", Decides::kModel,
          "What predicts the drift; stack weighs online-svr and Kalman filters with thermal memory "
          "by what they foretold."},
         kSchemes, options.scheme);
  describe_features(options, visitor);
  describe_temperature_rate(options.track, visitor);
  describe_model(options.model, visitor);
  describe_learning(options.learning, visitor);
  describe_earth_rate(options.earth_rate, visitor);
  visitor.section("factory_polynomial", "Drift by temperature as the factory measured it.");
  for (const auto axis : core::kAxes) {
    visitor.numbers(
        {"factory_polynomial." + std::string(core::name(axis)) + "_deg_h", Decides::kAnswers,
         "Coefficients of 1, T, T², ... with T in °C.", kAnyDrift, kDegH},
        options.factory_polynomial_radps[core::index(axis)]);
  }
  describe_reference(options.reference, visitor);
  describe_mounting(options.mounting, visitor);
  visitor.section("", "Temperatures and the prior.");
  visitor.number({"temperature_delay_s",
                  Decides::kAnswers,
                  "A rate sample at t uses temperatures stamped up to t less this.",
                  {0.0, 10.0}},
                 options.temperature_delay_s);
  visitor.number(
      {"temperature_stale_s", Decides::kAnswers,
       "With an older temperature the model is not used; where samples are more than 5 s "
       "apart, one older than 2.5 spacings.",
       kDuration},
      options.temperature_stale_s);
  visitor.number(
      {"probe_stuck_s", Decides::kAnswers,
       "A probe unchanged to the bit for this long while others move is not used; with more than "
       "one probe at most 999940.",
       kDuration},
      options.probe_stuck_s);
  visitor.texts(
      {"probes", Decides::kAnswers, "Thermometers also listened to, for a model adopted later."},
      options.more_probes);
  visitor.model({"prior", Decides::kModel,
                 "A twin's model file, path relative to this file: drift = model + what is learned "
                 "of the remainder."},
                options.prior);
}

}  // namespace zerodrift::compensation
