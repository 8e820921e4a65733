// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/options.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <utility>

#include "common/compensation/drift_prior.h"

namespace zerodrift::compensation {
namespace {

std::string text(double value) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                 std::chars_format::general, 6)
                       .ptr;
  return {buffer.data(), end};
}

std::string wrong(const char* key, double found, const std::string& expected) {
  return std::string(key) + ": found " + text(found) + ", expected " + expected;
}

std::optional<std::string> positive(const char* key, double value) {
  if (std::isfinite(value) && value > 0.0) return std::nullopt;
  return wrong(key, value, "a number above 0");
}

struct Bounded {
  const char* key;
  double value, low, high;
};

std::optional<std::string> first_out_of_bounds(std::initializer_list<Bounded> all) {
  for (const auto& [key, value, low, high] : all) {
    if (!(value >= low && value <= high)) {
      return wrong(key, value, text(low) + " to " + text(high));
    }
  }
  return std::nullopt;
}

// All that OnlineSvr refuses is refused here, by the configuration's key.
std::optional<std::string> find_wrong(const ModelOptions& model) {
  const regression::Kernel& kernel = model.kernel;
  if (auto line =
          first_out_of_bounds({{"svr.capacity", static_cast<double>(model.capacity), 10.0, 5000.0},
                               {"svr.epsilon", model.epsilon, 1e-4, 1.0},
                               {"svr.box_constraint", model.box_constraint, 1e-3, 1e6},
                               {"svr.gamma", kernel.gamma, 1e-4, 1e4}})) {
    return line;
  }
  // A tube that rounding would fill has no inside.
  regression::OnlineSvrOptions svr;
  svr.box_constraint = model.box_constraint;
  const double kkt_bound = svr.kkt_bound();
  if (model.epsilon <= kkt_bound) {
    return wrong("svr.epsilon", model.epsilon,
                 "more than " + text(kkt_bound) + ", 1e-9 box_constraint");
  }
  if (kernel.kind != regression::KernelKind::kPolynomial) return std::nullopt;
  if (auto line =
          first_out_of_bounds({{"svr.degree", static_cast<double>(kernel.degree), 1.0, 8.0}})) {
    return line;
  }
  // Every k(x, x) is offset^degree at least, and would be refused above this.
  const double largest = regression::kLargestMagnitude;
  if (!(kernel.offset >= 0.0 && std::pow(kernel.offset, kernel.degree) <= largest)) {
    return wrong("svr.offset", kernel.offset,
                 "0 to " + text(std::pow(largest, 1.0 / kernel.degree)));
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
  for (const auto& [key, value] :
       {std::pair{"learning.label_interval_s", learning.label_interval_s},
        std::pair{"learning.handover_s", learning.handover_s},
        std::pair{"temperature_stale_s", temperature_stale_s},
        std::pair{"probe_stuck_s", probe_stuck_s}}) {
    if (auto line = positive(key, value)) return line;
  }
  if (auto line = first_out_of_bounds({{"temperature_delay_s", temperature_delay_s, 0.0, 10.0},
                                       {"learning.confirm_s", learning.confirm_s, 0.0, 600.0}})) {
    return line;
  }
  if (auto line = find_wrong(model)) return line;
  if (auto line = reference.validate()) return line;
  if (prior) {
    if (auto line = find_wrong_prior(*prior)) return line;
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
  for (const auto& name : more_probes) note(name);
  if (prior) {
    for (const auto& name : prior_probes(*prior, names)) note(name);
  }
  return names;
}

}  // namespace zerodrift::compensation
