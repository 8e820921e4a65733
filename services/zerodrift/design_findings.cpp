// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/design_findings.h"

#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/config/config_error.h"
#include "common/config/whole_file.h"
#include "common/core/one_line.h"
#include "common/diagnosis/rounded_text.h"

namespace zerodrift::services {
namespace {

using Json = nlohmann::json;

// A value of the document and its path, for errors.
class Place {
 public:
  Place(const std::string& file, std::string path, const Json& value)
      : file_(file), path_(std::move(path)), value_(value) {}

  [[noreturn]] void fail(const std::string& expected) const {
    throw config::ConfigError(file_ + ": " + (path_.empty() ? "" : path_ + ": ") + "found " +
                              value_.type_name() + ", expected " + expected);
  }

  [[nodiscard]] Place at(const char* key) const {
    if (!value_.is_object()) fail("an object as `zerodrift diagnose --json` writes it");
    const auto found = value_.find(key);
    if (found == value_.end()) {
      throw config::ConfigError(file_ + ": " + joined(key) +
                                ": missing, expected what `zerodrift diagnose --json` of this "
                                "version writes");
    }
    return {file_, joined(key), *found};
  }
  [[nodiscard]] std::optional<Place> find(const char* key) const {
    const auto found = value_.find(key);
    if (found == value_.end() || found->is_null()) return std::nullopt;
    return Place(file_, joined(key), *found);
  }
  template <typename See>
  void each(const See& see) const {
    if (!value_.is_array()) fail("a list");
    for (std::size_t i = 0; i < value_.size(); ++i)
      see(Place(file_, path_ + '[' + std::to_string(i) + ']', value_[i]));
  }
  [[nodiscard]] std::string text() const {
    if (!value_.is_string()) fail("a text");
    return core::one_line(value_.get<std::string>());
  }
  [[nodiscard]] double number() const {
    if (!value_.is_number()) fail("a number");
    return value_.get<double>();
  }
  [[nodiscard]] double probability() const {
    const double p = number();
    if (p >= 0.0 && p <= 1.0) return p;
    throw config::ConfigError(file_ + ": " + path_ + ": found " + diagnosis::rounded(p) +
                              ", expected a probability, 0 to 1");
  }
  [[nodiscard]] std::map<std::string, double> numbers() const {
    if (!value_.is_object()) fail("names with numbers");
    std::map<std::string, double> values;
    for (const auto& [key, value] : value_.items())
      values[core::one_line(key)] = Place(file_, path_ + '.' + core::one_line(key), value).number();
    return values;
  }
  [[nodiscard]] std::vector<std::string> texts() const {
    std::vector<std::string> all;
    each([&](const Place& place) { all.push_back(place.text()); });
    return all;
  }
  [[nodiscard]] bool is_object() const { return value_.is_object(); }

 private:
  [[nodiscard]] std::string joined(const std::string& key) const {
    return path_.empty() ? key : path_ + '.' + key;
  }

  const std::string& file_;
  std::string path_;
  const Json& value_;
};

diagnosis::NamedEffect effect_from(const Place& place) {
  diagnosis::NamedEffect effect{.name = place.at("name").text(),
                                .probability = place.at("probability").probability(),
                                .inputs = place.at("inputs").texts(),
                                .parameters = place.at("parameters").numbers()};
  place.at("alternatives").each([&](const Place& other) {
    effect.alternatives.push_back({.name = other.at("name").text(),
                                   .probability = other.at("probability").probability(),
                                   .inputs = other.at("inputs").texts(),
                                   .parameters = other.at("parameters").numbers()});
  });
  return effect;
}

std::vector<diagnosis::NamedEffect> effects_from(const Place& list) {
  std::vector<diagnosis::NamedEffect> effects;
  list.each([&](const Place& place) { effects.push_back(effect_from(place)); });
  return effects;
}

void take_axis(const Place& place, core::Axis axis, const twin::Model& model,
               OpenFindings& findings) {
  const std::string head = "axis " + std::string(core::name(axis)) + ": ";
  if (const auto unknown = place.find("unknown")) {
    findings.notes.push_back(head + "the unknown effect (" + unknown->at("description").text() +
                             ") is no waveform that could be simulated; it takes no part");
  }
  for (auto& question : diagnosis::open_questions(model, axis, effects_from(place.at("effects")),
                                                  effects_from(place.at("taken_back")))) {
    for (const std::string& name : question.left_out) {
      findings.notes.push_back(head + name +
                               " has no waveform that could be simulated; it takes no part");
    }
    if (question.explanations.size() > 1) findings.questions.push_back(std::move(question));
  }
}

}  // namespace

OpenFindings findings_from(const std::string& text, const std::string& name,
                           const twin::Model& model) {
  const Json document = Json::parse(text, nullptr, false);
  if (document.is_discarded())
    throw config::ConfigError(name +
                              ": found no JSON, expected what `zerodrift diagnose --json` writes");
  const Place axes = Place(name, "", document).at("axis");
  if (!axes.is_object()) axes.fail("an object with axes");
  OpenFindings findings;
  for (const core::Axis axis : core::kAxes) {
    const std::string key(core::name(axis));
    if (axes.find(key.c_str())) take_axis(axes.at(key.c_str()), axis, model, findings);
  }
  return findings;
}

OpenFindings read_findings(const std::filesystem::path& path, const twin::Model& model) {
  return findings_from(config::read_whole(path), path.string(), model);
}

}  // namespace zerodrift::services
