// SPDX-License-Identifier: Apache-2.0
// Effects that a model lists without coefficients, as the owner of a gyro does who knows what it
// has but not how much of it: fitted together, before anything that is missing is looked for.
//
//   every amplitude of their kinds, beside the coefficients that the model gives and the noise
//   shapes by turns, each beside all others at the largest evidence, from three starts; the best
//     end of them by the likelihood less half a log of the number of coefficients for each
//     amplitude
//   effects that don't exceed the odds of ten to one, then amplitudes that the record speaks
//     against (Bayes factor below 1) stay out: the former wait, the latter are 0
//   what stays is the generalised least-squares fit, not shrunk
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/diagnosis/trial.h"

namespace zerodrift::diagnosis {

// A lag that a listed effect may have looks like another effect that is missing (a lagged
// polynomial of the temperature contains its rate), so it is a hypothesis of its own.
enum class Lags : std::uint8_t {
  kAtDefault,  // none, unless the model says otherwise
  kFree,
};

struct Calibration {
  // Repaired: with the coefficients found, noise and bias included.
  Trial trial;
  // The same where the noise still waits that waited: what a search begins with.
  twin::Model drift_alone;
  // Of what is left, nats; comparable between calibrations of one input.
  double score = 0.0;
  std::vector<std::size_t> fitted{};  // effects of the model that got coefficients
  Lags lags = Lags::kAtDefault;
  bool has_free_lags = false;  // whether any lag could move
};

// Whether calibration gives an effect of the axis its coefficients: a drift that is listed without
// them, not a constant, whose value any record gives.
[[nodiscard]] bool lists_without_coefficients(const twin::Model& model, core::Axis axis);

// Nothing is recalibrated where nothing waits or the record says nothing. Some 0.3 s for 18 000
// points and five effects.
// `beside`: what was found missing takes part, and is not in the calibration's models.
[[nodiscard]] Calibration calibrate(const TrialInput& input, Lags lags,
                                    std::span<const NamedEffect> beside = {});

// Whether the same effects got coefficients at the same inputs, lags and other shapes.
[[nodiscard]] bool same_shapes(const Calibration& a, const Calibration& b);

}  // namespace zerodrift::diagnosis
