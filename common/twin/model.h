// SPDX-License-Identifier: Apache-2.0
// What the twin knows of one gyro: its effects, its thermal plant and its thermometers. Plain data;
// the file form is idl/proto/twin.proto, written as YAML or JSON (common/config/twin_config.h).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/twin/temperature_point.h"

namespace zerodrift::twin {

// The model format this program writes and fully knows.
inline constexpr std::uint32_t kModelFormatVersion = 1;

// Keys a newer version wrote and this one doesn't know, as JSON text: carried along, never read.
using UnknownKeys = std::map<std::string, std::string>;

// What is wrong with a model or profile: the key as a path ("effects[3].parameters.tau_s") and why.
struct Problem {
  std::string key;
  std::string what;

  [[nodiscard]] std::string text() const { return key + ": " + what; }
};

// Who put an effect into the model, and on what evidence.
struct Origin {
  std::string by = "factory";  // "factory" or "diagnose"
  std::string record;
  std::string date;
  std::string evidence;
  UnknownKeys unknown_keys{};
};

struct EffectSpec {
  std::string kind;  // a name of the effect catalogue, or "formula"
  core::Axis axis = core::Axis::kX;
  // In the units that the names end in; a parameter left out has the catalogue's default. An effect
  // with no parameters at all is known to exist, waits to be fitted, and contributes nothing.
  std::map<std::string, double> parameters{};
  std::map<std::string, double> standard_errors{};
  std::vector<std::string> inputs{};  // temperatures it reads; empty = the catalogue's default
  Origin origin{};
  UnknownKeys unknown_keys{};
  std::string formula{};  // of kind "formula" alone (formula.h)

  // The first problem ("parameters.tau_s", ...), or none.
  [[nodiscard]] std::optional<Problem> find_problem() const;
};

// Lumped thermal network of the gyro (thermal_plant.h). The defaults are a palm-sized FOG of about
// 1 kg whose coil follows the case with a time constant of half an hour.
struct ThermalParameters {
  double case_capacity_j_per_k = 500.0;
  double coil_outer_capacity_j_per_k = 120.0;
  double coil_inner_capacity_j_per_k = 120.0;
  double board_capacity_j_per_k = 80.0;
  double chamber_case_w_per_k = 1.2;
  double case_coil_outer_w_per_k = 0.16;
  double coil_outer_inner_w_per_k = 0.25;
  double case_board_w_per_k = 0.5;
  double board_power_w = 3.0;  // dissipated while the gyro is on
  UnknownKeys unknown_keys{};
};

struct ProbeSpec {
  std::string name;  // as published: "coil", "coil_inner", ...
  TemperaturePoint node = TemperaturePoint::kCoil;
  double rate_hz = 10.0;
  double lag_s = 0.0;              // first-order time constant
  double noise_degc = 0.0;         // standard deviation, white
  double quantisation_degc = 0.0;  // step of the reading; 0 = none
  UnknownKeys unknown_keys{};
};

struct Model {
  std::uint32_t format_version = kModelFormatVersion;
  std::string gyro;     // identity, for people
  std::string gyro_id;  // identity on the topics; also part of the random streams' names
  double nominal_rate_hz = 200.0;
  ThermalParameters thermal_plant;
  std::vector<ProbeSpec> probes;
  std::vector<EffectSpec> effects;
  UnknownKeys unknown_keys{};

  // Written by a newer version: effects it doesn't know are kept and not simulated.
  [[nodiscard]] bool is_newer() const { return format_version > kModelFormatVersion; }

  // The first problem, or none.
  [[nodiscard]] std::optional<Problem> find_problem() const;
  [[nodiscard]] std::optional<std::string> validate() const;
};

}  // namespace zerodrift::twin
