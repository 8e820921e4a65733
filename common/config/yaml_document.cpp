// SPDX-License-Identifier: Apache-2.0
#include "common/config/yaml_document.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <charconv>
#include <sstream>
#include <utility>

#include "common/config/whole_file.h"
#include "common/config/yaml_place.h"

namespace zerodrift::config {
namespace {

// The parts of a path such as effects[3].axis: "effects", "3", "axis".
std::vector<std::string> path_parts(std::string_view path) {
  std::vector<std::string> parts(1);
  for (const char c : path) {
    if (c == ']') continue;
    if (c == '.' || c == '[') {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

// Takes every event and makes nothing of it.
class NoDocument final : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
};

// YAML::LoadAll() finds documents without end in some wrong texts (yaml-cpp 0.7, a ')' in the first
// column behind a folded scalar), so no more than two are asked for.
bool has_two_documents(const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  NoDocument none;
  return parser.HandleNextDocument(none) && parser.HandleNextDocument(none);
}

YAML::Node child(const YAML::Node& node, const std::string& part) {
  if (node.IsMap()) {
    for (const auto& entry : node) {
      if (entry.first.IsScalar() && entry.first.Scalar() == part) return entry.second;
    }
  }
  if (node.IsSequence()) {
    std::size_t i = 0;
    const auto [stop, error] = std::from_chars(part.data(), part.data() + part.size(), i);
    if (error == std::errc{} && i < node.size()) return node[i];
  }
  return YAML::Node(YAML::NodeType::Undefined);
}

}  // namespace

YamlDocument YamlDocument::read(const std::filesystem::path& path) {
  return parse(read_whole(path), path.string());
}

YamlDocument YamlDocument::parse(const std::string& text, std::string name) {
  try {
    if (has_two_documents(text)) {
      throw ConfigError(name + ": expected one YAML document, found more");
    }
    return YamlDocument(
        std::make_shared<const Content>(Content{std::move(name), YAML::Load(text)}));
  } catch (const YAML::Exception& error) {
    throw ConfigError(
        name + ':' + std::to_string(error.mark.line + 1) + ": not valid YAML: " + error.msg,
        place_of(error.mark));
  }
}

ConfigError YamlDocument::error(std::string_view key, std::string_view what) const {
  YAML::Node node = content_->root;
  for (const std::string& part : path_parts(key)) {
    const YAML::Node next = child(node, part);
    if (!next.IsDefined()) break;
    node.reset(next);
  }
  return ConfigError(content_->name + ':' + std::to_string(node.Mark().line + 1) + ": " +
                         std::string(key) + ": " + std::string(what),
                     place_of(node.Mark()));
}

}  // namespace zerodrift::config
