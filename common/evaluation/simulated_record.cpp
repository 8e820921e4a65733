// SPDX-License-Identifier: Apache-2.0
#include "common/evaluation/simulated_record.h"

#include <algorithm>
#include <optional>

#include "common/config/twin_config.h"
#include "common/record/record_writer.h"
#include "common/twin/effect_catalogue.h"
#include "common/twin/simulation.h"

namespace zerodrift::evaluation {
namespace {

// A probe and the reading that waits for its row: the first at or after its time.
struct Probe {
  twin::ThermometerSimulation simulation;
  std::optional<core::TemperatureSample> next;
};

// An input's columns, and where its values are.
struct InputColumns {
  std::vector<std::string> names;
  std::vector<double> (*values)(const twin::EffectInputs& inputs);
  twin::ExcitedQuantity quantity;
  twin::Need need;
};

std::vector<double> vector_of(const core::PerAxis<double>& v) {
  return {v.begin(), v.end()};
}

// Those that the profile moves or that one of the model's effects depends on.
std::vector<InputColumns> input_columns(const twin::Model& model, const twin::Profile& profile) {
  using twin::ExcitedQuantity;
  using twin::Need;
  std::vector<InputColumns> all{
      {{"magnetic_x_uT", "magnetic_y_uT", "magnetic_z_uT"},
       [](const twin::EffectInputs& i) { return vector_of(i.magnetic_ut); },
       ExcitedQuantity::kMagneticUt,
       Need::kMagnetic},
      {{"acceleration_x_m_s2", "acceleration_y_m_s2", "acceleration_z_m_s2"},
       [](const twin::EffectInputs& i) { return vector_of(i.acceleration_mps2); },
       ExcitedQuantity::kAccelerationMps2,
       Need::kAcceleration},
      {{"vibration_g"},
       [](const twin::EffectInputs& i) { return std::vector{i.vibration_g}; },
       ExcitedQuantity::kVibrationG,
       Need::kVibration},
      {{"source_current_mA"},
       [](const twin::EffectInputs& i) { return std::vector{i.source_current_ma}; },
       ExcitedQuantity::kSourceCurrentMa,
       Need::kSourceCurrent},
      {{"supply_V"},
       [](const twin::EffectInputs& i) { return std::vector{i.supply_v}; },
       ExcitedQuantity::kSupplyV,
       Need::kSupply}};
  std::erase_if(all, [&](const InputColumns& columns) {
    const bool moved = std::any_of(profile.excitations.begin(), profile.excitations.end(),
                                   [&](const twin::Excitation& excitation) {
                                     return excitation.quantity == columns.quantity;
                                   });
    return !moved && !twin::depends_on(model, columns.need);
  });
  return all;
}

}  // namespace

SimulatedRecord load_simulation(const std::string& model_file, const std::string& profile_file) {
  auto loaded = config::load_model(model_file);
  return {.model_name = model_file,
          .profile_name = profile_file,
          .model = loaded.model,
          .profile = config::load_profile(profile_file),
          .rate_hz = loaded.model.nominal_rate_hz,
          .warnings = loaded.warnings};
}

std::uint64_t write_simulation(const SimulatedRecord& simulated, const std::string& out,
                               const std::function<void(double share)>& progress) {
  twin::GyroSimulation gyro(simulated.model, simulated.profile, simulated.seed, simulated.rate_hz);
  std::vector<Probe> probes;
  record::RecordWriterOptions layout;
  layout.metadata = {{"model", simulated.model_name},
                     {"profile", simulated.profile_name},
                     {"seed", std::to_string(simulated.seed)}};
  layout.columns = {"time_s", "rate_x_rad_s", "rate_y_rad_s", "rate_z_rad_s"};
  if (simulated.has_reference) {
    layout.columns.insert(layout.columns.end(),
                          {"reference_x_rad_s", "reference_y_rad_s", "reference_z_rad_s"});
  }
  const auto inputs = input_columns(simulated.model, simulated.profile);
  for (const auto& columns : inputs) {
    layout.columns.insert(layout.columns.end(), columns.names.begin(), columns.names.end());
  }
  for (const auto& spec : simulated.model.probes) {
    layout.columns.push_back("temperature_" + spec.name + "_degC");
    probes.push_back(
        {twin::ThermometerSimulation(simulated.model, simulated.profile, simulated.seed, spec.name),
         std::nullopt});
    probes.back().next = probes.back().simulation.next();
  }
  record::RecordWriter writer(out, layout);
  std::uint64_t rows = 0;
  while (const auto sample = gyro.next()) {
    writer.time(sample->time);
    for (const auto axis : core::kAxes) writer.number(sample->rate_radps[core::index(axis)]);
    if (simulated.has_reference) {
      for (const auto axis : core::kAxes) writer.number(gyro.true_rate_radps()[core::index(axis)]);
    }
    for (const auto& columns : inputs) {
      for (const double value : columns.values(gyro.inputs())) writer.number(value);
    }
    for (auto& probe : probes) {
      if (!probe.next || probe.next->time > sample->time) {
        writer.blank();
        continue;
      }
      writer.number(probe.next->temperature_degc);
      while (probe.next && probe.next->time <= sample->time) probe.next = probe.simulation.next();
    }
    writer.end_row();
    if (++rows % 4096 == 0) progress(core::seconds(sample->time) / simulated.profile.duration_s);
  }
  writer.commit();
  return rows;
}

}  // namespace zerodrift::evaluation
