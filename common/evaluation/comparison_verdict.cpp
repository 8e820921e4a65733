// SPDX-License-Identifier: Apache-2.0
#include "common/evaluation/comparison_verdict.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <set>
#include <utility>

#include "common/compensation/option_keys.h"
#include "common/core/not_known.h"
#include "common/evaluation/comparison_figures.h"
#include "common/report/numbers.h"

namespace zerodrift::evaluation {
namespace {

using report::significant;

constexpr int kDigits = 3;
using core::kNaN;
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
    case allan::Identification::kInterval: return {scheme.name, b.value, false};
    case allan::Identification::kUpperBound: return {scheme.name, b.upper, true};
    case allan::Identification::kNotFitted:
    case allan::Identification::kWithheld: break;
  }
  return {scheme.name};
}

// Errors within one delay are much the same: fewer independent ones than this judge nothing.
constexpr double kFewestDelays = 3.0;
// Motion, between the labels of two stops.
constexpr core::SensorTime kLongestPause{30'000'000'000};
constexpr std::size_t kFewestStops = 3;
// "Gains nothing": within this much of holding.
constexpr double kGains = 0.95;

struct Ratio {
  double logs = 0.0;
  std::size_t judged = 0;

  void add(double rms, double held) {
    logs += std::log(rms / held);
    ++judged;
  }
  [[nodiscard]] double value() const {
    return judged > 0 ? std::exp(logs / static_cast<double>(judged)) : kNaN;
  }
};

bool is_long_enough(const AxisComparison& axis, const comparison::Protocol& protocol) {
  return !axis.points.empty() && core::seconds(axis.points.back().end - protocol.judged_from) >=
                                     kFewestDelays * protocol.delay_s;
}

// Geometric mean of the RMSE over holding's, of the axes that have labels enough; NaN without any.
Ratio late_ratio(const ComparisonResult& result, std::string_view name, double delay_s) {
  Ratio ratio;
  for (const AxisComparison& axis : result.axes) {
    for (const ProtocolOutcome& protocol : axis.protocols) {
      if (protocol.protocol.delay_s != delay_s || !is_long_enough(axis, protocol.protocol))
        continue;
      const SchemeOutcome* scheme = find(protocol, name);
      const SchemeOutcome* holding = find(protocol, kHolding);
      if (scheme == nullptr || holding == nullptr) return {};
      ratio.add(scheme->statistics.root_mean_square, holding->statistics.root_mean_square);
    }
  }
  return ratio;
}

// Mean square of the errors at the first label after each pause, which is what was applied when the
// motion ended, with how many there were.
std::pair<double, std::size_t> after_pauses(const AxisComparison& axis,
                                            const comparison::Protocol& protocol,
                                            const SchemeOutcome& scheme) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 1; i < axis.points.size() && i < scheme.predicted.size(); ++i) {
    const auto& point = axis.points[i];
    if (!scheme.predicted[i] || point.end <= protocol.judged_from ||
        point.begin - axis.points[i - 1].end < kLongestPause)
      continue;
    const double error = point.drift_radps - scheme.predicted[i]->drift_radps;
    sum += error * error;
    ++count;
  }
  return {sum / static_cast<double>(count), count};
}

Ratio motion_ratio(const ComparisonResult& result, std::string_view name) {
  Ratio ratio;
  for (const AxisComparison& axis : result.axes) {
    for (const ProtocolOutcome& protocol : axis.protocols) {
      if (protocol.protocol.delay_s > 0.0 || is_frozen(protocol.protocol)) continue;
      const SchemeOutcome* scheme = find(protocol, name);
      const SchemeOutcome* holding = find(protocol, kHolding);
      if (scheme == nullptr || holding == nullptr) return {};
      const auto [ours, stops] = after_pauses(axis, protocol.protocol, *scheme);
      const auto [held, held_stops] = after_pauses(axis, protocol.protocol, *holding);
      if (stops < kFewestStops || stops != held_stops) continue;
      ratio.add(std::sqrt(ours), std::sqrt(held));
    }
  }
  return ratio;
}

std::set<double, std::greater<>> delays_of(const ComparisonResult& result) {
  std::set<double, std::greater<>> delays;
  for (const AxisComparison& axis : result.axes) {
    for (const ProtocolOutcome& protocol : axis.protocols) {
      if (protocol.protocol.delay_s > 0.0) delays.insert(protocol.protocol.delay_s);
    }
  }
  return delays;
}

// Over all delays that the record is long enough for.
Ratio over_holding(const ComparisonResult& result, std::string_view name) {
  Ratio all;
  for (const double delay_s : delays_of(result)) {
    const Ratio ratio = late_ratio(result, name, delay_s);
    all.logs += ratio.logs;
    all.judged += ratio.judged;
  }
  return all;
}

// "600", "0.5"
std::string plain_seconds(double seconds) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", seconds);
  return text.data();
}

// " (290 s old behind motion)": the delay alone would name an age at which nothing was judged.
std::string age_of(const ComparisonResult& result, double delay_s) {
  std::optional<double> oldest_s;
  for (const AxisComparison& axis : result.axes) {
    for (const ProtocolOutcome& protocol : axis.protocols) {
      if (protocol.protocol.delay_s != delay_s) continue;
      oldest_s = std::max(oldest_s, age_behind_motion_s(axis, protocol.protocol));
    }
  }
  return oldest_s ? " (" + significant(*oldest_s, 2) + " s old behind motion)" : "";
}

// "with labels 600 s late its RMSE is 0.49, 60 s late 0.32, at the first label after motion 0.34 of
// that of holding the last minute"
std::string figures_of(const ComparisonResult& result, const std::string& scheme) {
  std::string text;
  for (const double delay_s : delays_of(result)) {
    const Ratio ratio = late_ratio(result, scheme, delay_s);
    if (!std::isfinite(ratio.value())) continue;
    const std::string late = plain_seconds(delay_s) + " s late" + age_of(result, delay_s);
    text += text.empty() ? "with labels " + late + " its RMSE is " : ", " + late + " ";
    text += significant(ratio.value(), 2);
  }
  const Ratio motion = motion_ratio(result, scheme);
  if (std::isfinite(motion.value()))
    text += ", at the first label after motion " + significant(motion.value(), 2);
  return text + " of that of holding the last minute";
}

bool is_run_by_service(std::string_view scheme) {
  const auto names = compensation::scheme_names();
  return std::find(names.begin(), names.end(), scheme) != names.end();
}

// "online-svr, stack, none"
std::string names_of_service() {
  std::string text;
  for (const auto name : compensation::scheme_names())
    text += (text.empty() ? "" : ", ") + std::string(name);
  return text;
}

// Why no scheme can be recommended. A delay that leaves no label to judge counts as one, too.
std::string no_recommendation(const ComparisonResult& result) {
  auto delays = delays_of(result);
  delays.insert(result.delays_s.begin(), result.delays_s.end());
  const bool has_holding =
      !result.axes.empty() && std::all_of(result.axes.begin(), result.axes.end(), [](auto& axis) {
        return std::all_of(axis.protocols.begin(), axis.protocols.end(),
                           [](auto& protocol) { return find(protocol, kHolding) != nullptr; });
      });
  if (delays.empty() || !has_holding) {
    return "No scheme is recommended: not comparable without " + std::string(kHolding) +
           " among --schemes and a time in --delays.";
  }
  const auto& schemes = result.axes.front().protocols.front().schemes;
  if (std::none_of(schemes.begin(), schemes.end(),
                   [](const SchemeOutcome& scheme) { return is_run_by_service(scheme.name); })) {
    return "No scheme is recommended: none that the service runs (" + names_of_service() +
           ") is among --schemes.";
  }
  return "No scheme is recommended: the record is too short, its judged labels span less than " +
         significant(kFewestDelays, 1) + " times " + plain_seconds(*delays.rbegin()) + " s.";
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
    const Ratio ratio = over_holding(result, scheme.name);
    if (scheme.name == kOurs) best.ours = ratio.value();
    if (!std::isfinite(ratio.value())) continue;
    if (!is_run_by_service(scheme.name)) {
      if (!best.better.empty() && !(ratio.value() < best.better_over_holding)) continue;
      best.better = scheme.name;
      best.better_over_holding = ratio.value();
      continue;
    }
    if (!best.scheme.empty() && !(ratio.value() < best.over_holding)) continue;
    best.scheme = scheme.name;
    best.over_holding = ratio.value();
    best.judged = ratio.judged;
  }
  if (best.scheme.empty()) return std::nullopt;
  if (best.better.empty() || best.over_holding <= kEqual * best.better_over_holding) {
    best.better.clear();
    best.better_over_holding = kNaN;
  }
  return best;
}

std::string recommendation(const ComparisonResult& result) {
  if (!result.no_model.empty()) return result.no_model + ".";
  const auto best = recommendation_of(result);
  if (!best) return no_recommendation(result);
  const std::string means =
      " (geometric means over axes; " + std::to_string(best->judged) + " judgements)";
  std::string text = "Use " + best->scheme + ": ";
  if (!(best->over_holding < kGains)) {
    text +=
        "with late labels none that the service runs gains 5 % over holding the last minute on "
        "this record, and of these it is the best; ";
  }
  text += figures_of(result, best->scheme) + means;
  if (best->scheme != kOurs && std::isfinite(best->ours)) {
    text += "; " + std::string(kOurs) + ", which the service runs by default, has " +
            significant(best->ours, 2) + " of it over all these ages, " + best->scheme + " " +
            significant(best->over_holding, 2);
  }
  if (!best->better.empty()) {
    text += "; " + best->better + ", which the service doesn't run, has " +
            significant(best->better_over_holding, 2) + " of it over all these ages, " +
            best->scheme + " " + significant(best->over_holding, 2);
  }
  return text + ".";
}

std::string verdict(const ComparisonResult& result, const Standing& standing) {
  if (!result.no_model.empty()) return result.no_model + ".";
  if (standing.figures.empty())
    return "Statistics of the chosen schemes; nothing to compare the stack with.";
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
  return text + against_holding(result) + interval_coverage(result);
}

}  // namespace zerodrift::evaluation
