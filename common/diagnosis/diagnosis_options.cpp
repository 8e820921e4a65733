// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/diagnosis_options.h"

namespace zerodrift::diagnosis {

std::optional<std::string> DiagnosisOptions::validate() const {
  if (!(false_names_per_record > 0.0 && false_names_per_record < 0.5)) {
    return "false_names_per_record is " + std::to_string(false_names_per_record) +
           ", must be inside (0, 0.5)";
  }
  if (most_effects < 1 || most_effects > 8)
    return "most_effects is " + std::to_string(most_effects) + ", must be 1 to 8";
  return std::nullopt;
}

}  // namespace zerodrift::diagnosis
