// SPDX-License-Identifier: Apache-2.0
// What models of several records say of the same coefficients, for unit_history.h.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "common/core/median.h"
#include "common/diagnosis/unit_history.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {
namespace {

using twin::EffectSpec;
using twin::ParameterRole;

bool is_measured(const EffectSpec& spec) {
  return spec.origin.by == "diagnose" && !spec.standard_errors.empty() &&
         twin::definition_of(spec) != nullptr;
}

std::string label_with_inputs(const EffectSpec& spec) {
  std::string label = twin::label_of(spec);
  std::string inputs;
  for (const std::string& input : spec.inputs) inputs += (inputs.empty() ? "" : ", ") + input;
  return inputs.empty() ? label : label + " (" + inputs + ")";
}

// An effect that stands twice on an axis has no identity that another record would know.
bool stands_alone(const twin::Model& model, const EffectSpec& spec) {
  return std::count_if(model.effects.begin(), model.effects.end(), [&](const EffectSpec& other) {
           return other.axis == spec.axis && twin::label_of(other) == twin::label_of(spec);
         }) == 1;
}

// One effect as one record judged it.
struct Judgement {
  std::string unit;
  const EffectSpec* spec = nullptr;
};

// Dates of the records that judged an axis, by unit.
using Dates = std::map<std::string, std::multiset<std::string>>;

using Key = std::pair<core::Axis, std::string>;  // axis and label

[[noreturn]] void refuse(const RecordedModel& recorded, const std::string& key,
                         const std::string& why) {
  throw std::invalid_argument(recorded.source + ": " + key + ": " + why);
}

class Judgements {
 public:
  void add(const RecordedModel& recorded) {
    if (!files_.insert(recorded.source).second)
      throw std::invalid_argument(recorded.source + ": given twice, expected one model a record");
    const twin::Model& model = recorded.model;
    core::PerAxis<std::string> newest{};
    for (std::size_t i = 0; i < model.effects.size(); ++i) {
      const EffectSpec& spec = model.effects[i];
      if (!is_measured(spec) || !stands_alone(model, spec)) continue;
      check(recorded, "effects[" + std::to_string(i) + "].origin", spec);
      by_effect_[{spec.axis, label_with_inputs(spec)}].push_back({model.gyro_id, &spec});
      std::string& date = newest[core::index(spec.axis)];
      date = std::max(date, spec.origin.date);
    }
    for (std::size_t i = 0; i < newest.size(); ++i) {
      if (!newest[i].empty()) records_[i][model.gyro_id].insert(newest[i]);
    }
  }

  [[nodiscard]] const std::map<Key, std::vector<Judgement>>& by_effect() const {
    return by_effect_;
  }
  [[nodiscard]] const Dates& records(core::Axis axis) const { return records_[core::index(axis)]; }

 private:
  void check(const RecordedModel& recorded, const std::string& origin, const EffectSpec& spec) {
    const std::string& unit = recorded.model.gyro_id;
    if (unit.empty()) refuse(recorded, "gyro_id", "a unit needs an identity, found none");
    if (!is_date(spec.origin.date)) {
      refuse(recorded, origin + ".date",
             "has to be a day as 2026-03-31, found '" + spec.origin.date + "'");
    }
    const auto [known, is_new] =
        sources_.try_emplace({unit, spec.origin.record, spec.origin.date}, recorded.source);
    if (!is_new && known->second != recorded.source) {
      refuse(recorded, origin + ".record",
             "'" + spec.origin.record + "' of " + spec.origin.date + " is in " + known->second +
                 " too");
    }
  }

  std::map<Key, std::vector<Judgement>> by_effect_;
  core::PerAxis<Dates> records_{};
  std::map<std::tuple<std::string, std::string, std::string>, std::string> sources_;
  std::set<std::string> files_;
};

std::set<std::string> sized_by(const Judgement& judgement) {
  std::set<std::string> names;
  for (const auto& [name, error] : judgement.spec->standard_errors) {
    if (error > 0.0) names.insert(name);
  }
  return names;
}

// Leaves those that sized what most did: a polynomial's coefficient is another one beside other
// powers.
void keep_of_the_same_terms(std::vector<Judgement>& judgements) {
  std::map<std::set<std::string>, std::size_t> counts;
  for (const Judgement& judgement : judgements) ++counts[sized_by(judgement)];
  const auto usual = std::max_element(counts.begin(), counts.end(),
                                      [](auto& a, auto& b) { return a.second < b.second; });
  std::erase_if(judgements,
                [&](const Judgement& judgement) { return sized_by(judgement) != usual->first; });
}

// Leaves those whose terms, time constants, widths, ... are the others'. How many are not.
std::size_t keep_of_one_shape(std::vector<Judgement>& judgements) {
  constexpr double kAlike = 0.1;
  const std::size_t all = judgements.size();
  keep_of_the_same_terms(judgements);
  const twin::DefinitionPtr definition = twin::definition_of(*judgements.front().spec);
  for (const twin::ParameterDefinition& parameter : definition->parameters) {
    if (parameter.role != ParameterRole::kShape || judgements.empty()) continue;
    const auto shape_of = [&](const Judgement& judgement) {
      return twin::complete_parameters(*definition, judgement.spec->parameters).at(parameter.name);
    };
    std::vector<double> shapes;
    for (const Judgement& judgement : judgements) shapes.push_back(shape_of(judgement));
    const double usual = core::median_of(std::move(shapes));
    std::erase_if(judgements, [&](const Judgement& judgement) {
      return std::abs(shape_of(judgement) - usual) > kAlike * std::abs(usual);
    });
  }
  return all - judgements.size();
}

void add_coefficients(std::vector<Coefficient>& coefficients, const Key& key,
                      std::vector<Judgement> judgements) {
  const std::size_t left_out = keep_of_one_shape(judgements);
  if (judgements.empty()) return;
  const twin::DefinitionPtr definition = twin::definition_of(*judgements.front().spec);
  for (const twin::ParameterDefinition& parameter : definition->parameters) {
    Coefficient coefficient{key.first, key.second, parameter.name, {}, left_out};
    for (const Judgement& judgement : judgements) {
      const auto value = judgement.spec->parameters.find(parameter.name);
      const auto error = judgement.spec->standard_errors.find(parameter.name);
      if (value == judgement.spec->parameters.end() ||
          error == judgement.spec->standard_errors.end() || !(error->second > 0.0))
        continue;
      coefficient.records.push_back(
          {judgement.unit, judgement.spec->origin.date, {value->second, error->second}});
    }
    if (coefficient.records.empty()) continue;
    std::stable_sort(
        coefficient.records.begin(), coefficient.records.end(),
        [](const DatedEstimate& a, const DatedEstimate& b) { return a.date < b.date; });
    coefficients.push_back(std::move(coefficient));
  }
}

UnitShare share_of(const std::string& unit, const std::multiset<std::string>& sized,
                   const std::multiset<std::string>& records) {
  UnitShare share{.unit = unit,
                  .sized = sized.size(),
                  .records = records.size(),
                  .first = *sized.begin(),
                  .last = *sized.rbegin()};
  const auto of_span = static_cast<std::size_t>(
      std::distance(records.lower_bound(share.first), records.upper_bound(share.last)));
  const bool is_whole = of_span == share.sized;
  share.only_late = is_whole && share.last == *records.rbegin();
  share.only_early = is_whole && share.first == *records.begin();
  return share;
}

// `dates`: of the records that judged the axis.
void add_if_partly_sized(std::vector<PartlySized>& found, const Key& key,
                         const std::vector<Judgement>& judgements, const Dates& dates) {
  PartlySized effect{.axis = key.first, .effect = key.second, .sized = judgements.size()};
  Dates sized;
  for (const Judgement& judgement : judgements)
    sized[judgement.unit].insert(judgement.spec->origin.date);
  for (const auto& [unit, records] : dates) {
    effect.records += records.size();
    const auto own = sized.find(unit);
    if (own != sized.end()) effect.units.push_back(share_of(unit, own->second, records));
  }
  if (effect.sized < effect.records) found.push_back(std::move(effect));
}

}  // namespace

bool is_date(const std::string& text) {
  constexpr std::string_view kForm = "0000-00-00";
  const bool has_form = text.size() == kForm.size() &&
                        std::equal(text.begin(), text.end(), kForm.begin(), [](char c, char form) {
                          return form == '0' ? c >= '0' && c <= '9' : c == form;
                        });
  if (!has_form) return false;
  const auto number = [&](std::size_t at, std::size_t size) {
    return std::stoi(text.substr(at, size));
  };
  constexpr int kFirstYear = 1900;  // no record is older
  const int year = number(0, 4);
  return year >= kFirstYear &&
         std::chrono::year_month_day(std::chrono::year(year),
                                     std::chrono::month(static_cast<unsigned>(number(5, 2))),
                                     std::chrono::day(static_cast<unsigned>(number(8, 2))))
             .ok();
}

MeasuredEffects measured_effects(std::span<const RecordedModel> models) {
  Judgements all;
  for (const RecordedModel& recorded : models) all.add(recorded);
  MeasuredEffects measured;
  for (const auto& [key, judgements] : all.by_effect()) {
    add_coefficients(measured.coefficients, key, judgements);
    add_if_partly_sized(measured.partly_sized, key, judgements, all.records(key.first));
  }
  return measured;
}

}  // namespace zerodrift::diagnosis
