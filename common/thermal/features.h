// SPDX-License-Identifier: Apache-2.0
// The regression's input: a short vector of scaled temperature and pulse terms, chosen by
// configuration (Mao et al. 2022, section 3.2: temperature, temperature rate, and terms made from
// the gyro's own output).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/time.h"
#include "common/thermal/temperature_track.h"

namespace zerodrift::thermal {

enum class FeatureKind : std::uint8_t {
  kTemperature,           // T of `probe`, °C; scale 10 °C
  kTemperatureRate,       // dT/dt of `probe`, °C/s; scale 1 °C/min
  kTemperatureTimesRate,  // T dT/dt of `probe`, °C²/s; scale 10 °C * 1 °C/min
  kLaggedTemperature,     // T of `probe` lag_s before now, °C; scale 10 °C
  kProbeDifference,       // T of `probe` less T of `second_probe`, °C; scale 1 °C
  kPulseMean,             // mean of the gyro's output when last at rest, rad/s; scale 1 deg/h
  kPulseRate,             // slope of that mean, rad/s²; scale 1 (deg/h)/min
};

[[nodiscard]] std::string_view name(FeatureKind kind);

// Scale where a specification gives none: as listed above, in the feature's unit.
[[nodiscard]] double default_scale(FeatureKind kind);

// One entry of the vector: (value - offset) / scale.
struct FeatureSpec {
  FeatureKind kind = FeatureKind::kTemperature;
  std::string probe{};            // every kind but the pulse terms
  std::string second_probe{};     // kProbeDifference
  double lag_s = 0.0;             // kLaggedTemperature
  double offset = 0.0;            // in the feature's unit
  std::optional<double> scale{};  // in the feature's unit; default_scale(kind) where absent
};

struct FeatureBuilderOptions {
  std::vector<FeatureSpec> features{};  // 1 to 12
  double max_temperature_age_s =
      10.0;  // an older newest reading, or one that much later than now, is stale
};

enum class FeatureStatus : std::uint8_t {
  kReady,
  kNoTemperature,     // a needed probe has given no reading yet
  kTemperatureStale,  // its newest reading is too old
  kRateNotReady,      // its rate window is not filled
  kLagNotReady,       // its history does not reach back, or has a gap there
  kPulseNotReady,     // no stationary mean or slope yet
};

[[nodiscard]] std::string_view name(FeatureStatus status);

inline constexpr std::size_t kMaxFeatures = 12;
inline constexpr double kLongestLagS = 9e5;  // of a history of 1e6 s, beyond a margin

struct FeatureVector {
  FeatureStatus status = FeatureStatus::kNoTemperature;
  std::size_t size = 0;        // number of features; 0 unless kReady
  std::size_t blocked_by = 0;  // index of the feature that gave the status, where not kReady
  std::array<double, kMaxFeatures> values{};  // dimensionless; 0 beyond size

  [[nodiscard]] std::span<const double> span() const noexcept { return {values.data(), size}; }
};

// What one axis contributes.
struct PulseTerms {
  std::optional<double> mean_radps{};
  std::optional<double> slope_radps2{};
};

class FeatureBuilder {
 public:
  // `probes` names the tracks that build() will be given, in that order. Throws
  // std::invalid_argument with one line: the feature, the wrong key, and what would be right.
  FeatureBuilder(const FeatureBuilderOptions& options, std::span<const std::string> probes);

  [[nodiscard]] std::size_t size() const noexcept { return terms_.size(); }

  // A longest lag for TemperatureTrackOptions::history_span_s, s.
  [[nodiscard]] double longest_lag_s() const noexcept { return longest_lag_s_; }

  // Deterministic, no allocation; O(size), a lagged temperature adds one binary search.
  // Needs one track for each probe name of the constructor; a missing one counts as kNoTemperature.
  [[nodiscard]] FeatureVector build(core::SensorTime now, std::span<const TemperatureTrack> tracks,
                                    const PulseTerms& pulse) const noexcept;

 private:
  struct Term {
    FeatureKind kind;
    std::size_t track;
    std::size_t second_track;
    core::SensorTime lag;
    double offset;
    double scale;
  };

  // A status other than kReady says why there is no value.
  struct Value {
    FeatureStatus status;
    double value;
  };

  [[nodiscard]] Value evaluate(const Term& term, core::SensorTime now,
                               std::span<const TemperatureTrack> tracks,
                               const PulseTerms& pulse) const noexcept;
  [[nodiscard]] Value temperature_term(const Term& term, core::SensorTime now,
                                       std::span<const TemperatureTrack> tracks) const noexcept;
  [[nodiscard]] FeatureStatus freshness(std::size_t track, core::SensorTime now,
                                        std::span<const TemperatureTrack> tracks) const noexcept;

  std::vector<Term> terms_;
  core::SensorTime max_age_{0};
  double longest_lag_s_ = 0.0;
};

}  // namespace zerodrift::thermal
