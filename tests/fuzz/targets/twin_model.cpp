// SPDX-License-Identifier: Apache-2.0
// Input: a twin's model file.
#include <optional>
#include <string>
#include <vector>

#include "common/compensation/drift_prior.h"
#include "common/config/proto_to_yaml.h"
#include "common/config/twin_config.h"
#include "tests/fuzz/expectations.h"
#include "tests/fuzz/scratch_file.h"

namespace zerodrift::fuzz {
namespace {

std::optional<config::LoadedModel> loaded(ScratchFile& file, std::string_view text) {
  file.fill(text);
  try {
    return config::load_model(file.path());
  } catch (const config::ConfigError& error) {
    demand_one_line(error.what());
    return std::nullopt;
  }
}

// A day's worth of pauses at a temperature that swings: nothing of it may reach beyond the model.
void step_as_prior(const twin::Model& model) {
  if (const auto wrong = compensation::find_wrong_prior(model)) return demand_one_line(*wrong);
  const std::vector<std::string> probes = compensation::prior_probes(model, {});
  compensation::DriftPrior prior(model, probes);
  for (int i = 0; i < 20; ++i) {
    const std::vector<compensation::PriorReading> readings(
        probes.size(), {.temperature_degc = 20.0 + 3.0 * i, .rate_degc_per_s = 0.1 * (i % 3 - 1)});
    prior.step(core::from_seconds(100.0 + 7.0 * i), core::from_seconds(100.0), readings);
  }
}

}  // namespace

void twin_model(Bytes input) {
  static ScratchFile file("model.yaml");
  const auto model = loaded(file, as_text(input));
  if (!model) return;
  for (const auto& warning : model->warnings) demand_one_line(warning);
  const std::string saved = config::to_yaml(config::to_proto(model->model));
  const auto again = loaded(file, saved);
  demand(again.has_value(), "a model that was saved is read again");
  demand(config::to_yaml(config::to_proto(again->model)) == saved,
         "a model that was saved is read as it was");
  step_as_prior(model->model);
}

}  // namespace zerodrift::fuzz
