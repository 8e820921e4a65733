// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "common/core/units.h"
#include "common/twin/b_spline.h"
#include "common/twin/effect_parts.h"
#include "common/twin/formula.h"
#include "common/twin/formula_units.h"

namespace zerodrift::twin {
namespace {

// Whatever a formula says: no value of a part, and no rate, is beyond.
constexpr double kLargestValue = 1e30;
constexpr double kLargestRateDegH = 1e6;

constexpr std::size_t kFirstMagnetic = kTemperaturePointCount;
constexpr std::size_t kFirstAcceleration = kFirstMagnetic + core::kAxisCount;
constexpr std::size_t kFirstRate = kFirstAcceleration + core::kAxisCount;
constexpr std::size_t kVibration = kFirstRate + core::kAxisCount;
constexpr std::size_t kSourceCurrent = kVibration + 1;
constexpr std::size_t kSupply = kSourceCurrent + 1;

double input_value(const EffectInputs& inputs, std::size_t input) noexcept {
  if (input < kFirstMagnetic) return inputs.thermal.temperature_degc[input];
  if (input < kFirstAcceleration) return inputs.magnetic_ut[input - kFirstMagnetic];
  if (input < kFirstRate) return inputs.acceleration_mps2[input - kFirstAcceleration];
  if (input < kVibration) return inputs.true_rate_radps[input - kFirstRate] / core::kRadPerDeg;
  if (input == kVibration) return inputs.vibration_g;
  if (input == kSourceCurrent) return inputs.source_current_ma;
  return input == kSupply ? inputs.supply_v : inputs.since_power_on_s;
}

double power(double base, std::size_t exponent) noexcept {
  double result = base;
  for (std::size_t i = 1; i < exponent; ++i) result *= base;
  return result;
}

// FormulaSpline with its values.
class Curve {
 public:
  Curve(const FormulaSpline& spline, const Formula& formula, const EffectContext& context)
      : from_(spline.from), to_(spline.to), coefficients_{0.0} {
    for (std::size_t i = 0; i < spline.count; ++i) {
      coefficients_.push_back(
          context.parameter(formula.parameters[spline.first_parameter + i].name));
    }
    const std::size_t intervals = coefficients_.size() - kSplineDegree;
    std::vector<double> inner;
    for (std::size_t i = 0; i < intervals; ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(intervals);
      inner.push_back(from_ + (to_ - from_) * share);
    }
    inner.push_back(to_);
    knots_ = knots_around(inner);
  }

  [[nodiscard]] double at(double x) const noexcept {
    const LocalSplines local = splines_at(knots_, std::clamp(x, from_, to_));
    double value = 0.0;
    for (std::size_t d = 0; d < local.values.size(); ++d)
      value += coefficients_[local.first + d] * local.values[d];
    return value;
  }

 private:
  double from_;
  double to_;
  std::vector<double> coefficients_;
  std::vector<double> knots_;
};

// Where an input that is read isn't finite, so is the result, and states hold; else it is finite.
class FormulaEffect final : public Effect {
 public:
  FormulaEffect(const Formula& formula, const EffectContext& context)
      : nodes_(formula.nodes), values_(nodes_.size()), interval_s_(context.interval_s) {
    for (FormulaNode& node : nodes_) {
      if (node.operation != FormulaOperation::kParameter) continue;
      node.operation = FormulaOperation::kNumber;
      node.number = context.parameter(formula.parameters[node.which].name);
    }
    for (const FormulaSpline& spline : formula.splines)
      curves_.emplace_back(spline, formula, context);
    memories_.reserve(nodes_.size());
    for (const FormulaNode& node : nodes_) {
      const bool is_lag = node.operation == FormulaOperation::kLag;
      const double rise_s = is_lag ? nodes_[node.right].number : 0.0;
      const double fall_s = is_lag ? nodes_[node.third].number : 0.0;
      memories_.push_back({LowPass(rise_s, fall_s, interval_s_)});
    }
  }

  double step(const EffectInputs& inputs) noexcept override {
    for (std::size_t i = 0; i < nodes_.size(); ++i)
      values_[i] = std::clamp(evaluate(i, inputs), -kLargestValue, kLargestValue);
    return core::radps_from_deg_h(std::clamp(values_.back(), -kLargestRateDegH, kLargestRateDegH));
  }

  void carry(core::StateArchive& archive) override {
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      Memory& memory = memories_[i];
      if (nodes_[i].operation == FormulaOperation::kLag) memory.lag.carry(archive);
      if (nodes_[i].operation == FormulaOperation::kPlay ||
          nodes_[i].operation == FormulaOperation::kRate)
        archive(memory.last, memory.started);
    }
  }

 private:
  struct Memory {
    LowPass lag;
    double last = 0.0;
    bool started = false;
  };

  double evaluate(std::size_t i, const EffectInputs& inputs) noexcept {
    const FormulaNode& node = nodes_[i];
    const double left = values_[node.left];
    const double right = values_[node.right];
    switch (node.operation) {
      case FormulaOperation::kNumber:
      case FormulaOperation::kParameter: return node.number;
      case FormulaOperation::kInput: return input_value(inputs, node.which);
      case FormulaOperation::kAdd: return left + right;
      case FormulaOperation::kSubtract: return left - right;
      case FormulaOperation::kMultiply: return left * right;
      case FormulaOperation::kDivide:  // by 0: 0
        return right == 0.0 ? 0.0 * left : left / right;
      case FormulaOperation::kNegate: return -left;
      case FormulaOperation::kPower: return power(left, node.which);
      case FormulaOperation::kAbs: return std::abs(left);
      case FormulaOperation::kTanh: return std::tanh(left);
      case FormulaOperation::kExp: return std::exp(left);
      case FormulaOperation::kRate: return rate(node, memories_[i], inputs);
      case FormulaOperation::kLag: return memories_[i].lag.step(left);
      case FormulaOperation::kPlay: return play(memories_[i], left, right);
      case FormulaOperation::kSpline: return curves_[node.which].at(left);
    }
    return 0.0;
  }

  double rate(const FormulaNode& node, Memory& memory, const EffectInputs& inputs) noexcept {
    const std::size_t input = nodes_[node.left].which;
    if (const auto point = formula_temperature(input))
      return temperature_rate_degc_per_s(inputs, *point);
    const double now = values_[node.left];
    if (!std::isfinite(now)) return now;
    const double change = memory.started ? now - memory.last : 0.0;
    memory.last = now;
    memory.started = true;
    return change / interval_s_;
  }

  static double play(Memory& memory, double x, double width) noexcept {
    if (!std::isfinite(x)) return x;
    const double reach = std::abs(width);
    memory.last = memory.started ? std::clamp(memory.last, x - reach, x + reach) : x;
    memory.started = true;
    return memory.last;
  }

  std::vector<FormulaNode> nodes_;
  std::vector<double> values_;
  std::vector<Memory> memories_;
  std::vector<Curve> curves_;
  double interval_s_;
};

std::string meaning_of(FormulaUse use) {
  switch (use) {
    case FormulaUse::kAmplitude: return "factor of a summand, or of its spline";
    case FormulaUse::kLag: return "time constant of a lag, s";
    case FormulaUse::kTemperatureWidth: return "width of a backlash, degC";
    case FormulaUse::kWidth: return "width of a backlash";
    case FormulaUse::kShape: break;
  }
  return "enters the formula's shape";
}

// Only what has a unit of its own has a grid.
ParameterDefinition parameter_definition(const FormulaParameter& parameter) {
  ParameterDefinition definition{.name = parameter.name, .meaning = meaning_of(parameter.use)};
  if (parameter.use == FormulaUse::kAmplitude) {
    definition.default_value = 1.0;
    return definition;
  }
  definition.role = ParameterRole::kShape;
  if (parameter.use == FormulaUse::kLag) {
    definition = lag_parameter();
    definition.name = parameter.name;
    definition.meaning = meaning_of(parameter.use);
    definition.maximum = kLongestLagS;
  } else if (parameter.use == FormulaUse::kTemperatureWidth) {
    definition.default_value = 1.0;
    definition.minimum = 0.0;
    definition.maximum = 1e3;
    definition.grid = {0.25, 0.5, 1.0, 2.0, 4.0};
  } else if (parameter.use == FormulaUse::kWidth) {
    definition.minimum = 0.0;
  }
  return definition;
}

Need need_of(std::size_t input, core::Axis axis) {
  if (input < kFirstMagnetic) return Need::kTemperature;
  if (input < kFirstAcceleration) return Need::kMagnetic;
  if (input < kFirstRate) return Need::kAcceleration;
  if (input < kVibration)
    return input - kFirstRate == core::index(axis) ? Need::kReferenceRate : Need::kCrossAxisRate;
  if (input == kVibration) return Need::kVibration;
  if (input == kSourceCurrent) return Need::kSourceCurrent;
  return input == kSupply ? Need::kSupply : Need::kPowerOn;
}

template <typename T>
void add_once(std::vector<T>& list, T value) {
  if (std::find(list.begin(), list.end(), value) == list.end()) list.push_back(value);
}

}  // namespace

const EffectDefinition& formula_in_general() {
  static const EffectDefinition kAny = [] {
    EffectDefinition definition;
    definition.kind = kFormulaKind;
    definition.equation = "the formula of the model file";
    definition.source = "the model file";
    return definition;
  }();
  return kAny;
}

EffectDefinition formula_effect(const Formula& formula, const std::string& text, core::Axis axis) {
  EffectDefinition definition = formula_in_general();
  definition.equation = text;
  definition.formula = text;
  for (const FormulaParameter& parameter : formula.parameters)
    definition.parameters.push_back(parameter_definition(parameter));
  for (const FormulaNode& node : formula.nodes) {
    if (node.operation != FormulaOperation::kInput) continue;
    if (const auto point = formula_temperature(node.which)) add_once(definition.inputs, *point);
    add_once(definition.needs, need_of(node.which, axis));
  }
  definition.search.has_fixed_inputs = true;
  definition.make = [formula](const EffectContext& c) -> std::unique_ptr<Effect> {
    return std::make_unique<FormulaEffect>(formula, c);
  };
  return definition;
}

}  // namespace zerodrift::twin
