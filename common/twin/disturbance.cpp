// SPDX-License-Identifier: Apache-2.0
#include "common/twin/disturbance.h"

#include <array>
#include <charconv>
#include <stdexcept>
#include <utility>

#include "common/core/time_text.h"
#include "common/core/units.h"

namespace zerodrift::twin {
namespace {

constexpr double kLargestDegH = 1e6;
constexpr double kShortestS = 1e-3;
constexpr double kLongestS = 86400.0;
constexpr std::array<std::pair<std::string_view, DisturbanceKind>, 4> kKinds{
    {{"step", DisturbanceKind::kStep},
     {"noise", DisturbanceKind::kNoise},
     {"stuck", DisturbanceKind::kStuck},
     {"gap", DisturbanceKind::kGap}}};

[[noreturn]] void refuse(std::string_view text, const std::string& expected) {
  throw std::invalid_argument("found '" + std::string(text) + "', expected " + expected);
}

std::vector<std::string_view> fields_of(std::string_view text) {
  std::vector<std::string_view> fields;
  for (;;) {
    const std::size_t colon = text.find(':');
    fields.push_back(text.substr(0, colon));
    if (colon == std::string_view::npos) return fields;
    text.remove_prefix(colon + 1);
  }
}

double number(std::string_view field, std::string_view text, double least, double most,
              const std::string& what) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  const bool read = error == std::errc() && end == field.data() + field.size();
  if (!read || !(value >= least && value <= most)) refuse(text, what);
  return value;
}

double duration_s_of(std::string_view field, std::string_view text) {
  const std::optional<double> time_s = core::parse_time_s(field);
  if (!time_s || !(*time_s >= kShortestS && *time_s <= kLongestS))
    refuse(text, "a time of 1ms to 1d, as 60, 60s, 5min or 200ms");
  return *time_s;
}

DisturbanceKind kind_of(std::string_view field, std::string_view text) {
  for (const auto& [name, kind] : kKinds) {
    if (name == field) return kind;
  }
  refuse(text, "the kind step, noise, stuck or gap");
}

core::PerAxis<bool> axes_of(std::string_view field, std::string_view text) {
  if (field == "xyz") return {true, true, true};
  core::PerAxis<bool> axes{};
  for (const auto axis : core::kAxes) axes[core::index(axis)] = field == core::name(axis);
  if (axes == core::PerAxis<bool>{}) refuse(text, "the axis x, y, z or xyz");
  return axes;
}

}  // namespace

Disturbance parse_disturbance(std::string_view text) {
  const auto fields = fields_of(text);
  if (fields.size() < 3 || fields.size() > 4)
    refuse(text, "kind:axis:magnitude[:time], e.g. step:x:5:60s");
  Disturbance result{.kind = kind_of(fields[0], text), .axes = axes_of(fields[1], text)};
  const double magnitude_deg_h =
      number(fields[2], text, -kLargestDegH, kLargestDegH, "a magnitude of at most 1e6 deg/h");
  result.magnitude_radps = core::radps_from_deg_h(magnitude_deg_h);
  if (fields.size() == 4) result.duration_s = duration_s_of(fields[3], text);
  const bool has_magnitude =
      result.kind == DisturbanceKind::kStep || result.kind == DisturbanceKind::kNoise;
  if (!has_magnitude && magnitude_deg_h != 0.0) refuse(text, "the magnitude 0 for stuck and gap");
  if (result.kind == DisturbanceKind::kNoise && magnitude_deg_h < 0.0)
    refuse(text, "a magnitude of noise of at least 0");
  if (result.kind == DisturbanceKind::kGap && fields[1] != "xyz")
    refuse(text, "the axis xyz for a gap");
  return result;
}

bool Disturber::begin(const Disturbance& disturbance) {
  if (acting_.size() >= kMost) return false;
  acting_.push_back({.what = disturbance, .number = begun_++});
  return true;
}

Disturber::Delivery Disturber::apply(core::AngularRateSample& sample) {
  std::erase_if(acting_, [&](const Acting& a) { return a.end && sample.time >= *a.end; });
  auto delivery = Delivery::kGive;
  for (Acting& acting : acting_) {
    if (!acting.end) {
      acting.end = sample.time + core::from_seconds(acting.what.duration_s);
      acting.held = sample.rate_radps;
    }
    if (acting.what.kind == DisturbanceKind::kGap) delivery = Delivery::kWithhold;
    disturb(acting, sample);
  }
  return delivery;
}

void Disturber::disturb(const Acting& acting, core::AngularRateSample& sample) const noexcept {
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    if (!acting.what.axes[i]) continue;
    double& rate = sample.rate_radps[i];
    switch (acting.what.kind) {
      case DisturbanceKind::kStep: rate += acting.what.magnitude_radps; break;
      case DisturbanceKind::kNoise:
        rate += acting.what.magnitude_radps *
                noise_.substream(core::kAxisCount * acting.number + i).gaussian(sample.sequence);
        break;
      case DisturbanceKind::kStuck: rate = acting.held[i]; break;
      case DisturbanceKind::kGap: break;
    }
  }
}

}  // namespace zerodrift::twin
