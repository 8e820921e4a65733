// SPDX-License-Identifier: Apache-2.0
// Which rate references are used, and why others are not.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/core/samples.h"
#include "common/core/units.h"

namespace zerodrift::compensation {

enum class ReferencePolicy : std::uint8_t { kAccept, kRefuse };

struct ReferenceOptions {
  // A rate table's or a record's true rate. Refused where the truth is to judge the result.
  ReferencePolicy truth = ReferencePolicy::kAccept;
  ReferencePolicy rest = ReferencePolicy::kAccept;
  // A filter's opinion of the drift in motion (residual_correction.h).
  ReferencePolicy navigation_residual = ReferencePolicy::kRefuse;
  // With records and simulations: rest references are waited for from the first sample on, not only
  // once one was received; then nothing depends on who came first.
  bool await_feedback = false;
  double largest_rest_sigma_radps = core::radps_from_deg_h(1.0);
  double largest_residual_sigma_radps = core::radps_from_deg_h(0.3);
  double innovation_sigmas = 3.0;  // of forecast and residual together; further off is refused
  double largest_correction_radps = core::radps_from_deg_h(0.5);
  double correction_slew_radps2 = core::radps_from_deg_h(0.05);  // per second
  double correction_memory_s = 600.0;  // a correction without a new residual fades with it
};

// What becomes of a reference. The order is that of the counters.
enum class ReferenceVerdict : std::uint8_t {
  kTaken,
  kEmpty,        // no axis valid: it says that nothing is known
  kNotAccepted,  // its kind is refused by the options
  kUnknownKind,
  kUncertain,          // variance above the limit, negative or no number, on all axes
  kMoreThanEarth,      // a rest reference faster than the Earth turns
  kEarthRateIncluded,  // Earth rate counts as drift here: it would be taken off twice
  kWrongEpoch,         // a residual of another model than was in force at its time
  kNoForecast,         // a residual where there is no estimate with a variance to hold it against
  kAtRest,             // a residual at rest, where labels are measured
  kImplausible,        // a residual further off than forecast and residual explain
  kDistrusted,         // a residual after several implausible ones, until the next label
  kTimeUnusable,       // a stamp more than 73 years from the epoch
};
inline constexpr std::size_t kReferenceVerdicts = 13;

constexpr std::string_view name(ReferenceVerdict verdict) {
  constexpr std::array<std::string_view, kReferenceVerdicts> kNames{
      "taken",        "empty",           "not_accepted",        "unknown_kind",
      "uncertain",    "more_than_earth", "earth_rate_included", "wrong_epoch",
      "no_forecast",  "at_rest",         "implausible",         "distrusted",
      "time_unusable"};
  return kNames[static_cast<std::size_t>(verdict)];
}

using ReferenceCounts = std::array<std::uint64_t, kReferenceVerdicts>;

// Feedback (rest and residual) stamped t counts from the sample at t + this on and is forgotten
// kOldestReference after t: between the two a filter has the time to answer, so that a record or a
// simulation need not wait for it and the result does not depend on how fast it was.
inline constexpr core::SensorTime kFeedbackDelay{500'000'000};
inline constexpr core::SensorTime kOldestReference{1'000'000'000};

// What can be said of a reference by itself. Makes axes invalid that can't be used, and their
// numbers and variances that say nothing 0; kTaken leaves at least one valid. O(1).
ReferenceVerdict screen(const ReferenceOptions& options,
                        core::RateReferenceSample& reference) noexcept;

constexpr bool is_feedback(core::ReferenceKind kind) {
  return kind == core::ReferenceKind::kRest || kind == core::ReferenceKind::kNavigationResidual;
}

}  // namespace zerodrift::compensation
