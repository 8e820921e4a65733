// SPDX-License-Identifier: Apache-2.0
#include "common/regression/online_svr_options.h"

#include <algorithm>
#include <cmath>

namespace zerodrift::regression {
namespace {

std::string wrong(const std::string& key, const std::string& found, const std::string& expected) {
  return key + ": found " + found + ", expected " + expected;
}

bool is_positive(double value) {
  return std::isfinite(value) && value > 0.0;
}

}  // namespace

double OnlineSvrOptions::kkt_bound() const noexcept {
  return kkt_tolerance * std::max(1.0, box_constraint);
}

bool OnlineSvrOptions::is_weight(double weight) const noexcept {
  return weight > 0.0 && weight <= 1.0 && std::isnormal(weight * box_constraint);
}

std::optional<std::string> OnlineSvrOptions::validate() const {
  if (dimension < 1 || dimension > kMaxDimension) {
    return wrong("dimension", std::to_string(dimension), "1 to " + std::to_string(kMaxDimension));
  }
  if (capacity < 2) return wrong("capacity", std::to_string(capacity), "at least 2");
  if (auto error = kernel.validate()) return error;
  if (!is_positive(epsilon)) return wrong("epsilon", std::to_string(epsilon), "a number above 0");
  if (!is_positive(box_constraint)) {
    return wrong("box_constraint", std::to_string(box_constraint), "a number above 0");
  }
  if (!is_positive(kkt_tolerance)) {
    return wrong("kkt_tolerance", std::to_string(kkt_tolerance), "a number above 0");
  }
  if (!(epsilon > kkt_bound())) {
    return wrong("epsilon", std::to_string(epsilon), "more than kkt_tolerance max(1, C)");
  }
  if (event_budget < 1) return wrong("event_budget", "0", "at least 1");
  if (window == WindowPolicy::kTwoTier && (recent_capacity < 1 || recent_capacity >= capacity)) {
    return wrong("recent_capacity", std::to_string(recent_capacity), "1 to capacity - 1");
  }
  return std::nullopt;
}

}  // namespace zerodrift::regression
