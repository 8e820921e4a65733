// SPDX-License-Identifier: Apache-2.0
// How the coefficients and deviations of a gyro are called and in which units they are reported.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/allan/coefficients.h"
#include "common/allan/deviations.h"
#include "common/allan/noise_units.h"
#include "common/core/units.h"

namespace zerodrift::services {

inline constexpr double kArcsecondsPerRadian = 3600.0 / core::kRadPerDeg;
inline constexpr double kDegPerHourPerRadPerSecond = 1.0 / core::kRadPerSecPerDegPerHour;

struct TermText {
  std::string_view name;
  std::string_view unit;
  double per_si = 1.0;       // of that unit
  std::string_view si_key;   // in JSON
  std::string_view read_at;  // of the term's own line
};

[[nodiscard]] constexpr TermText texts_of(allan::NoiseTerm term) {
  using allan::NoiseTerm;
  switch (term) {
    case NoiseTerm::kQuantization:
      return {"quantization", "arcsec", kArcsecondsPerRadian, "quantization_rad", "√3 s"};
    case NoiseTerm::kAngleRandomWalk:
      return {"angle random walk", "deg/√h", allan::kDegPerRootHour, "angle_random_walk_rad_rts",
              "1 s"};
    case NoiseTerm::kBiasInstability:
      return {"bias instability", "deg/h", kDegPerHourPerRadPerSecond, "bias_instability_rad_s",
              "lowest point / 0.664"};
    case NoiseTerm::kRateRandomWalk:
      return {"rate random walk", "deg/h^1.5", allan::kDegPerHourPerRootHour,
              "rate_random_walk_rad_s_rts", "3 s"};
    case NoiseTerm::kRateRamp:
      return {"rate ramp", "deg/h²", allan::kDegPerHourPerHour, "rate_ramp_rad_s2", "√2 s"};
  }
  return {};
}

// What only a curve that asks for it has.
struct FoundTerm {
  std::string text;
  std::string_view unit;
  double per_si;
  std::string_view si_key;
  allan::Coefficient value;
};

[[nodiscard]] inline std::vector<FoundTerm> found_terms(const allan::CoefficientReport& r) {
  std::vector<FoundTerm> found;
  if (r.sinusoid) {
    found.push_back({"sinusoid, amplitude", "deg/h", kDegPerHourPerRadPerSecond,
                     "sinusoid_amplitude_rad_s", r.sinusoid->amplitude_radps});
    found.push_back(
        {"sinusoid, frequency", "Hz", 1.0, "sinusoid_frequency_hz", r.sinusoid->frequency_hz});
  }
  if (r.markov) {
    found.push_back({"Markov noise, drive", "deg/h^1.5", allan::kDegPerHourPerRootHour,
                     "markov_drive_rad_s_rts", r.markov->drive_radps_rts});
    found.push_back({"Markov noise, correlation time", "s", 1.0, "markov_time_constant_s",
                     r.markov->time_constant_s});
  }
  return found;
}

struct DeviationUnit {
  std::string_view text;
  double per_si = 1.0;
};

[[nodiscard]] constexpr DeviationUnit unit_of(allan::Statistic statistic) {
  if (statistic == allan::Statistic::kTdev) return {"arcsec", kArcsecondsPerRadian};
  return {"deg/h", kDegPerHourPerRadPerSecond};
}

}  // namespace zerodrift::services
