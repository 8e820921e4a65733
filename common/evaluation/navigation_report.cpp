// SPDX-License-Identifier: Apache-2.0
#include "common/evaluation/navigation_report.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "common/core/counted.h"
#include "common/core/not_known.h"
#include "common/core/units.h"
#include "common/report/json_object.h"
#include "common/report/numbers.h"

namespace zerodrift::evaluation {
namespace {

using core::kRadPerDeg;
using navigation::StreamErrors;
using report::significant;

constexpr int kDigits = 3;
using core::kNaN;
constexpr double kEqual = 1.05;         // errors whose ratio is nearer to 1 are called equal
constexpr double kExpectedSigma = 2.0;  // of the filters: an error within has noise as a cause

std::string cell(double value) {
  return std::isfinite(value) ? significant(value, kDigits) : "n/a";
}

double ratio(double raw, double compensated) {
  return std::abs(compensated) > 0.0 ? std::abs(raw / compensated) : kNaN;
}

double in_deg(const StreamErrors& errors, double angle_rad) {
  return errors.samples > 0 ? angle_rad / kRadPerDeg : kNaN;
}

std::string degrees(double angle_rad) {
  return significant(std::abs(angle_rad) / kRadPerDeg, kDigits);
}

std::string from_to(double raw_rad, double compensated_rad) {
  return "from " + degrees(raw_rad) + " to " + degrees(compensated_rad) + " deg";
}

double nis(const navigation::StreamCounts& stream) {
  return stream.nis_degrees > 0 ? stream.nis_sum / static_cast<double>(stream.nis_degrees) : kNaN;
}

// One heading error at one end tells little: both may be what noise alone leaves.
bool could_be_noise(const NavigationResult& result) {
  for (std::size_t i = 0; i < 2; ++i) {
    const StreamErrors& errors = result.errors[i];
    if (std::abs(errors.heading_now) > kExpectedSigma * errors.heading_sigma_now) return false;
  }
  return true;
}

}  // namespace

std::string navigation_advice(const NavigationResult& result) {
  const std::string unknown = "Whether compensation helped the heading can't be said: ";
  if (!result.truth_known) return unknown + result.truth_note + ".";
  const auto& [raw, compensated] = result.errors;
  if (raw.samples == 0 || compensated.samples == 0) {
    return unknown + (result.truth_note.empty()
                          ? "the record is too short, it ends before the alignment does."
                          : result.truth_note + ".");
  }
  const double before = raw.heading_rms();
  const double after = compensated.heading_rms();
  if (std::max(before, after) <= kEqual * std::min(before, after)) {
    return "Compensation made no difference to the heading: its error is " + degrees(before) +
           " deg rms raw and " + degrees(after) + " compensated.";
  }
  std::string text = after < before ? "Compensation helped: the heading error falls "
                                    : "Compensation harmed: the heading error rises ";
  text += from_to(before, after) + " rms, at its largest " +
          from_to(raw.heading_largest, compensated.heading_largest);
  if (could_be_noise(result)) {
    text += "; both end within what the filters expect of noise alone (2 sigma, " +
            degrees(kExpectedSigma * result.errors[1].heading_sigma_now) +
            " deg), so that another run may say otherwise";
  }
  return text + ".";
}

report::Table navigation_table(const NavigationResult& result) {
  report::Table table;
  table.caption = "heading, raw beside compensated";
  table.columns = {{"", report::Align::kLeft}, {"raw"}, {"compensated"}, {"raw / compensated"}};
  const auto add = [&](const char* name, const std::function<double(std::size_t)>& value,
                       bool compares) {
    const double raw = value(0);
    const double compensated = value(1);
    table.rows.push_back(
        {{name, cell(raw), cell(compensated), compares ? cell(ratio(raw, compensated)) : ""}});
  };
  const auto& errors = result.errors;
  if (result.truth_known) {
    add(
        result.truth_lost ? "error when last known, deg" : "error at the end, deg",
        [&](auto i) { return in_deg(errors[i], errors[i].heading_now); }, true);
    add(
        "error rms, deg", [&](auto i) { return in_deg(errors[i], errors[i].heading_rms()); }, true);
    add(
        "largest error, deg", [&](auto i) { return in_deg(errors[i], errors[i].heading_largest); },
        true);
    add(
        "NEES, attitude (3 expected)", [&](auto i) { return errors[i].nees_mean(); }, false);
  }
  add(
      "heading at the end, deg",
      [&](auto i) { return result.attitudes[i].heading_rad / kRadPerDeg; }, false);
  add(
      "its sigma, deg", [&](auto i) { return result.heading_sigma_rad[i] / kRadPerDeg; }, false);
  add(
      "updates at rest", [&](auto i) { return static_cast<double>(result.streams[i].updates); },
      false);
  add(
      "refused", [&](auto i) { return static_cast<double>(result.streams[i].rejected); }, false);
  add(
      "NIS (1 expected)", [&](auto i) { return nis(result.streams[i]); }, false);
  return table;
}

std::string navigation_note(const NavigationRequest& request, const NavigationResult& result) {
  std::string note =
      request.navigation.updates == navigation::Updates::kNone
          ? "Free inertial from the end of the alignment on: the drift shows in full. "
          : "Both filters are updated at rest: what they then know of the drift makes up for "
            "much of what compensation does. ";
  note += significant(result.rest_s, kDigits) + " s at rest; the compensation learned " +
          std::to_string(result.compensation.labels) + " labels, " +
          std::to_string(result.compensation.references[0]) + " references were taken.";
  if (result.counts.losses > 0)
    note += " Rates were missing for too long to bridge " +
            core::counted(result.counts.losses, "time") + ": the heading is uncertain since.";
  return note;
}

nlohmann::ordered_json navigation_json(const NavigationResult& result) {
  auto json = nlohmann::ordered_json::object();
  json["advice"] = navigation_advice(result);
  json["record"] = result.record;
  json["truth_known"] = result.truth_known;
  json["truth_lost"] = result.truth_lost;
  json["warnings"] = result.warnings;
  json["rest_s"] = result.rest_s;
  json["labels"] = result.compensation.labels;
  for (std::size_t v = 0; v < compensation::kReferenceVerdicts; ++v) {
    const auto verdict = static_cast<compensation::ReferenceVerdict>(v);
    report::object_at(json, "references")[std::string(compensation::name(verdict))] =
        result.compensation.references[v];
  }
  json["samples"] = result.counts.samples;
  json["gaps"] = result.counts.gaps;
  json["losses"] = result.counts.losses;
  const char* names[] = {"raw", "compensated"};
  for (std::size_t i = 0; i < 2; ++i) {
    const StreamErrors& errors = result.errors[i];
    auto& stream = report::object_at(json, names[i]);
    stream["heading_error_end_deg"] = in_deg(errors, errors.heading_now);
    stream["heading_error_rms_deg"] = in_deg(errors, errors.heading_rms());
    stream["heading_error_largest_deg"] = in_deg(errors, errors.heading_largest);
    stream["heading_error_end_sigma_deg"] = in_deg(errors, errors.heading_sigma_now);
    stream["attitude_error_end_deg"] = in_deg(errors, errors.angle_now);
    stream["nees"] = errors.nees_mean();
    stream["heading_end_deg"] = result.attitudes[i].heading_rad / kRadPerDeg;
    stream["heading_sigma_deg"] = result.heading_sigma_rad[i] / kRadPerDeg;
    stream["updates"] = result.streams[i].updates;
    stream["rejected"] = result.streams[i].rejected;
    stream["nis"] = nis(result.streams[i]);
  }
  json["ratio"] = {
      {"end", ratio(result.errors[0].heading_now, result.errors[1].heading_now)},
      {"rms", ratio(result.errors[0].heading_rms(), result.errors[1].heading_rms())},
      {"largest", ratio(result.errors[0].heading_largest, result.errors[1].heading_largest)}};
  return json;
}

report::Document navigation_page(const NavigationRequest& request, const NavigationResult& result) {
  report::Document page;
  page.title = "Navigation, raw beside compensated";
  page.subtitle = result.record;
  page.verdict = navigation_advice(result);
  page.blocks.emplace_back(navigation_table(result));
  page.blocks.emplace_back(report::Paragraph{.text = navigation_note(request, result)});
  for (const std::string& warning : result.warnings)
    page.blocks.emplace_back(report::Paragraph{.text = "Note: " + warning + "."});
  if (result.points.size() < 2) return page;
  report::Chart chart;
  chart.title = "Heading error";
  chart.x_label = "time (s)";
  chart.y_label = "heading error (deg)";
  report::Curve raw{.name = "raw"};
  report::Curve compensated{.name = "compensated"};
  for (const NavigationPoint& point : result.points) {
    raw.x.push_back(point.time_s);
    compensated.x.push_back(point.time_s);
    raw.y.push_back(point.raw_error_rad / kRadPerDeg);
    compensated.y.push_back(point.compensated_error_rad / kRadPerDeg);
  }
  chart.curves = {raw, compensated};
  page.blocks.emplace_back(
      report::Figure{.chart = chart, .caption = "Heading error against the record's true rate."});
  return page;
}

}  // namespace zerodrift::evaluation
