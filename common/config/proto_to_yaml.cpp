// SPDX-License-Identifier: Apache-2.0
#include "common/config/proto_to_yaml.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace zerodrift::config {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

template <typename T>
std::string shortest(T value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

bool is_word(const std::string& text) {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  const auto is_plain = [&is_letter](char c) {
    return is_letter(c) || (c >= '0' && c <= '9') || c == '_';
  };
  return !text.empty() && is_letter(text.front()) &&
         std::all_of(text.begin(), text.end(), is_plain);
}

// Words that YAML takes for something else than text.
bool is_reserved(const std::string& text) {
  constexpr std::array<std::string_view, 7> kReserved{"true", "false", "null", "yes",
                                                      "no",   "on",    "off"};
  std::string lower = text;
  for (char& c : lower) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  return std::find(kReserved.begin(), kReserved.end(), lower) != kReserved.end();
}

std::string quoted(const std::string& text) {
  constexpr std::string_view kHex = "0123456789abcdef";
  if (is_word(text) && !is_reserved(text)) return text;
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += {'\\', c};
    } else if (byte < 0x20) {
      out += {'\\', 'x', kHex[byte >> 4U], kHex[byte & 15U]};
    } else {
      out += c;
    }
  }
  return out + '"';
}

// Value of a single field (`at` < 0) or of one element of a list.
std::string scalar(const Message& message, const FieldDescriptor& field, int at) {
  const Reflection& r = *message.GetReflection();
  const bool list = at >= 0;
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return shortest(list ? r.GetRepeatedDouble(message, &field, at)
                           : r.GetDouble(message, &field));
    case FieldDescriptor::CPPTYPE_FLOAT:
      return shortest(list ? r.GetRepeatedFloat(message, &field, at) : r.GetFloat(message, &field));
    case FieldDescriptor::CPPTYPE_INT32:
      return shortest(list ? r.GetRepeatedInt32(message, &field, at) : r.GetInt32(message, &field));
    case FieldDescriptor::CPPTYPE_INT64:
      return shortest(list ? r.GetRepeatedInt64(message, &field, at) : r.GetInt64(message, &field));
    case FieldDescriptor::CPPTYPE_UINT32:
      return shortest(list ? r.GetRepeatedUInt32(message, &field, at)
                           : r.GetUInt32(message, &field));
    case FieldDescriptor::CPPTYPE_UINT64:
      return shortest(list ? r.GetRepeatedUInt64(message, &field, at)
                           : r.GetUInt64(message, &field));
    case FieldDescriptor::CPPTYPE_BOOL:
      return (list ? r.GetRepeatedBool(message, &field, at) : r.GetBool(message, &field)) ? "true"
                                                                                          : "false";
    case FieldDescriptor::CPPTYPE_ENUM:
      return (list ? r.GetRepeatedEnum(message, &field, at) : r.GetEnum(message, &field))->name();
    case FieldDescriptor::CPPTYPE_STRING:
      return quoted(list ? r.GetRepeatedString(message, &field, at) : r.GetString(message, &field));
    case FieldDescriptor::CPPTYPE_MESSAGE: break;
  }
  throw std::logic_error(field.full_name() + " is no scalar");
}

bool is_extra(const FieldDescriptor& field) {
  return field.is_map() && field.name() == "extra";
}

// Keys and values of a map field, values as YAML text; those of `extra` are YAML (JSON) already.
std::map<std::string, std::string> entries(const Message& message, const FieldDescriptor& field) {
  std::map<std::string, std::string> sorted;
  const Reflection& reflection = *message.GetReflection();
  for (int i = 0; i < reflection.FieldSize(message, &field); ++i) {
    const Message& entry = reflection.GetRepeatedMessage(message, &field, i);
    const auto& pair = *entry.GetDescriptor();
    sorted[scalar(entry, *pair.map_key(), -1)] =
        is_extra(field) ? entry.GetReflection()->GetString(entry, pair.map_value())
                        : scalar(entry, *pair.map_value(), -1);
  }
  return sorted;
}

std::string flow_map(const std::map<std::string, std::string>& sorted) {
  std::string text;
  for (const auto& [key, value] : sorted) text += (text.empty() ? "" : ", ") + key + ": " + value;
  return '{' + text + '}';
}

std::string flow_list(const Message& message, const FieldDescriptor& field) {
  std::string text;
  for (int i = 0; i < message.GetReflection()->FieldSize(message, &field); ++i) {
    text += (i == 0 ? "" : ", ") + scalar(message, field, i);
  }
  return '[' + text + ']';
}

std::string block(const Message& message, const std::string& indent);

// "  - first: ...\n    second: ...\n" for each element.
std::string block_list(const Message& message, const FieldDescriptor& field,
                       const std::string& indent) {
  std::string text;
  const Reflection& reflection = *message.GetReflection();
  for (int i = 0; i < reflection.FieldSize(message, &field); ++i) {
    const Message& item = reflection.GetRepeatedMessage(message, &field, i);
    std::string lines = block(item, indent + "    ");
    if (lines.empty()) lines = indent + "    {}\n";
    lines[indent.size() + 2] = '-';
    text += lines;
  }
  return text;
}

std::string field_text(const Message& message, const FieldDescriptor& field,
                       const std::string& indent) {
  const std::string key = indent + field.name() + ":";
  if (is_extra(field)) {
    std::string text;
    for (const auto& [name, json] : entries(message, field)) {
      text += indent + name + ": " + json + '\n';
    }
    return text;
  }
  if (field.is_map()) return key + ' ' + flow_map(entries(message, field)) + '\n';
  const bool is_message = field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
  if (field.is_repeated()) {
    return is_message ? key + '\n' + block_list(message, field, indent)
                      : key + ' ' + flow_list(message, field) + '\n';
  }
  if (!is_message) return key + ' ' + scalar(message, field, -1) + '\n';
  const std::string inner =
      block(message.GetReflection()->GetMessage(message, &field), indent + "  ");
  return inner.empty() ? key + " {}\n" : key + '\n' + inner;
}

std::string block(const Message& message, const std::string& indent) {
  std::vector<const FieldDescriptor*> fields;
  message.GetReflection()->ListFields(message, &fields);  // those that are set, by number
  std::string text;
  for (const FieldDescriptor* field : fields) text += field_text(message, *field, indent);
  return text;
}

}  // namespace

std::string to_yaml(const Message& message) {
  return block(message, "");
}

}  // namespace zerodrift::config
