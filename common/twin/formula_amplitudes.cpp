// SPDX-License-Identifier: Apache-2.0
#include "common/twin/formula_amplitudes.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace zerodrift::twin {
namespace {

using Operation = FormulaOperation;

[[noreturn]] void fail(std::size_t at, std::string what) {
  throw FormulaProblem{at + 1, std::move(what)};
}

// What a product has as factors, by their nodes.
struct Factors {
  std::vector<std::size_t> parameters{};
  std::vector<std::size_t> splines{};
};

void factors_of(const Formula& formula, std::size_t node, Factors& factors) {
  const FormulaNode& n = formula.nodes[node];
  if (n.operation == Operation::kParameter) factors.parameters.push_back(node);
  if (n.operation == Operation::kSpline) factors.splines.push_back(node);
  if (n.operation == Operation::kMultiply || n.operation == Operation::kDivide ||
      n.operation == Operation::kNegate)
    factors_of(formula, n.left, factors);
  if (n.operation == Operation::kMultiply) factors_of(formula, n.right, factors);
}

std::size_t uses_of(const Formula& formula, std::size_t parameter) {
  return static_cast<std::size_t>(
      std::count_if(formula.nodes.begin(), formula.nodes.end(), [&](const FormulaNode& n) {
        return n.operation == Operation::kParameter && n.which == parameter;
      }));
}

void refuse_shared_coefficients(const Formula& formula) {
  for (const FormulaSpline& spline : formula.splines) {
    for (std::size_t i = 0; i < spline.count; ++i) {
      const std::size_t parameter = spline.first_parameter + i;
      if (uses_of(formula, parameter) == 0) continue;
      fail(0, "found '" + formula.parameters[parameter].name +
                  "' in a spline and elsewhere, expected it in the spline alone");
    }
  }
}

}  // namespace

void find_amplitudes(Formula& formula, std::span<const FormulaSummand> summands) {
  std::size_t splines = 0;
  for (const FormulaSummand& summand : summands) {
    Factors factors;
    factors_of(formula, summand.node, factors);
    const auto own = std::find_if(
        factors.parameters.begin(), factors.parameters.end(),
        [&](std::size_t node) { return uses_of(formula, formula.nodes[node].which) == 1; });
    const bool has_own = own != factors.parameters.end();
    if (!has_own && factors.splines.empty()) {
      fail(summand.position,
           "found a summand without a parameter of its own as a factor, expected one as the k "
           "of k * T_coil");
    }
    if (factors.splines.size() + (has_own ? 1U : 0U) > 1U) {
      fail(summand.position,
           "found a spline beside another factor that is fitted, expected one of them: the "
           "spline's parameters are its size");
    }
    splines += factors.splines.size();
    if (has_own) formula.parameters[formula.nodes[*own].which].use = FormulaUse::kAmplitude;
  }
  if (splines != formula.splines.size())
    fail(0, "found a spline within a function or power, expected it as a factor of a summand");
  refuse_shared_coefficients(formula);
}

}  // namespace zerodrift::twin
