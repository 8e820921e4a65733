// SPDX-License-Identifier: Apache-2.0
// The JSON that `zerodrift diagnose --json` writes, as far as the design of an experiment needs it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/diagnosis/design.h"
#include "common/twin/model.h"

namespace zerodrift::services {

struct OpenFindings {
  std::vector<diagnosis::Question> questions{};
  std::vector<std::string> notes{};  // a line each: what no experiment can be designed for
};

// Throws config::ConfigError with one line: file, key, what was found, what would be right.
[[nodiscard]] OpenFindings read_findings(const std::filesystem::path& path,
                                         const twin::Model& model);
// The same of a text; `name` stands for the file's name in errors.
[[nodiscard]] OpenFindings findings_from(const std::string& text, const std::string& name,
                                         const twin::Model& model);

}  // namespace zerodrift::services
