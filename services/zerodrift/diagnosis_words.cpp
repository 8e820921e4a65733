// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/diagnosis_words.h"

#include <algorithm>

#include "common/core/units.h"
#include "common/report/numbers.h"

namespace zerodrift::services {

DiagnosedAxes diagnosed_axes(const DiagnosisResult& result) {
  DiagnosedAxes axes;
  for (const auto axis : core::kAxes) {
    if (const auto& one = result.diagnosis.axes[core::index(axis)])
      axes.push_back({std::string(core::name(axis)), *one});
  }
  return axes;
}

std::string formula_text(const diagnosis::NamedEffect& summand) {
  const std::string values = joined(summand.parameters, [&](const auto& parameter) {
    const auto& [name, value] = parameter;
    const auto error = summand.standard_errors.find(name);
    std::string text = name + " = " + report::significant(value, kDiagnosisDigits);
    if (error != summand.standard_errors.end())
      text += " ± " + report::significant(error->second, 2);
    return text;
  });
  const std::size_t others = summand.alternatives.size();
  return summand.formula + " with " + values +
         (others == 0   ? ""
          : others == 1 ? "; another formula does nearly as well"
                        : "; " + std::to_string(others) + " other formulas do nearly as well");
}

std::string in_deg_per_hour(double radps) {
  return report::significant(core::deg_h_from_radps(radps), kDiagnosisDigits);
}

std::string spelled_out(std::string_view key) {
  std::string text(key);
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

std::string joined(const std::vector<std::string>& items) {
  return joined(items, [](const std::string& item) { return item; });
}

}  // namespace zerodrift::services
