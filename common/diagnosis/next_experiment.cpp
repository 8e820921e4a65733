// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/next_experiment.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "common/core/units.h"
#include "common/diagnosis/candidates.h"
#include "common/diagnosis/experiment_plan.h"
#include "common/diagnosis/gap.h"
#include "common/diagnosis/held_out.h"
#include "common/diagnosis/known_effects.h"
#include "common/diagnosis/playback.h"
#include "common/diagnosis/rounded_text.h"
#include "common/diagnosis/separation.h"
#include "common/twin/effect_catalogue.h"
#include "common/twin/profile.h"
#include "common/twin/thermal_plant.h"

namespace zerodrift::diagnosis {
namespace {

constexpr double kDurationS = 4.0 * 3600.0;
constexpr double kIntervalS = 2.0;
// Standard errors: below, an experiment tells nothing apart.
constexpr double kLeastSeparation = 1.0;

// What is done to the gyro besides its temperature.
enum class Exposure { kNothing, kRates, kSurroundings };

struct Experiment {
  const char* name;
  double power_on_s;
  std::vector<twin::ChamberPoint> chamber;
  Exposure exposure;
};

std::vector<twin::ChamberPoint> cycles(double low, double high, double ramp_s, double soak_s) {
  std::vector<twin::ChamberPoint> points;
  for (double time = soak_s; time < kDurationS; time += 2.0 * (ramp_s + soak_s)) {
    points.push_back({time, low});
    points.push_back({time + ramp_s, high});
    points.push_back({time + ramp_s + soak_s, high});
    points.push_back({time + 2.0 * ramp_s + soak_s, low});
  }
  return points;
}

std::vector<Experiment> menu() {
  return {
      {"switching on and four hours at constant temperature", 0.0, {}, Exposure::kNothing},
      {"slow ramps up and down over the same temperatures (0.5 °C/min)", -7200.0,
       cycles(0.0, 50.0, 6000.0, 1200.0), Exposure::kNothing},
      {"fast ramps up and down with soaks (3 °C/min)", -7200.0, cycles(0.0, 50.0, 1000.0, 1800.0),
       Exposure::kNothing},
      {"small temperature cycles (5 °C) about one level", -7200.0, cycles(22.5, 27.5, 600.0, 300.0),
       Exposure::kNothing},
      {"a rate table at constant temperature, slow and fast, both ways",
       -7200.0,
       {},
       Exposure::kRates},
      {"a rate table while the temperature ramps", -7200.0, cycles(0.0, 50.0, 3000.0, 1800.0),
       Exposure::kRates},
      {"blocks of magnetic field, tilt, vibration and source current at constant temperature",
       -7200.0,
       {},
       Exposure::kSurroundings},
  };
}

// Blocks of ten minutes, a level for each.
constexpr double kBlockS = 600.0;

// What is moved, each with a pattern of its own.
enum Moved : std::uint64_t { kRate = 1, kField = 4, kTilt = 7, kVibration = 10, kCurrent = 11 };

// In an order of its own for each channel: of 24 blocks, two channels are correlated by .2.
std::vector<double> levels_of(std::uint64_t channel) {
  constexpr std::array kLevels{0.0, 1.0, -1.0, 0.3, -0.3, 0.05, 0.7, -0.05};
  return shuffled_levels(kLevels, static_cast<std::size_t>(kDurationS / kBlockS), channel);
}

void expose(MeasuredSeries& series, Exposure exposure) {
  const auto fill = [&series](std::vector<double>& channel, double offset, double size,
                              std::uint64_t which) {
    const std::vector<double> levels = levels_of(which);
    channel.resize(series.size);
    for (std::size_t i = 0; i < series.size; ++i) {
      const auto block = static_cast<std::size_t>(static_cast<double>(i) * kIntervalS / kBlockS);
      channel[i] = offset + size * levels[std::min(block, levels.size() - 1)];
    }
  };
  for (const core::Axis axis : core::kAxes) {
    const std::size_t a = core::index(axis);
    const double rate = exposure == Exposure::kRates ? 10.0 * core::kRadPerDeg : 0.0;
    fill(series.reference_radps[a], 0.0, rate, Moved::kRate + a);
    if (exposure != Exposure::kSurroundings) continue;
    fill(series.magnetic_ut[a], 0.0, 100.0, Moved::kField + a);
    fill(series.acceleration_mps2[a], 0.0, 9.8, Moved::kTilt + a);
  }
  series.has_reference = exposure == Exposure::kRates;
  if (exposure != Exposure::kSurroundings) return;
  fill(series.vibration_g, 1.0, 1.0, Moved::kVibration);
  fill(series.source_current_ma, twin::kNominalSourceCurrentMa, 5.0, Moved::kCurrent);
}

MeasuredSeries simulate(const Experiment& experiment, const twin::ThermalParameters& plant_of) {
  twin::Profile profile;
  profile.duration_s = kDurationS;
  profile.initial_temperature_degc = 25.0;
  profile.power_on_s = experiment.power_on_s;
  profile.chamber = experiment.chamber;
  twin::ThermalPlant plant(plant_of, profile);
  MeasuredSeries series;
  series.interval_s = series.sample_period_s = kIntervalS;
  series.size = static_cast<std::size_t>(kDurationS / kIntervalS);
  constexpr std::array kPoints{twin::TemperaturePoint::kCoilOuter,
                               twin::TemperaturePoint::kCoilInner, twin::TemperaturePoint::kBoard};
  for (const auto point : kPoints)
    series.probes.push_back({.name = std::string(twin::name(point))});
  for (std::size_t i = 0; i < series.size; ++i) {
    const auto state = plant.at(core::from_seconds(static_cast<double>(i) * kIntervalS));
    for (std::size_t p = 0; p < kPoints.size(); ++p) {
      series.probes[p].temperature_degc.push_back(state.temperature_degc[twin::index(kPoints[p])]);
      series.probes[p].rate_degc_per_s.push_back(
          state.temperature_rate_degc_per_s[twin::index(kPoints[p])]);
    }
    series.since_power_on_s.push_back(static_cast<double>(i + 1) * kIntervalS -
                                      experiment.power_on_s);
  }
  expose(series, experiment.exposure);
  return series;
}

// The effect as found, over an experiment.
Columns waveform_of(const NamedEffect& effect, const Playback& playback, core::Axis axis) {
  const twin::EffectDefinition* definition = twin::find_effect(effect.name);
  if (definition == nullptr || !is_waveform(*definition)) return {};
  return {playback.run(*definition, context_of(spec_of(effect, axis), *definition, kIntervalS))};
}

// Of the effect as found from the rival in any size, or from nothing.
double separation(const Experiment& experiment, const twin::Model& model, core::Axis axis,
                  const NamedEffect& effect, const std::optional<std::string>& rival,
                  Whitener& whitener) {
  const MeasuredSeries series = simulate(experiment, model.thermal_plant);
  const Playback playback(series);
  const Columns waveform = waveform_of(effect, playback, axis);
  if (waveform.empty()) return 0.0;
  const Eigen::VectorXd found = whitener.matrix(waveform).col(0);
  Columns known;
  for (auto& parameter : known_parameters(model, axis, playback))
    known.push_back(std::move(parameter.column.values));
  const Eigen::MatrixXd beside = whitener.matrix(known);
  double nearest = norm_beside(found, beside);
  if (nearest < kLeastSeparation || !rival) return nearest;
  const Candidates all = candidates(series, playback, model, axis, offered_scans());
  for (const Columns& columns : rivals_of(*rival, all, playback)) {
    const Eigen::MatrixXd of_rival = whitener.matrix(columns);
    Eigen::MatrixXd both(beside.rows(), beside.cols() + of_rival.cols());
    both << beside, of_rival;
    nearest = std::min(nearest, norm_beside(found, both));
  }
  return nearest;
}

// What another record shows of an effect and its rival, of which an event does not come again.
struct ShownAgain {
  NamedEffect effect;
  std::optional<std::string> rival{};
  std::string event{};
};

ShownAgain shown_again(const NamedEffect& effect, core::Axis axis) {
  const Alternative& other = effect.alternatives.front();
  const NamedEffect rival{
      .name = other.name, .inputs = other.inputs, .parameters = other.parameters};
  if (happens_once(spec_of(effect, axis))) return {.effect = rival, .event = effect.name};
  if (happens_once(spec_of(rival, axis))) return {.effect = effect, .event = rival.name};
  return {.effect = effect, .rival = rival.name};
}

std::string to_separate(const twin::Model& model, core::Axis axis, const NamedEffect& effect) {
  const ShownAgain shown = shown_again(effect, axis);
  if (!can_be_run(shown.effect.name) || (shown.rival && !can_be_run(*shown.rival))) return {};
  auto noise =
      model_noise(model, axis, kIntervalS, static_cast<std::size_t>(kDurationS / kIntervalS));
  if (!(*std::max_element(noise.begin(), noise.end()) > 0.0)) return {};  // no unit to count in
  Whitener whitener(std::move(noise));
  const auto experiments = menu();
  std::size_t best = 0;
  double largest = -1.0;
  for (std::size_t i = 0; i < experiments.size(); ++i) {
    const double d = separation(experiments[i], model, axis, shown.effect, shown.rival, whitener);
    if (d > largest) {
      largest = d;
      best = i;
    }
  }
  if (!(largest >= kLeastSeparation)) return {};
  const std::string size = rounded(largest, 2) + " standard errors";
  const std::string why = shown.rival ? "they would be " + size + " apart"
                                      : shown.effect.name + " would stand out by " + size + ", " +
                                            shown.event + " does not come again";
  return "To tell " + effect.name + " from " + effect.alternatives.front().name + ": " +
         experiments[best].name + " (" + why + ").";
}

bool would_test(const Candidates& of_experiment, const std::string& name) {
  return std::any_of(of_experiment.testable.begin(), of_experiment.testable.end(),
                     [&](const Candidate& c) { return c.definition->kind == name; });
}

std::string to_test_more(const twin::Model& model, core::Axis axis,
                         const std::vector<NotTestable>& not_testable) {
  if (not_testable.empty()) return {};
  std::string best;
  std::vector<std::string> most;
  for (const Experiment& experiment : menu()) {
    const MeasuredSeries series = simulate(experiment, model.thermal_plant);
    const Playback playback(series);
    const Candidates all = candidates(series, playback, model, axis, offered_scans());
    std::vector<std::string> names;
    for (const NotTestable& effect : not_testable) {
      if (would_test(all, effect.name)) names.push_back(effect.name);
    }
    if (names.size() <= most.size()) continue;
    most = names;
    best = experiment.name;
  }
  if (most.empty()) return {};
  std::string text = "To test what this record could not: " + best + " (";
  for (std::size_t i = 0; i < most.size(); ++i) text += (i > 0 ? ", " : "") + most[i];
  return text + ").";
}

}  // namespace

std::string next_experiment(const twin::Model& model, core::Axis axis,
                            const AxisDiagnosis& diagnosis) {
  for (const NamedEffect& effect : diagnosis.effects) {
    if (effect.alternatives.empty()) continue;
    const std::string answer = to_separate(model, axis, effect);
    if (!answer.empty()) return answer;
  }
  return to_test_more(model, axis, diagnosis.not_testable);
}

}  // namespace zerodrift::diagnosis
