// SPDX-License-Identifier: Apache-2.0
#include "services/allan_monitor/event_text.h"

#include <fmt/format.h>

#include "common/core/units.h"

namespace zerodrift::services {
namespace {

using core::deg_h_from_radps;

// "1.2 deg/h in the last 3600 s, 0.9 before" and the like.
std::string figures(const allan::Finding& finding, double window_s, const char* reference) {
  return fmt::format("{:.4g} deg/h in the last {:g} s, {:.4g} {}",
                     deg_h_from_radps(finding.watched_radps), window_s,
                     deg_h_from_radps(finding.reference_radps), reference);
}

std::string evidence(const allan::Finding& finding) {
  return fmt::format(" (p {:.1e}, reported below {:.1e})", finding.p_value, finding.threshold);
}

}  // namespace

std::string subject(std::uint32_t gyro_id, core::Axis axis, Stream stream) {
  return fmt::format("gyro {} axis {} {}: ", gyro_id, core::name(axis), name(stream));
}

std::string noise_grew(const allan::Finding& finding, double window_s) {
  return fmt::format("noise grew at tau {:.3g} s: {}{}", finding.tau_s,
                     figures(finding, window_s, "before"), evidence(finding));
}

std::string noise_is_back(const allan::Finding& finding, double window_s) {
  return fmt::format("noise is back to normal, at tau {:.3g} s: {}", finding.tau_s,
                     figures(finding, window_s, "before it grew"));
}

std::string worse_than_raw(const allan::Finding& finding, double window_s) {
  return fmt::format("noisier than raw at tau {:.3g} s: {}{}", finding.tau_s,
                     figures(finding, window_s, "raw"), evidence(finding));
}

std::string no_longer_worse(const allan::Finding& finding, double window_s) {
  return fmt::format("no longer noisier than raw, at tau {:.3g} s: {}", finding.tau_s,
                     figures(finding, window_s, "raw"));
}

}  // namespace zerodrift::services
