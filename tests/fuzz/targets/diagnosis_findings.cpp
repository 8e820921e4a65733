// SPDX-License-Identifier: Apache-2.0
// Input: the JSON of a diagnosis, as the design of an experiment reads it.
#include "common/config/config_error.h"
#include "services/zerodrift/design_findings.h"
#include "tests/fuzz/expectations.h"

namespace zerodrift::fuzz {

void diagnosis_findings(Bytes input) {
  try {
    const auto findings = services::findings_from(std::string(as_text(input)), "d.json", {});
    for (const auto& question : findings.questions)
      demand(question.explanations.size() > 1, "a question has two answers at least");
    for (const std::string& note : findings.notes) demand_one_line(note);
  } catch (const config::ConfigError& error) {
    demand_one_line(error.what());
  }
}

}  // namespace zerodrift::fuzz
