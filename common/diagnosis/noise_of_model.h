// SPDX-License-Identifier: Apache-2.0
// The stochastic effects of a model as terms of a noise spectrum.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/noise_spectrum.h"
#include "common/twin/effect.h"
#include "common/twin/model.h"

namespace zerodrift::diagnosis {

// Relative standard error of a model's noise squares without one in the file.
inline constexpr double kModelNoiseSigma = 0.3;

// The stochastic effects that a model lists for an axis, as terms of a noise spectrum of a series
// of which this share is valid: bridges over missing samples carry none of the white noises (white
// rate, white angle), whose power falls by as much. `relative_sigma` of a square where the file
// gives no standard error.
[[nodiscard]] NoisePrior noise_prior(const twin::Model& model, core::Axis axis,
                                     double relative_sigma, double valid_share);

[[nodiscard]] double valid_share(std::span<const std::uint8_t> valid);

// Whether a noise wanders: all but white rate and white angle.
[[nodiscard]] bool is_slow(NoiseKind kind);
// The same of the catalogue's effect of this kind; false of what is no such noise.
[[nodiscard]] bool is_slow_noise(const std::string& effect);

// Share of a noise's power that is left in a series of which `share` is valid, as GapBridge bridges
// it: `share` of the white noises, all of the slow ones.
[[nodiscard]] double seen_share(NoiseKind kind, double share);

inline constexpr double kAnyValue = 50.0;  // relative sigma: no prior to speak of

struct ListedNoise {
  std::size_t effect;  // in the model
  KnownNoise noise;    // as seen in a series of which `share` is valid
};

[[nodiscard]] std::vector<ListedNoise> listed_noise(const twin::Model& model, core::Axis axis,
                                                    double relative_sigma, double share);

// The catalogue's effect of a law of noise; they have one each.
[[nodiscard]] const twin::EffectDefinition& noise_effect(twin::NoiseLaw law);
[[nodiscard]] const twin::EffectDefinition& noise_effect(NoiseKind kind);

// The value in a model file that a square means, as seen in a series of which `share` is valid;
// nothing of an effect whose noise has no single coefficient.
[[nodiscard]] double value_in_file(const twin::EffectDefinition& definition, double square,
                                   double share);
// An effect whose noise one coefficient scales, so that it can be refitted.
[[nodiscard]] bool has_one_coefficient(const twin::EffectDefinition& definition);

}  // namespace zerodrift::diagnosis
