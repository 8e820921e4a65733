// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/noise_of_model.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "common/core/require.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {

using twin::EffectDefinition;
using twin::EffectSpec;
using twin::NoiseLaw;

namespace {

std::optional<NoiseKind> kind_of(NoiseLaw law) {
  switch (law) {
    case NoiseLaw::kWhite: return NoiseKind::kWhite;
    case NoiseLaw::kFlicker: return NoiseKind::kFlicker;
    case NoiseLaw::kRandomWalk: return NoiseKind::kRandomWalk;
    case NoiseLaw::kQuantization: return NoiseKind::kQuantization;
    case NoiseLaw::kFirstOrder:
    case NoiseLaw::kTwoLevel:  // the spectrum of a first-order noise of its variance
      return NoiseKind::kMarkov;
    case NoiseLaw::kNone: break;
  }
  return std::nullopt;
}

// Relative, where the file gives a standard error.
std::optional<double> error_of_square(const twin::EffectSpec& spec, const std::string& parameter) {
  constexpr double kSmallest = 0.05;
  const auto error = spec.standard_errors.find(parameter);
  const auto value = spec.parameters.find(parameter);
  if (error == spec.standard_errors.end() || value == spec.parameters.end()) return std::nullopt;
  if (!(error->second > 0.0 && value->second > 0.0)) return std::nullopt;
  return std::max(kSmallest, 2.0 * error->second / value->second);
}

KnownNoise known_noise(const EffectSpec& spec, const EffectDefinition& definition, NoiseKind kind,
                       double relative_sigma, double share) {
  const twin::Spectrum& spectrum = definition.spectrum;
  const auto parameters = twin::complete_parameters(definition, spec.parameters);
  KnownNoise noise{{kind, 0.0}, 0.0, relative_sigma};
  double scale = 0.0;
  if (spectrum.first_order) {
    const twin::FirstOrder first_order = spectrum.first_order(parameters);
    scale = first_order.sigma_deg_h;
    noise.term.correlation_s = first_order.tau_s;
  } else {
    scale = parameters.at(spectrum.scale);
  }
  const double value = scale * spectrum.si_per_unit;
  noise.square = value * value * seen_share(kind, share);
  if (has_one_coefficient(definition)) {
    noise.relative_sigma = error_of_square(spec, spectrum.scale).value_or(relative_sigma);
    if (spec.parameters.empty()) noise.relative_sigma = kAnyValue;
  }
  return noise;
}

}  // namespace

bool has_one_coefficient(const EffectDefinition& definition) {
  const NoiseLaw law = definition.spectrum.law;
  return law != NoiseLaw::kNone && law != NoiseLaw::kTwoLevel;
}

const EffectDefinition& noise_effect(NoiseLaw law) {
  const auto all = twin::effect_catalogue();
  const auto found = std::find_if(
      all.begin(), all.end(), [law](const EffectDefinition& d) { return d.spectrum.law == law; });
  core::require(found != all.end(), "the catalogue has an effect of each law of noise");
  return *found;
}

const EffectDefinition& noise_effect(NoiseKind kind) {
  for (const NoiseLaw law :
       {NoiseLaw::kWhite, NoiseLaw::kFlicker, NoiseLaw::kRandomWalk, NoiseLaw::kQuantization}) {
    if (kind_of(law) == kind) return noise_effect(law);
  }
  return noise_effect(NoiseLaw::kFirstOrder);
}

double value_in_file(const EffectDefinition& definition, double square, double share) {
  const NoiseKind kind = kind_of(definition.spectrum.law).value();
  return std::sqrt(square / seen_share(kind, share)) / definition.spectrum.si_per_unit;
}

std::vector<ListedNoise> listed_noise(const twin::Model& model, core::Axis axis,
                                      double relative_sigma, double share) {
  std::vector<ListedNoise> listed;
  for (std::size_t i = 0; i < model.effects.size(); ++i) {
    const EffectSpec& spec = model.effects[i];
    const EffectDefinition* definition = twin::find_effect(spec.kind);
    if (spec.axis != axis || definition == nullptr) continue;
    if (const auto kind = kind_of(definition->spectrum.law))
      listed.push_back({i, known_noise(spec, *definition, *kind, relative_sigma, share)});
  }
  return listed;
}

bool is_slow(NoiseKind kind) {
  return kind != NoiseKind::kWhite && kind != NoiseKind::kQuantization;
}

bool is_slow_noise(const std::string& effect) {
  const EffectDefinition* definition = twin::find_effect(effect);
  const auto kind = definition ? kind_of(definition->spectrum.law) : std::nullopt;
  return kind && is_slow(*kind);
}

double seen_share(NoiseKind kind, double share) {
  return is_slow(kind) ? 1.0 : share;
}

double valid_share(std::span<const std::uint8_t> valid) {
  const auto present = std::count_if(valid.begin(), valid.end(), [](auto v) { return v != 0; });
  return valid.empty() ? 1.0 : static_cast<double>(present) / static_cast<double>(valid.size());
}

NoisePrior noise_prior(const twin::Model& model, core::Axis axis, double relative_sigma,
                       double valid_share) {
  NoisePrior prior;
  for (const ListedNoise& entry : listed_noise(model, axis, relative_sigma, valid_share)) {
    if (entry.noise.square > 0.0) prior.known.push_back(entry.noise);
  }
  return prior;
}

}  // namespace zerodrift::diagnosis
