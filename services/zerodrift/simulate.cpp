// SPDX-License-Identifier: Apache-2.0
// zerodrift simulate: the twin's record of a profile, as a file. What the gyro doesn't say (while
// it is off, dropped samples) are blank cells of rows that are there.
#include <algorithm>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "common/config/twin_config.h"
#include "common/files/atomic_file.h"
#include "common/record/record_writer.h"
#include "common/service/main.h"
#include "common/twin/effect_catalogue.h"
#include "common/twin/simulation.h"
#include "services/zerodrift/commands.h"
#include "services/zerodrift/ending.h"
#include "services/zerodrift/progress_bar.h"

namespace zerodrift::services {
namespace {

struct SimulateOptions {
  std::string model;
  std::string profile;
  std::string duration;
  double rate_hz = 0.0;
  std::uint64_t seed = 1;
  std::string out;
  bool reference = false;
};

// "90", "90s", "30min" or "5h", in seconds.
double parse_duration(const std::string& text) {
  std::size_t used = 0;
  double value = 0.0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  const std::string unit = used == 0 ? "?" : text.substr(used);
  const double factor = unit.empty() || unit == "s" ? 1.0
                        : unit == "min"             ? 60.0
                        : unit == "h"               ? 3600.0
                                                    : 0.0;
  if (factor == 0.0 || !(value > 0.0)) {
    throw std::invalid_argument("--duration: found '" + text + "', expected e.g. 90s, 30min or 5h");
  }
  return value * factor;
}

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

int simulate(const SimulateOptions& options) {
  const EndsAtOnce on_signal;
  files::check_outputs({{"--model", options.model}, {"--profile", options.profile}},
                       {{"--out", options.out}});
  const auto loaded = config::load_model(options.model);
  for (const auto& line : loaded.warnings) std::fprintf(stderr, "%s\n", line.c_str());
  twin::Profile profile = config::load_profile(options.profile);
  if (!options.duration.empty()) profile.duration_s = parse_duration(options.duration);
  const double rate_hz = options.rate_hz > 0.0 ? options.rate_hz : loaded.model.nominal_rate_hz;

  twin::GyroSimulation gyro(loaded.model, profile, options.seed, rate_hz);
  std::vector<Probe> probes;
  record::RecordWriterOptions layout;
  layout.metadata = {{"model", options.model},
                     {"profile", options.profile},
                     {"seed", std::to_string(options.seed)}};
  layout.columns = {"time_s", "rate_x_rad_s", "rate_y_rad_s", "rate_z_rad_s"};
  if (options.reference) {
    layout.columns.insert(layout.columns.end(),
                          {"reference_x_rad_s", "reference_y_rad_s", "reference_z_rad_s"});
  }
  const auto inputs = input_columns(loaded.model, profile);
  for (const auto& columns : inputs) {
    layout.columns.insert(layout.columns.end(), columns.names.begin(), columns.names.end());
  }
  for (const auto& spec : loaded.model.probes) {
    layout.columns.push_back("temperature_" + spec.name + "_degC");
    probes.push_back({twin::ThermometerSimulation(loaded.model, profile, options.seed, spec.name),
                      std::nullopt});
    probes.back().next = probes.back().simulation.next();
  }
  record::RecordWriter writer(options.out, layout);
  ProgressBar bar("simulating");
  std::uint64_t rows = 0;
  while (const auto sample = gyro.next()) {
    writer.time(sample->time);
    for (const auto axis : core::kAxes) writer.number(sample->rate_radps[core::index(axis)]);
    if (options.reference) {
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
    if (++rows % 4096 == 0) bar.show(core::seconds(sample->time) / profile.duration_s);
  }
  writer.commit();
  std::printf("%s: %llu samples at %g Hz\n", options.out.c_str(),
              static_cast<unsigned long long>(rows), rate_hz);
  return service::kExitDone;
}

}  // namespace

void add_simulate(CLI::App& app, Run& run) {
  auto* command = app.add_subcommand("simulate", "write the twin's record of a profile");
  auto options = std::make_shared<SimulateOptions>();
  command->add_option("--model", options->model, "the twin's model file")->required();
  command->add_option("--profile", options->profile, "what the experiment does")->required();
  command->add_option("--duration", options->duration,
                      "e.g. 90s, 30min, 5h; the profile's without");
  command->add_option("--rate", options->rate_hz,
                      "sample rate, Hz; the model's nominal rate without");
  command->add_option("--seed", options->seed, "seed of all noise")->capture_default_str();
  command->add_option("--out", options->out, "record to write: .csv, .csv.gz or .csv.xz")
      ->required();
  command->add_flag("--reference", options->reference, "with the true rate as reference columns");
  command->callback([options, &run] { run = [options] { return simulate(*options); }; });
}

}  // namespace zerodrift::services
