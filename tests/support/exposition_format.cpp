// SPDX-License-Identifier: Apache-2.0
#include "tests/support/exposition_format.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <sstream>
#include <string_view>

namespace zerodrift::test_support {
namespace {

struct Family {
  std::string help{};
  std::string type{};
};

// Of one histogram: the buckets of one set of labels, in their order.
struct Buckets {
  double newest = -1.0;
  std::optional<double> infinite{};
};

bool ends_with_any(const std::string& name, std::initializer_list<std::string_view> endings) {
  return std::any_of(endings.begin(), endings.end(),
                     [&](std::string_view ending) { return name.ends_with(ending); });
}

class Checker {
 public:
  std::vector<std::string> check(const std::string& text) {
    if (text.empty() || text.back() != '\n') tell("the last line has no end", "");
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) take(line);
    std::set<std::string> helps;
    for (const auto& [name, family] : families_) {
      lint(name, family);
      if (!helps.insert(family.help).second) tell("the help text of another metric", name);
    }
    for (const auto& [of, buckets] : buckets_) {
      if (!buckets.infinite) tell("a histogram without its bucket of infinity", of);
    }
    return problems_;
  }

 private:
  void tell(const std::string& problem, const std::string& where) {
    problems_.push_back(problem + ": " + where);
  }

  void take(const std::string& line) {
    static const std::regex kComment(R"(# (HELP|TYPE) ([a-zA-Z_:][a-zA-Z0-9_:]*) (.+))");
    static const std::regex kSample(
        R"re(([a-zA-Z_:][a-zA-Z0-9_:]*)(\{(.*)\})? ([-+]?[0-9.eE+-]+|NaN|Nan|[+-]?Inf)( [0-9]+)?)re");
    std::smatch match;
    if (std::regex_match(line, match, kComment)) {
      comment(match[1], match[2], match[3]);
    } else if (std::regex_match(line, match, kSample)) {
      sample(match[1], match[3], match[4], line);
    } else if (!line.empty()) {
      tell("no line of the format", line);
    }
  }

  void comment(const std::string& kind, const std::string& name, const std::string& text) {
    if (name != open_ && families_.contains(name)) tell("a family stands twice", name);
    open_ = name;
    std::string& field = kind == "HELP" ? families_[name].help : families_[name].type;
    if (!field.empty()) tell(kind + " stands twice", name);
    if (kind == "TYPE" && samples_.contains(name)) tell("its type comes after its samples", name);
    field = text;
  }

  void sample(const std::string& name, const std::string& labels, const std::string& value,
              const std::string& line) {
    const bool is_histogram = families_[open_].type == "histogram";
    const std::string ending = name.starts_with(open_) ? name.substr(open_.size()) : "?";
    const bool belongs = is_histogram
                             ? ending == "_bucket" || ending == "_sum" || ending == "_count"
                             : ending.empty();
    if (!belongs) tell("a sample outside of its family " + open_, line);
    samples_.insert(open_);
    if (!seen_.insert(name + "{" + labels + "}").second) tell("a sample stands twice", line);
    const auto le = read_labels(labels, line);
    if (le.has_value() != (is_histogram && ending == "_bucket"))
      tell("the label le is that of buckets", line);
    if (is_histogram) of_histogram(ending, without_le(labels), le.value_or(""), value, line);
  }

  // The value of le.
  std::optional<std::string> read_labels(const std::string& labels, const std::string& line) {
    static const std::regex kLabel(
        R"re(([a-zA-Z_][a-zA-Z0-9_]*)="((?:[^"\\\n]|\\[\\"n])*)"(,|$))re");
    std::set<std::string> names;
    std::optional<std::string> le;
    std::size_t read = 0;
    for (std::sregex_iterator label(labels.begin(), labels.end(), kLabel), end; label != end;
         ++label) {
      if (static_cast<std::size_t>(label->position()) != read) break;
      read += static_cast<std::size_t>(label->length());
      const std::string name = (*label)[1];
      if (!names.insert(name).second || name.starts_with("__")) tell("a wrong label", line);
      if (name == "le") le = (*label)[2];
      if (name == "quantile") tell("the label quantile is that of summaries", line);
    }
    if (read != labels.size()) tell("no labels of the format", line);
    return le;
  }

  static std::string without_le(const std::string& labels) {
    return std::regex_replace(labels, std::regex(R"re(,?le="[^"]*")re"), "");
  }

  void of_histogram(const std::string& ending, const std::string& labels, const std::string& le,
                    const std::string& value, const std::string& line) {
    const double count = std::strtod(value.c_str(), nullptr);
    if (!std::isfinite(count)) tell("a figure of a histogram that isn't finite", line);
    const std::string of = open_ + "{" + labels + "}";
    if (ending == "_bucket") {
      Buckets& buckets = buckets_[of];
      if (count < buckets.newest) tell("a bucket below the one before it", line);
      buckets.newest = count;
      if (le == "+Inf") buckets.infinite = count;
    } else if (ending == "_count") {
      counts_[of] = count;
    }
    const auto counted = counts_.find(of);
    const auto bucket = buckets_.find(of);
    if (counted != counts_.end() && bucket != buckets_.end() && bucket->second.infinite &&
        *bucket->second.infinite != counted->second)
      tell("the count is not that of the bucket of infinity", line);
  }

  void lint(const std::string& name, const Family& family) {
    if (name.empty()) return tell("samples without a family", "");
    static const std::regex kSentence(R"(\S+( \S+){2,}\.)");
    if (!std::regex_match(family.help, kSentence)) tell("no sentence as its help text", name);
    static const std::set<std::string> kTypes{"gauge", "counter", "histogram"};
    if (!kTypes.contains(family.type)) tell("no type", name);
    if ((family.type == "counter") != name.ends_with("_total"))
      tell("counters, and they alone, end in _total", name);
    if (family.type != "histogram" && ends_with_any(name, {"_count", "_sum", "_bucket"}))
      tell("the end of the name is a histogram's", name);
    if (std::regex_search(name, std::regex("[a-z][A-Z]|:"))) tell("camel case or a colon", name);
    std::istringstream parts(name);
    for (std::string part; std::getline(parts, part, '_');) lint_part(part, name);
  }

  void lint_part(const std::string& part, const std::string& name) {
    static const std::set<std::string> kAbbreviated{"s",  "ms", "us", "ns", "sec", "b", "kb",
                                                    "mb", "gb", "tb", "pb", "m",   "h", "d"};
    static const std::set<std::string> kTypeNames{"gauge", "counter", "histogram", "summary"};
    static const std::regex kNotBase(
        "(milli|micro|nano|kilo|mega|giga)?(minutes|hours|days|weeks|kelvins|fahrenheit|bits|"
        "inches|feet|miles|calories|pounds)|"
        "(milli|micro|nano|kilo|mega|giga)(seconds|bytes|meters|volts|grams|celsius)");
    if (kAbbreviated.contains(part)) tell("an abbreviated unit", name);
    if (kTypeNames.contains(part)) tell("a type in the name", name);
    if (std::regex_match(part, kNotBase)) tell("no base unit", name);
  }

  std::vector<std::string> problems_{};
  std::map<std::string, Family> families_{};
  std::string open_{};  // the family whose lines come
  std::set<std::string> samples_{};
  std::set<std::string> seen_{};
  std::map<std::string, Buckets> buckets_{};
  std::map<std::string, double> counts_{};
};

}  // namespace

std::vector<std::string> exposition_problems(const std::string& text) {
  return Checker().check(text);
}

}  // namespace zerodrift::test_support
