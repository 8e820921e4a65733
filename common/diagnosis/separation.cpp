// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/separation.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/units.h"
#include "common/twin/effect_catalogue.h"
#include "common/twin/thermal_plant.h"

namespace zerodrift::diagnosis {

Whitener::Whitener(std::vector<double> dct_variances)
    : transform_(dct_variances.size()), variances_(std::move(dct_variances)) {
  const double largest = *std::max_element(variances_.begin(), variances_.end());
  for (double& v : variances_) v = v > 0.0 ? v : largest;
}

Eigen::MatrixXd Whitener::matrix(const Columns& columns) {
  const auto n = static_cast<Eigen::Index>(variances_.size());
  Eigen::MatrixXd result(n, static_cast<Eigen::Index>(columns.size()));
  for (std::size_t c = 0; c < columns.size(); ++c) {
    Eigen::VectorXd cosine = transform_.forward(columns[c]);
    cosine(0) = 0.0;
    for (Eigen::Index k = 1; k < n; ++k)
      cosine(k) /= std::sqrt(variances_[static_cast<std::size_t>(k)]);
    result.col(static_cast<Eigen::Index>(c)) = cosine;
  }
  return result;
}

double norm_beside(const Eigen::VectorXd& waveform, const Eigen::MatrixXd& others) {
  if (others.cols() == 0) return waveform.norm();
  const Eigen::VectorXd scale = others.colwise().norm().cwiseMax(1e-300).transpose();
  const Eigen::MatrixXd unit = others * scale.cwiseInverse().asDiagonal();
  const Eigen::VectorXd fit = unit * unit.colPivHouseholderQr().solve(waveform);
  return (waveform - fit).norm();
}

Scans offered_scans() {
  constexpr double kArcsecPerRad = 3600.0 / core::kRadPerDeg;
  const auto offered = [](twin::SearchRule rule, const auto& frequency_of) {
    OscillationPeaks peaks;
    for (const auto& definition : twin::effect_catalogue()) {
      for (const auto& parameter : definition.parameters) {
        if (parameter.rule != rule) continue;
        for (const double v : parameter.grid) peaks.frequencies.push_back(frequency_of(v));
      }
    }
    peaks.looked_at = static_cast<double>(peaks.frequencies.size());
    return peaks;
  };
  Scans all;
  all.lines = offered(twin::SearchRule::kFrequency, [](double hz) { return hz; });
  for (const double hz : all.lines.frequencies) all.cycles.push_back({.frequency_hz = hz});
  all.fringes.fill(offered(twin::SearchRule::kPeriod, [](double degc) { return 1.0 / degc; }));
  all.resets =
      offered(twin::SearchRule::kAngle, [](double arcsec) { return kArcsecPerRad / arcsec; });
  return all;
}

std::vector<Columns> rivals_of(const std::string& name, const Candidates& all,
                               const Playback& playback) {
  constexpr std::size_t kMostVariants = 24;
  std::vector<Columns> rivals;
  for (const Candidate& candidate : all.testable) {
    if (candidate.definition->kind != name) continue;
    const std::size_t stride = candidate.variants.size() / kMostVariants + 1;
    for (std::size_t v = 0; v < candidate.variants.size(); v += stride) {
      rivals.push_back(
          columns_of(playback, *candidate.definition,
                     context_of(candidate, candidate.variants[v], playback.interval_s())));
    }
  }
  return rivals;
}

bool can_be_run(const std::string& name) {
  const twin::EffectDefinition* definition = twin::find_effect(name);
  return definition != nullptr && is_waveform(*definition);
}

namespace {

std::vector<ProbeSeries> temperatures_of(const twin::Model& model, const twin::Profile& profile,
                                         double interval_s) {
  twin::ThermalPlant plant(model.thermal_plant, profile);
  std::vector<ProbeSeries> probes;
  for (const twin::ProbeSpec& probe : model.probes) probes.push_back({.name = probe.name});
  const auto size = static_cast<std::size_t>(profile.duration_s / interval_s);
  for (std::size_t i = 0; i < size; ++i) {
    const auto state = plant.at(core::from_seconds(static_cast<double>(i) * interval_s));
    for (std::size_t p = 0; p < probes.size(); ++p) {
      const std::size_t node = twin::index(model.probes[p].node);
      probes[p].temperature_degc.push_back(state.temperature_degc[node]);
      probes[p].rate_degc_per_s.push_back(state.temperature_rate_degc_per_s[node]);
    }
  }
  return probes;
}

void add_excitations(const twin::Profile& profile, MeasuredSeries& series) {
  using twin::ExcitedQuantity;
  const auto channel = [&](const twin::Excitation& excitation) -> std::vector<double>& {
    switch (excitation.quantity) {
      case ExcitedQuantity::kMagneticUt: return series.magnetic_ut[core::index(excitation.axis)];
      case ExcitedQuantity::kAccelerationMps2:
        return series.acceleration_mps2[core::index(excitation.axis)];
      case ExcitedQuantity::kVibrationG: return series.vibration_g;
      case ExcitedQuantity::kSourceCurrentMa: return series.source_current_ma;
      case ExcitedQuantity::kSupplyV: break;
    }
    return series.supply_v;
  };
  for (auto& axis : series.magnetic_ut) axis.assign(series.size, 0.0);
  for (auto& axis : series.acceleration_mps2) axis.assign(series.size, 0.0);
  series.vibration_g.assign(series.size, 0.0);
  series.source_current_ma.assign(series.size, twin::kNominalSourceCurrentMa);
  series.supply_v.assign(series.size, twin::kNominalSupplyV);
  for (const twin::Excitation& excitation : profile.excitations) {
    auto& values = channel(excitation);
    const auto first = static_cast<std::size_t>(excitation.start_s / series.interval_s);
    const double end_s = excitation.start_s + excitation.duration_s;
    for (std::size_t i = first; i < series.size && series.time_s(i) <= end_s; ++i)
      values[i] += twin::excited_value(excitation, series.time_s(i));
  }
}

// The mean over the interval that ends at each time.
void add_turns(const twin::Profile& profile, MeasuredSeries& series) {
  for (auto& axis : series.reference_radps) axis.assign(series.size, 0.0);
  series.has_reference = true;
  for (const twin::Turn& turn : profile.turns) {
    auto& rate = series.reference_radps[core::index(turn.axis)];
    const auto first = static_cast<std::size_t>(turn.start_s / series.interval_s);
    const double end_s = turn.start_s + turn.duration_s + series.interval_s;
    for (std::size_t i = first; i < series.size && series.time_s(i) <= end_s; ++i) {
      const double now_s = series.time_s(i);
      rate[i] += (twin::turned_angle_rad(turn, now_s) -
                  twin::turned_angle_rad(turn, now_s - series.interval_s)) /
                 series.interval_s;
    }
  }
}

}  // namespace

MeasuredSeries exposure(const twin::Model& model, const twin::Profile& profile, double interval_s) {
  return exposure(profile, interval_s, temperatures_of(model, profile, interval_s));
}

MeasuredSeries exposure(const twin::Profile& profile, double interval_s,
                        const std::vector<ProbeSeries>& temperatures) {
  MeasuredSeries series;
  series.interval_s = series.sample_period_s = interval_s;
  series.size = static_cast<std::size_t>(profile.duration_s / interval_s);
  series.probes = temperatures;
  add_excitations(profile, series);
  add_turns(profile, series);
  for (std::size_t i = 0; i < series.size; ++i) {
    const auto state = twin::power_at(profile, series.time_s(i));
    series.since_power_on_s.push_back(std::max(0.0, state.since_on_s) + interval_s);
  }
  return series;
}

}  // namespace zerodrift::diagnosis
