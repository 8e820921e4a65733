// SPDX-License-Identifier: Apache-2.0
// A compensator with everything small, so that a few hundred samples reach every part.
#pragma once

#include <cstdint>

#include "common/compensation/compensator.h"

namespace zerodrift::fuzz {

inline constexpr core::SensorTime kSmallInterval{100'000'000};

inline compensation::CompensationOptions small_compensation(bool with_prior) {
  compensation::CompensationOptions options;
  options.features = {{.kind = thermal::FeatureKind::kTemperature, .probe = "coil"}};
  options.model.capacity = 10;
  options.learning = {.label_interval_s = 1.0,
                      .confirm_s = 1.0,
                      .handover_s = 1.0,
                      .initial_labels = 4,
                      .rest = options.learning.rest};
  options.learning.rest.dwell_s = 1.0;
  options.temperature_stale_s = 5.0;
  options.probe_stuck_s = 10.0;
  if (with_prior) {
    options.prior.emplace();
    options.prior->effects = {
        {.kind = "bias_temperature",
         .parameters = {{"reference_degc", 20.0}, {"c1_deg_h_per_degc", 0.5}}}};
  }
  return options;
}

inline core::AngularRateSample good_rate(std::uint64_t sequence, core::SensorTime time, int value) {
  return {.sequence = sequence,
          .time = time,
          .interval_s = core::seconds(kSmallInterval),
          .rate_radps = {1e-7 * value, -1e-7 * value, 1e-5},
          .valid = {true, true, true},
          .clipped = {},
          .clock = core::ClockSource::kReplay};
}

inline core::TemperatureSample good_temperature(core::SensorTime time, int value) {
  return {.probe = "coil",
          .sequence = 0,
          .time = time,
          .temperature_degc = 20.0 + 0.25 * value,
          .measured = true,
          .clock = core::ClockSource::kReplay};
}

// Works off what the compensator and its learner have to do, on this thread.
template <typename Take>
void answer_all(compensation::Compensator& compensator, const Take& take) {
  const auto learn = [&] {
    while (compensator.learner().run_one()) {
    }
  };
  while (compensator.readiness() != compensation::Readiness::kNothing) {
    learn();
    take(compensator.answer_next());
  }
  learn();
}

}  // namespace zerodrift::fuzz
