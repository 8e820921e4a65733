// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/reference_screen.h"

#include <cmath>

#include "common/core/integer_time.h"
#include "common/core/plausible.h"

namespace zerodrift::compensation {

using core::index;
using core::kAxes;
using core::ReferenceKind;

namespace {

// Of a unit's error in the Earth rate a filter computes.
constexpr double kEarthTolerance = 1.001;

bool has_axis(const core::RateReferenceSample& reference) {
  return reference.valid != core::PerAxis<bool>{};
}

ReferencePolicy policy_of(const ReferenceOptions& options, ReferenceKind kind) {
  switch (kind) {
    case ReferenceKind::kRest: return options.rest;
    case ReferenceKind::kNavigationResidual: return options.navigation_residual;
    default: return options.truth;
  }
}

// Nothing in what is kept is left that isn't a number.
void clean(core::RateReferenceSample& reference) {
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    if (!reference.valid[i]) reference.rate_radps[i] = 0.0;
    if (!reference.valid[i] || !(reference.variance[i] >= 0.0)) reference.variance[i] = 0.0;
  }
}

void drop_uncertain(double largest_sigma_radps, core::RateReferenceSample& reference) {
  const double largest = largest_sigma_radps * largest_sigma_radps;
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    const double variance = reference.variance[i];
    reference.valid[i] = reference.valid[i] && variance >= 0.0 && variance <= largest;
  }
}

ReferenceVerdict judge(const ReferenceOptions& options, core::RateReferenceSample& reference) {
  if (reference.kind == ReferenceKind::kNone ||
      reference.kind > ReferenceKind::kNavigationResidual) {
    return ReferenceVerdict::kUnknownKind;
  }
  if (policy_of(options, reference.kind) == ReferencePolicy::kRefuse)
    return ReferenceVerdict::kNotAccepted;
  if (!core::is_usable(reference.time)) return ReferenceVerdict::kTimeUnusable;
  if (!has_axis(reference)) return ReferenceVerdict::kEmpty;
  double square = 0.0;
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    reference.valid[i] =
        reference.valid[i] && std::abs(reference.rate_radps[i]) <= core::kLargestRateRadps &&
        !(reference.variance[i] > core::kLargestRateRadps * core::kLargestRateRadps);
    if (reference.valid[i]) square += reference.rate_radps[i] * reference.rate_radps[i];
  }
  if (!is_feedback(reference.kind)) return ReferenceVerdict::kTaken;
  const bool is_rest = reference.kind == ReferenceKind::kRest;
  if (is_rest && std::sqrt(square) > kEarthTolerance * core::kEarthRateRadps) {
    reference.valid = {};
    return ReferenceVerdict::kMoreThanEarth;
  }
  drop_uncertain(is_rest ? options.largest_rest_sigma_radps : options.largest_residual_sigma_radps,
                 reference);
  return has_axis(reference) ? ReferenceVerdict::kTaken : ReferenceVerdict::kUncertain;
}

}  // namespace

ReferenceVerdict screen(const ReferenceOptions& options,
                        core::RateReferenceSample& reference) noexcept {
  const ReferenceVerdict verdict = judge(options, reference);
  clean(reference);
  return verdict;
}

}  // namespace zerodrift::compensation
