// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/comparison_verdict.h"

#include <algorithm>
#include <cmath>

#include "common/report/numbers.h"
#include "services/zerodrift/comparison_figures.h"

namespace zerodrift::services {
namespace {

using report::significant;

constexpr int kDigits = 3;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// Figures that differ by less print alike.
constexpr double kEqual = 1.005;

// A bound takes part as if it were the value: below the stack's value it proves the other better.
// The stack's own bound decides nothing.
void place(Standing& standing, const std::string& axis, const std::string& judged,
           const std::string& figure, const std::vector<Figure>& figures) {
  const Figure* ours = nullptr;
  const Figure* best = nullptr;
  for (const Figure& one : figures) {
    if (!std::isfinite(one.value)) continue;
    if (one.scheme == kOurs) {
      ours = &one;
    } else if (best == nullptr || one.value < best->value) {
      best = &one;
    }
  }
  if (ours == nullptr || best == nullptr || ours->is_bound) return;
  Standing::Count& count = standing.figures[figure];
  ++count.judged;
  if (ours->value <= kEqual * best->value) {
    ++count.best;
  } else {
    standing.behind.push_back({axis, judged, figure, *best, ours->value});
  }
}

Figure bias_instability(const SchemeOutcome& scheme) {
  const auto& b = scheme.stream.coefficients[allan::NoiseTerm::kBiasInstability];
  switch (b.identification) {
    case allan::Identification::kInterval:
      return {scheme.name, b.value, false};
    case allan::Identification::kUpperBound:
      return {scheme.name, b.upper, true};
    case allan::Identification::kNotFitted:
      break;
  }
  return {scheme.name};
}

double over_holding(const ComparisonResult& result, std::string_view name, std::size_t& judged) {
  double logs = 0.0;
  judged = 0;
  for (const AxisComparison& axis : result.axes) {
    for (const ProtocolOutcome& protocol : axis.protocols) {
      if (!(protocol.protocol.delay_s > 0.0)) continue;
      const SchemeOutcome* scheme = find(protocol, name);
      const SchemeOutcome* holding = find(protocol, kHolding);
      if (scheme == nullptr || holding == nullptr) return kNaN;
      logs += std::log(scheme->statistics.root_mean_square / holding->statistics.root_mean_square);
      ++judged;
    }
  }
  return judged > 0 ? std::exp(logs / static_cast<double>(judged)) : kNaN;
}

std::string sentence_of(const Recommendation& best) {
  std::string text;
  if (best.scheme == kHolding) {
    text = "With late labels nothing on this record is better than holding the last minute (" +
           std::string(kHolding) + ")";
  } else {
    text = "With late labels " + best.scheme + " is best on this record: its RMSE is " +
           significant(best.over_holding, 2) + " of that of holding the last minute";
  }
  text += " (geometric mean of " + std::to_string(best.judged) + " axes and ages)";
  if (best.scheme != kOurs && std::isfinite(best.ours))
    text += "; " + std::string(kOurs) + ", which the service runs by default, has " +
            significant(best.ours, 2) + " of it";
  return text + ". ";
}

// The largest RMSE of the stack in those of holding the last minute; "" without the two.
std::string against_holding(const ComparisonResult& result) {
  double worst = 0.0;
  std::string where;
  for (const AxisComparison& axis : result.axes) {
    for (const ProtocolOutcome& protocol : axis.protocols) {
      const SchemeOutcome* ours = find(protocol, kOurs);
      const SchemeOutcome* holding = find(protocol, kHolding);
      if (ours == nullptr || holding == nullptr) continue;
      const double times = ours->statistics.root_mean_square / holding->statistics.root_mean_square;
      if (!(times > worst)) continue;
      worst = times;
      where = axis_name(axis) + ", " + protocol.protocol.name;
    }
  }
  if (where.empty()) return {};
  return " Its RMSE is at most " + significant(worst, kDigits) +
         " times that of persistence, which holds the last minute (" + where + ").";
}

// Between which shares the 95 % intervals of the stack hold; "" without any.
std::string interval_coverage(const ComparisonResult& result) {
  double least = 2.0;
  double most = -1.0;
  std::string where;
  for (const AxisComparison& axis : result.axes) {
    for (const ProtocolOutcome& protocol : axis.protocols) {
      const SchemeOutcome* ours = find(protocol, kOurs);
      if (ours == nullptr || !std::isfinite(ours->statistics.coverage)) continue;
      most = std::max(most, ours->statistics.coverage);
      if (ours->statistics.coverage >= least) continue;
      least = ours->statistics.coverage;
      where = axis_name(axis) + ", " + protocol.protocol.name;
    }
  }
  if (where.empty()) return {};
  return " Its 95 % intervals hold " + significant(100.0 * least, kDigits) + " % (" + where +
         ") to " + significant(100.0 * most, kDigits) + " % of the labels.";
}

}  // namespace

Standing standing_of(const ComparisonResult& result) {
  Standing standing;
  for (const AxisComparison& axis : result.axes) {
    const std::string name = axis_name(axis);
    std::vector<Figure> deviation, rmse, b;
    for (const ProtocolOutcome& protocol : axis.protocols) {
      deviation = rmse = b = {};
      for (const SchemeOutcome& scheme : protocol.schemes) {
        deviation.push_back({scheme.name, scheme.statistics.standard_deviation});
        rmse.push_back({scheme.name, scheme.statistics.root_mean_square});
        b.push_back(bias_instability(scheme));
      }
      place(standing, name, protocol.protocol.name, "std", deviation);
      place(standing, name, protocol.protocol.name, "RMSE", rmse);
      place(standing, name, protocol.protocol.name, "B", b);
    }
    deviation = rmse = b = {};
    for (const PaperOutcome& outcome : axis.paper) {
      deviation.push_back({outcome.name, outcome.moments.standard_deviation});
      rmse.push_back({outcome.name, outcome.moments.root_mean_square});
      if (outcome.coefficients)
        b.push_back({outcome.name, outcome.coefficients->bias_instability_radps});
    }
    place(standing, name, std::string(kPaperProcedure), "std", deviation);
    place(standing, name, std::string(kPaperProcedure), "RMSE", rmse);
    place(standing, name, std::string(kPaperProcedure), "B", b);
  }
  return standing;
}

std::optional<Recommendation> recommendation_of(const ComparisonResult& result) {
  Recommendation best;
  if (result.axes.empty() || result.axes.front().protocols.empty()) return std::nullopt;
  for (const SchemeOutcome& scheme : result.axes.front().protocols.front().schemes) {
    std::size_t judged = 0;
    const double ratio = over_holding(result, scheme.name, judged);
    if (scheme.name == kOurs) best.ours = ratio;
    if (!std::isfinite(ratio) || !(best.scheme.empty() || ratio < best.over_holding)) continue;
    best.scheme = scheme.name;
    best.over_holding = ratio;
    best.judged = judged;
  }
  if (best.scheme.empty()) return std::nullopt;
  return best;
}

std::string verdict(const ComparisonResult& result, const Standing& standing) {
  if (!result.no_model.empty()) return result.no_model + ".";
  const auto best = recommendation_of(result);
  const std::string recommended = best ? sentence_of(*best) : "";
  if (standing.figures.empty())
    return recommended + "Statistics of the chosen schemes; nothing to compare the stack with.";
  std::string text =
      "Of all judgements, each an axis by a protocol, the stack is best, or equal within 0.5 %,";
  bool first = true;
  for (const auto* figure : {"RMSE", "std", "B"}) {
    const auto found = standing.figures.find(figure);
    if (found == standing.figures.end()) continue;
    text += std::string(first ? " in " : ", in ") + figure + " in " +
            std::to_string(found->second.best) + " of " + std::to_string(found->second.judged);
    first = false;
  }
  text += standing.behind.empty() ? "." : "; where another scheme is better, a table says so.";
  return recommended + text + against_holding(result) + interval_coverage(result);
}

}  // namespace zerodrift::services
