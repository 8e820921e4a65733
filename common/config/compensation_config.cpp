// SPDX-License-Identifier: Apache-2.0
#include "common/config/compensation_config.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "common/compensation/drift_prior.h"
#include "common/compensation/option_keys.h"
#include "common/config/twin_config.h"
#include "common/config/yaml_place.h"
#include "common/core/closest_name.h"
#include "common/core/units.h"
#include "common/navigation/earth_rate.h"

namespace zerodrift::config {
namespace {

using compensation::CompensationOptions;
using compensation::OptionKey;

// Of svr.epsilon: svr and epsilon.
std::string group_of(const std::string& path) {
  const std::size_t dot = path.rfind('.');
  return dot == std::string::npos ? "" : path.substr(0, dot);
}
std::string leaf_of(const std::string& path) {
  return path.substr(path.rfind('.') + 1);
}

// Sets every option whose key the document gives, and knows at the end which keys it has that no
// option has.
class OptionReader final : public compensation::OptionVisitor {
 public:
  OptionReader(const YamlDocument& document, const std::filesystem::path& folder)
      : document_(document), folder_(folder) {
    list("", document.content().root);
  }

  void section(const std::string& name, const char*) override { known_.insert(name); }

  std::optional<std::size_t> groups(const std::string& name, const char*) override {
    known_.insert(name);
    const auto found = given_.find(name);
    if (found == given_.end() || found->second.IsNull()) return {};
    if (!found->second.IsSequence()) at(name, found->second).fail("a list");
    for (std::size_t i = 0; i < found->second.size(); ++i) {
      const std::string path = element(name, i);
      const YAML::Node item = found->second[i];
      if (!item.IsMap() && !item.IsNull()) at(path, item).fail("keys and values");
    }
    if (found->second.size() == 0) return {};
    replaced_.insert(name);
    return found->second.size();
  }

  void number(const OptionKey& key, double& value) override {
    if (const auto* node = find(key)) value = checked(key, at(key.name, *node).number());
  }
  void number(const OptionKey& key, std::optional<double>& value) override {
    if (const auto* node = find(key)) value = checked(key, at(key.name, *node).number());
  }
  void count(const OptionKey& key, std::size_t& value) override {
    const auto* node = find(key);
    if (node == nullptr) return;
    const auto found = finite_number(*node);
    if (!found || *found != std::floor(*found))
      at(key.name, *node).fail("a whole number, " + key.range.text());
    value = static_cast<std::size_t>(checked(key, *found));
  }
  void flag(const OptionKey& key, bool& value) override {
    if (const auto* node = find(key)) value = at(key.name, *node).flag();
  }
  void text(const OptionKey& key, std::string& value) override {
    if (const auto* node = find(key)) value = at(key.name, *node).text();
  }
  void choice(const OptionKey& key, std::span<const std::string_view> names,
              std::size_t& chosen) override {
    const auto* node = find(key);
    const bool is_missing =
        key.required && replaced_.contains(key.name.substr(0, key.name.find('[')));
    if (node == nullptr && !is_missing) return;
    const std::string word = node == nullptr ? "" : at(key.name, *node).text();
    const auto found = std::find(names.begin(), names.end(), word);
    if (found == names.end()) {
      std::string known;
      for (const auto name : names) known += (known.empty() ? "" : ", ") + std::string(name);
      throw document_.error(key.name, "found '" + word + "', expected one of " + known);
    }
    chosen = static_cast<std::size_t>(found - names.begin());
  }
  void numbers(const OptionKey& key, std::vector<double>& values) override {
    read_list(key, values, [&](const YamlPlace& place) { return checked(key, place.number()); });
  }
  void texts(const OptionKey& key, std::vector<std::string>& values) override {
    read_list(key, values, [&](const YamlPlace& place) {
      const std::string text = place.text();
      if (text.empty()) throw document_.error(place.path, "found nothing, expected a name");
      return text;
    });
  }
  void model(const OptionKey& key, std::optional<twin::Model>& value) override {
    const auto* node = find(key);
    if (node == nullptr) return;
    const std::string file = at(key.name, *node).text();
    if (!file.empty()) value = load_prior(folder_ / file);
  }

  void refuse_unknown() const {
    for (const auto& [path, node] : in_order_) {
      if (known_.contains(path)) continue;
      std::vector<std::string> beside;
      for (const std::string& known : known_) {
        if (group_of(known) == group_of(path)) beside.push_back(leaf_of(known));
      }
      at(path, node).refuse("unknown key" + core::suggestion(leaf_of(path), beside));
    }
  }

 private:
  [[nodiscard]] YamlPlace at(const std::string& path, const YAML::Node& node) const {
    return {document_.content().name, node, path};
  }

  // All keys that the document gives, two mappings deep: no key lies deeper.
  void list(const std::string& path, const YAML::Node& node) {
    if (node.IsNull()) return;
    if (!node.IsMap()) at(path.empty() ? "top level" : path, node).fail("keys and values");
    std::set<std::string> seen;
    for (const auto& entry : node) {
      const std::string key = joined(path, at(path, entry.first).key(seen));
      given_.emplace(key, entry.second);
      in_order_.emplace_back(key, entry.first);
      if (!path.empty()) continue;
      if (entry.second.IsMap()) list(key, entry.second);
      if (!entry.second.IsSequence()) continue;
      for (std::size_t i = 0; i < entry.second.size(); ++i) {
        if (entry.second[i].IsMap()) list(element(key, i), entry.second[i]);
      }
    }
  }

  // Null where the key is absent. A key whose values before it don't go with it is refused.
  const YAML::Node* find(const OptionKey& key) {
    if (key.internal) return nullptr;
    require_mapping(group_of(key.name));
    known_.insert(key.name);
    const auto found = given_.find(key.name);
    if (found == given_.end()) return nullptr;
    if (key.refused != nullptr) throw document_.error(key.name, key.refused);
    return &found->second;
  }

  void require_mapping(const std::string& group) const {
    const auto found = given_.find(group);
    if (found == given_.end() || found->second.IsMap() || found->second.IsNull()) return;
    at(group, found->second).fail("keys and values");
  }

  double checked(const OptionKey& key, double value) const {
    if (!key.range.contains(value)) {
      throw document_.error(
          key.name, "found " + compensation::short_text(value) + ", expected " + key.range.text());
    }
    return value * key.si_per_unit;
  }

  template <typename Value, typename Read>
  void read_list(const OptionKey& key, std::vector<Value>& values, const Read& read) {
    const auto* node = find(key);
    if (node == nullptr || node->IsNull()) return;
    if (!node->IsSequence()) at(key.name, *node).fail("a list");
    values.clear();
    for (std::size_t i = 0; i < node->size(); ++i) {
      const std::string path = element(key.name, i);
      const YAML::Node item = (*node)[i];
      values.push_back(read(at(path, item)));
    }
  }

  const YamlDocument& document_;
  const std::filesystem::path& folder_;
  std::map<std::string, YAML::Node> given_;
  std::vector<std::pair<std::string, YAML::Node>> in_order_;
  std::set<std::string> known_;
  std::set<std::string> replaced_;  // lists of groups that the document gives
};

// Lines that start with the wrong key ("key: what" or "key what"), as errors of this file.
ConfigError error_of(const YamlDocument& file, const std::string& line) {
  const auto end = std::min(line.find_first_of(": "), line.size());
  const auto what = std::min(line.find_first_not_of(": ", end), line.size());
  return file.error(line.substr(0, end), line.substr(what));
}

void resolve_earth_rate(const YamlDocument& file, compensation::EarthRateOptions& earth) {
  if (earth.mode != compensation::EarthRateMode::kKnown) return;
  if (!earth.latitude_deg || !earth.roll_deg || !earth.pitch_deg || !earth.heading_deg) {
    throw file.error("earth_rate",
                     "mode known needs latitude_deg, roll_deg, pitch_deg and heading_deg");
  }
  const navigation::Attitude attitude{.roll_rad = *earth.roll_deg * core::kRadPerDeg,
                                      .pitch_rad = *earth.pitch_deg * core::kRadPerDeg,
                                      .heading_rad = *earth.heading_deg * core::kRadPerDeg};
  earth.rate_radps =
      navigation::earth_rate_radps_b(*earth.latitude_deg * core::kRadPerDeg, attitude);
}

void check(const YamlDocument& file, const CompensationOptions& options) {
  if (const auto line = options.validate()) throw error_of(file, *line);
  try {
    const thermal::FeatureBuilder builder({.features = options.features}, options.probes());
  } catch (const std::invalid_argument& problem) {
    throw error_of(file, problem.what());
  }
}

}  // namespace

CompensationOptions load_compensation(const std::filesystem::path& path) {
  const YamlDocument file = YamlDocument::read(path);
  const std::filesystem::path folder = path.parent_path();
  CompensationOptions options;
  OptionReader reader(file, folder);
  compensation::describe(options, reader);
  reader.refuse_unknown();
  resolve_earth_rate(file, options.earth_rate);
  check(file, options);
  return options;
}

namespace {

twin::Model checked_prior(twin::Model model, const std::string& file) {
  if (const auto line = compensation::find_wrong_prior(model))
    throw ConfigError(file + ": " + *line);
  return model;
}

}  // namespace

twin::Model load_prior(const std::filesystem::path& path) {
  std::error_code problem;
  if (std::filesystem::exists(path, problem)) {
    if (!std::filesystem::is_regular_file(path, problem)) {
      throw ConfigError(path.string() + ": found something else than a file, expected a model");
    }
    const std::uintmax_t size = std::filesystem::file_size(path, problem);
    if (problem || size > kLargestModelFile) {
      throw ConfigError(path.string() + ": found more bytes than a model has, expected at most " +
                        std::to_string(kLargestModelFile));
    }
  }
  return checked_prior(load_model(path).model, path.string());
}

twin::Model prior_from_text(const std::string& text, const std::string& name) {
  return checked_prior(model_from(YamlDocument::parse(text, name)).model, name);
}

}  // namespace zerodrift::config
