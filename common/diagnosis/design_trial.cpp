// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/design_trial.h"

#include <algorithm>
#include <optional>

#include "common/core/not_known.h"
#include "common/core/time.h"
#include "common/diagnosis/candidates.h"
#include "common/diagnosis/diagnosis.h"
#include "common/twin/simulation.h"

namespace zerodrift::diagnosis {
namespace {

// A thermometer's newest reading until a time; NaN where there is no new one.
class Thermometer {
 public:
  Thermometer(const twin::Model& model, const twin::Profile& profile, std::uint64_t seed,
              const std::string& probe)
      : simulation_(model, profile, seed, probe), next_(simulation_.next()) {}

  double at(core::SensorTime time) {
    double reading = core::kNaN;
    while (next_ && next_->time <= time) {
      reading = next_->temperature_degc;
      next_ = simulation_.next();
    }
    return reading;
  }

 private:
  twin::ThermometerSimulation simulation_;
  std::optional<core::TemperatureSample> next_;
};

// Of this axis alone: the others take time and say nothing.
twin::Model of_axis(const twin::Model& model, core::Axis axis) {
  twin::Model own = model;
  std::erase_if(own.effects, [axis](const twin::EffectSpec& e) { return e.axis != axis; });
  return own;
}

// Of the explanations its set keeps the truth alone: what both records together leave.
bool tells(const AxisDiagnosis& diagnosis, const Question& question, const Explanation& truth) {
  if (truth.is_nothing())
    return diagnosis.effects.empty() && diagnosis.taken_back.empty() && !diagnosis.unknown;
  const auto is_rival = [&](const std::string& name) {
    return name != truth.name() &&
           std::any_of(question.explanations.begin(), question.explanations.end(),
                       [&](const Explanation& other) { return other.name() == name; });
  };
  bool is_there = false;
  const auto see = [&](const std::string& name) { is_there |= name == truth.name(); };
  for (const NamedEffect& effect : diagnosis.effects) {
    if (is_rival(effect.name)) return false;
    see(effect.name);
    for (const Alternative& other : effect.alternatives) {
      if (is_rival(other.name)) return false;
      see(other.name);
    }
  }
  return is_there;
}

bool is_resolved(const Question& question, const Explanation& truth, const twin::Profile& profile,
                 std::uint64_t seed) {
  const twin::Model model = of_axis(question.model, question.axis);
  twin::Model gyro = model;
  if (!truth.is_nothing()) gyro.effects.push_back(spec_of(truth.effect, question.axis));
  const MeasuredSeries series = simulated_series(gyro, profile, question.axis, seed);
  const Diagnosis diagnosis = diagnose(model, series, {}, {});
  const auto& of_axis = diagnosis.axes[core::index(question.axis)];
  return of_axis && tells(*of_axis, question, truth);
}

}  // namespace

MeasuredSeries simulated_series(const twin::Model& model, const twin::Profile& profile,
                                core::Axis axis, std::uint64_t seed) {
  const double rate_hz = std::min(1.0, model.nominal_rate_hz);
  twin::GyroSimulation gyro(model, profile, seed, rate_hz);
  SeriesOptions options{.has_reference = true, .sample_period_s = 1.0 / rate_hz};
  options.grid_interval_s = std::max(1.0, options.sample_period_s);
  std::vector<Thermometer> thermometers;
  for (const twin::ProbeSpec& probe : model.probes) {
    options.probes.push_back(probe.name);
    thermometers.emplace_back(model, profile, seed, probe.name);
  }
  SeriesBuilder builder(options);
  std::vector<double> readings(thermometers.size());
  const std::size_t a = core::index(axis);
  while (const auto sample = gyro.next()) {
    for (std::size_t p = 0; p < thermometers.size(); ++p)
      readings[p] = thermometers[p].at(sample->time);
    const twin::EffectInputs& in = gyro.inputs();
    MeasuredRow row{.time_s = core::seconds(sample->time), .temperature_degc = readings};
    row.rate_radps = {core::kNaN, core::kNaN, core::kNaN};
    if (sample->valid[a]) row.rate_radps[a] = sample->rate_radps[a];
    row.reference_radps = gyro.true_rate_radps();
    row.magnetic_ut = in.magnetic_ut;
    row.acceleration_mps2 = in.acceleration_mps2;
    row.vibration_g = in.vibration_g;
    row.source_current_ma = in.source_current_ma;
    row.supply_v = sample->valid[a] ? in.supply_v : 0.0;
    builder.add(row);
  }
  return builder.finish();
}

std::vector<Share> measured_shares(const std::vector<Question>& questions,
                                   const twin::Profile& profile, std::size_t replicates,
                                   std::uint64_t seed,
                                   const std::function<void(double)>& progress) {
  std::size_t all = 0;
  for (const Question& question : questions) all += question.explanations.size() * replicates;
  std::vector<Share> shares;
  std::uint64_t record = 0;
  for (const Question& question : questions) {
    for (const Explanation& truth : question.explanations) {
      Share share{.explanation = truth.name(), .axis = question.axis, .records = replicates};
      for (std::size_t r = 0; r < replicates; ++r, ++record) {
        progress(static_cast<double>(record) / static_cast<double>(all));
        if (is_resolved(question, truth, profile, seed + record)) ++share.resolved;
      }
      shares.push_back(share);
    }
  }
  return shares;
}

}  // namespace zerodrift::diagnosis
