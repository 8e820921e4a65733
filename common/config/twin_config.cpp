// SPDX-License-Identifier: Apache-2.0
#include "common/config/twin_config.h"

#include <google/protobuf/arena.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <algorithm>

#include "common/config/proto_to_yaml.h"
#include "common/config/whole_file.h"
#include "common/core/closest_name.h"
#include "common/core/units.h"
#include "common/twin/effect_catalogue.h"
#include "common/twin/thermal_keys.h"

namespace zerodrift::config {
namespace {

using StringMap = google::protobuf::Map<std::string, std::string>;
using NumberMap = google::protobuf::Map<std::string, double>;

std::string in_list(const char* list, int i, const char* key) {
  return std::string(list) + '[' + std::to_string(i) + "]." + key;
}

twin::UnknownKeys from_map(const StringMap& map) {
  return {map.begin(), map.end()};
}

std::map<std::string, double> from_map(const NumberMap& map) {
  return {map.begin(), map.end()};
}

template <typename From, typename To>
void copy_map(const From& from, To* to) {
  for (const auto& [key, value] : from) (*to)[key] = value;
}

core::Axis axis_from(const std::string& text, const std::string& key) {
  for (const core::Axis axis : core::kAxes) {
    if (text == core::name(axis)) return axis;
  }
  throw InvalidField({key, "must be x, y or z, found '" + text + "'"});
}

twin::TemperaturePoint node_from(const proto::TwinProbe& probe, const std::string& key) {
  const std::string& text = probe.node().empty() ? probe.name() : probe.node();
  if (const auto point = twin::temperature_point(text)) return *point;
  throw InvalidField({key, "no temperature is called '" + text + "'" +
                               core::suggestion(text, twin::temperature_point_names())});
}

const google::protobuf::FieldDescriptor* field_of(const twin::ThermalKey& key) {
  return proto::TwinThermalPlant::descriptor()->FindFieldByName(key.name);
}

twin::ThermalParameters plant_from(const proto::TwinThermalPlant& m) {
  twin::ThermalParameters p;
  const google::protobuf::Reflection& fields = *m.GetReflection();
  for (const twin::ThermalKey& key : twin::kThermalKeys) {
    const auto* field = field_of(key);
    if (fields.HasField(m, field)) p.*key.value = fields.GetDouble(m, field);
  }
  p.unknown_keys = from_map(m.extra());
  return p;
}

twin::ProbeSpec probe_from(const proto::TwinProbe& m, int i) {
  twin::ProbeSpec probe;
  probe.name = m.name();
  probe.node = node_from(m, in_list("probes", i, "node"));
  if (m.has_rate_hz()) probe.rate_hz = m.rate_hz();
  probe.lag_s = m.lag_s();
  probe.noise_degc = m.noise_degc();
  probe.quantisation_degc = m.quantisation_degc();
  probe.unknown_keys = from_map(m.extra());
  return probe;
}

twin::Origin origin_from(const proto::TwinOrigin& m, const std::string& key) {
  if (m.by() != "factory" && m.by() != "diagnose") {
    throw InvalidField({key, "must be factory or diagnose, found '" + m.by() + "'"});
  }
  return {m.by(), m.record(), m.date(), m.evidence(), from_map(m.extra())};
}

twin::EffectSpec effect_from(const proto::TwinEffect& m, int i) {
  twin::EffectSpec effect;
  effect.kind = m.kind();
  effect.axis = axis_from(m.axis(), in_list("effects", i, "axis"));
  effect.parameters = from_map(m.parameters());
  effect.standard_errors = from_map(m.standard_errors());
  effect.inputs = {m.inputs().begin(), m.inputs().end()};
  if (m.has_origin()) effect.origin = origin_from(m.origin(), in_list("effects", i, "origin.by"));
  effect.unknown_keys = from_map(m.extra());
  effect.formula = m.formula();
  return effect;
}

void to_proto(const twin::ThermalParameters& p, proto::TwinThermalPlant& m) {
  for (const twin::ThermalKey& key : twin::kThermalKeys)
    m.GetReflection()->SetDouble(&m, field_of(key), p.*key.value);
  copy_map(p.unknown_keys, m.mutable_extra());
}

void to_proto(const twin::ProbeSpec& probe, proto::TwinProbe& m) {
  m.set_name(probe.name);
  m.set_node(std::string(twin::name(probe.node)));
  m.set_rate_hz(probe.rate_hz);
  m.set_lag_s(probe.lag_s);
  m.set_noise_degc(probe.noise_degc);
  m.set_quantisation_degc(probe.quantisation_degc);
  copy_map(probe.unknown_keys, m.mutable_extra());
}

void to_proto(const twin::Origin& origin, proto::TwinOrigin& m) {
  m.set_by(origin.by);
  m.set_record(origin.record);
  m.set_date(origin.date);
  m.set_evidence(origin.evidence);
  copy_map(origin.unknown_keys, m.mutable_extra());
}

void to_proto(const twin::EffectSpec& effect, proto::TwinEffect& m) {
  m.set_kind(effect.kind);
  m.set_axis(std::string(core::name(effect.axis)));
  copy_map(effect.parameters, m.mutable_parameters());
  copy_map(effect.standard_errors, m.mutable_standard_errors());
  for (const std::string& input : effect.inputs) m.add_inputs(input);
  m.set_formula(effect.formula);
  to_proto(effect.origin, *m.mutable_origin());
  copy_map(effect.unknown_keys, m.mutable_extra());
}

void require(bool given, const std::string& key) {
  if (!given) throw InvalidField({key, "must be given"});
}

twin::ChamberPoint chamber_point_from(const proto::TwinChamberPoint& m, int i) {
  require(m.has_time_s(), in_list("chamber", i, "time_s"));
  require(m.has_temperature_degc(), in_list("chamber", i, "temperature_degc"));
  return {m.time_s(), m.temperature_degc()};
}

twin::Turn turn_from(const proto::TwinTurn& m, int i) {
  require(m.has_start_s(), in_list("turns", i, "start_s"));
  require(m.has_duration_s(), in_list("turns", i, "duration_s"));
  require(m.has_rate_deg_s(), in_list("turns", i, "rate_deg_s"));
  return {m.start_s(), m.duration_s(), axis_from(m.axis(), in_list("turns", i, "axis")),
          m.rate_deg_s() * core::kRadPerDeg, m.ramp_s()};
}

twin::PowerCycle power_cycle_from(const proto::TwinPowerCycle& m, int i) {
  require(m.has_off_s(), in_list("power_cycles", i, "off_s"));
  require(m.has_on_s(), in_list("power_cycles", i, "on_s"));
  return {m.off_s(), m.on_s()};
}

twin::Excitation excitation_from(const proto::TwinExcitation& m, int i) {
  require(m.has_start_s(), in_list("excitations", i, "start_s"));
  require(m.has_duration_s(), in_list("excitations", i, "duration_s"));
  require(m.has_value(), in_list("excitations", i, "value"));
  const auto quantity = twin::excited_quantity(m.quantity());
  if (!quantity) {
    throw InvalidField({in_list("excitations", i, "quantity"),
                        "no quantity is called '" + m.quantity() + "'" +
                            core::suggestion(m.quantity(), twin::excited_quantity_names())});
  }
  const std::string axis_key = in_list("excitations", i, "axis");
  if (!twin::has_axis(*quantity) && !m.axis().empty()) {
    throw InvalidField({axis_key, m.quantity() + " has no axis, found '" + m.axis() + "'"});
  }
  const core::Axis axis =
      twin::has_axis(*quantity) ? axis_from(m.axis(), axis_key) : core::Axis::kX;
  return {m.start_s(), m.duration_s(), *quantity, axis, m.value(), m.ramp_s()};
}

twin::EarthRateSetup earth_rate_from(const proto::TwinEarthRate& m) {
  require(m.has_latitude_deg(), "earth_rate.latitude_deg");
  return {m.latitude_deg() * core::kRadPerDeg, m.heading_deg() * core::kRadPerDeg,
          m.pitch_deg() * core::kRadPerDeg, m.roll_deg() * core::kRadPerDeg};
}

std::vector<std::string> unknown_effects(const twin::Model& model, const YamlDocument& document) {
  std::vector<std::string> warnings;
  for (std::size_t i = 0; i < model.effects.size(); ++i) {
    const std::string& kind = model.effects[i].kind;
    if (twin::find_effect(kind) != nullptr) continue;
    const std::string key = "effects[" + std::to_string(i) + "].kind";
    warnings.emplace_back(
        document.error(key, "effect '" + kind + "' is not known; kept and not simulated").what());
  }
  return warnings;
}

// A message that nobody destroys: maps of the library (protobuf 3.21) that ran out of memory while
// they grew end the program in their destructor.
template <typename Message>
class UndestroyedMessage {
 public:
  [[nodiscard]] Message& get() noexcept { return *message_; }

 private:
  google::protobuf::Arena arena_;
  Message* message_ = google::protobuf::Arena::CreateMessage<Message>(&arena_);
};

void fill(const twin::Model& model, proto::TwinModel& message) {
  message.set_format_version(model.format_version);
  message.set_gyro(model.gyro);
  message.set_gyro_id(model.gyro_id);
  message.set_nominal_rate_hz(model.nominal_rate_hz);
  to_proto(model.thermal_plant, *message.mutable_thermal_plant());
  for (const twin::ProbeSpec& probe : model.probes) to_proto(probe, *message.add_probes());
  for (const twin::EffectSpec& effect : model.effects) to_proto(effect, *message.add_effects());
  copy_map(model.unknown_keys, message.mutable_extra());
}

}  // namespace

twin::Model model_from_proto(const proto::TwinModel& message) {
  twin::Model model;
  if (message.has_format_version()) model.format_version = message.format_version();
  model.gyro = message.gyro();
  model.gyro_id = message.gyro_id();
  if (message.has_nominal_rate_hz()) model.nominal_rate_hz = message.nominal_rate_hz();
  model.thermal_plant = plant_from(message.thermal_plant());
  for (int i = 0; i < message.probes_size(); ++i) {
    model.probes.push_back(probe_from(message.probes(i), i));
  }
  for (int i = 0; i < message.effects_size(); ++i) {
    model.effects.push_back(effect_from(message.effects(i), i));
  }
  model.unknown_keys = from_map(message.extra());
  if (auto problem = model.find_problem()) throw InvalidField(*std::move(problem));
  return model;
}

proto::TwinModel to_proto(const twin::Model& model) {
  proto::TwinModel message;
  fill(model, message);
  return message;
}

twin::Profile profile_from_proto(const proto::TwinProfile& message) {
  twin::Profile profile;
  profile.name = message.name();
  require(message.has_duration_s(), "duration_s");
  require(message.has_initial_temperature_degc(), "initial_temperature_degc");
  profile.duration_s = message.duration_s();
  profile.initial_temperature_degc = message.initial_temperature_degc();
  profile.power_on_s = message.power_on_s();
  for (int i = 0; i < message.chamber_size(); ++i) {
    profile.chamber.push_back(chamber_point_from(message.chamber(i), i));
  }
  for (int i = 0; i < message.turns_size(); ++i) {
    profile.turns.push_back(turn_from(message.turns(i), i));
  }
  for (int i = 0; i < message.power_cycles_size(); ++i) {
    profile.power_cycles.push_back(power_cycle_from(message.power_cycles(i), i));
  }
  for (int i = 0; i < message.excitations_size(); ++i) {
    profile.excitations.push_back(excitation_from(message.excitations(i), i));
  }
  if (message.has_earth_rate()) profile.earth_rate = earth_rate_from(message.earth_rate());
  if (auto problem = profile.find_problem()) throw InvalidField(*std::move(problem));
  return profile;
}

proto::TwinProfile to_proto(const twin::Profile& profile) {
  proto::TwinProfile message;
  message.set_name(profile.name);
  message.set_duration_s(profile.duration_s);
  message.set_initial_temperature_degc(profile.initial_temperature_degc);
  message.set_power_on_s(profile.power_on_s);
  for (const twin::ChamberPoint& point : profile.chamber) {
    auto& m = *message.add_chamber();
    m.set_time_s(point.time_s);
    m.set_temperature_degc(point.temperature_degc);
  }
  for (const twin::Turn& turn : profile.turns) {
    auto& m = *message.add_turns();
    m.set_start_s(turn.start_s);
    m.set_duration_s(turn.duration_s);
    m.set_axis(std::string(core::name(turn.axis)));
    m.set_rate_deg_s(turn.rate_radps / core::kRadPerDeg);
    m.set_ramp_s(turn.ramp_s);
  }
  for (const twin::PowerCycle& cycle : profile.power_cycles) {
    auto& m = *message.add_power_cycles();
    m.set_off_s(cycle.off_s);
    m.set_on_s(cycle.on_s);
  }
  for (const twin::Excitation& excitation : profile.excitations) {
    auto& m = *message.add_excitations();
    m.set_start_s(excitation.start_s);
    m.set_duration_s(excitation.duration_s);
    m.set_quantity(twin::excited_quantity_names()[static_cast<std::size_t>(excitation.quantity)]);
    if (twin::has_axis(excitation.quantity)) m.set_axis(std::string(core::name(excitation.axis)));
    m.set_value(excitation.value);
    m.set_ramp_s(excitation.ramp_s);
  }
  if (!profile.earth_rate) return message;
  auto& earth = *message.mutable_earth_rate();
  earth.set_latitude_deg(profile.earth_rate->latitude_rad / core::kRadPerDeg);
  earth.set_heading_deg(profile.earth_rate->heading_rad / core::kRadPerDeg);
  earth.set_pitch_deg(profile.earth_rate->pitch_rad / core::kRadPerDeg);
  earth.set_roll_deg(profile.earth_rate->roll_rad / core::kRadPerDeg);
  return message;
}

LoadedModel load_model(const std::filesystem::path& path) {
  return model_from(YamlDocument::read(path));
}

LoadedModel model_from(const YamlDocument& document) {
  UndestroyedMessage<proto::TwinModel> whole;
  proto::TwinModel& message = whole.get();
  LoadedModel loaded;
  loaded.warnings = document.fill(message);
  const bool newer = message.format_version() > twin::kModelFormatVersion;
  if (!newer && !loaded.warnings.empty()) throw ConfigError(loaded.warnings.front());
  for (std::string& warning : loaded.warnings) warning += "; kept unread";
  try {
    loaded.model = model_from_proto(message);
  } catch (const InvalidField& error) {
    throw document.error(error.problem().key, error.problem().what);
  }
  const auto effects = unknown_effects(loaded.model, document);
  loaded.warnings.insert(loaded.warnings.end(), effects.begin(), effects.end());
  return loaded;
}

std::string model_text(const twin::Model& model) {
  UndestroyedMessage<proto::TwinModel> message;
  fill(model, message.get());
  return to_yaml(message.get());
}

void save_model(const twin::Model& model, const std::filesystem::path& path) {
  write_whole(path, model_text(model));
}

twin::Profile load_profile(const std::filesystem::path& path) {
  const YamlDocument document = YamlDocument::read(path);
  UndestroyedMessage<proto::TwinProfile> whole;
  proto::TwinProfile& message = whole.get();
  const auto unknown = document.fill(message);
  if (!unknown.empty()) throw ConfigError(unknown.front());
  try {
    return profile_from_proto(message);
  } catch (const InvalidField& error) {
    throw document.error(error.problem().key, error.problem().what);
  }
}

void save_profile(const twin::Profile& profile, const std::vector<std::string>& comments,
                  const std::filesystem::path& path) {
  std::string text;
  for (const std::string& line : comments) text += "# " + line + '\n';
  write_whole(path, text + to_yaml(to_proto(profile)));
}

}  // namespace zerodrift::config
