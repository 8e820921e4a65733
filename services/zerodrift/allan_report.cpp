// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/allan_report.h"

#include <algorithm>
#include <cmath>

#include "common/allan/noise_units.h"
#include "common/core/units.h"
#include "common/report/numbers.h"
#include "services/zerodrift/allan_chart.h"
#include "services/zerodrift/allan_units.h"

namespace zerodrift::services {
namespace {

using allan::Coefficient;
using allan::Identification;
using allan::NoiseTerm;
using allan::Statistic;
using core::deg_h_from_radps;
using report::Align;
using report::significant;

constexpr int kDigits = 4;
// Compensation is slow: it cannot lower the angle random walk. Off by more, something smooths.
constexpr double kEqualNoise = 0.05;
constexpr double kTrusted = 2.0;  // a deviation is trustworthy where it is known to this factor

std::string title(const AllanStream& stream) {
  return "axis " + std::string(core::name(stream.axis)) + ", " + std::string(name(stream.kind));
}

bool is_alone(const AllanStream& stream, const AllanResult& result) {
  return std::none_of(result.streams.begin(), result.streams.end(), [&](const AllanStream& other) {
    return other.axis == stream.axis && other.kind != stream.kind;
  });
}

// "axis x", and "raw" only where there is a compensated one beside it.
std::string short_title(const AllanStream& stream, const AllanResult& result) {
  return is_alone(stream, result) ? "axis " + std::string(core::name(stream.axis)) : title(stream);
}

std::string percent(double confidence) {
  return significant(100.0 * confidence, 2) + " %";
}

std::string long_name(Statistic statistic) {
  switch (statistic) {
    case Statistic::kAdev: return "Allan deviation without overlap";
    case Statistic::kOadev: return "overlapping Allan deviation";
    case Statistic::kMdev: return "modified Allan deviation";
    case Statistic::kTdev: return "time deviation, here of the angle";
    case Statistic::kHdev: return "Hadamard deviation without overlap";
    case Statistic::kOhdev: return "overlapping Hadamard deviation";
    case Statistic::kTotdev: return "total deviation, its bias left in";
  }
  return "unknown";
}

// --- tables

report::Table statistic_table(const AllanStream& stream, const allan::StatisticCurve& curve,
                              const AllanResult& result) {
  report::Table table;
  const DeviationUnit unit = unit_of(curve.statistic);
  table.caption = short_title(stream, result) + ": " + long_name(curve.statistic);
  if (result.less_reference[core::index(stream.axis)]) table.caption += " of rate - reference";
  table.columns = {
      {"tau s", Align::kRight},
      {std::string(allan::name(curve.statistic)) + " " + std::string(unit.text), Align::kRight},
      {percent(result.request.confidence) + " from", Align::kRight},
      {"to", Align::kRight},
      {"edf", Align::kRight},
      {"pairs", Align::kRight},
      {"noise", Align::kLeft}};
  for (const auto& p : curve.points) {
    table.rows.push_back(
        {{significant(p.tau_s, kDigits), significant(unit.per_si * p.deviation, kDigits),
          significant(unit.per_si * p.lower, kDigits), significant(unit.per_si * p.upper, kDigits),
          significant(p.degrees_of_freedom, 3), std::to_string(p.terms),
          std::string(allan::name(p.noise))},
         false});
  }
  return table;
}

std::string value_cell(const Coefficient& c, double unit) {
  switch (c.identification) {
    case Identification::kInterval: return significant(unit * c.value, 3);
    case Identification::kUpperBound: return "< " + significant(unit * c.upper, 3);
    case Identification::kNotFitted:
    case Identification::kWithheld: break;
  }
  return "-";
}

std::string interval_cell(const Coefficient& c, double unit) {
  if (c.identification != Identification::kInterval) return "";
  return significant(unit * c.lower, 3) + " to " + significant(unit * c.upper, 3);
}

std::string reading_place(NoiseTerm term, const allan::SeriesReport& r) {
  if (term != NoiseTerm::kBiasInstability) return std::string(texts_of(term).read_at);
  return r.lowest ? "lowest point, " + significant(r.lowest->tau_s, 3) + " s, / 0.664" : "";
}

// Where the model cannot explain the shortest taus.
std::string begin_of_fit(const allan::SeriesReport& r) {
  const double from_s = r.coefficients.shortest_tau_s;
  if (r.allan.empty() || from_s <= 1.01 * r.allan.front().point.tau_s) return "";
  const std::string from = " from " + significant(from_s, 3) + " s on ";
  if (r.coefficients.short_taus == allan::ShortTaus::kBandLimited)
    return from +
           "(where the curve is white: shorter taus are held down by a bandwidth or a filter)";
  return from +
         "(shorter taus follow no mixture of these noises: the bandwidth of the sensor, a filter "
         "or a vibration)";
}

// Why coefficients are withheld, and what is stated all the same; nothing where none is.
std::string why_withheld(const allan::CoefficientReport& fit) {
  if (fit.status != allan::FitStatus::kUnexplained) return {};
  if (fit.short_taus == allan::ShortTaus::kNeverWhite)
    return "no coefficient is stated: a bandwidth or a filter holds the shortest taus down, and no "
           "longer ones are white; a record without the filter would tell them";
  const std::string why = "the curve follows no mixture of these noises (reduced chi-square " +
                          significant(fit.reduced_chi_square, 2) + "), so ";
  if (!fit.white_alone) return why + "no coefficient is stated";
  return why + "N alone is stated, of the white part from " +
         significant(fit.white_alone->from_s, 3) + " to " + significant(fit.white_alone->to_s, 3) +
         " s";
}

std::string footnote_of(const allan::SeriesReport& r) {
  const allan::CoefficientReport& fit = r.coefficients;
  if (fit.status == allan::FitStatus::kTooFewPoints)
    return "too few points with two degrees of freedom for a fit";
  if (const std::string why = why_withheld(fit); !why.empty()) return why;
  return "fit of " + std::to_string(fit.points) + " points" + begin_of_fit(r) +
         ", reduced chi-square " + significant(fit.reduced_chi_square, 2) +
         (fit.status == allan::FitStatus::kIterationLimit ? "; its weights had not come to rest"
                                                          : "");
}

report::Table coefficient_table(const AllanStream& stream, const AllanResult& result) {
  const allan::SeriesReport& r = stream.report;
  report::Table table;
  table.caption = short_title(stream, result) + ": noise coefficients";
  table.columns = {
      {"coefficient", Align::kLeft},    {"unit", Align::kLeft},
      {"fitted", Align::kRight},        {percent(result.request.confidence), Align::kRight},
      {"slope reading", Align::kRight}, {"read at", Align::kLeft}};
  for (const NoiseTerm term : allan::kNoiseTerms) {
    const TermText text = texts_of(term);
    const Coefficient& c = r.coefficients[term];
    const auto& slope = r.slopes[allan::index(term)];
    table.rows.push_back(
        {{std::string(allan::symbol(term)) + " " + std::string(text.name), std::string(text.unit),
          value_cell(c, text.per_si), interval_cell(c, text.per_si),
          slope ? significant(text.per_si * *slope, 3) : "-", reading_place(term, r)},
         false});
  }
  for (const FoundTerm& found : found_terms(r.coefficients)) {
    table.rows.push_back(
        {{found.text, std::string(found.unit), value_cell(found.value, found.per_si),
          interval_cell(found.value, found.per_si), "-", "fitted on evidence"},
         false});
  }
  table.footnote = footnote_of(r);
  return table;
}

// --- sentences

std::string coefficient_text(const allan::SeriesReport& r, NoiseTerm term) {
  const TermText text = texts_of(term);
  const Coefficient& c = r.coefficients[term];
  const std::string unit = " " + std::string(text.unit);
  const std::string symbol(allan::symbol(term));
  switch (c.identification) {
    case Identification::kInterval:
      return symbol + " " + value_cell(c, text.per_si) + unit + " (" +
             interval_cell(c, text.per_si) + ")";
    case Identification::kUpperBound:
      return symbol + " not seen, below " + significant(text.per_si * c.upper, 3) + unit;
    case Identification::kNotFitted:
    case Identification::kWithheld: break;
  }
  return {};
}

std::string found_text(const allan::CoefficientReport& r) {
  std::string text;
  if (r.sinusoid) {
    text += ", a sinusoid of " +
            value_cell(r.sinusoid->amplitude_radps, kDegPerHourPerRadPerSecond) + " deg/h at " +
            value_cell(r.sinusoid->frequency_hz, 1.0) + " Hz";
  }
  if (r.markov) {
    text += ", Markov noise of " +
            value_cell(r.markov->drive_radps_rts, allan::kDegPerHourPerRootHour) +
            " deg/h^1.5 with a correlation time of " + value_cell(r.markov->time_constant_s, 1.0) +
            " s";
  }
  return text;
}

std::string stream_sentence(const AllanStream& stream, const AllanResult& result) {
  const allan::SeriesReport& r = stream.report;
  std::string text = short_title(stream, result) + ": ";
  bool any = false;
  for (const NoiseTerm term : allan::kNoiseTerms) {
    const std::string one = coefficient_text(r, term);
    if (one.empty()) continue;
    text += (any ? ", " : "") + one;
    any = true;
  }
  text += found_text(r.coefficients);
  const std::string withheld = why_withheld(r.coefficients);
  if (!any) text += withheld.empty() ? "too short for coefficients" : withheld;
  if (any && !withheld.empty()) text += "; " + withheld;
  if (!r.lowest) return text + ".";
  const bool at_the_end = r.lowest->tau_s >= r.allan.back().point.tau_s;
  text += "; lowest deviation " + significant(deg_h_from_radps(r.lowest->deviation_radps), 3) +
          " deg/h at " + significant(r.lowest->tau_s, 3) + " s";
  return text + (at_the_end ? ", the longest there is: a longer record may go lower."
                            : ", longer averages are no better.");
}

struct BothStreams {  // null: not in the record
  const allan::SeriesReport* raw = nullptr;
  const allan::SeriesReport* compensated = nullptr;
};

BothStreams streams_of(core::Axis axis, const AllanResult& result) {
  BothStreams both;
  for (const AllanStream& stream : result.streams) {
    if (stream.axis == axis)
      (stream.kind == StreamKind::kRaw ? both.raw : both.compensated) = &stream.report;
  }
  return both;
}

// What compensation did, where both streams are there.
std::string compensation_sentence(core::Axis axis, const AllanResult& result) {
  const auto [raw, compensated] = streams_of(axis, result);
  if (raw == nullptr || compensated == nullptr) return {};
  std::string text = "Axis " + std::string(core::name(axis)) + ", compensated over raw:";
  bool any = false;
  for (const NoiseTerm term : allan::kNoiseTerms) {
    const auto ratio = allan::coefficient_ratio(compensated->coefficients, raw->coefficients, term);
    if (!ratio) continue;
    text += std::string(any ? ", " : " ") + std::string(allan::symbol(term)) + " " +
            significant(*ratio, 3);
    any = true;
  }
  if (raw->lowest && compensated->lowest && raw->lowest->deviation_radps > 0.0) {
    text += std::string(any ? ", " : " ") + "lowest deviation " +
            significant(compensated->lowest->deviation_radps / raw->lowest->deviation_radps, 3);
  }
  text += ".";
  const auto n = allan::coefficient_ratio(compensated->coefficients, raw->coefficients,
                                          NoiseTerm::kAngleRandomWalk);
  if (n && std::abs(*n - 1.0) > kEqualNoise)
    text += " A compensation does not change N; here something smooths or adds noise.";
  return text;
}

std::string capital(std::string sentence) {
  sentence.front() = 'A';  // of "axis"
  return sentence;
}

std::string compensation_sentences(const AllanResult& result) {
  std::string text;
  for (const auto axis : core::kAxes) {
    const std::string sentence = compensation_sentence(axis, result);
    if (!sentence.empty()) text += (text.empty() ? "" : " ") + sentence;
  }
  return text;
}

std::string verdict(const AllanResult& result) {
  std::string text;
  for (const AllanStream& stream : result.streams)
    text += (text.empty() ? "" : " ") + capital(stream_sentence(stream, result));
  const std::string compensation = compensation_sentences(result);
  return compensation.empty() ? text : text + " " + compensation;
}

// --- the advice

std::string plain_coefficient(const allan::SeriesReport& r, NoiseTerm term) {
  const TermText text = texts_of(term);
  const Coefficient& c = r.coefficients[term];
  const std::string unit = " " + std::string(text.unit);
  if (c.identification == Identification::kInterval)
    return std::string(text.name) + " " + significant(text.per_si * c.value, 3) + unit;
  if (c.identification == Identification::kUpperBound)
    return std::string(text.name) + " below " + significant(text.per_si * c.upper, 3) + unit +
           ", too small to be seen in this record";
  return {};
}

// Where the curve says what it says of the gyro, and is known well enough; nothing: nowhere.
std::optional<allan::TauRange> trusted_taus(const allan::SeriesReport& r) {
  std::optional<allan::TauRange> range;
  for (const allan::GappedPoint& one : r.allan) {
    const allan::AllanPoint& p = one.point;
    if (p.tau_s < r.coefficients.shortest_tau_s || !(p.deviation_radps > 0.0)) continue;
    const bool is_known = p.upper_radps < kTrusted * p.deviation_radps &&
                          p.lower_radps > p.deviation_radps / kTrusted;
    if (!is_known) break;
    range = {range ? range->from_s : p.tau_s, p.tau_s};
  }
  return range;
}

// What an owner asks of a gyro: how noisy, how stable, and what of that can be relied on.
std::string noise_advice(const allan::SeriesReport& r) {
  std::string text;
  for (const NoiseTerm term : {NoiseTerm::kAngleRandomWalk, NoiseTerm::kBiasInstability}) {
    const std::string one = plain_coefficient(r, term);
    if (!one.empty()) text += (text.empty() ? "" : "; ") + one;
  }
  const std::string withheld = why_withheld(r.coefficients);
  if (text.empty())
    text = withheld.empty() ? "the record is too short for angle random walk and bias instability"
                            : withheld;
  else if (!withheld.empty())
    text += "; no bias instability: " + withheld;
  const auto trusted = trusted_taus(r);
  if (!trusted) return text + "; no deviation is trustworthy to a factor of 2";
  return text + "; deviations are trustworthy to a factor of 2 from " +
         significant(trusted->from_s, 3) + " s to " + significant(trusted->to_s, 3) + " s";
}

// By the intervals of the lowest points, which have to lie apart.
std::string compensation_advice(const allan::SeriesReport& raw,
                                const allan::SeriesReport& compensated) {
  if (!raw.lowest || !compensated.lowest) return "; too short to say what the compensation does";
  const std::string change =
      " the lowest deviation from " +
      significant(deg_h_from_radps(raw.lowest->deviation_radps), 3) + " to " +
      significant(deg_h_from_radps(compensated.lowest->deviation_radps), 3) + " deg/h";
  if (compensated.lowest->upper_radps < raw.lowest->lower_radps)
    return "; the compensation lowers" + change;
  if (compensated.lowest->lower_radps > raw.lowest->upper_radps)
    return "; the compensation harms: it raises" + change;
  return "; whether the compensation lowers the lowest deviation can't be told: the intervals "
         "overlap";
}

std::string record_note(const AllanResult& result) {
  std::string text = std::to_string(result.samples) + " samples, one every " +
                     significant(result.period_s, 4) + " s, over " +
                     significant(result.duration_s / core::kSecondsPerHour, 4) + " h.";
  std::string with, without;
  for (const AllanStream& stream : result.streams) {
    if (stream.kind != StreamKind::kRaw) continue;
    auto& list = result.less_reference[core::index(stream.axis)] ? with : without;
    list += (list.empty() ? "" : ", ") + std::string(core::name(stream.axis));
  }
  if (!with.empty()) text += " Analysed is the drift, rate - reference, of " + with + ".";
  if (!without.empty())
    text += " Without a reference the rate itself is analysed, of " + without +
            ": the gyro must have been at rest.";
  return text;
}

std::string reading_note(const AllanResult& result) {
  std::string text =
      "Interval: chi-square, with the equivalent degrees of freedom (edf) of the noise that is "
      "identified at that tau. Fitted: non-negative least squares on the variance, weighted by "
      "these; Q, R, a sinusoid and a Markov noise only where the curve cannot do without; <: not "
      "seen, and below that at " +
      percent(result.request.confidence) +
      " confidence. Slope reading: where the curve has the term's own slope, carried along it to "
      "the "
      "reading point; it counts neighbouring noises as its own and has no interval.";
  const auto& streams = result.streams;
  const bool cascade = std::any_of(streams.begin(), streams.end(), [](const AllanStream& s) {
    return s.report.method == allan::SeriesMethod::kCascade;
  });
  const auto& asked = result.request.statistics;
  if (!cascade && std::find(asked.begin(), asked.end(), Statistic::kTotdev) != asked.end())
    text += " The total deviation is left with its bias (SP 1065, table 6).";
  return text;
}

// --- the page

void add_stream(report::Document& page, const AllanStream& stream, const AllanResult& result) {
  if (!is_alone(stream, result))
    page.blocks.emplace_back(report::Subheading{std::string(name(stream.kind))});
  if (!is_alone(stream, result))
    page.blocks.emplace_back(report::Paragraph{capital(stream_sentence(stream, result))});
  page.blocks.emplace_back(
      report::Figure{noise_chart(stream, result), noise_caption(result.request.confidence)});
  page.blocks.emplace_back(coefficient_table(stream, result));
  for (const auto& curve : stream.report.curves)
    page.blocks.emplace_back(statistic_table(stream, curve, result));
  if (auto chart = statistics_chart(stream)) {
    page.blocks.emplace_back(report::Figure{
        std::move(*chart), "The statistics beside each other, with " +
                               percent(result.request.confidence) + " confidence bands."});
  }
}

}  // namespace

std::vector<report::Table> allan_tables(const AllanResult& result) {
  std::vector<report::Table> tables;
  for (const AllanStream& stream : result.streams) {
    for (const auto& curve : stream.report.curves)
      tables.push_back(statistic_table(stream, curve, result));
    tables.push_back(coefficient_table(stream, result));
  }
  return tables;
}

std::string allan_advice(const AllanResult& result) {
  std::string text;
  for (const auto axis : core::kAxes) {
    const auto [raw, compensated] = streams_of(axis, result);
    const allan::SeriesReport* shown = compensated != nullptr ? compensated : raw;
    if (shown == nullptr) continue;
    text += (text.empty() ? "Axis " : " Axis ") + std::string(core::name(axis)) +
            (compensated != nullptr ? ", compensated: " : ": ") + noise_advice(*shown);
    if (raw != nullptr && compensated != nullptr) text += compensation_advice(*raw, *compensated);
    text += ".";
  }
  return text;
}

std::vector<std::string> allan_notes(const AllanResult& result) {
  return {record_note(result), reading_note(result), verdict(result)};
}

report::Document allan_page(const AllanResult& result) {
  report::Document page;
  page.title = "Allan deviation";
  page.subtitle = result.request.record.file;
  page.doubts = measurement::lines_of(result.doubts);
  page.verdict = allan_advice(result);
  const std::string compensation = compensation_sentences(result);
  page.blocks.emplace_back(
      report::Paragraph{compensation.empty() ? verdict(result) : compensation});
  page.blocks.emplace_back(report::Paragraph{record_note(result)});
  for (const std::string& warning : result.warnings)
    page.blocks.emplace_back(report::Paragraph{"Note: " + warning + "."});
  for (const auto axis : core::kAxes) {
    bool is_first = true;
    for (const AllanStream& stream : result.streams) {
      if (stream.axis != axis) continue;
      if (is_first) {
        page.blocks.emplace_back(report::Heading{"Axis " + std::string(core::name(axis))});
        if (!is_alone(stream, result))
          page.blocks.emplace_back(
              report::Figure{beside_chart(axis, result), "Raw and compensated, with " +
                                                             percent(result.request.confidence) +
                                                             " confidence bands."});
      }
      is_first = false;
      add_stream(page, stream, result);
    }
  }
  page.blocks.emplace_back(report::Heading{"How to read this"});
  page.blocks.emplace_back(report::Paragraph{reading_note(result)});
  return page;
}

}  // namespace zerodrift::services
