// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/diagnosis_run.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "common/config/twin_config.h"
#include "common/report/numbers.h"
#include "common/report/plain_text.h"
#include "common/twin/effect_catalogue.h"
#include "services/zerodrift/progress_bar.h"

namespace zerodrift::services {
namespace {

// Share of the progress bar that belongs to the reading.
constexpr double kReading = 0.5;
// Units of rate differ by 57 times at least; twin and gyro never do in their white noise.
constexpr double kWrongUnit = 50.0;

bool is_same_file(const std::string& a, const std::string& b) {
  std::error_code error;
  return a == b || (std::filesystem::equivalent(a, b, error) && !error);
}

// What was fitted can't prove anything.
void check(const DiagnosisRequest& request) {
  for (std::size_t i = 0; i < request.validation.size(); ++i) {
    const std::string& file = request.validation[i];
    const auto refuse = [&](const std::string& why) {
      throw std::invalid_argument("--validate: found '" + report::one_line(file) + "' " + why +
                                  ", expected a record that takes no part in the fit, each once");
    };
    if (is_same_file(file, request.record.file)) refuse("that is also --record");
    for (std::size_t j = 0; j < i; ++j) {
      if (is_same_file(file, request.validation[j])) refuse("twice");
    }
  }
}

RecordSummary summary_of(const measurement::MeasuredRecord& record) {
  RecordSummary summary{.file = record.file,
                        .rows = record.series.rows,
                        .duration_s = record.duration_s(),
                        .sample_period_s = record.series.sample_period_s,
                        .interval_s = record.series.interval_s,
                        .has_reference = record.series.has_reference};
  for (const auto& probe : record.series.probes) summary.probes.push_back(probe.name);
  return summary;
}

// White noise of a sample by the model, rad/s; 0 where the model has none.
double expected_noise_radps(const twin::Model& model, core::Axis axis, double period_s) {
  double square = 0.0;
  for (const twin::EffectSpec& effect : model.effects) {
    const twin::Spectrum& spectrum = twin::find_effect(effect.kind)->spectrum;
    if (effect.axis != axis || spectrum.law != twin::NoiseLaw::kWhite) continue;
    const auto found = effect.parameters.find(spectrum.scale);
    if (found == effect.parameters.end()) continue;
    const double n = found->second * spectrum.si_per_unit;
    square += n * n / period_s;
  }
  return std::sqrt(square);
}

// Rates in another unit than their name says betray themselves by their noise.
void compare_noise(const twin::Model& model, const measurement::MeasuredRecord& record,
                   std::vector<std::string>& warnings) {
  for (const auto axis : core::kAxes) {
    if (!record.has(axis)) continue;
    const double expected = expected_noise_radps(model, axis, record.series.sample_period_s);
    const double measured = record.sample_noise_radps[core::index(axis)];
    if (!(expected > 0.0 && measured > 0.0)) continue;
    const double times = measured / expected;
    if (times < kWrongUnit && times > 1.0 / kWrongUnit) continue;
    warnings.push_back(record.file + ": column " +
                       report::shortened(record.rate_column[core::index(axis)], 60) +
                       ": from sample to sample the noise is " +
                       report::significant(times > 1.0 ? times : 1.0 / times, 2) + " times " +
                       (times > 1.0 ? "larger" : "smaller") +
                       " than the twin's; is the unit right? (1 rad/s = 57.3 deg/s = 206265 "
                       "deg/h)");
  }
}

// An axis of which the twin says nothing.
void name_bare_axes(const twin::Model& model, const DiagnosisRequest& request,
                    const measurement::MeasuredRecord& record, std::vector<std::string>& warnings) {
  for (const auto axis : core::kAxes) {
    const bool listed =
        std::any_of(model.effects.begin(), model.effects.end(),
                    [&](const twin::EffectSpec& effect) { return effect.axis == axis; });
    if (record.has(axis) && !listed) {
      warnings.push_back(request.model + ": lists no effect of axis " +
                         std::string(core::name(axis)) + "; all of its drift counts as missing");
    }
  }
}

void require_common_axis(const measurement::MeasuredRecord& record,
                         const measurement::MeasuredRecord& validation) {
  for (const auto axis : core::kAxes) {
    if (record.has(axis) && validation.has(axis)) return;
  }
  throw std::invalid_argument(validation.file + ": found no axis that " + record.file +
                              " has, expected a record of the same gyro");
}

// Of a record to prove on. What is compared are means of 60 s: ten of them are the least that tells
// drift from chance. (A short record to diagnose gets the verdict that it can't be decided.)
void require_length(const measurement::MeasuredRecord& validation) {
  constexpr double kShortestS = 600.0;
  if (validation.duration_s() >= kShortestS) return;
  throw std::invalid_argument(validation.file + ": found " +
                              report::significant(validation.duration_s(), 3) +
                              " s, expected at least 10 min to prove anything on");
}

// A diagnosis of nothing would read as a clean bill.
void require_an_axis(const DiagnosisResult& result) {
  const auto& axes = result.diagnosis.axes;
  if (std::any_of(axes.begin(), axes.end(), [](const auto& axis) { return axis.has_value(); }))
    return;
  const auto& why = result.diagnosis.warnings;
  throw std::invalid_argument(result.record.file + ": " +
                              (why.empty() ? "no axis can be diagnosed" : why.back()));
}

bool is_equal(const twin::EffectSpec& a, const twin::EffectSpec& b) {
  return a.kind == b.kind && a.axis == b.axis && a.parameters == b.parameters &&
         a.standard_errors == b.standard_errors && a.inputs == b.inputs;
}

DiagnosisResult diagnose_with(const DiagnosisRequest& request, const config::LoadedModel& loaded,
                              const measurement::MeasuredRecord& record, ProgressBar& bar) {
  DiagnosisResult result;
  result.model = request.model;
  result.gyro = loaded.model.gyro;
  result.warnings = loaded.warnings;
  const auto note = [&](const measurement::MeasuredRecord& measured) {
    result.doubts.insert(result.doubts.end(), measured.doubts.begin(), measured.doubts.end());
    result.warnings.insert(result.warnings.end(), measured.warnings.begin(),
                           measured.warnings.end());
    compare_noise(loaded.model, measured, result.warnings);
  };
  note(record);
  name_bare_axes(loaded.model, request, record, result.warnings);
  result.record = summary_of(record);
  std::vector<diagnosis::MeasuredSeries> validation;
  const double share_of_each = kReading / static_cast<double>(1 + request.validation.size());
  double done = share_of_each;
  for (const std::string& file : request.validation) {
    bar.show(done);
    measurement::MeasuredRecord held_out = measurement::read_measured_record(
        {.record = request.record.beside(file)},
        [&](double share) { bar.show(done + share_of_each * share); });
    done += share_of_each;
    note(held_out);
    require_length(held_out);
    require_common_axis(record, held_out);
    result.validation.push_back(summary_of(held_out));
    validation.push_back(std::move(held_out.series));
  }
  bar.show(done);
  result.diagnosis = diagnosis::diagnose(loaded.model, record.series, validation,
                                         {.record = request.record.file, .date = request.date});
  for (const std::string& line : result.diagnosis.warnings) result.warnings.push_back(line);
  require_an_axis(result);
  result.change = change_between(loaded.model, result.diagnosis.repaired);
  return result;
}

measurement::MeasuredRecord read_with(const DiagnosisRequest& request, ProgressBar& bar) {
  const double share_of_each = kReading / static_cast<double>(1 + request.validation.size());
  bar.show(0.0);
  return measurement::read_measured_record({.record = request.record, .axes = request.axes},
                                           [&](double share) { bar.show(share_of_each * share); });
}

}  // namespace

ModelChange change_between(const twin::Model& model, const twin::Model& repaired) {
  const bool equal = std::equal(model.effects.begin(), model.effects.end(),
                                repaired.effects.begin(), repaired.effects.end(), is_equal);
  return equal ? ModelChange::kUnchanged : ModelChange::kRepaired;
}

DiagnosisResult run_diagnosis(const DiagnosisRequest& request) {
  check(request);
  ProgressBar bar("diagnose");
  const auto record = read_with(request, bar);
  return diagnose_with(request, config::load_model(request.model), record, bar);
}

DiagnosisResult run_diagnosis(const DiagnosisRequest& request,
                              const measurement::MeasuredRecord& record) {
  check(request);
  ProgressBar bar("diagnose");
  return diagnose_with(request, config::load_model(request.model), record, bar);
}

DiagnosisResult run_calibration(
    DiagnosisRequest request,
    const std::function<twin::Model(const measurement::MeasuredRecord&)>& list) {
  check(request);
  ProgressBar bar("calibrate");
  const auto record = read_with(request, bar);
  request.model = "its listed effects";
  return diagnose_with(request, {.model = list(record), .warnings = {}}, record, bar);
}

}  // namespace zerodrift::services
