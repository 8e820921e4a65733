// SPDX-License-Identifier: Apache-2.0
// A place in a YAML document: what stands there, read strictly, and errors that name file, line and
// the key's path. Only the readers of this folder include it.
#pragma once

#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <optional>
#include <set>
#include <string>

#include "common/config/yaml_document.h"

namespace zerodrift::config {

struct YamlDocument::Content {
  std::string name;
  YAML::Node root;
};

// A key of YAML ends within 1024 characters, and one written back may take six for each of its own.
inline constexpr std::size_t kLongestKey = 160;

// "svr" and "epsilon" are svr.epsilon; an empty path is the top level.
[[nodiscard]] std::string joined(const std::string& path, const std::string& key);
// "features" and 3 are features[3].
[[nodiscard]] std::string element(const std::string& path, std::size_t i);

// "line 3", which quotes nothing of the file.
[[nodiscard]] std::string place_of(const YAML::Mark& mark);

// A finite number that is written as one, not as text in quotes.
[[nodiscard]] std::optional<double> finite_number(const YAML::Node& node);

// Valid as long as what it was made of.
struct YamlPlace {
  const std::string& file;
  const YAML::Node& node;
  const std::string& path;

  // "file:line: path: what"
  [[nodiscard]] std::string line(const std::string& what) const;
  // Throws ConfigError with that line.
  [[noreturn]] void refuse(const std::string& what) const;
  // The same with "expected that, found this".
  [[noreturn]] void fail(const std::string& expected) const;

  // Each throws ConfigError where something else stands there.
  [[nodiscard]] double number() const;
  template <typename Whole>  // std::int32_t, std::uint32_t, std::int64_t or std::uint64_t
  [[nodiscard]] Whole whole_number() const;
  [[nodiscard]] bool flag() const;
  [[nodiscard]] std::string text() const;
  // The place is a key of a mapping, `seen` holds the mapping's keys before it; a key that stands
  // twice, or is too long to be one, is refused.
  [[nodiscard]] std::string key(std::set<std::string>& seen) const;
};

}  // namespace zerodrift::config
