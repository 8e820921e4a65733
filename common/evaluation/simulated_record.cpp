// SPDX-License-Identifier: Apache-2.0
#include "common/evaluation/simulated_record.h"

#include <optional>

#include "common/config/twin_config.h"
#include "common/record/column_map.h"
#include "common/record/record_writer.h"
#include "common/twin/simulation.h"

namespace zerodrift::evaluation {
namespace {

// A probe and the reading that waits for its row: the first at or after its time.
struct Probe {
  twin::ThermometerSimulation simulation;
  std::optional<core::TemperatureSample> next;
};

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
                               const record::WriteShare& progress) {
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
  const auto channels = twin::environment_channels(simulated.model, simulated.profile);
  for (std::size_t i = 0; i < core::kEnvironmentChannels; ++i) {
    if (core::has_channel(channels, i))
      layout.columns.push_back(record::column_name(record::environment_channel(i)));
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
    const core::Environment environment = gyro.environment();
    for (std::size_t i = 0; i < core::kEnvironmentChannels; ++i) {
      if (core::has_channel(channels, i)) writer.number(core::channel(environment, i));
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
    if (++rows % 4096 == 0)
      progress(core::seconds(sample->time) / simulated.profile.duration_s, writer.bytes());
  }
  writer.commit();
  return rows;
}

}  // namespace zerodrift::evaluation
