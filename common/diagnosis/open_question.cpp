// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/open_question.h"

#include <algorithm>
#include <set>
#include <utility>

#include "common/diagnosis/held_out.h"
#include "common/diagnosis/separation.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {
namespace {

void add_nothing(Question& question, double probability) {
  for (Explanation& explanation : question.explanations) {
    if (!explanation.is_nothing()) continue;
    explanation.probability += probability;
    return;
  }
  question.explanations.push_back({.probability = probability});
}

void take_alternatives(Question& question, const NamedEffect& effect) {
  const auto add = [&](NamedEffect candidate, double probability) {
    if (happens_once(spec_of(candidate, question.axis))) return add_nothing(question, probability);
    const auto definition = twin::definition_of(spec_of(candidate, question.axis));
    const bool is_sized = !candidate.parameters.empty();
    if (definition == nullptr || !is_waveform(*definition) || !is_sized ||
        spec_of(candidate, question.axis).find_problem()) {
      question.left_out.push_back(candidate.name);
      return;
    }
    question.explanations.push_back({std::move(candidate), probability});
  };
  NamedEffect named = effect;
  named.alternatives.clear();
  add(named, effect.probability);
  for (const Alternative& other : effect.alternatives) {
    add({.name = other.name, .inputs = other.inputs, .parameters = other.parameters},
        other.probability);
  }
}

// Effects of the catalogue that look like an explanation, or it like them: the next record has to
// exclude them as the last one did.
std::vector<std::string> look_alikes(const Question& question) {
  std::set<std::string> names;
  const auto has = [](const std::vector<std::string>& list, const std::string& name) {
    return std::find(list.begin(), list.end(), name) != list.end();
  };
  for (const Explanation& explanation : question.explanations) {
    for (const twin::EffectDefinition& other : twin::effect_catalogue()) {
      const auto* own = twin::find_effect(explanation.effect.name);
      if (own == nullptr || !is_waveform(other) || other.search.happens_once) continue;
      if (has(own->confused_with, other.kind) || has(other.confused_with, own->kind))
        names.insert(other.kind);
    }
  }
  for (const Explanation& explanation : question.explanations) names.erase(explanation.name());
  return {names.begin(), names.end()};
}

void normalise(std::vector<Explanation>& explanations) {
  constexpr double kNegligible = 0.01;  // of a probability
  std::erase_if(explanations, [](const Explanation& e) { return !(e.probability > kNegligible); });
  double sum = 0.0;
  for (const Explanation& explanation : explanations) sum += explanation.probability;
  for (Explanation& explanation : explanations) explanation.probability /= sum;
}

}  // namespace

std::vector<Question> open_questions(const twin::Model& model, core::Axis axis,
                                     const std::vector<NamedEffect>& effects,
                                     const std::vector<NamedEffect>& taken_back) {
  std::vector<Question> questions;
  const auto ask = [&](const NamedEffect& effect, bool may_be_nothing) {
    if (effect.alternatives.empty() && !may_be_nothing) return;
    Question question{.axis = axis, .model = model};
    for (const NamedEffect& other : effects) {
      const bool comes_again = can_be_run(other.name) && !happens_once(spec_of(other, axis));
      if (other.name != effect.name && comes_again && !other.parameters.empty())
        question.model.effects.push_back(spec_of(other, axis));
    }
    take_alternatives(question, effect);
    normalise(question.explanations);
    question.look_alikes = look_alikes(question);
    if (may_be_nothing) {
      for (Explanation& explanation : question.explanations) explanation.probability *= 0.5;
      add_nothing(question, 0.5);
    }
    questions.push_back(std::move(question));
  };
  for (const NamedEffect& effect : effects) ask(effect, false);
  for (const NamedEffect& effect : taken_back) ask(effect, true);
  return questions;
}

}  // namespace zerodrift::diagnosis
