// SPDX-License-Identifier: Apache-2.0
#include "common/config/compensation_config.h"

#include <algorithm>
#include <array>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "common/compensation/drift_prior.h"
#include "common/config/twin_config.h"
#include "common/config/yaml_to_proto.h"
#include "common/core/units.h"
#include "common/navigation/earth_rate.h"

namespace zerodrift::config {
namespace {

using compensation::CompensationOptions;

// One choice out of named ones; `key` is the path for the error line.
template <typename Choice, std::size_t N>
Choice choose(const YamlDocument& file, const std::string& key, const std::string& text,
              const std::array<std::pair<const char*, Choice>, N>& choices) {
  std::string known;
  for (const auto& [name, choice] : choices) {
    if (text == name) return choice;
    known += (known.empty() ? "" : ", ") + std::string(name);
  }
  throw file.error(key, "found '" + text + "', expected one of " + known);
}

constexpr std::array kSchemes{std::pair{"online-svr", compensation::Scheme::kOnlineSvr},
                              std::pair{"none", compensation::Scheme::kNone}};
constexpr std::array kWindows{std::pair{"two_tier", regression::WindowPolicy::kTwoTier},
                              std::pair{"fifo", regression::WindowPolicy::kFifo}};
constexpr std::array kKernels{std::pair{"rbf", regression::KernelKind::kRbf},
                              std::pair{"matern32", regression::KernelKind::kMatern32},
                              std::pair{"matern52", regression::KernelKind::kMatern52},
                              std::pair{"polynomial", regression::KernelKind::kPolynomial},
                              std::pair{"linear", regression::KernelKind::kLinear}};
using Selection = std::optional<regression::SelectionCriterion>;
constexpr std::array kSelections{
    std::pair{"marginal_likelihood",
              Selection(regression::SelectionCriterion::kMarginalLikelihood)},
    std::pair{"leave_one_out", Selection(regression::SelectionCriterion::kLeaveOneOut)},
    std::pair{"paper", Selection(regression::SelectionCriterion::kPaper)},
    std::pair{"fixed", Selection()}};
constexpr std::array kEarthRates{std::pair{"auto", compensation::EarthRateMode::kAuto},
                                 std::pair{"included", compensation::EarthRateMode::kIncluded},
                                 std::pair{"known", compensation::EarthRateMode::kKnown},
                                 std::pair{"unknown", compensation::EarthRateMode::kUnknown}};
constexpr std::array kPolicies{std::pair{"accept", compensation::ReferencePolicy::kAccept},
                               std::pair{"refuse", compensation::ReferencePolicy::kRefuse}};
constexpr std::array kEstimators{
    std::pair{"sliding_mean", thermal::RateMethod::kSlidingMean},
    std::pair{"local_polynomial", thermal::RateMethod::kLocalPolynomial}};
constexpr std::array kFeatures{
    std::pair{"temperature", thermal::FeatureKind::kTemperature},
    std::pair{"temperature_rate", thermal::FeatureKind::kTemperatureRate},
    std::pair{"temperature_times_rate", thermal::FeatureKind::kTemperatureTimesRate},
    std::pair{"lagged_temperature", thermal::FeatureKind::kLaggedTemperature},
    std::pair{"probe_difference", thermal::FeatureKind::kProbeDifference},
    std::pair{"pulse_mean", thermal::FeatureKind::kPulseMean},
    std::pair{"pulse_rate", thermal::FeatureKind::kPulseRate}};

void require_above_0(const YamlDocument& file, const char* key, double value) {
  if (value > 0.0) return;
  throw file.error(key, "found " + std::to_string(value) + ", expected a number above 0");
}

void require_within(const YamlDocument& file, const char* key, double value, int low, int high) {
  if (value >= low && value <= high) return;
  throw file.error(key, "found " + std::to_string(value) + ", expected " + std::to_string(low) +
                            " to " + std::to_string(high));
}

bool is_pulse(thermal::FeatureKind kind) {
  return kind == thermal::FeatureKind::kPulseMean || kind == thermal::FeatureKind::kPulseRate;
}

void read_features(const YamlDocument& file, const proto::CompensationConfig& in,
                   CompensationOptions& out) {
  if (in.features().empty()) return;
  out.features.clear();
  for (int i = 0; i < in.features_size(); ++i) {
    const proto::FeatureConfig& feature = in.features(i);
    thermal::FeatureSpec spec;
    spec.kind = choose(file, "features[" + std::to_string(i) + "].kind", feature.kind(), kFeatures);
    if (!is_pulse(spec.kind)) spec.probe = feature.probe().empty() ? "coil" : feature.probe();
    spec.second_probe = feature.second_probe();
    if (feature.has_lag_s()) spec.lag_s = feature.lag_s();
    if (feature.has_scale()) spec.scale = feature.scale();
    out.features.push_back(spec);
  }
}

void read_rate_estimator(const YamlDocument& file, const proto::TemperatureRateConfig& in,
                         CompensationOptions& out) {
  if (!in.estimator().empty()) {
    out.track.rate_method = choose(file, "temperature_rate.estimator", in.estimator(), kEstimators);
  }
  if (!in.has_window_s()) return;
  require_within(file, "temperature_rate.window_s", in.window_s(), 1, 3600);
  out.track.local_polynomial.window_s = in.window_s();
  out.track.sliding_mean.window_samples =
      static_cast<std::size_t>(in.window_s() * out.track.sliding_mean.sample_rate_hz);
}

// A key without effect on the kernel is a mistake about the kernel.
void read_kernel(const YamlDocument& file, const proto::SvrConfig& in, regression::Kernel& out) {
  using regression::KernelKind;
  if (!in.kernel().empty()) out.kind = choose(file, "svr.kernel", in.kernel(), kKernels);
  if (in.has_gamma() && out.kind == KernelKind::kLinear) {
    throw file.error("svr.gamma", "found a gamma of kernel linear, which has none");
  }
  for (const auto& [key, is_there] :
       {std::pair{"svr.degree", in.has_degree()}, std::pair{"svr.offset", in.has_offset()}}) {
    if (is_there && out.kind != KernelKind::kPolynomial) {
      throw file.error(key, "expected with kernel polynomial only");
    }
  }
  if (in.has_gamma()) out.gamma = in.gamma();
  if (in.has_degree()) out.degree = in.degree();
  if (in.has_offset()) out.offset = in.offset();
}

void read_model(const YamlDocument& file, const proto::SvrConfig& in, CompensationOptions& out) {
  if (in.has_capacity()) out.model.capacity = in.capacity();
  if (in.has_epsilon()) out.model.epsilon = in.epsilon();
  if (in.has_box_constraint()) out.model.box_constraint = in.box_constraint();
  read_kernel(file, in, out.model.kernel);
  if (!in.selection().empty()) {
    out.model.selection = choose(file, "svr.selection", in.selection(), kSelections);
  }
  if (!in.window().empty()) out.model.window = choose(file, "svr.window", in.window(), kWindows);
}

void read_learning(const YamlDocument& file, const proto::LearningConfig& in,
                   CompensationOptions& out) {
  if (in.has_label_interval_s()) out.learning.label_interval_s = in.label_interval_s();
  if (in.has_confirm_s()) out.learning.confirm_s = out.learning.rest.dwell_s = in.confirm_s();
  if (in.has_handover_s()) out.learning.handover_s = in.handover_s();
  if (in.has_max_drift_deg_h()) {
    require_above_0(file, "learning.max_drift_deg_h", in.max_drift_deg_h());
    out.learning.rest.max_level_radps = core::radps_from_deg_h(in.max_drift_deg_h());
  }
  if (in.has_max_drift_slew_deg_h_s()) {
    require_above_0(file, "learning.max_drift_slew_deg_h_s", in.max_drift_slew_deg_h_s());
    out.learning.rest.max_slew_radps2 = core::radps_from_deg_h(in.max_drift_slew_deg_h_s());
  }
}

void read_earth_rate(const YamlDocument& file, const proto::EarthRateConfig& in,
                     CompensationOptions& out) {
  if (in.mode().empty()) return;
  out.earth_rate.mode = choose(file, "earth_rate.mode", in.mode(), kEarthRates);
  if (out.earth_rate.mode != compensation::EarthRateMode::kKnown) return;
  if (!in.has_latitude_deg() || !in.has_roll_deg() || !in.has_pitch_deg() ||
      !in.has_heading_deg()) {
    throw file.error("earth_rate",
                     "mode known needs latitude_deg, roll_deg, pitch_deg and heading_deg");
  }
  require_within(file, "earth_rate.latitude_deg", in.latitude_deg(), -90, 90);
  const navigation::Attitude attitude{.roll_rad = in.roll_deg() * core::kRadPerDeg,
                                      .pitch_rad = in.pitch_deg() * core::kRadPerDeg,
                                      .heading_rad = in.heading_deg() * core::kRadPerDeg};
  out.earth_rate.rate_radps =
      navigation::earth_rate_radps_b(in.latitude_deg() * core::kRadPerDeg, attitude);
}

void read_reference(const YamlDocument& file, const proto::ReferenceConfig& in,
                    CompensationOptions& out) {
  compensation::ReferenceOptions& reference = out.reference;
  if (!in.truth().empty()) reference.truth = choose(file, "reference.truth", in.truth(), kPolicies);
  if (!in.rest().empty()) reference.rest = choose(file, "reference.rest", in.rest(), kPolicies);
  if (!in.navigation_residual().empty()) {
    reference.navigation_residual =
        choose(file, "reference.navigation_residual", in.navigation_residual(), kPolicies);
  }
  if (in.has_await_feedback()) reference.await_feedback = in.await_feedback();
  using core::radps_from_deg_h;
  if (in.has_largest_rest_sigma_deg_h())
    reference.largest_rest_sigma_radps = radps_from_deg_h(in.largest_rest_sigma_deg_h());
  if (in.has_largest_residual_sigma_deg_h())
    reference.largest_residual_sigma_radps = radps_from_deg_h(in.largest_residual_sigma_deg_h());
  if (in.has_innovation_sigmas()) reference.innovation_sigmas = in.innovation_sigmas();
  if (in.has_largest_correction_deg_h())
    reference.largest_correction_radps = radps_from_deg_h(in.largest_correction_deg_h());
  if (in.has_correction_slew_deg_h_s())
    reference.correction_slew_radps2 = radps_from_deg_h(in.correction_slew_deg_h_s());
  if (in.has_correction_memory_s()) reference.correction_memory_s = in.correction_memory_s();
}

std::vector<double> polynomial(const google::protobuf::RepeatedField<double>& coefficients_deg_h) {
  std::vector<double> result;
  for (const double value : coefficients_deg_h) result.push_back(core::radps_from_deg_h(value));
  return result;
}

// Lines that start with the wrong key ("key: what" or "key what"), as errors of this file.
ConfigError error_of(const YamlDocument& file, const std::string& line) {
  const auto end = std::min(line.find_first_of(": "), line.size());
  const auto what = std::min(line.find_first_not_of(": ", end), line.size());
  return file.error(line.substr(0, end), line.substr(what));
}

void check(const YamlDocument& file, const CompensationOptions& options) {
  if (const auto line = options.validate()) throw error_of(file, *line);
  try {
    const thermal::FeatureBuilder builder({.features = options.features}, options.probes());
  } catch (const std::invalid_argument& problem) {
    throw error_of(file, problem.what());
  }
}

}  // namespace

compensation::CompensationOptions load_compensation(const std::filesystem::path& path) {
  const YamlDocument file = YamlDocument::read(path);
  proto::CompensationConfig in;
  load_message(path, in);
  CompensationOptions out;
  if (!in.scheme().empty()) out.scheme = choose(file, "scheme", in.scheme(), kSchemes);
  read_features(file, in, out);
  read_rate_estimator(file, in.temperature_rate(), out);
  read_model(file, in.svr(), out);
  read_learning(file, in.learning(), out);
  read_earth_rate(file, in.earth_rate(), out);
  read_reference(file, in.reference(), out);
  out.factory_polynomial_radps = {polynomial(in.factory_polynomial().x_deg_h()),
                                  polynomial(in.factory_polynomial().y_deg_h()),
                                  polynomial(in.factory_polynomial().z_deg_h())};
  out.more_probes.assign(in.probes().begin(), in.probes().end());
  for (std::size_t i = 0; i < out.more_probes.size(); ++i) {
    if (out.more_probes[i].empty()) {
      throw file.error("probes[" + std::to_string(i) + "]", "found nothing, expected a name");
    }
  }
  if (!in.prior().empty()) out.prior = load_prior(path.parent_path() / in.prior());
  if (in.has_temperature_delay_s()) out.temperature_delay_s = in.temperature_delay_s();
  if (in.has_temperature_stale_s()) out.temperature_stale_s = in.temperature_stale_s();
  if (in.has_probe_stuck_s()) out.probe_stuck_s = in.probe_stuck_s();
  check(file, out);
  return out;
}

twin::Model load_prior(const std::filesystem::path& path) {
  std::error_code problem;
  if (std::filesystem::exists(path, problem)) {
    if (!std::filesystem::is_regular_file(path, problem)) {
      throw ConfigError(path.string() + ": found something else than a file, expected a model");
    }
    const std::uintmax_t size = std::filesystem::file_size(path, problem);
    if (problem || size > kLargestModelFile) {
      throw ConfigError(path.string() + ": found more bytes than a model has, expected at most " +
                        std::to_string(kLargestModelFile));
    }
  }
  twin::Model model = load_model(path).model;
  if (const auto line = compensation::find_wrong_prior(model)) {
    throw ConfigError(path.string() + ": " + *line);
  }
  return model;
}

}  // namespace zerodrift::config
