// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/options.h"

#include <algorithm>
#include <cmath>

namespace zerodrift::compensation {
namespace {

std::optional<std::string> positive(const char* key, double value) {
  if (std::isfinite(value) && value > 0.0) return std::nullopt;
  return std::string(key) + ": found " + std::to_string(value) + ", expected a number above 0";
}

}  // namespace

CompensationOptions::CompensationOptions() {
  features = {{.kind = thermal::FeatureKind::kTemperature, .probe = "coil"},
              {.kind = thermal::FeatureKind::kTemperatureRate, .probe = "coil"}};
  track.rate_method = thermal::RateMethod::kLocalPolynomial;
  model.kernel.kind = regression::KernelKind::kRbf;
  model.kernel.gamma = 0.03;
}

std::optional<std::string> CompensationOptions::validate() const {
  for (const auto& [key, value] :
       {std::pair{"learning.label_interval_s", learning.label_interval_s},
        std::pair{"learning.handover_s", learning.handover_s},
        std::pair{"svr.epsilon", model.epsilon},
        std::pair{"svr.box_constraint", model.box_constraint},
        std::pair{"temperature_stale_s", temperature_stale_s},
        std::pair{"probe_stuck_s", probe_stuck_s},
        std::pair{"svr.rbf_gamma", model.kernel.gamma}}) {
    if (auto line = positive(key, value)) return line;
  }
  if (!(temperature_delay_s >= 0.0) || temperature_delay_s > 10.0) {
    return "temperature_delay_s: found " + std::to_string(temperature_delay_s) +
           ", expected 0 to 10";
  }
  if (!(learning.confirm_s >= 0.0) || learning.confirm_s > 600.0) {
    return "learning.confirm_s: found " + std::to_string(learning.confirm_s) +
           ", expected 0 to 600";
  }
  if (model.capacity < 10 || model.capacity > 5000) {
    return "svr.capacity: found " + std::to_string(model.capacity) + ", expected 10 to 5000";
  }
  return track.validate();
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
  return names;
}

}  // namespace zerodrift::compensation
