// SPDX-License-Identifier: Apache-2.0
// A YAML file into options that are described once (compensation/option_keys.h).
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/compensation/option_keys.h"
#include "common/config/yaml_document.h"
#include "common/config/yaml_place.h"

namespace zerodrift::config {

// Sets every option whose key the document gives, and knows at the end which keys it has that no
// option has. Each method throws ConfigError with one line. Valid as long as the document.
class OptionReader final : public compensation::OptionVisitor {
 public:
  using OptionKey = compensation::OptionKey;

  // read_model: a model by its name in the file; what it throws is told of the key.
  OptionReader(const YamlDocument& document,
               std::function<twin::Model(const std::string&)> read_model);

  void section(const std::string& name, const char* text) override;
  std::optional<std::size_t> groups(const std::string& name, const char* text) override;
  void number(const OptionKey& key, double& value) override;
  void number(const OptionKey& key, std::optional<double>& value) override;
  void count(const OptionKey& key, std::size_t& value) override;
  void flag(const OptionKey& key, bool& value) override;
  void text(const OptionKey& key, std::string& value) override;
  void choice(const OptionKey& key, std::span<const std::string_view> names,
              std::size_t& chosen) override;
  void numbers(const OptionKey& key, std::vector<double>& values) override;
  void texts(const OptionKey& key, std::vector<std::string>& values) override;
  void model(const OptionKey& key, std::optional<twin::Model>& value) override;

  // Of a key that must stand in the file.
  void require(const std::string& key, const char* expected) const;
  void refuse_unknown() const;

 private:
  [[nodiscard]] YamlPlace at(const std::string& path, const YAML::Node& node) const;
  // All keys that the document gives, two mappings deep: no key lies deeper.
  void list(const std::string& path, const YAML::Node& node);
  // Null where the key is absent. A key whose values before it don't go with it is refused.
  const YAML::Node* find(const OptionKey& key);
  void require_mapping(const std::string& group) const;
  [[nodiscard]] double checked(const OptionKey& key, double value) const;
  template <typename Value, typename Read>
  void read_list(const OptionKey& key, std::vector<Value>& values, const Read& read);

  const YamlDocument& document_;
  std::function<twin::Model(const std::string&)> read_model_;
  std::map<std::string, YAML::Node> given_;
  std::vector<std::pair<std::string, YAML::Node>> in_order_;
  std::set<std::string> known_;
  std::set<std::string> replaced_;  // lists of groups that the document gives
};

}  // namespace zerodrift::config
