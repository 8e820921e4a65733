// SPDX-License-Identifier: Apache-2.0
#include "common/checkpoint/deciding_options.h"

#include <array>
#include <charconv>
#include <optional>

#include "common/compensation/drift_prior.h"

namespace zerodrift::checkpoint {
namespace {

std::string text(double value) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  return {buffer.data(), end};
}

std::string text(regression::KernelKind kind) {
  switch (kind) {
    case regression::KernelKind::kRbf:
      return "rbf";
    case regression::KernelKind::kMatern32:
      return "matern32";
    case regression::KernelKind::kMatern52:
      return "matern52";
    case regression::KernelKind::kPolynomial:
      return "polynomial";
    case regression::KernelKind::kLinear:
      return "linear";
  }
  return "unknown";
}

std::string text(std::optional<regression::SelectionCriterion> selection) {
  if (!selection) return "fixed";
  switch (*selection) {
    case regression::SelectionCriterion::kPaper:
      return "paper";
    case regression::SelectionCriterion::kMarginalLikelihood:
      return "marginal_likelihood";
    case regression::SelectionCriterion::kLeaveOneOut:
      return "leave_one_out";
  }
  return "unknown";
}

std::string text(compensation::EarthRateMode mode) {
  switch (mode) {
    case compensation::EarthRateMode::kAuto:
      return "auto";
    case compensation::EarthRateMode::kIncluded:
      return "included";
    case compensation::EarthRateMode::kKnown:
      return "known";
    case compensation::EarthRateMode::kUnknown:
      return "unknown";
  }
  return "unknown";
}

std::string text(compensation::ReferencePolicy policy) {
  return policy == compensation::ReferencePolicy::kAccept ? "accept" : "refuse";
}

// "temperature of coil, offset 0, scale 10"
std::string text(const thermal::FeatureSpec& feature) {
  std::string line(thermal::name(feature.kind));
  if (!feature.probe.empty()) line += " of " + feature.probe;
  if (!feature.second_probe.empty()) line += " less " + feature.second_probe;
  if (feature.lag_s != 0.0) line += ", lag_s " + text(feature.lag_s);
  if (feature.offset != 0.0) line += ", offset " + text(feature.offset);
  return line + ", scale " + text(feature.scale.value_or(thermal::default_scale(feature.kind)));
}

// In one line, because only the estimator in use counts.
std::string text(const thermal::TemperatureTrackOptions& track) {
  if (track.rate_method == thermal::RateMethod::kSlidingMean) {
    const auto& mean = track.sliding_mean;
    return "sliding_mean, " + std::to_string(mean.window_samples) + " samples at " +
           text(mean.sample_rate_hz) + " Hz";
  }
  const auto& polynomial = track.local_polynomial;
  return "local_polynomial, degree " + std::to_string(polynomial.degree) + ", window_s " +
         text(polynomial.window_s);
}

}  // namespace

std::vector<DecidingOption> deciding_options(const compensation::CompensationOptions& options) {
  std::vector<DecidingOption> all;
  for (std::size_t i = 0; i < options.features.size(); ++i)
    all.push_back({"features[" + std::to_string(i) + "]", text(options.features[i])});
  const auto& [capacity, epsilon, box_constraint, kernel, selection, window] = options.model;
  all.push_back({"temperature_rate", text(options.track)});
  all.push_back({"svr.capacity", std::to_string(capacity)});
  all.push_back({"svr.epsilon", text(epsilon)});
  all.push_back({"svr.box_constraint", text(box_constraint)});
  all.push_back({"svr.kernel", text(kernel.kind)});
  all.push_back({"svr.gamma", text(kernel.gamma)});
  all.push_back({"svr.degree", std::to_string(kernel.degree)});
  all.push_back({"svr.offset", text(kernel.offset)});
  all.push_back({"svr.selection", text(selection)});
  all.push_back({"svr.window", window == regression::WindowPolicy::kFifo ? "fifo" : "two_tier"});
  all.push_back({"learning.label_interval_s", text(options.learning.label_interval_s)});
  all.push_back({"learning.initial_labels", std::to_string(options.learning.initial_labels)});
  all.push_back({"earth_rate.mode", text(options.earth_rate.mode)});
  if (options.earth_rate.mode == compensation::EarthRateMode::kKnown) {
    for (const auto axis : core::kAxes) {
      all.push_back({"earth_rate." + std::string(core::name(axis)) + " [rad/s]",
                     text(options.earth_rate.rate_radps[core::index(axis)])});
    }
  }
  // Last, and without one not at all: files from before there were priors can still be continued.
  if (options.prior) all.push_back({"prior", compensation::prior_identity(*options.prior)});
  return all;
}

std::vector<DecidingOption> path_options(const compensation::CompensationOptions& options) {
  std::string probes;
  for (const auto& probe : options.probes()) probes += (probes.empty() ? "" : ", ") + probe;
  const auto& learning = options.learning;
  const auto& rest = learning.rest;
  const auto& track = options.track;
  std::vector<DecidingOption> all{
      {"scheme", options.scheme == compensation::Scheme::kNone ? "none" : "online_svr"},
      {"probes", probes},
      {"learning.confirm_s", text(learning.confirm_s)},
      {"learning.handover_s", text(learning.handover_s)},
      {"learning.rest.departure_sigmas", text(rest.departure_sigmas)},
      {"learning.rest.max_slew", text(rest.max_slew_radps2)},
      {"learning.rest.noise_slew", text(rest.noise_slew_per_s)},
      {"learning.rest.max_level", text(rest.max_level_radps)},
      {"learning.rest.spread_ratio", text(rest.spread_ratio)},
      {"learning.rest.initial_blocks", std::to_string(rest.initial_blocks)},
      {"learning.rest.dwell_s", text(rest.dwell_s)},
      {"temperature_rate.span_s", text(track.history_span_s)},
      {"temperature_rate.step_s", text(track.history_step_s)},
      {"temperature_rate.bridged_s", text(track.history_max_gap_s)},
      {"temperature_rate.gaps_s",
       text(track.sliding_mean.max_gap_s) + ", " + text(track.local_polynomial.max_gap_s)},
      {"temperature_rate.bins", std::to_string(track.local_polynomial.bins) + ", " +
                                    std::to_string(track.local_polynomial.min_bins) + ", " +
                                    text(track.local_polynomial.min_span_fraction)},
      {"temperature_rate.range_degc",
       text(track.min_temperature_degc) + " to " + text(track.max_temperature_degc)},
      {"reference.truth", text(options.reference.truth)},
      {"reference.rest", text(options.reference.rest)},
      {"reference.navigation_residual", text(options.reference.navigation_residual)},
      {"reference.await_feedback", options.reference.await_feedback ? "true" : "false"},
      {"reference.largest_rest_sigma", text(options.reference.largest_rest_sigma_radps)},
      {"reference.largest_residual_sigma", text(options.reference.largest_residual_sigma_radps)},
      {"reference.innovation_sigmas", text(options.reference.innovation_sigmas)},
      {"reference.largest_correction", text(options.reference.largest_correction_radps)},
      {"reference.correction_slew", text(options.reference.correction_slew_radps2)},
      {"reference.correction_memory_s", text(options.reference.correction_memory_s)},
      {"temperature_delay_s", text(options.temperature_delay_s)},
      {"temperature_stale_s", text(options.temperature_stale_s)},
      {"probe_stuck_s", text(options.probe_stuck_s)}};
  for (const auto axis : core::kAxes) {
    std::string polynomial;
    for (const double c : options.factory_polynomial_radps[core::index(axis)])
      polynomial += (polynomial.empty() ? "" : ", ") + text(c);
    all.push_back({"factory_polynomial." + std::string(core::name(axis)), polynomial});
  }
  return all;
}

}  // namespace zerodrift::checkpoint
