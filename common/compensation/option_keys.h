// SPDX-License-Identifier: Apache-2.0
// Every key of the configuration once: its name, unit, range and meaning, and what it decides. The
// configuration file, the checks of ranges, the identity of a saved state, `zerodrift config` and
// the reference page are visitors of this one description.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/compensation/options.h"

namespace zerodrift::compensation {

// What changes with a key's value, and so what may not be shared between two values of it.
enum class Decides : std::uint8_t {
  kModel,    // what a learner's numbers mean: a learner saved with another value can't be continued
  kAnswers,  // what the data path answers from equal inputs
};

// Of a number, in the key's unit.
struct OptionRange {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool above_low = false;  // `low` itself is outside

  [[nodiscard]] bool contains(double value) const noexcept {
    return std::isfinite(value) && (above_low ? value > low : value >= low) && value <= high;
  }
  // "0.1 to 100", "a number above 0, at most 10"; empty where every finite number is allowed.
  [[nodiscard]] std::string text() const;
};

struct OptionKey {
  std::string name;  // the path in the configuration file, such as svr.epsilon
  Decides decides = Decides::kAnswers;
  const char* text = "";  // what it means, for the reference page
  OptionRange range{};
  double si_per_unit = 1.0;  // rad/s for a key in deg/h; the name's ending says the unit
  // Why a file may not give the key beside the values before it; null where it may.
  const char* refused = nullptr;
  // A member without a key of its own: part of the identity, not of the file.
  bool internal = false;
  bool required = false;  // wherever its group is given
  // Empty, it is no part of the identity: states from before there was such a key go on.
  bool only_if_given = false;
};

// Sees each key in the order of the reference page, and may set the value. Numbers are in SI.
class OptionVisitor {
 public:
  virtual ~OptionVisitor() = default;
  // A group of keys follows: `name` is the path that they share.
  virtual void section(const std::string& name, const char* text) = 0;
  // A list of groups follows, visited as name[0], name[1], ... A number of them that is returned
  // replaces those that were there by new ones.
  virtual std::optional<std::size_t> groups(const std::string& name, const char* text) = 0;

  virtual void number(const OptionKey& key, double& value) = 0;
  virtual void number(const OptionKey& key, std::optional<double>& value) = 0;
  virtual void count(const OptionKey& key, std::size_t& value) = 0;
  virtual void flag(const OptionKey& key, bool& value) = 0;
  virtual void text(const OptionKey& key, std::string& value) = 0;
  // `chosen` is an index of `names`.
  virtual void choice(const OptionKey& key, std::span<const std::string_view> names,
                      std::size_t& chosen) = 0;
  virtual void numbers(const OptionKey& key, std::vector<double>& values) = 0;
  virtual void texts(const OptionKey& key, std::vector<std::string>& values) = 0;
  virtual void model(const OptionKey& key, std::optional<twin::Model>& value) = 0;
};

// Shows every key to the visitor. A visitor that sets nothing leaves `options` as they are.
void describe(CompensationOptions& options, OptionVisitor& visitor);

// A visitor that looks at values as text: numbers exactly, in the fewest digits and in the key's
// unit; nothing for an optional one that is absent; a prior by its identity.
class OptionTextVisitor : public OptionVisitor {
 public:
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

 private:
  virtual void see(const OptionKey& key, const std::string& value) = 0;
};

// One key with its value as text: numbers exactly, in the fewest digits and in the key's unit.
struct OptionValue {
  std::string key;
  std::string value;
};

// All keys, internal ones too, that decide this. Two options with the same ones of kModel may
// continue each other's learner; with those of kAnswers as well, equal inputs give equal samples.
[[nodiscard]] std::vector<OptionValue> option_values(const CompensationOptions& options,
                                                     Decides decides);

// The first number outside its range, as "key: found this, expected that".
[[nodiscard]] std::optional<std::string> find_out_of_range(const CompensationOptions& options);

// A number in the fewest digits that give it back, and in six digits for people.
[[nodiscard]] std::string exact_text(double value);
[[nodiscard]] std::string short_text(double value);

// Names of the schemes, as scheme takes them.
[[nodiscard]] std::span<const std::string_view> scheme_names();
[[nodiscard]] Scheme scheme_named(std::string_view name);  // one of them

}  // namespace zerodrift::compensation
