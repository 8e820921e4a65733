// SPDX-License-Identifier: Apache-2.0
// What the tables, the page and the JSON of a diagnosis say in the same words.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "services/zerodrift/diagnosis_run.h"

namespace zerodrift::services {

// Digits of a figure in a text or a table.
inline constexpr int kDiagnosisDigits = 3;

// One axis that was diagnosed.
struct Diagnosed {
  std::string axis;  // "x"
  const diagnosis::AxisDiagnosis& of;

  [[nodiscard]] std::string name() const { return "axis " + axis; }
};

using DiagnosedAxes = std::vector<Diagnosed>;

// Of a result that outlives them.
[[nodiscard]] DiagnosedAxes diagnosed_axes(const DiagnosisResult& result);

// "k * B_x^2 with k = 1.2e-06 ± 3e-08; 2 other formulas do nearly as well"
[[nodiscard]] std::string formula_text(const diagnosis::NamedEffect& summand);

// A rate in deg/h.
[[nodiscard]] std::string in_deg_per_hour(double radps);
// "rate_random_walk" as "rate random walk".
[[nodiscard]] std::string spelled_out(std::string_view key);

template <typename Items, typename Text>
[[nodiscard]] std::string joined(const Items& items, Text text, const char* separator = ", ") {
  std::string all;
  for (const auto& item : items) (all += all.empty() ? "" : separator) += text(item);
  return all;
}

[[nodiscard]] std::string joined(const std::vector<std::string>& items);

}  // namespace zerodrift::services
