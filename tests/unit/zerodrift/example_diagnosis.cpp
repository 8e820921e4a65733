// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/zerodrift/example_diagnosis.h"

#include <cmath>

#include "common/core/units.h"

namespace zerodrift::services {
namespace {

using core::radps_from_deg_h;
using diagnosis::AxisDiagnosis;

constexpr int kMinutes = 300;

// A chamber that goes up and down; its rate of change is what the hidden effect follows.
double rate_degc_per_min(int minute) {
  return std::sin(0.05 * minute);
}

double noise_deg_h(int minute) {
  return 0.1 * std::sin(1.7 * minute * minute);
}

void add_curves(AxisDiagnosis& axis, double missing_deg_h) {
  axis.residual.emplace();
  axis.residual->input = "temperature rate of coil (°C/min)";
  for (int i = 0; i < kMinutes; ++i) {
    const double hidden = missing_deg_h * rate_degc_per_min(i);
    const double measured = 1.0 + hidden + noise_deg_h(i);
    axis.waveforms.time_s.push_back(60.0 * i);
    axis.waveforms.measured_radps.push_back(radps_from_deg_h(measured));
    axis.waveforms.before_radps.push_back(radps_from_deg_h(1.0));
    axis.waveforms.after_radps.push_back(radps_from_deg_h(1.0 + 0.98 * hidden));
    axis.residual->value.push_back(rate_degc_per_min(i));
    axis.residual->residual_radps.push_back(radps_from_deg_h(hidden + noise_deg_h(i)));
    axis.residual->explained_radps.push_back(radps_from_deg_h(0.98 * hidden));
  }
  for (double tau_s = 1.0; tau_s < 2000.0; tau_s *= 2.0) {
    const double white = radps_from_deg_h(0.3) / std::sqrt(tau_s);
    const double slow = radps_from_deg_h(missing_deg_h) * tau_s / (tau_s + 1000.0);
    axis.allan.tau_s.push_back(tau_s);
    axis.allan.measured_radps.push_back(std::hypot(white, slow));
    axis.allan.before_radps.push_back(white);
    axis.allan.after_radps.push_back(1.02 * std::hypot(white, slow));
  }
}

AxisDiagnosis named() {
  AxisDiagnosis axis;
  axis.verdict = diagnosis::Verdict::kEffectNamed;
  axis.sentence = "shupe was missing (probability 0.97); the held-out gap fell from 2.00 to 0.100.";
  axis.where = {{"temperature_rate", 0.5, 1.0, 40.0, 1e-20},
                {"allan_tau", 512.0, 1024.0, 9.0, 1e-4}};
  axis.effects = {{.name = "shupe",
                   .probability = 0.97,
                   .alternatives = {{"coil_lag", 0.02}},
                   .inputs = {"coil"},
                   .parameters = {{"coefficient_deg_h_min_per_degc", 2.0}},
                   .standard_errors = {{"coefficient_deg_h_min_per_degc", 0.03}},
                   .log_evidence = 321.0,
                   .share_of_gap = 0.99}};
  axis.recalibrated = {{"bias_temperature", "c1_deg_h_per_degc", 0.01, 0.012, 0.0004}};
  axis.fit = {radps_from_deg_h(1.9), radps_from_deg_h(0.09), radps_from_deg_h(0.08)};
  axis.held_out_kind = diagnosis::HeldOut::kRecords;
  axis.held_out = {radps_from_deg_h(2.0), radps_from_deg_h(0.1), radps_from_deg_h(0.08)};
  axis.allan_log_distance = {1.5, 0.05};
  axis.acceptance = diagnosis::Acceptance::kAccepted;
  axis.not_testable = {{"scale_factor", "no reference rate in the record"},
                       {"magnetic", "no magnetic field in the record"}};
  axis.could_have_seen = {{"hysteresis", radps_from_deg_h(0.05)}};
  axis.next_experiment = "turn the table at 10 deg/s both ways for 10 min";
  axis.evidence = {{"shupe", 321.0, 25.0, radps_from_deg_h(2.0)},
                   {"coil_lag", 317.0, 24.8, radps_from_deg_h(2.0)},
                   {"warm_up", -1.0, 0.5, radps_from_deg_h(0.01)}};
  add_curves(axis, 2.0);
  return axis;
}

AxisDiagnosis consistent() {
  AxisDiagnosis axis;
  axis.sentence = "nothing is missing that this record could have shown.";
  axis.fit = {radps_from_deg_h(0.08), radps_from_deg_h(0.08), radps_from_deg_h(0.08)};
  return axis;
}

}  // namespace

DiagnosisResult example_diagnosis() {
  DiagnosisResult result;
  result.model = "fog.yaml";
  result.gyro = "a FOG";
  result.record = {.file = "r.csv",
                   .rows = 3'600'000,
                   .duration_s = 18000.0,
                   .sample_period_s = 0.005,
                   .interval_s = 1.0,
                   .probes = {"coil", "case"}};
  result.validation = {result.record};
  result.validation.front().file = "v.csv";
  result.warnings = {"r.csv: 1 gap, the longest of 60.0 s"};
  result.diagnosis.verdict = diagnosis::Verdict::kEffectNamed;
  result.diagnosis.axes[core::index(core::Axis::kX)] = named();
  result.diagnosis.axes[core::index(core::Axis::kZ)] = consistent();
  result.change = ModelChange::kRepaired;
  return result;
}

}  // namespace zerodrift::services
