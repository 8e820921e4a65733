// SPDX-License-Identifier: Apache-2.0
#include "common/config/configuration_text.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <span>
#include <string_view>

#include "common/compensation/drift_prior.h"
#include "common/compensation/option_keys.h"

namespace zerodrift::config {
namespace {

using compensation::CompensationOptions;
using compensation::OptionKey;

constexpr double kUnlimited = 1e30;  // what the options have for a limit that is none
constexpr const char* kNoLimit = "no limit";

std::string leaf_of(const std::string& path) {
  return path.substr(path.rfind('.') + 1);
}

std::string listed(std::span<const std::string_view> names) {
  std::string all;
  for (const auto name : names) all += (all.empty() ? "" : " | ") + std::string(name);
  return all;
}

// A word that YAML reads back as the text it is.
std::string quoted(const std::string& text) {
  const auto is_plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
  };
  const bool is_word = !text.empty() && std::isalpha(static_cast<unsigned char>(text.front())) &&
                       std::all_of(text.begin(), text.end(), is_plain);
  if (is_word) return text;
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("''") : std::string(1, c);
  return result + "'";
}

// Six digits where they give the value back to the bit, else as many as it takes.
std::string number_text(const OptionKey& key, double value) {
  const std::string six = compensation::short_text(value / key.si_per_unit);
  const bool is_exact = std::strtod(six.c_str(), nullptr) * key.si_per_unit == value;
  return is_exact ? six : compensation::exact_text(value / key.si_per_unit);
}

class YamlWriter final : public compensation::OptionTextVisitor {
 public:
  std::string yaml;

  void section(const std::string& name, const char* text) override {
    yaml += "\n# " + std::string(text) + '\n';
    if (!name.empty()) yaml += name + ":\n";
  }
  std::optional<std::size_t> groups(const std::string& name, const char* text) override {
    section(name, text);
    return std::nullopt;
  }
  void number(const OptionKey& key, double& value) override {
    if (value == kUnlimited) {
      put(key, kNoLimit);
    } else {
      put(key, number_text(key, value));
    }
  }
  void number(const OptionKey& key, std::optional<double>& value) override {
    if (value) put(key, number_text(key, *value));
  }
  void text(const OptionKey& key, std::string& value) override {
    if (!value.empty()) put(key, quoted(value));
  }
  void choice(const OptionKey& key, std::span<const std::string_view> names,
              std::size_t& chosen) override {
    put(key, std::string(names[chosen]), listed(names));
  }
  void numbers(const OptionKey& key, std::vector<double>& values) override {
    std::string list;
    for (const double value : values) list += (list.empty() ? "" : ", ") + number_text(key, value);
    put(key, '[' + list + ']');
  }
  void texts(const OptionKey& key, std::vector<std::string>& values) override {
    std::string list;
    for (const std::string& value : values) list += (list.empty() ? "" : ", ") + quoted(value);
    put(key, '[' + list + ']');
  }
  void model(const OptionKey& key, std::optional<twin::Model>& value) override {
    if (value) yaml += "# " + key.name + ": " + compensation::prior_identity(*value) + '\n';
  }

 private:
  void see(const OptionKey& key, const std::string& value) override {
    if (!value.empty()) put(key, value);
  }

  void put(const OptionKey& key, const std::string& value, const std::string& choices = "") {
    if (key.internal || key.refused != nullptr) return;
    const std::string allowed = choices.empty() ? key.range.text() : choices;
    const bool is_element = key.name.find("].") != std::string::npos;
    const bool is_grouped = key.name.find('.') != std::string::npos;
    yaml += is_element ? (leaf_of(key.name) == "kind" ? "  - " : "    ") : is_grouped ? "  " : "";
    // What no file can say is the default: a comment.
    if (value == kNoLimit) yaml += "# ";
    yaml += leaf_of(key.name) + ": " + value + "  # " + (allowed.empty() ? "" : allowed + ". ") +
            key.text + '\n';
  }
};

class ReferenceWriter final : public compensation::OptionTextVisitor {
 public:
  using OptionTextVisitor::number;
  std::string page;

  void section(const std::string& name, const char* text) override {
    page += "\n## " + (name.empty() ? "Others" : '`' + name + '`') + "\n" + text + "\n\n" +
            kReferenceHead;
  }
  std::optional<std::size_t> groups(const std::string& name, const char* text) override {
    section(name, text);
    return 1;  // one of each key
  }
  void number(const OptionKey& key, double& value) override {
    const bool is_unlimited = value >= kUnlimited;
    put(key, is_unlimited ? kNoLimit : compensation::short_text(value / key.si_per_unit),
        key.range.text());
  }
  void choice(const OptionKey& key, std::span<const std::string_view> names,
              std::size_t& chosen) override {
    put(key, std::string(names[chosen]), listed(names));
  }

 private:
  void see(const OptionKey& key, const std::string& value) override {
    put(key, value, key.range.text());
  }
  void put(const OptionKey& key, const std::string& value, const std::string& allowed) {
    if (key.internal) return;
    if (page.empty()) {
      page = std::string(
                 "# Configuration of the compensation\n\n"
                 "Made from the program (`zerodrift config reference`); a test compares. YAML or "
                 "JSON; a "
                 "key left out keeps its default. Times are in s, temperatures in °C; the end of a "
                 "name "
                 "tells other units. `zerodrift config show --config FILE` prints what is in "
                 "force.\n\n") +
             kReferenceHead;
    }
    page += reference_row(leaf_of(key.name), value, allowed, key.text);
  }
};

}  // namespace

std::string effective_yaml(const CompensationOptions& options) {
  CompensationOptions copy = options;
  YamlWriter writer;
  compensation::describe(copy, writer);
  return writer.yaml;
}

std::string reference_row(const std::string& name, const std::string& value, std::string allowed,
                          const std::string& text) {
  for (std::size_t at = 0; (at = allowed.find('|', at)) != std::string::npos; at += 2)
    allowed.insert(at, 1, '\\');
  return "| `" + name + "` | " + value + " | " + allowed + " | " + text + " |\n";
}

std::string configuration_reference() {
  CompensationOptions defaults;
  ReferenceWriter writer;
  compensation::describe(defaults, writer);
  return writer.page;
}

}  // namespace zerodrift::config
