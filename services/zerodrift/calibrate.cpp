// SPDX-License-Identifier: Apache-2.0
// zerodrift calibrate: a first model of one's own gyro, from a record of it.
#include <memory>
#include <set>
#include <stdexcept>
#include <utility>

#include "common/service/main.h"
#include "services/zerodrift/commands.h"
#include "services/zerodrift/diagnosis_output.h"
#include "services/zerodrift/diagnosis_run.h"
#include "services/zerodrift/ending.h"
#include "services/zerodrift/record_options.h"

namespace zerodrift::services {
namespace {

struct CalibrateOptions {
  DiagnosisRequest request;
  std::uint32_t gyro_id = 1;
  std::vector<std::string> axes;
  std::vector<std::string> effects;
  std::string gyro = "gyro";
  Invocation made_by;
  DiagnosisOutputs outputs;

  CalibrateOptions() {
    outputs.if_changed = "the gyro's model";
    outputs.if_unchanged = "the effects as listed; of none the record proves a size";
  }
};

void check_effects(const std::vector<std::string>& effects) {
  std::set<std::string> named;
  for (const std::string& effect : effects) {
    if (!named.insert(effect).second)
      throw std::invalid_argument("--effects: found " + effect + " twice, expected it once");
    if (const auto problem = twin::EffectSpec{.kind = effect}.find_problem())
      throw std::invalid_argument("--effects: " + problem->what);
  }
}

// Its effects on every axis that was measured, none with a size yet.
twin::Model listing(const CalibrateOptions& options, const measurement::MeasuredRecord& record) {
  twin::Model model;
  model.gyro = options.gyro;
  model.gyro_id = options.gyro;
  model.nominal_rate_hz = 1.0 / record.series.sample_period_s;
  for (const auto& probe : record.series.probes) {
    const auto place = twin::temperature_point(probe.name);
    model.probes.push_back(
        {.name = probe.name, .node = place.value_or(twin::TemperaturePoint::kCoil)});
  }
  for (const auto axis : core::kAxes) {
    if (!record.has(axis)) continue;
    for (const std::string& effect : options.effects) {
      twin::EffectSpec spec{.kind = effect, .axis = axis};
      spec.origin.by = "diagnose";
      spec.origin.record = options.request.record.file;
      spec.origin.date = options.request.date;
      model.effects.push_back(std::move(spec));
    }
  }
  return model;
}

Provenance calibration_provenance(const CalibrateOptions& options) {
  std::vector<std::string> records = options.request.validation;
  records.insert(records.begin(), options.request.record.file);
  return provenance_of(options.made_by, "", records);
}

int calibrate(CalibrateOptions options) {
  if (options.gyro.empty())
    throw std::invalid_argument("--gyro: found nothing, expected the gyro's name");
  options.request.axes = axes_named(options.axes);
  if (options.request.date.empty()) options.request.date = today();
  check_effects(options.effects);
  std::vector<files::NamedFile> inputs{{"--record", options.request.record.file}};
  for (const std::string& file : options.request.validation) inputs.push_back({"--validate", file});
  check_against(inputs, options.outputs);
  const EndsAtOnce on_signal;
  hand_out(run_calibration(
               options.request,
               [&](const measurement::MeasuredRecord& record) { return listing(options, record); }),
           options.outputs, calibration_provenance(options));
  return service::kExitDone;
}

}  // namespace

void add_calibrate(CLI::App& app, Run& run, const Invocation& made_by) {
  auto* command = app.add_subcommand(
      "calibrate", "make a first model of a gyro from a record of it, with standard errors");
  auto options = std::make_shared<CalibrateOptions>();
  options->made_by = made_by;
  DiagnosisRequest& request = options->request;
  command->add_option("--record", request.record.file, kRecordHelp)->required();
  command
      ->add_option("--effects", options->effects,
                   "what the gyro is known to have, by the catalogue's names; what else the record "
                   "proves comes to it")
      ->delimiter(',')
      ->required();
  command->add_option("--out-model", options->outputs.model, "file for the model")->required();
  command->add_option("--gyro", options->gyro, "the gyro's name in the model")
      ->capture_default_str();
  const auto* gyro_id = command->add_option("--gyro-id", options->gyro_id,
                                            "of .mcap files: which, where there are several");
  add_columns(*command, request.record.columns);
  add_bag_topics(*command, request.record.topics);
  command->add_option(
      "--validate", request.validation,
      "records that the model is proved on, read as the first; without, blocks of it");
  add_axis_option(*command, options->axes);
  add_output_options(*command, request, options->outputs);
  command->footer(
      "Rates at rest, or with the true rate beside them, over the temperatures that the gyro is to "
      "work at; an hour at least. Exit codes: 0 a model was written, with what could be proved; 2 "
      "wrong usage or bad input.");
  command->callback([options, gyro_id, &run] {
    options->request.record.gyro_id = chosen_gyro(*gyro_id);
    run = [options] { return calibrate(*options); };
  });
}

}  // namespace zerodrift::services
