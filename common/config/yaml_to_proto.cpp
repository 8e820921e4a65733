// SPDX-License-Identifier: Apache-2.0
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <set>
#include <utility>

#include "common/config/yaml_document.h"
#include "common/config/yaml_place.h"
#include "common/core/closest_name.h"

namespace zerodrift::config {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

constexpr const char* kExtraField = "extra";
constexpr std::size_t kDeepestUnknown = 64;
constexpr std::size_t kLongestUnknown = 1U << 20U;  // characters, all unknown values together
constexpr std::size_t kMostValues = 100000;         // far above the largest model's

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

// Walks a YAML tree along a message type.
class Filler {
 public:
  explicit Filler(const std::string& file) : file_(file) {}

  void fill_message(const YAML::Node& node, Message& message, const std::string& path);
  [[nodiscard]] std::vector<std::string> take_unknown() { return std::move(unknown_); }

 private:
  [[nodiscard]] YamlPlace place(const YAML::Node& node, const std::string& path) const {
    return {file_, node, path};
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
  place(node, path)
      .refuse("expected at most " + std::to_string(kMostValues) +
              " values in a file, each alias counted as what it stands for");
}

void Filler::fill_message(const YAML::Node& node, Message& message, const std::string& path) {
  if (node.IsNull()) return;
  if (!node.IsMap()) place(node, path.empty() ? "top level" : path).fail("keys and values");
  const Descriptor& type = *message.GetDescriptor();
  std::set<std::string> seen;
  for (const auto& entry : node) {
    const std::string key = place(entry.first, path).key(seen);
    count_value(entry.first, joined(path, key));
    const FieldDescriptor* field = type.FindFieldByName(key);
    if (field == nullptr || field == extra_field(type)) {
      keep_unknown(entry.first, entry.second, message, joined(path, key));
    } else {
      fill_field(entry.second, message, *field, joined(path, key));
    }
  }
}

void Filler::keep_unknown(const YAML::Node& key, const YAML::Node& value, Message& message,
                          const std::string& path) {
  const Descriptor& type = *message.GetDescriptor();
  unknown_.push_back(
      place(key, path).line("unknown key" + core::suggestion(key.Scalar(), key_names(type))));
  const FieldDescriptor* extra = extra_field(type);
  if (extra == nullptr) return;
  std::string json;
  const bool whole = append_json(value, 0, json);
  kept_ += json.size();
  if (!whole || kept_ > kLongestUnknown) {
    place(key, path).refuse("unknown key whose value, or a key in it, is too long to keep");
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
  if (!node.IsMap()) place(node, path).fail("keys and values");
  std::set<std::string> seen;
  for (const auto& item : node) {
    const std::string key = place(item.first, path).key(seen);
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
  if (!node.IsSequence()) place(node, path).fail("a list");
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
  const YamlPlace here = place(node, path);
  const auto put = [&](auto set, auto add, auto value) {
    if (field.is_repeated()) {
      (reflection.*add)(&message, &field, std::move(value));
    } else {
      (reflection.*set)(&message, &field, std::move(value));
    }
  };
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return put(&Reflection::SetDouble, &Reflection::AddDouble, here.number());
    case FieldDescriptor::CPPTYPE_FLOAT:
      return put(&Reflection::SetFloat, &Reflection::AddFloat, static_cast<float>(here.number()));
    case FieldDescriptor::CPPTYPE_INT32:
      return put(&Reflection::SetInt32, &Reflection::AddInt32, here.whole_number<std::int32_t>());
    case FieldDescriptor::CPPTYPE_INT64:
      return put(&Reflection::SetInt64, &Reflection::AddInt64, here.whole_number<std::int64_t>());
    case FieldDescriptor::CPPTYPE_UINT32:
      return put(&Reflection::SetUInt32, &Reflection::AddUInt32,
                 here.whole_number<std::uint32_t>());
    case FieldDescriptor::CPPTYPE_UINT64:
      return put(&Reflection::SetUInt64, &Reflection::AddUInt64,
                 here.whole_number<std::uint64_t>());
    case FieldDescriptor::CPPTYPE_BOOL:
      return put(&Reflection::SetBool, &Reflection::AddBool, here.flag());
    case FieldDescriptor::CPPTYPE_ENUM:
      return put(&Reflection::SetEnumValue, &Reflection::AddEnumValue,
                 enum_number(node, field, path));
    case FieldDescriptor::CPPTYPE_STRING:
      return put(&Reflection::SetString, &Reflection::AddString, here.text());
    case FieldDescriptor::CPPTYPE_MESSAGE: break;
  }
  here.fail("a single value");
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
  place(node, path).fail("one of " + names);
}

}  // namespace

std::vector<std::string> YamlDocument::fill(Message& message) const {
  Filler filler(content_->name);
  filler.fill_message(content_->root, message, "");
  return filler.take_unknown();
}

}  // namespace zerodrift::config
