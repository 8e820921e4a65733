// SPDX-License-Identifier: Apache-2.0
#include "common/twin/formula.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "common/core/closest_name.h"
#include "common/twin/formula_amplitudes.h"
#include "common/twin/formula_units.h"

namespace zerodrift::twin {

std::span<const std::string> formula_inputs() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names;
    for (const std::string& place : temperature_point_names()) names.push_back("T_" + place);
    for (const char* quantity : {"B_", "a_", "w_"}) {
      for (const core::Axis axis : core::kAxes)
        names.push_back(quantity + std::string(core::name(axis)));
    }
    for (const char* other : {"vibration", "source_current", "supply", "time_on"})
      names.emplace_back(other);
    return names;
  }();
  return kNames;
}

std::optional<TemperaturePoint> formula_temperature(std::size_t input) {
  if (input >= kTemperaturePointCount) return std::nullopt;
  return static_cast<TemperaturePoint>(input);
}

std::string FormulaProblem::text() const {
  return "at character " + std::to_string(position) + ": " + what;
}

namespace {

using Operation = FormulaOperation;

constexpr double kLargestNumber = 1e12;
constexpr std::size_t kHighestPower = 6;
constexpr int kHighestUnitPower = 24;
constexpr std::size_t kLongestName = 31;

const std::vector<std::string>& functions() {
  static const std::vector<std::string> kNames{"abs", "tanh", "exp",   "rate",
                                               "lag", "play", "spline"};
  return kNames;
}

bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}
bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

std::string number_text(double value) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  return {buffer.data(), end};
}

// A node made, where it begins, and what it measures.
struct Part {
  std::size_t node = 0;
  std::size_t position = 0;
  FormulaUnit unit = FormulaUnit::none();
};

class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text) {}

  Formula run() {
    if (text_.size() > Formula::kLongest) {
      fail(Formula::kLongest, "the formula has " + std::to_string(text_.size()) +
                                  " characters, at most " + std::to_string(Formula::kLongest) +
                                  " are taken");
    }
    std::vector<FormulaSummand> summands;
    sum(0, &summands);
    skip_spaces();
    if (at_ < text_.size()) fail(at_, found() + ", expected an operator or the end");
    find_amplitudes(formula_, summands);
    if (!reads_an_input_) fail(0, "the formula reads no input; valid: " + listed(formula_inputs()));
    return std::move(formula_);
  }

  [[nodiscard]] static std::string listed(std::span<const std::string> names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
    return text;
  }

 private:
  [[noreturn]] static void fail(std::size_t at, std::string what) {
    throw FormulaProblem{at + 1, std::move(what)};
  }

  void skip_spaces() {
    while (at_ < text_.size() && text_[at_] == ' ') ++at_;
  }
  [[nodiscard]] char next() {
    skip_spaces();
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  bool takes(char c) {
    if (next() != c || at_ >= text_.size()) return false;
    ++at_;
    return true;
  }
  [[nodiscard]] std::string found() {
    if (next() == '\0' && at_ >= text_.size()) return "found the end";
    const char c = text_[at_];
    if (c < ' ' || c > '~') return "found a character that no formula has";
    return std::string("found '") + c + "'";
  }
  void expect(char c) {
    if (!takes(c)) fail(at_, found() + ", expected '" + c + "'");
  }

  Part make(FormulaNode node, std::size_t position, FormulaUnit unit) {
    if (formula_.nodes.size() == Formula::kMostNodes) {
      fail(position, "the formula has more than " + std::to_string(Formula::kMostNodes) +
                         " numbers, names and operations, which is the most taken");
    }
    if (unit.highest_power() > kHighestUnitPower) {
      fail(position, "found the unit " + unit.text() + ", expected powers of a unit up to " +
                         std::to_string(kHighestUnitPower));
    }
    formula_.nodes.push_back(node);
    return {formula_.nodes.size() - 1, position, unit};
  }

  Part binary(Operation operation, const Part& left, const Part& right, std::size_t at) {
    std::optional<FormulaUnit> unit;
    if (operation == Operation::kMultiply) {
      unit = left.unit.times(right.unit);
    } else if (operation == Operation::kDivide) {
      unit = left.unit.over(right.unit);
    } else {
      unit = left.unit.beside(right.unit);
    }
    if (!unit) {
      fail(at, "found " + left.unit.text() + " and " + right.unit.text() +
                   " in one sum, expected one unit; a parameter as a factor takes any");
    }
    return make({.operation = operation, .left = left.node, .right = right.node}, left.position,
                *unit);
  }

  // Of the whole formula: also its summands.
  Part sum(std::size_t depth, std::vector<FormulaSummand>* summands = nullptr) {
    if (depth > Formula::kDeepest) {
      fail(at_, "more than " + std::to_string(Formula::kDeepest) +
                    " parentheses, functions and signs in each other, which is the most taken");
    }
    Part result = product(depth);
    if (summands != nullptr) summands->push_back({result.node, result.position});
    while (next() == '+' || next() == '-') {
      const std::size_t at = at_;
      const auto operation = text_[at_++] == '+' ? Operation::kAdd : Operation::kSubtract;
      const Part right = product(depth);
      if (summands != nullptr) summands->push_back({right.node, right.position});
      result = binary(operation, result, right, at);
    }
    return result;
  }

  Part product(std::size_t depth) {
    Part result = factor(depth);
    while (next() == '*' || next() == '/') {
      const std::size_t at = at_;
      const auto operation = text_[at_++] == '*' ? Operation::kMultiply : Operation::kDivide;
      result = binary(operation, result, factor(depth), at);
    }
    return result;
  }

  Part factor(std::size_t depth) {
    const char c = next();
    const std::size_t at = at_;
    if (c == '-') {
      ++at_;
      if (depth >= Formula::kDeepest) return sum(depth + 1);  // tells that it is too deep
      const Part of = factor(depth + 1);
      return make({.operation = Operation::kNegate, .left = of.node}, at, of.unit);
    }
    const Part base = atom(depth);
    if (!takes('^')) return base;
    const char digit = next();
    const bool is_power =
        digit >= '1' && digit <= static_cast<char>('0' + kHighestPower) &&
        (at_ + 1 >= text_.size() || (!is_digit(text_[at_ + 1]) && text_[at_ + 1] != '.'));
    if (!is_power) fail(at_, found() + ", expected a power of 1 to 6");
    const auto exponent = static_cast<std::size_t>(digit - '0');
    ++at_;
    if (next() == '^') fail(at_, "found a power of a power, expected one power");
    return make({.operation = Operation::kPower, .which = exponent, .left = base.node}, at,
                base.unit.to_the(static_cast<int>(exponent)));
  }

  Part atom(std::size_t depth) {
    const char c = next();
    if (is_digit(c) || c == '.') return number();
    if (is_letter(c)) return named(depth);
    if (!takes('(')) {
      fail(at_, found() + ", expected a number, an input, a parameter, a function or '('");
    }
    Part inner = sum(depth + 1);
    expect(')');
    return inner;
  }

  Part number() {
    const std::size_t at = at_;
    return make({.operation = Operation::kNumber, .number = number_value()}, at,
                FormulaUnit::of_number());
  }

  double number_value() {
    double value = 0.0;
    const auto [end, error] =
        std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
    if (error != std::errc() || !(std::abs(value) <= kLargestNumber))
      fail(at_, "found a number beyond 1e12 or none, expected one like 18 or 2.5e-3");
    at_ = static_cast<std::size_t>(end - text_.data());
    return value;
  }

  [[nodiscard]] std::string name() {
    const std::size_t at = at_;
    while (at_ < text_.size() && (is_letter(text_[at_]) || is_digit(text_[at_]))) ++at_;
    if (at_ - at > kLongestName) fail(at, "found a name of more than 31 characters");
    return std::string(text_.substr(at, at_ - at));
  }

  Part named(std::size_t depth) {
    const std::size_t at = at_;
    const std::string word = name();
    const bool is_called = next() == '(';
    const auto& known = functions();
    const bool is_function = std::find(known.begin(), known.end(), word) != known.end();
    if (is_called && !is_function)
      fail(at, "no function is called '" + word + "'" + core::suggestion(word, known));
    if (is_called) return call(word, at, depth);
    if (is_function) fail(at_, found() + ", expected '(' after " + word);
    if (const auto input = input_called(word)) return of_input(*input, at);
    refuse_misspelt(word, at);
    return of_parameter(word, at);
  }

  [[nodiscard]] static std::optional<std::size_t> input_called(const std::string& word) {
    const auto names = formula_inputs();
    const auto found = std::find(names.begin(), names.end(), word);
    if (found == names.end()) return std::nullopt;
    return static_cast<std::size_t>(found - names.begin());
  }

  // What begins as an input does, or is but for a letter or two, is meant as one.
  static void refuse_misspelt(const std::string& word, std::size_t at) {
    constexpr std::size_t kShortestGuessed = 5;
    const auto names = formula_inputs();
    const bool begins_so = word.starts_with("T_") || word.starts_with("B_") ||
                           word.starts_with("a_") || word.starts_with("w_");
    const bool is_near =
        word.size() >= kShortestGuessed && core::closest_name(word, names, 1).has_value();
    if (begins_so || is_near)
      fail(at, "no input is called '" + word + "'" + core::suggestion(word, names));
  }

  Part of_input(std::size_t input, std::size_t at) {
    reads_an_input_ = true;
    return make({.operation = Operation::kInput, .which = input}, at, FormulaUnit::of_input(input));
  }

  Part of_parameter(const std::string& word, std::size_t at) {
    auto& all = formula_.parameters;
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const auto& p) { return p.name == word; });
    const auto place = static_cast<std::size_t>(found - all.begin());
    if (found == all.end()) {
      const std::size_t others = all.size() - of_splines_;
      if (others == Formula::kMostParameters) {
        fail(at, "'" + word + "' is parameter " + std::to_string(others + 1) + ", at most " +
                     std::to_string(Formula::kMostParameters) + " are taken");
      }
      all.push_back({word});
    }
    return make({.operation = Operation::kParameter, .which = place}, at,
                FormulaUnit::of_parameter());
  }

  Part call(const std::string& function, std::size_t at, std::size_t depth) {
    expect('(');
    if (function == "rate") return rate_call(at);
    const Part of = sum(depth + 1);
    if (function == "lag" || function == "play") {
      expect(',');
      const bool is_lag = function == "lag";
      const Part constant = constant_of(function, "second", of.unit);
      const Part below = is_lag && takes(',') ? constant_of(function, "third", of.unit) : constant;
      expect(')');
      return make({.operation = is_lag ? Operation::kLag : Operation::kPlay,
                   .left = of.node,
                   .right = constant.node,
                   .third = below.node},
                  at, of.unit);
    }
    if (function == "spline") return spline_call(of, at);
    expect(')');
    if (function == "abs")
      return make({.operation = Operation::kAbs, .left = of.node}, at, of.unit);
    if (!of.unit.may_be_none()) {
      fail(of.position, "found " + of.unit.text() + " in " + function +
                            ", expected none; a parameter as a factor or divisor takes it away");
    }
    return make(
        {.operation = function == "tanh" ? Operation::kTanh : Operation::kExp, .left = of.node}, at,
        FormulaUnit::none());
  }

  Part rate_call(std::size_t at) {
    skip_spaces();
    const std::size_t begin = at_;
    const std::string word = name();
    const auto input = input_called(word);
    if (!input) {
      fail(begin, (word.empty() ? found() : "found '" + word + "'") +
                      ", expected the name of an input: rate takes nothing else");
    }
    const Part of = of_input(*input, begin);
    expect(')');
    return make({.operation = Operation::kRate, .left = of.node}, at, of.unit.per_second());
  }

  Part spline_call(const Part& of, std::size_t at) {
    FormulaSpline spline{.first_parameter = formula_.parameters.size()};
    expect(',');
    spline.from = end_of_spline();
    expect(',');
    const std::size_t end = at_;
    spline.to = end_of_spline();
    if (!(spline.from < spline.to)) {
      fail(end, "found a spline from " + number_text(spline.from) + " to " +
                    number_text(spline.to) + ", expected an end above its begin");
    }
    while (takes(',')) {
      coefficient_of_spline();
      ++spline.count;
    }
    expect(')');
    if (spline.count < Formula::kFewestOfSplines) {
      fail(at, "found a spline of " + std::to_string(spline.count) + " parameters, expected " +
                   std::to_string(Formula::kFewestOfSplines) + " or more");
    }
    formula_.splines.push_back(spline);
    return make(
        {.operation = Operation::kSpline, .which = formula_.splines.size() - 1, .left = of.node},
        at, FormulaUnit::of_parameter());
  }

  double end_of_spline() {
    const bool is_negative = takes('-');
    const char c = next();
    if (!is_digit(c) && c != '.') fail(at_, found() + ", expected a number: an end of the spline");
    const double value = number_value();
    return is_negative ? -value : value;
  }

  void coefficient_of_spline() {
    skip_spaces();
    const std::size_t at = at_;
    const std::string word = name_of_parameter("a parameter of the spline");
    auto& all = formula_.parameters;
    if (std::any_of(all.begin(), all.end(), [&](const auto& p) { return p.name == word; }))
      fail(at, "found '" + word + "' once more, expected a parameter of the spline's own");
    if (of_splines_ == Formula::kMostOfSplines) {
      fail(at, "found more than " + std::to_string(Formula::kMostOfSplines) +
                   " parameters of splines, which is the most taken");
    }
    ++of_splines_;
    all.push_back({word, FormulaUse::kAmplitude});
  }

  // Where nothing but a parameter may stand, or what `expected` says beside it.
  [[nodiscard]] std::string name_of_parameter(const std::string& expected) {
    const char c = next();
    const std::size_t at = at_;
    std::string word = is_letter(c) ? name() : std::string();
    const auto& known = functions();
    const bool is_parameter = !word.empty() && !input_called(word) &&
                              std::find(known.begin(), known.end(), word) == known.end();
    if (!is_parameter) {
      at_ = at;
      fail(at, found() + ", expected " + expected);
    }
    refuse_misspelt(word, at);
    return word;
  }

  // How far a lag or a play reaches.
  Part constant_of(const std::string& function, const std::string& place, const FormulaUnit& of) {
    const char c = next();
    const std::size_t at = at_;
    if (is_digit(c) || c == '.') {
      const Part part = number();
      const double value = formula_.nodes[part.node].number;
      if (function == "lag" && !(value <= kLongestLagS))
        fail(at, "found a lag of " + number_text(value) + " s, expected at most 1e5 s");
      return part;
    }
    const std::string word =
        name_of_parameter("a number or a parameter as the " + place + " argument of " + function);
    const Part part = of_parameter(word, at);
    auto& use = formula_.parameters[formula_.nodes[part.node].which].use;
    use = function == "lag"     ? FormulaUse::kLag
          : of.is_temperature() ? FormulaUse::kTemperatureWidth
                                : FormulaUse::kWidth;
    return part;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  Formula formula_;
  std::size_t of_splines_ = 0;  // parameters
  bool reads_an_input_ = false;
};

}  // namespace

std::variant<Formula, FormulaProblem> parse_formula(std::string_view text) {
  try {
    return Parser(text).run();
  } catch (FormulaProblem& problem) {
    return std::move(problem);
  }
}

}  // namespace zerodrift::twin
