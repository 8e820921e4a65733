// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/options.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/compensation/drift_prior.h"
#include "common/compensation/option_keys.h"
#include "common/compensation/temperature_inputs.h"

namespace zerodrift::compensation {
namespace {

constexpr double kLabelInSpacings = 0.9;   // uneven spacing doesn't make two samples of a label
constexpr double kGapInSpacings = 2.5;     // one sample may be missing
constexpr double kWindowInSpacings = 8.0;  // of which the temperature rate needs six

// What OnlineSvr refuses beyond the ranges of single keys is refused here, by the configuration's
// key.
std::optional<std::string> find_contradiction(const ModelOptions& model) {
  // A tube that rounding would fill has no inside.
  regression::OnlineSvrOptions svr;
  svr.box_constraint = model.box_constraint;
  if (model.epsilon <= svr.kkt_bound()) {
    return "svr.epsilon: found " + short_text(model.epsilon) + ", expected more than " +
           short_text(svr.kkt_bound()) + ", 1e-9 box_constraint";
  }
  const regression::Kernel& kernel = model.kernel;
  if (kernel.kind != regression::KernelKind::kPolynomial) return std::nullopt;
  // Every k(x, x) is offset^degree at least, and would be refused above this.
  const double largest = regression::kLargestMagnitude;
  if (kernel.offset >= 0.0 && std::pow(kernel.offset, kernel.degree) <= largest)
    return std::nullopt;
  return "svr.offset: found " + short_text(kernel.offset) + ", expected 0 to " +
         short_text(std::pow(largest, 1.0 / kernel.degree));
}

// What the features' builder refuses of their scales, lags and probes.
std::optional<std::string> find_wrong_features(const CompensationOptions& options) {
  try {
    static_cast<void>(
        thermal::FeatureBuilder({options.features, options.temperature_stale_s}, options.probes()));
  } catch (const std::invalid_argument& refusal) {
    return refusal.what();
  }
  return std::nullopt;
}

std::optional<std::string> find_wrong_references(const CompensationOptions& options) {
  const ReferenceOptions& reference = options.reference;
  if (reference.await_feedback && reference.rest == ReferencePolicy::kRefuse)
    return "reference.await_feedback: found with rest: refuse, expected only with rest: accept";
  if (!options.learning.scale_factor) return std::nullopt;
  if (reference.truth == ReferencePolicy::kRefuse) {
    return "learning.scale_factor: found with reference.truth: refuse, expected only with truth: "
           "accept";
  }
  // What a filter finds left in motion is the scale factor's too: it would be taken off twice.
  if (reference.navigation_residual == ReferencePolicy::kAccept) {
    return "learning.scale_factor: found with reference.navigation_residual: accept, expected only "
           "with navigation_residual: refuse";
  }
  return std::nullopt;
}

}  // namespace

CompensationOptions::CompensationOptions() {
  features = {{.kind = thermal::FeatureKind::kTemperature, .probe = "coil"},
              {.kind = thermal::FeatureKind::kTemperatureRate, .probe = "coil"}};
  track.rate_method = thermal::RateMethod::kLocalPolynomial;
  model.kernel.kind = regression::KernelKind::kRbf;
  model.kernel.gamma = 0.3;
}

std::optional<std::string> CompensationOptions::validate() const {
  if (auto line = find_out_of_range(*this)) return line;
  if (auto line = find_contradiction(model)) return line;
  if (auto line = find_wrong_features(*this)) return line;
  if (auto line = Mounting::find_wrong(mounting)) return line;
  if (auto line = find_wrong_references(*this)) return line;
  if (prior) {
    if (auto line = find_wrong_prior(*prior)) return line;
  }
  if (auto line = track.validate()) return line;
  return TemperatureInputs::find_wrong(*this);
}

CompensationOptions CompensationOptions::for_samples_every(double interval_s) const {
  CompensationOptions own = *this;
  const bool is_slow = interval_s > kUsualLabelS && interval_s <= kSlowestSpacingS;
  double& label_s = own.learning.label_interval_s;
  if (label_s == 0.0)
    label_s = is_slow ? std::max(kUsualLabelS, kLabelInSpacings * interval_s) : kUsualLabelS;
  if (!is_slow) return own;
  const double gap_s = kGapInSpacings * interval_s;
  auto& polynomial = own.track.local_polynomial;
  polynomial.window_s = std::max(polynomial.window_s, kWindowInSpacings * interval_s);
  for (double* longest : {&polynomial.max_gap_s, &own.track.sliding_mean.max_gap_s,
                          &own.track.history_max_gap_s, &own.temperature_stale_s})
    *longest = std::max(*longest, gap_s);
  // The noise of a mean over so long is so much smaller than that of a second; the drift isn't.
  own.learning.rest.noise_slew_per_s *= std::sqrt(interval_s);
  return own;
}

std::vector<std::string> CompensationOptions::probes() const {
  std::vector<std::string> names;
  const auto note = [&](const std::string& name) {
    if (!name.empty() && std::find(names.begin(), names.end(), name) == names.end())
      names.push_back(name);
  };
  for (const auto& feature : features) {
    note(feature.probe);
    note(feature.second_probe);
  }
  for (const auto& name : more_probes) note(name);
  if (prior) {
    for (const auto& name : prior_probes(*prior, names)) note(name);
  }
  return names;
}

}  // namespace zerodrift::compensation
