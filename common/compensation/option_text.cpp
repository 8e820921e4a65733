// SPDX-License-Identifier: Apache-2.0
// Visitors that look at keys as text or at their ranges.
#include <array>
#include <charconv>
#include <utility>

#include "common/compensation/drift_prior.h"
#include "common/compensation/option_keys.h"

namespace zerodrift::compensation {
namespace {

std::string joined(const std::vector<std::string>& parts) {
  std::string all;
  for (const std::string& part : parts) all += (all.empty() ? "" : ", ") + part;
  return all;
}

class ValuesOf : public OptionTextVisitor {
 public:
  explicit ValuesOf(Decides decides) : decides_(decides) {}
  std::vector<OptionValue> values;

  // The last key: where there is no prior there is none, and a prior too many is refused as such.
  void model(const OptionKey& key, std::optional<twin::Model>& value) override {
    if (value) OptionTextVisitor::model(key, value);
  }

 private:
  void see(const OptionKey& key, const std::string& value) override {
    if (key.decides != decides_ || (key.only_if_given && value.empty())) return;
    values.push_back({key.name, value});
  }
  Decides decides_;
};

class RangeCheck : public OptionTextVisitor {
 public:
  std::optional<std::string> wrong;

  void number(const OptionKey& key, double& value) override { check(key, value / key.si_per_unit); }
  void number(const OptionKey& key, std::optional<double>& value) override {
    if (value) check(key, *value / key.si_per_unit);
  }
  void count(const OptionKey& key, std::size_t& value) override {
    check(key, static_cast<double>(value));
  }
  void numbers(const OptionKey& key, std::vector<double>& values) override {
    for (const double value : values) check(key, value / key.si_per_unit);
  }

 private:
  void see(const OptionKey&, const std::string&) override {}
  void check(const OptionKey& key, double value) {
    if (wrong || key.range.text().empty() || key.refused || key.range.contains(value)) return;
    wrong = key.name + ": found " + short_text(value) + ", expected " + key.range.text();
  }
};

}  // namespace

void OptionTextVisitor::section(const std::string&, const char*) {}
std::optional<std::size_t> OptionTextVisitor::groups(const std::string&, const char*) {
  return std::nullopt;
}
void OptionTextVisitor::number(const OptionKey& key, double& value) {
  see(key, exact_text(value / key.si_per_unit));
}
void OptionTextVisitor::number(const OptionKey& key, std::optional<double>& value) {
  see(key, value ? exact_text(*value / key.si_per_unit) : "");
}
void OptionTextVisitor::count(const OptionKey& key, std::size_t& value) {
  see(key, std::to_string(value));
}
void OptionTextVisitor::flag(const OptionKey& key, bool& value) {
  see(key, value ? "true" : "false");
}
void OptionTextVisitor::text(const OptionKey& key, std::string& value) {
  see(key, value);
}
void OptionTextVisitor::choice(const OptionKey& key, std::span<const std::string_view> names,
                               std::size_t& chosen) {
  see(key, std::string(chosen < names.size() ? names[chosen] : "unknown"));
}
void OptionTextVisitor::numbers(const OptionKey& key, std::vector<double>& values) {
  std::vector<std::string> parts;
  for (const double value : values) parts.push_back(exact_text(value / key.si_per_unit));
  see(key, joined(parts));
}
void OptionTextVisitor::texts(const OptionKey& key, std::vector<std::string>& values) {
  see(key, joined(values));
}
void OptionTextVisitor::model(const OptionKey& key, std::optional<twin::Model>& value) {
  see(key, value ? prior_identity(*value) : "");
}

std::string OptionRange::text() const {
  if (!std::isfinite(low)) return "";
  if (std::isfinite(high) && !above_low) return short_text(low) + " to " + short_text(high);
  const std::string from = (above_low ? "a number above " : "a number from ") + short_text(low);
  return std::isfinite(high) ? from + ", at most " + short_text(high) : from;
}

std::string exact_text(double value) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  return {buffer.data(), end};
}

std::string short_text(double value) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                 std::chars_format::general, 6)
                       .ptr;
  return {buffer.data(), end};
}

std::vector<OptionValue> option_values(const CompensationOptions& options, Decides decides) {
  CompensationOptions copy = options.for_samples_every(0.0);
  ValuesOf values(decides);
  describe(copy, values);
  return std::move(values.values);
}

std::optional<std::string> find_out_of_range(const CompensationOptions& options) {
  CompensationOptions copy = options;
  RangeCheck check;
  describe(copy, check);
  return std::move(check.wrong);
}

}  // namespace zerodrift::compensation
