// SPDX-License-Identifier: Apache-2.0
// A YAML or JSON file (JSON is read as the YAML it is), and where in it what stands.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/config/config_error.h"

namespace google::protobuf {
class Message;
}

namespace zerodrift::config {

class YamlDocument {
 public:
  // Throws ConfigError where the file can't be read or isn't one YAML document.
  [[nodiscard]] static YamlDocument read(const std::filesystem::path& path);
  // `name` stands for the file's name in errors.
  [[nodiscard]] static YamlDocument parse(const std::string& text, std::string name);

  // Puts every key into `message`, of any type: keys are the fields' names. Scalars convert
  // strictly: a number field takes a plain finite number, a flag true or false, an enum its value's
  // name; a string field any scalar. Throws ConfigError naming file, line and the key's path for a
  // wrong type and a key that stands twice. Returns one line for each unknown key, with the closest
  // valid one; where the message has a field `map<string, string> extra`, it is kept there as JSON
  // text.
  [[nodiscard]] std::vector<std::string> fill(google::protobuf::Message& message) const;

  // "file:line: key: what", the line being that of the key or of its closest existing parent. For
  // values that have the right type but are wrong. `key` is a path such as effects[3].axis.
  [[nodiscard]] ConfigError error(std::string_view key, std::string_view what) const;

  // For the readers of this folder (yaml_place.h).
  struct Content;
  [[nodiscard]] const Content& content() const noexcept { return *content_; }

 private:
  explicit YamlDocument(std::shared_ptr<const Content> content) : content_(std::move(content)) {}

  std::shared_ptr<const Content> content_;
};

}  // namespace zerodrift::config
