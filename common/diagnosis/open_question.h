// SPDX-License-Identifier: Apache-2.0
// What a diagnosis left open, as questions to another record.
#pragma once

#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/finding.h"
#include "common/twin/model.h"

namespace zerodrift::diagnosis {

// One of the answers to a question. Without a name: nothing is missing.
struct Explanation {
  NamedEffect effect{};  // at its fitted size
  double probability = 0.0;

  [[nodiscard]] bool is_nothing() const { return effect.name.empty(); }
  [[nodiscard]] std::string name() const { return is_nothing() ? "nothing" : effect.name; }
};

// What is missing on an axis: one of these. They sum to 1.
struct Question {
  core::Axis axis = core::Axis::kX;
  twin::Model model;  // with what was found on the axis beside it
  std::vector<Explanation> explanations{};
  // The catalogue's names of what the diagnosis excluded and looks like them: they share what is
  // beyond the credible set.
  std::vector<std::string> look_alikes{};
  std::vector<std::string> left_out{};  // that no experiment can be run with: noise, and what the
                                        // catalogue doesn't know
};

// Nothing of the axes on which nothing is open. What was taken back rivals nothing, of which the
// findings give no probability: it is taken to be one half. An event does not come again: in
// another record it is nothing too.
[[nodiscard]] std::vector<Question> open_questions(const twin::Model& model, core::Axis axis,
                                                   const std::vector<NamedEffect>& effects,
                                                   const std::vector<NamedEffect>& taken_back);

}  // namespace zerodrift::diagnosis
