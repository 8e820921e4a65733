// SPDX-License-Identifier: Apache-2.0

#include "common/core/not_known.h"
#include "common/measurement/doubts_json.h"
#include "common/report/json_object.h"
#include "services/zerodrift/allan_report.h"
#include "services/zerodrift/allan_units.h"

namespace zerodrift::services {
namespace {

using allan::Coefficient;
using allan::Identification;
using allan::NoiseTerm;
using allan::Statistic;
using nlohmann::ordered_json;

using core::kNaN;

std::string statistic_key(Statistic statistic) {
  return std::string(allan::name(statistic));
}

ordered_json json_of(const allan::StatisticCurve& curve, const AllanStream& stream) {
  const std::string unit = curve.statistic == Statistic::kTdev ? "_rad" : "_rad_s";
  auto points = ordered_json::array();
  for (std::size_t i = 0; i < curve.points.size(); ++i) {
    const auto& p = curve.points[i];
    ordered_json point{{"tau_s", p.tau_s},
                       {"deviation" + unit, p.deviation},
                       {"lower" + unit, p.lower},
                       {"upper" + unit, p.upper},
                       {"degrees_of_freedom", p.degrees_of_freedom},
                       {"terms", p.terms},
                       {"noise", std::string(allan::name(p.noise))}};
    if (curve.statistic == Statistic::kOadev)
      point["clusters_may_lack_samples"] =
          stream.report.allan[i].rule == allan::GapRule::kNearlyComplete;
    points.push_back(std::move(point));
  }
  return points;
}

std::string name(Identification identification) {
  switch (identification) {
    case Identification::kNotFitted: return "not_fitted";
    case Identification::kUpperBound: return "upper_bound";
    case Identification::kInterval: return "interval";
    case Identification::kWithheld: return "withheld";
  }
  return "unknown";
}

ordered_json json_of(const Coefficient& c) {
  const bool has_interval = c.identification == Identification::kInterval;
  const bool is_bounded = has_interval || c.identification == Identification::kUpperBound;
  return {{"identification", name(c.identification)},
          {"value", has_interval ? c.value : kNaN},
          {"lower", has_interval ? c.lower : kNaN},
          {"upper", is_bounded ? c.upper : kNaN}};
}

ordered_json coefficients_json(const allan::SeriesReport& r) {
  ordered_json json = ordered_json::object();
  for (const NoiseTerm term : allan::kNoiseTerms) {
    auto& own = json[std::string(texts_of(term).si_key)] = json_of(r.coefficients[term]);
    own["slope_reading"] = r.slopes[allan::index(term)].value_or(kNaN);
  }
  for (const FoundTerm& found : found_terms(r.coefficients))
    json[std::string(found.si_key)] = json_of(found.value);
  return json;
}

std::string name(allan::SeriesMethod method) {
  switch (method) {
    case allan::SeriesMethod::kFullOverlap: return "full_overlap";
    case allan::SeriesMethod::kFullOverlapWithGaps: return "full_overlap_with_gaps";
    case allan::SeriesMethod::kCascade: return "cascade";
  }
  return "unknown";
}

std::string name(allan::ShortTaus short_taus) {
  switch (short_taus) {
    case allan::ShortTaus::kMixture: return "mixture";
    case allan::ShortTaus::kBandLimited: return "band_limited";
    case allan::ShortTaus::kNeverWhite: return "never_white";
  }
  return "unknown";
}

ordered_json fit_json(const allan::CoefficientReport& fit) {
  ordered_json json{{"points", fit.points},
                    {"shortest_tau_s", fit.shortest_tau_s},
                    {"short_taus", name(fit.short_taus)},
                    {"converged", fit.status == allan::FitStatus::kConverged},
                    {"explains_the_curve", fit.status != allan::FitStatus::kUnexplained},
                    {"reduced_chi_square", fit.reduced_chi_square}};
  if (fit.white_alone)
    json["white_alone"] = {{"from_s", fit.white_alone->from_s}, {"to_s", fit.white_alone->to_s}};
  return json;
}

ordered_json json_of(const AllanStream& stream) {
  const allan::SeriesReport& r = stream.report;
  ordered_json json{
      {"method", name(r.method)},        {"samples", r.findings.samples},
      {"missing_samples", r.missing},    {"gaps", r.interruptions},
      {"outliers", r.findings.outliers}, {"longest_run_of_equal_samples", r.findings.longest_run},
      {"is_stuck", r.findings.is_stuck}};
  for (const auto& curve : r.curves) {
    json[statistic_key(curve.statistic)] = json_of(curve, stream);
    if (curve.stretch)
      json[statistic_key(curve.statistic) + "_stretch"] = {{"first_sample", curve.stretch->begin},
                                                           {"samples", curve.stretch->count}};
  }
  json["coefficients"] = coefficients_json(r);
  json["fit"] = fit_json(r.coefficients);
  if (r.lowest)
    json["lowest"] = {{"tau_s", r.lowest->tau_s}, {"deviation_rad_s", r.lowest->deviation_radps}};
  return json;
}

}  // namespace

ordered_json allan_json(const AllanResult& result) {
  ordered_json json{
      {"advice", allan_advice(result)},          {"record", result.request.record.file},
      {"confidence", result.request.confidence}, {"samples", result.samples},
      {"sample_period_s", result.period_s},      {"duration_s", result.duration_s},
      {"doubts", doubts_json(result.doubts)},    {"warnings", result.warnings},
      {"verdict", allan_notes(result).back()}};
  for (const AllanStream& stream : result.streams) {
    auto& axis =
        report::object_at(report::object_at(json, "axis"), std::string(core::name(stream.axis)));
    axis["less_reference"] = result.less_reference[core::index(stream.axis)];
    axis[std::string(name(stream.kind))] = json_of(stream);
  }
  return json;
}

}  // namespace zerodrift::services
