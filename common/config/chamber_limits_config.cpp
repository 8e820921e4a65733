// SPDX-License-Identifier: Apache-2.0
#include "common/config/chamber_limits_config.h"

#include "common/config/configuration_text.h"
#include "common/config/option_reader.h"
#include "common/config/yaml_document.h"
#include "common/core/units.h"

namespace zerodrift::config {
namespace {

using compensation::OptionKey;
using compensation::OptionRange;

constexpr OptionRange kTemperature{.low = -200.0, .high = 300.0};

class ReferenceRows final : public compensation::OptionTextVisitor {
 public:
  std::string page = kReferenceHead;

 private:
  void see(const OptionKey& key, const std::string& value) override {
    page += reference_row(key.name, value, key.range.text(), key.text);
  }
};

}  // namespace

void describe(twin::ChamberLimits& limits, compensation::OptionVisitor& visitor) {
  const auto number = [&](const char* name, OptionRange range, const char* text, auto& value,
                          double si_per_unit = 1.0) {
    visitor.number({.name = name, .text = text, .range = range, .si_per_unit = si_per_unit}, value);
  };
  number("duration_s", {.low = 600.0, .high = 604800.0}, "of the experiment; must be given",
         limits.duration_s);
  number("ambient_degc", kTemperature, "of a laboratory without a chamber", limits.ambient_degc);
  visitor.section("temperature", "A chamber; its three bounds come together.");
  number("temperature.low_degc", kTemperature, "lowest air temperature", limits.low_degc);
  number("temperature.high_degc", kTemperature, "highest air temperature", limits.high_degc);
  number("temperature.ramp_degc_per_min", {.low = 0.01, .high = 20.0}, "fastest ramp, up and down",
         limits.ramp_degc_per_s, 1.0 / 60.0);
  number("temperature.soak_s", {.low = 60.0, .high = 86400.0}, "shortest hold", limits.soak_s);
  visitor.section("rate_table", "A table that turns the gyro about each of its axes.");
  number("rate_table.largest_deg_s", {.low = 0.01, .high = 2000.0}, "both ways", limits.rate_radps,
         core::kRadPerDeg);
  visitor.section("magnetic", "Coils around the gyro.");
  number("magnetic.largest_ut", {.low = 0.1, .high = 1e5}, "along each axis, both ways",
         limits.magnetic_ut);
  visitor.section("tilt", "A support that tilts about x and y.");
  number("tilt.largest_deg", {.low = 0.1, .high = 90.0}, "both ways", limits.tilt_rad,
         core::kRadPerDeg);
  visitor.section("vibration", "A shaker.");
  number("vibration.largest_g", {.low = 0.001, .high = 100.0}, "rms", limits.vibration_g);
  visitor.section("source_current", "Of the light source.");
  number("source_current.change_ma", {.low = 0.01, .high = 90.0},
         "away from the nominal one, both ways", limits.source_current_ma);
  visitor.section("supply", "Of the gyro.");
  number("supply.change_v", {.low = 0.001, .high = 4.5}, "away from the nominal one, both ways",
         limits.supply_v);
  visitor.section("power", "A switch for the gyro.");
  number("power.off_s", {.low = 60.0, .high = 86400.0}, "how long it stays off", limits.off_s);
}

twin::ChamberLimits load_chamber_limits(const std::filesystem::path& path) {
  const YamlDocument file = YamlDocument::read(path);
  twin::ChamberLimits limits;
  OptionReader reader(file, [](const std::string&) -> twin::Model { return {}; });
  describe(limits, reader);
  reader.refuse_unknown();
  reader.require("duration_s", "how long an experiment may last");
  if (const auto problem = limits.find_problem()) throw file.error(problem->key, problem->what);
  return limits;
}

std::string chamber_limits_reference() {
  twin::ChamberLimits none;
  ReferenceRows rows;
  describe(none, rows);
  return rows.page;
}

}  // namespace zerodrift::config
