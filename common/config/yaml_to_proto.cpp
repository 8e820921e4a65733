// SPDX-License-Identifier: Apache-2.0
#include "common/config/yaml_to_proto.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <sstream>
#include <type_traits>
#include <utility>

#include "common/config/whole_file.h"
#include "common/core/one_line.h"
#include "common/twin/closest_name.h"

namespace zerodrift::config {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

constexpr const char* kExtraField = "extra";
constexpr std::size_t kDeepestUnknown = 64;
constexpr std::size_t kLongestUnknown = 1U << 20U;  // characters, all unknown values together
// A key of YAML ends within 1024 characters, and one written back may take six for each of its own.
constexpr std::size_t kLongestKey = 160;
constexpr std::size_t kMostValues = 100000;  // far above the largest model's

const FieldDescriptor* extra_field(const Descriptor& type) {
  const FieldDescriptor* field = type.FindFieldByName(kExtraField);
  return field != nullptr && field->is_map() ? field : nullptr;
}

std::vector<std::string> key_names(const Descriptor& type) {
  std::vector<std::string> names;
  for (int i = 0; i < type.field_count(); ++i) {
    if (type.field(i) != extra_field(type)) names.push_back(type.field(i)->name());
  }
  return names;
}

std::string joined(const std::string& path, const std::string& key) {
  return path.empty() ? key : path + '.' + key;
}

std::string element(const std::string& path, std::size_t i) {
  return path + '[' + std::to_string(i) + ']';
}

// What stands there, for error messages.
std::string described(const YAML::Node& node) {
  if (node.IsMap()) return "a mapping";
  if (node.IsSequence()) return "a list";
  if (node.IsNull()) return "nothing";
  return node.Tag() == "!" ? "the text \"" + node.Scalar() + '"' : "'" + node.Scalar() + "'";
}

// " in Hz" where the key's suffix tells the unit.
std::string unit_hint(const std::string& path) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 9> kUnits{{
      {"_deg_h", "deg/h"},
      {"_deg_s", "deg/s"},
      {"_degc", "°C"},
      {"_deg", "degrees"},
      {"_hz", "Hz"},
      {"_ms", "ms"},
      {"_ppm", "ppm"},
      {"_w", "W"},
      {"_s", "s"},
  }};
  for (const auto& [suffix, unit] : kUnits) {
    if (path.ends_with(suffix)) return " in " + std::string(unit);
  }
  return "";
}

template <typename T>
std::optional<T> parsed(const YAML::Node& node) {
  if (!node.IsScalar() || node.Tag() == "!") return std::nullopt;
  const std::string& text = node.Scalar();
  const char* end = text.data() + text.size();
  T value{};
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return value;
}

std::optional<double> finite_number(const YAML::Node& node) {
  const auto value = parsed<double>(node);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::string json_text(const std::string& text) {
  constexpr std::string_view kHex = "0123456789abcdef";
  std::string json = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      json += {'\\', c};
    } else if (byte < 0x20) {
      json += {'\\', 'u', '0', '0', kHex[byte >> 4U], kHex[byte & 15U]};
    } else {
      json += c;
    }
  }
  return json + '"';
}

// Any YAML as JSON; nothing where it nests too deep or grows too long (aliases can make it
// endless).
bool append_json(const YAML::Node& node, std::size_t depth, std::string& json) {
  if (depth > kDeepestUnknown || json.size() > kLongestUnknown) return false;
  const char* separator = "";
  if (node.IsMap()) {
    json += '{';
    for (const auto& entry : node) {
      if (entry.first.Scalar().size() > kLongestKey) return false;
      json += std::exchange(separator, ", ") + json_text(entry.first.Scalar()) + ": ";
      if (!append_json(entry.second, depth + 1, json)) return false;
    }
    json += '}';
  } else if (node.IsSequence()) {
    json += '[';
    for (const YAML::Node& value : node) {
      json += std::exchange(separator, ", ");
      if (!append_json(value, depth + 1, json)) return false;
    }
    json += ']';
  } else if (node.IsNull()) {
    json += "null";
  } else {
    const bool plain = finite_number(node) ||
                       (node.Tag() != "!" && (node.Scalar() == "true" || node.Scalar() == "false"));
    json += plain ? node.Scalar() : json_text(node.Scalar());
  }
  return true;
}

}  // namespace

struct YamlDocument::Content {
  std::string name;
  YAML::Node root;
};

namespace {

// Walks a YAML tree along a message type.
class Filler {
 public:
  explicit Filler(const std::string& file) : file_(file) {}

  void fill_message(const YAML::Node& node, Message& message, const std::string& path);
  [[nodiscard]] std::vector<std::string> take_unknown() { return std::move(unknown_); }

 private:
  [[nodiscard]] std::string line_of(const YAML::Node& node, const std::string& path,
                                    const std::string& what) const {
    return core::one_line(file_ + ':' + std::to_string(node.Mark().line + 1) + ": " + path + ": " +
                          what);
  }

  [[noreturn]] void fail(const YAML::Node& node, const std::string& path,
                         const std::string& expected) const {
    throw ConfigError(line_of(node, path, "expected " + expected + ", found " + described(node)));
  }

  void fill_field(const YAML::Node& node, Message& message, const FieldDescriptor& field,
                  const std::string& path);
  void fill_map(const YAML::Node& node, Message& message, const FieldDescriptor& field,
                const std::string& path);
  void fill_list(const YAML::Node& node, Message& message, const FieldDescriptor& field,
                 const std::string& path);
  void fill_scalar(const YAML::Node& node, Message& message, const FieldDescriptor& field,
                   const std::string& path);
  void keep_unknown(const YAML::Node& key, const YAML::Node& value, Message& message,
                    const std::string& path);
  [[nodiscard]] std::string key_text(const YAML::Node& key, const std::string& path,
                                     std::set<std::string>& seen) const;
  [[nodiscard]] bool flag(const YAML::Node& node, const std::string& path) const;
  [[nodiscard]] double number(const YAML::Node& node, const std::string& path) const;
  template <typename T>
  [[nodiscard]] T whole_number(const YAML::Node& node, const std::string& path) const;
  [[nodiscard]] int enum_number(const YAML::Node& node, const FieldDescriptor& field,
                                const std::string& path) const;

  // Aliases let a short file stand for any number of values.
  void count_value(const YAML::Node& node, const std::string& path);

  const std::string& file_;
  std::vector<std::string> unknown_;
  std::size_t values_ = 0;
  std::size_t kept_ = 0;  // characters of unknown values
};

void Filler::count_value(const YAML::Node& node, const std::string& path) {
  if (++values_ <= kMostValues) return;
  throw ConfigError(line_of(node, path,
                            "expected at most " + std::to_string(kMostValues) +
                                " values in a file, each alias counted as what it stands for"));
}

void Filler::fill_message(const YAML::Node& node, Message& message, const std::string& path) {
  if (node.IsNull()) return;
  if (!node.IsMap()) fail(node, path.empty() ? "top level" : path, "keys and values");
  const Descriptor& type = *message.GetDescriptor();
  std::set<std::string> seen;
  for (const auto& entry : node) {
    const std::string key = key_text(entry.first, path, seen);
    count_value(entry.first, joined(path, key));
    const FieldDescriptor* field = type.FindFieldByName(key);
    if (field == nullptr || field == extra_field(type)) {
      keep_unknown(entry.first, entry.second, message, joined(path, key));
    } else {
      fill_field(entry.second, message, *field, joined(path, key));
    }
  }
}

std::string Filler::key_text(const YAML::Node& key, const std::string& path,
                             std::set<std::string>& seen) const {
  if (!key.IsScalar()) fail(key, path.empty() ? "top level" : path, "a key");
  if (key.Scalar().size() > kLongestKey) {
    throw ConfigError(line_of(key, joined(path, key.Scalar().substr(0, kLongestKey) + "..."),
                              "expected a key of at most " + std::to_string(kLongestKey) +
                                  " characters, found " + std::to_string(key.Scalar().size())));
  }
  if (!seen.insert(key.Scalar()).second) {
    throw ConfigError(line_of(key, joined(path, key.Scalar()), "this key stands twice"));
  }
  return key.Scalar();
}

void Filler::keep_unknown(const YAML::Node& key, const YAML::Node& value, Message& message,
                          const std::string& path) {
  const Descriptor& type = *message.GetDescriptor();
  unknown_.push_back(
      line_of(key, path, "unknown key" + twin::suggestion(key.Scalar(), key_names(type))));
  const FieldDescriptor* extra = extra_field(type);
  if (extra == nullptr) return;
  std::string json;
  const bool whole = append_json(value, 0, json);
  kept_ += json.size();
  if (!whole || kept_ > kLongestUnknown) {
    throw ConfigError(
        line_of(key, path, "unknown key whose value, or a key in it, is too long to keep"));
  }
  Message& entry = *message.GetReflection()->AddMessage(&message, extra);
  const Descriptor& pair = *entry.GetDescriptor();
  entry.GetReflection()->SetString(&entry, pair.map_key(), key.Scalar());
  entry.GetReflection()->SetString(&entry, pair.map_value(), json);
}

void Filler::fill_field(const YAML::Node& node, Message& message, const FieldDescriptor& field,
                        const std::string& path) {
  if (field.is_map()) return fill_map(node, message, field, path);
  if (field.is_repeated()) return fill_list(node, message, field, path);
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
    return fill_message(node, *message.GetReflection()->MutableMessage(&message, &field), path);
  }
  fill_scalar(node, message, field, path);
}

void Filler::fill_map(const YAML::Node& node, Message& message, const FieldDescriptor& field,
                      const std::string& path) {
  if (node.IsNull()) return;
  if (!node.IsMap()) fail(node, path, "keys and values");
  std::set<std::string> seen;
  for (const auto& item : node) {
    const std::string key = key_text(item.first, path, seen);
    count_value(item.first, joined(path, key));
    Message& entry = *message.GetReflection()->AddMessage(&message, &field);
    const Descriptor& pair = *entry.GetDescriptor();
    fill_field(item.first, entry, *pair.map_key(), joined(path, key));
    fill_field(item.second, entry, *pair.map_value(), joined(path, key));
  }
}

void Filler::fill_list(const YAML::Node& node, Message& message, const FieldDescriptor& field,
                       const std::string& path) {
  if (node.IsNull()) return;
  if (!node.IsSequence()) fail(node, path, "a list");
  for (std::size_t i = 0; i < node.size(); ++i) {
    count_value(node, element(path, i));
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      fill_message(node[i], *message.GetReflection()->AddMessage(&message, &field),
                   element(path, i));
    } else {
      fill_scalar(node[i], message, field, element(path, i));
    }
  }
}

// Sets a single field, appends to a list.
void Filler::fill_scalar(const YAML::Node& node, Message& message, const FieldDescriptor& field,
                         const std::string& path) {
  const Reflection& reflection = *message.GetReflection();
  const auto put = [&](auto set, auto add, auto value) {
    if (field.is_repeated()) {
      (reflection.*add)(&message, &field, std::move(value));
    } else {
      (reflection.*set)(&message, &field, std::move(value));
    }
  };
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return put(&Reflection::SetDouble, &Reflection::AddDouble, number(node, path));
    case FieldDescriptor::CPPTYPE_FLOAT:
      return put(&Reflection::SetFloat, &Reflection::AddFloat,
                 static_cast<float>(number(node, path)));
    case FieldDescriptor::CPPTYPE_INT32:
      return put(&Reflection::SetInt32, &Reflection::AddInt32,
                 whole_number<std::int32_t>(node, path));
    case FieldDescriptor::CPPTYPE_INT64:
      return put(&Reflection::SetInt64, &Reflection::AddInt64,
                 whole_number<std::int64_t>(node, path));
    case FieldDescriptor::CPPTYPE_UINT32:
      return put(&Reflection::SetUInt32, &Reflection::AddUInt32,
                 whole_number<std::uint32_t>(node, path));
    case FieldDescriptor::CPPTYPE_UINT64:
      return put(&Reflection::SetUInt64, &Reflection::AddUInt64,
                 whole_number<std::uint64_t>(node, path));
    case FieldDescriptor::CPPTYPE_BOOL:
      return put(&Reflection::SetBool, &Reflection::AddBool, flag(node, path));
    case FieldDescriptor::CPPTYPE_ENUM:
      return put(&Reflection::SetEnumValue, &Reflection::AddEnumValue,
                 enum_number(node, field, path));
    case FieldDescriptor::CPPTYPE_STRING:
      if (!node.IsScalar()) fail(node, path, "a text");
      return put(&Reflection::SetString, &Reflection::AddString, std::string(node.Scalar()));
    case FieldDescriptor::CPPTYPE_MESSAGE:
      break;
  }
  fail(node, path, "a single value");
}

bool Filler::flag(const YAML::Node& node, const std::string& path) const {
  const bool plain = node.IsScalar() && node.Tag() != "!";
  if (plain && node.Scalar() == "true") return true;
  if (plain && node.Scalar() == "false") return false;
  fail(node, path, "true or false");
}

double Filler::number(const YAML::Node& node, const std::string& path) const {
  if (const auto value = finite_number(node)) return *value;
  fail(node, path, "a plain number" + unit_hint(path));
}

template <typename T>
T Filler::whole_number(const YAML::Node& node, const std::string& path) const {
  if (const auto value = parsed<T>(node)) return *value;
  fail(node, path,
       "a whole number from " + std::to_string(std::numeric_limits<T>::min()) + " to " +
           std::to_string(std::numeric_limits<T>::max()));
}

int Filler::enum_number(const YAML::Node& node, const FieldDescriptor& field,
                        const std::string& path) const {
  const auto& type = *field.enum_type();
  if (node.IsScalar()) {
    if (const auto* value = type.FindValueByName(node.Scalar())) return value->number();
  }
  std::string names;
  for (int i = 0; i < type.value_count(); ++i) {
    names += (i == 0 ? "" : ", ") + type.value(i)->name();
  }
  fail(node, path, "one of " + names);
}

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
    throw ConfigError(name + ':' + std::to_string(error.mark.line + 1) +
                      ": not valid YAML: " + error.msg);
  }
}

std::vector<std::string> YamlDocument::fill(Message& message) const {
  Filler filler(content_->name);
  filler.fill_message(content_->root, message, "");
  return filler.take_unknown();
}

ConfigError YamlDocument::error(std::string_view key, std::string_view what) const {
  YAML::Node node = content_->root;
  for (const std::string& part : path_parts(key)) {
    const YAML::Node next = child(node, part);
    if (!next.IsDefined()) break;
    node.reset(next);
  }
  return ConfigError(content_->name + ':' + std::to_string(node.Mark().line + 1) + ": " +
                     std::string(key) + ": " + std::string(what));
}

void load_message(const std::filesystem::path& path, Message& message) {
  const auto unknown = YamlDocument::read(path).fill(message);
  if (!unknown.empty()) throw ConfigError(unknown.front());
}

}  // namespace zerodrift::config
