// SPDX-License-Identifier: Apache-2.0
#include "common/config/option_reader.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/core/closest_name.h"

namespace zerodrift::config {
namespace {

// Of svr.epsilon: svr and epsilon.
std::string group_of(const std::string& path) {
  const std::size_t dot = path.rfind('.');
  return dot == std::string::npos ? "" : path.substr(0, dot);
}
std::string leaf_of(const std::string& path) {
  return path.substr(path.rfind('.') + 1);
}

}  // namespace

template <typename Value, typename Read>
void OptionReader::read_list(const OptionKey& key, std::vector<Value>& values, const Read& read) {
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

OptionReader::OptionReader(const YamlDocument& document,
                           std::function<twin::Model(const std::string&)> read_model)
    : document_(document), read_model_(std::move(read_model)) {
  list("", document.content().root);
}

void OptionReader::section(const std::string& name, const char*) {
  known_.insert(name);
}

std::optional<std::size_t> OptionReader::groups(const std::string& name, const char*) {
  known_.insert(name);
  const auto found = given_.find(name);
  if (found == given_.end() || found->second.IsNull()) return {};
  if (!found->second.IsSequence()) at(name, found->second).fail("a list");
  for (std::size_t i = 0; i < found->second.size(); ++i) {
    const std::string path = element(name, i);
    const YAML::Node item = found->second[i];
    if (!item.IsMap() && !item.IsNull()) at(path, item).fail("keys and values");
  }
  if (found->second.size() == 0) {
    throw document_.error(name,
                          "found an empty list, expected one or more, or no such key, which "
                          "keeps the default");
  }
  replaced_.insert(name);
  return found->second.size();
}

void OptionReader::number(const OptionKey& key, double& value) {
  if (const auto* node = find(key)) value = checked(key, at(key.name, *node).number());
}
void OptionReader::number(const OptionKey& key, std::optional<double>& value) {
  if (const auto* node = find(key)) value = checked(key, at(key.name, *node).number());
}
void OptionReader::count(const OptionKey& key, std::size_t& value) {
  const auto* node = find(key);
  if (node == nullptr) return;
  const auto found = finite_number(*node);
  if (!found || *found != std::floor(*found))
    at(key.name, *node).fail("a whole number, " + key.range.text());
  value = static_cast<std::size_t>(checked(key, *found));
}
void OptionReader::flag(const OptionKey& key, bool& value) {
  if (const auto* node = find(key)) value = at(key.name, *node).flag();
}
void OptionReader::text(const OptionKey& key, std::string& value) {
  if (const auto* node = find(key)) value = at(key.name, *node).text();
}
void OptionReader::choice(const OptionKey& key, std::span<const std::string_view> names,
                          std::size_t& chosen) {
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
void OptionReader::numbers(const OptionKey& key, std::vector<double>& values) {
  read_list(key, values, [&](const YamlPlace& place) { return checked(key, place.number()); });
}
void OptionReader::texts(const OptionKey& key, std::vector<std::string>& values) {
  read_list(key, values, [&](const YamlPlace& place) {
    const std::string text = place.text();
    if (text.empty()) throw document_.error(place.path, "found nothing, expected a name");
    return text;
  });
}
void OptionReader::model(const OptionKey& key, std::optional<twin::Model>& value) {
  const auto* node = find(key);
  if (node == nullptr) return;
  const std::string file = at(key.name, *node).text();
  if (file.empty()) return;
  try {
    value = read_model_(file);
  } catch (const std::runtime_error& error) {
    throw document_.error(key.name, error.what());
  }
}

void OptionReader::require(const std::string& key, const char* expected) const {
  if (!given_.contains(key)) throw document_.error(key, std::string("must be given: ") + expected);
}

void OptionReader::refuse_unknown() const {
  for (const auto& [path, node] : in_order_) {
    if (known_.contains(path)) continue;
    std::vector<std::string> beside;
    for (const std::string& known : known_) {
      if (group_of(known) == group_of(path)) beside.push_back(leaf_of(known));
    }
    at(path, node).refuse("unknown key" + core::suggestion(leaf_of(path), beside));
  }
}

YamlPlace OptionReader::at(const std::string& path, const YAML::Node& node) const {
  return {document_.content().name, node, path};
}

void OptionReader::list(const std::string& path, const YAML::Node& node) {
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

const YAML::Node* OptionReader::find(const OptionKey& key) {
  if (key.internal) return nullptr;
  require_mapping(group_of(key.name));
  known_.insert(key.name);
  const auto found = given_.find(key.name);
  if (found == given_.end()) return nullptr;
  if (key.refused != nullptr) throw document_.error(key.name, key.refused);
  return &found->second;
}

void OptionReader::require_mapping(const std::string& group) const {
  const auto found = given_.find(group);
  if (found == given_.end() || found->second.IsMap() || found->second.IsNull()) return;
  at(group, found->second).fail("keys and values");
}

double OptionReader::checked(const OptionKey& key, double value) const {
  if (!key.range.contains(value)) {
    throw document_.error(
        key.name, "found " + compensation::short_text(value) + ", expected " + key.range.text());
  }
  return value * key.si_per_unit;
}

}  // namespace zerodrift::config
