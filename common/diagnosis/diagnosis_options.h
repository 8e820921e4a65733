// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>

namespace zerodrift::diagnosis {

struct DiagnosisOptions {
  double false_names_per_record = 0.02;  // accepted rate on records in which nothing is missing
  std::size_t most_effects = 4;          // added to an axis
  std::string record{};                  // for the origin of what is added
  std::string date{};

  // Names the first wrong key.
  [[nodiscard]] std::optional<std::string> validate() const;
};

}  // namespace zerodrift::diagnosis
