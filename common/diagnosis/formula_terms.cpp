// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/formula_terms.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "common/core/require.h"
#include "common/core/units.h"
#include "common/diagnosis/rounded_text.h"
#include "common/twin/formula.h"

namespace zerodrift::diagnosis {
namespace {

constexpr std::array<double, 4> kLagsS{60.0, 180.0, 600.0, 1800.0};
constexpr std::array<double, 5> kPlaysDegc{0.25, 0.5, 1.0, 2.0, 4.0};
// Of half the range.
constexpr std::array<double, 3> kWidths{0.1, 0.3, 1.0};
// Of a creep: its width, of half the range, and the times it may take either way.
constexpr double kCreepWidth = 0.3;
constexpr std::array<double, 3> kCreepsS{300.0, 1200.0, 4800.0};
constexpr std::array<double, 4> kExponentWidths{-1.5, -0.5, 0.5, 1.5};
// Centres of what has no zero: where a function bends at one, and where it only begins there.
constexpr int kBends = 12;
constexpr int kBegins = 4;

// Where a form is centred: at 0 where the operand has one.
std::vector<double> centres(const Operand& operand, int count) {
  if (operand.has_zero) return {0.0};
  std::vector<double> grid;
  for (int i = 0; i <= count; ++i)
    grid.push_back(operand.lowest + (operand.highest - operand.lowest) * i / count);
  return grid;
}

struct Moving {
  double lowest = 0.0;
  double highest = 0.0;

  [[nodiscard]] bool moves() const {
    constexpr double kLeast = 1e-9;  // of the values: what rounding leaves of a constant
    return highest - lowest > kLeast * std::max(std::abs(lowest), std::abs(highest));
  }
};

template <typename Value>
Moving range_of(const Playback& playback, std::span<const std::uint8_t> valid, Value value) {
  Moving range;
  bool any = false;
  const auto inputs = playback.inputs();
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    if (valid[i] == 0) continue;
    const double x = value(inputs[i]);
    range.lowest = any ? std::min(range.lowest, x) : x;
    range.highest = any ? std::max(range.highest, x) : x;
    any = true;
  }
  return range;
}

// Builds the list, leaving out what doesn't move.
class OperandList {
 public:
  OperandList(const Playback& playback, std::span<const std::uint8_t> valid)
      : playback_(playback), valid_(valid) {}

  template <typename Value>
  void add(Operand operand, Value value) {
    const Moving range = range_of(playback_, valid_, value);
    if (!range.moves()) return;
    operand.lowest = range.lowest;
    operand.highest = range.highest;
    all_.push_back(std::move(operand));
  }
  [[nodiscard]] std::vector<Operand> take() { return std::move(all_); }

 private:
  const Playback& playback_;
  std::span<const std::uint8_t> valid_;
  std::vector<Operand> all_;
};

void add_temperatures(OperandList& list, const Playback& playback) {
  const auto points = playback.measured_points();
  const auto named = [](twin::TemperaturePoint p) { return std::string(twin::name(p)); };
  for (const auto p : points) {
    list.add({.text = "T_" + named(p),
              .channels = {"temperature_" + named(p)},
              .has_zero = false,
              .is_temperature = true},
             [p](const auto& in) { return temperature_degc(in, p); });
    list.add({.text = "rate(T_" + named(p) + ")", .channels = {"temperature_rate_" + named(p)}},
             [p](const auto& in) { return temperature_rate_degc_per_s(in, p); });
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = i + 1; j < points.size(); ++j) {
      const auto a = points[i];
      const auto b = points[j];
      if (a == twin::TemperaturePoint::kCoil || b == twin::TemperaturePoint::kCoil) continue;
      list.add(
          {.text = "T_" + named(a) + " - T_" + named(b),
           .channels = {"temperature_" + named(a), "temperature_" + named(b)}},
          [a, b](const auto& in) { return temperature_degc(in, a) - temperature_degc(in, b); });
    }
  }
}

std::string in_parentheses(const std::string& text) {
  return text.find(' ') == std::string::npos ? text : "(" + text + ")";
}

// So many that a value keeps its place in the range to some thousandths.
int digits_of_places(const Operand& operand) {
  constexpr int kOfTheRange = 3;
  const double largest = std::max(std::abs(operand.lowest), std::abs(operand.highest));
  const double ratio = largest / (operand.highest - operand.lowest);
  return kOfTheRange + std::max(1, static_cast<int>(std::ceil(std::log10(ratio))));
}

std::string centred(const Operand& operand, double centre) {
  if (centre == 0.0) return operand.text;
  return operand.text + (centre > 0.0 ? " - " : " + ") +
         rounded(std::abs(centre), digits_of_places(operand));
}

// Writes factors one after the other; parameters of one kind are numbered from the second on.
class Writer {
 public:
  std::string factor(const Factor& factor, const Operand& operand) {
    const std::string inner = centred(operand, factor.centre);
    const std::string u = in_parentheses(inner);
    switch (factor.form) {
      case Form::kPlain: return u;
      case Form::kSquare: return u + "^2";
      case Form::kCube: return u + "^3";
      case Form::kMagnitude: return "abs(" + inner + ")";
      case Form::kTanh: return "tanh(" + u + " / " + parameter("width", factor.width) + ")";
      case Form::kBump: return "exp(-(" + u + " / " + parameter("width", factor.width) + ")^2)";
      case Form::kExp: return "exp(" + u + " / " + parameter("width", factor.width) + ")";
      case Form::kLag: return "lag(" + inner + ", " + parameter("tau", factor.width) + ")";
      case Form::kPlay: return "play(" + inner + ", " + parameter("backlash", factor.width) + ")";
      case Form::kCreep: {
        const std::string width = parameter("width", factor.width);
        const std::string rise = parameter("rise", factor.rise_s);
        return "lag(tanh(" + u + " / " + width + "), " + rise + ", " +
               parameter("fall", factor.fall_s) + ")";
      }
    }
    return {};
  }
  std::string lagged(const std::string& text, double tau_s) {
    return "lag(" + text + ", " + parameter("tau", tau_s) + ")";
  }
  [[nodiscard]] twin::Parameters take() { return std::move(values_); }

 private:
  std::string parameter(const std::string& kind, double value) {
    const int count = ++counts_[kind];
    std::string name = count == 1 ? kind : kind + std::to_string(count);
    values_[name] = value;
    return name;
  }

  std::map<std::string, int> counts_;
  twin::Parameters values_;
};

}  // namespace

std::vector<Operand> operands_of(const Playback& playback, std::span<const std::uint8_t> valid,
                                 core::Axis axis) {
  OperandList list(playback, valid);
  add_temperatures(list, playback);
  for (const core::Axis a : core::kAxes) {
    const std::size_t i = core::index(a);
    const std::string suffix(core::name(a));
    list.add({.text = "B_" + suffix, .channels = {"magnetic_" + suffix}},
             [i](const auto& in) { return in.magnetic_ut[i]; });
    list.add({.text = "a_" + suffix, .channels = {"acceleration_" + suffix}},
             [i](const auto& in) { return in.acceleration_mps2[i]; });
    list.add({.text = "w_" + suffix, .channels = {a == axis ? "rate" : "rate_" + suffix}},
             [i](const auto& in) { return in.true_rate_radps[i] / core::kRadPerDeg; });
  }
  list.add({.text = "vibration", .channels = {"vibration"}},
           [](const auto& in) { return in.vibration_g; });
  list.add({.text = "source_current", .channels = {"source_current"}, .has_zero = false},
           [](const auto& in) { return in.source_current_ma; });
  list.add({.text = "supply", .channels = {"supply"}, .has_zero = false},
           [](const auto& in) { return in.supply_v; });
  return list.take();
}

bool same_structure(const Term& a, const Term& b) {
  const auto alike = [](const Factor& x, const Factor& y) {
    return x.operand == y.operand && x.form == y.form;
  };
  return (a.lag_s == 0.0) == (b.lag_s == 0.0) &&
         std::equal(a.factors.begin(), a.factors.end(), b.factors.begin(), b.factors.end(), alike);
}

std::span<const double> lags_looked_at_s() {
  return kLagsS;
}

std::vector<Factor> grid_of(const Operand& operand, std::size_t place, Form form) {
  std::vector<Factor> grid;
  const auto add = [&](double centre, double width) {
    grid.push_back({place, form, centre, width});
  };
  switch (form) {
    case Form::kPlain:
    case Form::kSquare:
    case Form::kCube:
      for (const double c : centres(operand, kBegins)) add(c, 0.0);
      break;
    case Form::kMagnitude:
      for (const double c : centres(operand, kBends)) add(c, 0.0);
      break;
    case Form::kTanh:
    case Form::kBump:
      for (const double c : centres(operand, kBends)) {
        for (const double w : kWidths) add(c, w * operand.half_range());
      }
      break;
    case Form::kExp:  // its centre says nothing but that the numbers stay small
      for (const double w : kExponentWidths) {
        add(operand.has_zero ? 0.0 : operand.middle(), w * operand.half_range());
      }
      break;
    case Form::kLag:
      for (const double c : centres(operand, kBegins)) {
        for (const double tau_s : kLagsS) add(c, tau_s);
      }
      break;
    case Form::kPlay:
      if (!operand.is_temperature) break;
      for (const double c : centres(operand, kBegins)) {
        for (const double width : kPlaysDegc) add(c, width);
      }
      break;
    case Form::kCreep:
      if (!operand.is_temperature) break;
      for (const double c : centres(operand, kBegins)) {
        for (const double rise_s : kCreepsS) {
          for (const double fall_s : kCreepsS) {
            if (rise_s != fall_s)
              grid.push_back({place, form, c, kCreepWidth * operand.half_range(), rise_s, fall_s});
          }
        }
      }
      break;
  }
  return grid;
}

double log_prior_of(const Term& term, std::span<const Operand> operands) {
  constexpr double kStructures = 4.0;
  double choices = kStructures;
  for (const Factor& factor : term.factors) {
    const auto values = grid_of(operands[factor.operand], factor.operand, factor.form).size();
    choices *= static_cast<double>(operands.size()) * static_cast<double>(kFormCount) *
               static_cast<double>(values);
  }
  if (term.factors.size() == 2) choices /= 2.0;  // either order says the same
  if (term.lag_s > 0.0) choices *= static_cast<double>(kLagsS.size());
  return -std::log(choices);
}

WrittenTerm written(const Term& term, std::span<const Operand> operands) {
  Writer writer;
  std::string product;
  for (const Factor& factor : term.factors) {
    product += (product.empty() ? "" : " * ") + writer.factor(factor, operands[factor.operand]);
  }
  if (term.lag_s > 0.0) product = writer.lagged(product, term.lag_s);
  return {"k * " + product, writer.take()};
}

WrittenTerm written(const Curve& curve, std::span<const Operand> operands) {
  const Operand& over = operands[curve.over];
  const int digits = digits_of_places(over) + 1;
  Writer writer;
  std::string spline = "spline(" +
                       (curve.lag_s > 0.0 ? writer.lagged(over.text, curve.lag_s) : over.text) +
                       ", " + rounded(over.lowest, digits) + ", " + rounded(over.highest, digits);
  for (std::size_t i = 1; i <= curve.parameters; ++i) {
    const bool is_padded = i < 10 && curve.parameters >= 10;  // lists sort names as text
    spline += std::string(is_padded ? ", k0" : ", k") + std::to_string(i);
  }
  spline += ")";
  if (!curve.by) return {std::move(spline), writer.take()};
  const Operand& by = operands[*curve.by];
  const std::string factor = in_parentheses(centred(by, by.has_zero ? 0.0 : by.middle()));
  return {spline + " * " + factor + " + k * " + factor, writer.take()};
}

twin::DefinitionPtr definition_of(const WrittenTerm& term, core::Axis axis) {
  auto definition = twin::definition_of(
      {.kind = std::string(twin::kFormulaKind), .axis = axis, .formula = term.formula});
  core::require(definition != nullptr, "a term is written in the twin's own grammar");
  return definition;
}

}  // namespace zerodrift::diagnosis
