// SPDX-License-Identifier: Apache-2.0
// The state of one thermometer: newest reading, rate, history, and what was wrong with what came
// in. Time is an argument; what an old or unchanging reading means is the owner's to decide.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "common/core/samples.h"
#include "common/core/state_archive.h"
#include "common/thermal/decimated_history.h"
#include "common/thermal/local_polynomial_rate.h"
#include "common/thermal/sliding_mean_rate.h"

namespace zerodrift::thermal {

enum class RateMethod : std::uint8_t {
  kSlidingMean,      // the paper's, K / (2 f) late
  kLocalPolynomial,  // at the newest reading, without lag for degree 2
};

struct TemperatureTrackOptions {
  RateMethod rate_method = RateMethod::kSlidingMean;
  SlidingMeanRateOptions sliding_mean;
  LocalPolynomialRateOptions local_polynomial;
  double history_span_s = 600.0;    // longest lag that can be asked for
  double history_step_s = 1.0;      // one mean is kept for each
  double history_max_gap_s = 60.0;  // longest gap that the history interpolates across
  double min_temperature_degc =
      -100.0;  // readings outside are refused: a broken wire reads -127 or 850 °C
  double max_temperature_degc = 250.0;

  // Nothing when usable, else one line that names the wrong key.
  [[nodiscard]] std::optional<std::string> validate() const;
  // What history_span_s can be at most: of 1e6 steps, which are 16 MB.
  [[nodiscard]] double longest_history_s() const noexcept { return 1e6 * history_step_s; }
};

enum class ReadingVerdict : std::uint8_t {
  kAccepted,
  kJumped,  // accepted, as the one before it was doubtful and says the same: the track begins anew
  kDoubtful,     // farther from the newest one than a thermometer gets: not taken unless the next
                 // one says the same
  kNotMeasured,  // the sample says that nothing was measured
  kNotFinite,
  kOutOfRange,  // of the plausible temperatures, or of usable time stamps
  kOutOfOrder,  // not later than the newest reading: late, or delivered twice
};

[[nodiscard]] std::string_view name(ReadingVerdict verdict);
[[nodiscard]] constexpr bool is_accepted(ReadingVerdict verdict) {
  return verdict == ReadingVerdict::kAccepted || verdict == ReadingVerdict::kJumped;
}

struct ReadingCounts {
  std::uint64_t accepted = 0;
  std::uint64_t not_measured = 0;
  std::uint64_t not_finite = 0;
  std::uint64_t out_of_range = 0;
  std::uint64_t out_of_order = 0;
  std::uint64_t doubtful = 0;

  friend bool operator==(const ReadingCounts&, const ReadingCounts&) = default;

  void carry(core::StateArchive& archive) {
    archive(accepted, not_measured, not_finite, out_of_range, out_of_order, doubtful);
  }
};

// Allocates in the constructor only.
class TemperatureTrack {
 public:
  // Throws std::invalid_argument with validate()'s line.
  explicit TemperatureTrack(const TemperatureTrackOptions& options);

  // What is not accepted is counted and leaves the rest of the state as it was; a doubtful reading
  // is kept until the next one. After a jump rate and history begin anew: what lies across it is no
  // rate. The sample's probe name is not looked at: routing is the owner's. Cost: one rate
  // estimate.
  ReadingVerdict add(const core::TemperatureSample& sample) noexcept;

  // Forgets readings, rate and history, keeps the counts; for a source whose clock started anew.
  void reset() noexcept;

  [[nodiscard]] const std::optional<Reading>& newest() const noexcept { return newest_; }

  // °C/s, the method's lag before the newest reading; nothing until the method's window is filled.
  [[nodiscard]] std::optional<double> rate_degc_per_s() const noexcept { return rate_; }

  // °C at a past time, see DecimatedHistory::at.
  [[nodiscard]] std::optional<double> temperature_degc_at(core::SensorTime time) const noexcept;

  // Time from the newest reading to `now`, negative where that is later; nothing without a reading.
  [[nodiscard]] std::optional<core::SensorTime> age(core::SensorTime now) const noexcept;

  // Time from the last reading that differed by any bit from the one before it (or from the first
  // reading) to `now`. Long for a stuck thermometer, but also for a coarse one in a steady room:
  // compare with other probes before judging.
  [[nodiscard]] std::optional<core::SensorTime> unchanged_for(core::SensorTime now) const noexcept;

  [[nodiscard]] const ReadingCounts& counts() const noexcept { return counts_; }

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive);

 private:
  using RateEstimator = std::variant<SlidingMeanRate, LocalPolynomialRate>;

  // std::visit without its exception: a variant of these two never loses its value.
  template <typename Function>
  static auto with(auto& estimator, Function function) noexcept {
    if (auto* sliding = std::get_if<SlidingMeanRate>(&estimator)) return function(*sliding);
    return function(*std::get_if<LocalPolynomialRate>(&estimator));
  }

  [[nodiscard]] static RateEstimator make_estimator(const TemperatureTrackOptions& options);
  [[nodiscard]] ReadingVerdict judge(const core::TemperatureSample& sample) const noexcept;
  void count(ReadingVerdict verdict) noexcept;
  void accept(const Reading& reading) noexcept;

  double min_temperature_degc_;
  double max_temperature_degc_;
  RateEstimator estimator_;
  DecimatedHistory history_;
  std::optional<Reading> newest_;
  std::optional<Reading> doubtful_;  // the last one, where it was
  std::optional<double> rate_;
  core::SensorTime changed_at_{0};
  ReadingCounts counts_;
};

}  // namespace zerodrift::thermal
