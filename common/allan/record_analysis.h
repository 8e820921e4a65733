// SPDX-License-Identifier: Apache-2.0
// Allan statistics of one series of a record, whatever the record is like: with all the overlap
// there is where the series fits the memory that may be taken, by the streaming cascade where it
// doesn't, and with an honest rule for missing samples.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/allan/allan_point.h"
#include "common/allan/coefficients.h"
#include "common/allan/deviations.h"
#include "common/allan/rolling_allan.h"
#include "common/allan/series_check.h"
#include "common/allan/tau_grid.h"

namespace zerodrift::allan {

// Which second differences make a point of a series that lacks samples.
enum class GapRule : std::uint8_t {
  kComplete,        // those without a missing sample
  kNearlyComplete,  // also those whose clusters each lack at most a tenth of their samples
};

struct GappedPoint {
  AllanPoint point;
  GapRule rule = GapRule::kComplete;
};

// Overlapping Allan deviation of an evenly spaced series in which NaN stands for a missing sample.
// A cluster's mean is taken over the samples it has. Where at least half of the admissible
// differences lack no sample, only those count, else all admissible ones (then white rate noise is
// up to 1/18 of its deviation too high, a hundredth of the samples missing: 0.5 %). Without missing
// samples the same as overlapping_allan(). O(samples) a tau; allocates 12 bytes a sample.
[[nodiscard]] std::vector<GappedPoint> overlapping_allan_with_gaps(
    std::span<const double> rate_radps, double sample_interval_s, TauGrid grid,
    double confidence = 0.95);

struct Stretch {
  std::size_t begin = 0;
  std::size_t count = 0;
};

// The first of the longest runs of samples that aren't NaN. O(n).
[[nodiscard]] Stretch longest_stretch(std::span<const double> rate_radps);

// One point of any statistic. The deviation is an angle in rad for kTdev, else in rad/s.
struct CurvePoint {
  double tau_s = 0.0;
  double deviation = 0.0;
  double lower = 0.0;
  double upper = 0.0;
  double degrees_of_freedom = 0.0;
  std::uint64_t terms = 0;
  NoiseType noise = NoiseType::kAngleRandomWalk;
};

// A batch statistic at every cluster of the grid, with bounds for the noise that
// overlapping_allan() identifies at the same tau. Degrees of freedom: Greenhall & Riley
// (confidence.h); of the total deviation by SP 1065 table 10, b T/tau - c, and for white angle
// noise those of the overlapping Allan deviation. O(angles) a tau.
[[nodiscard]] std::vector<CurvePoint> deviation_curve(Statistic statistic,
                                                      std::span<const double> angle_rad,
                                                      double sample_interval_s, TauGrid grid,
                                                      double confidence = 0.95);

struct SeriesOptions {
  double nominal_interval_s = 0.005;
  TauGrid grid = TauGrid::kOctave;
  double confidence = 0.95;
  std::vector<Statistic> statistics{Statistic::kOadev};
  std::size_t most_kept_samples = std::size_t{1} << 26;  // beyond, only the cascade is kept

  // Names the first wrong key.
  [[nodiscard]] std::optional<std::string> validate() const;
};

enum class SeriesMethod : std::uint8_t {
  kFullOverlap,          // all differences there are
  kFullOverlapWithGaps,  // overlapping_allan_with_gaps()
  kCascade,              // RollingAllan: differences a sixteenth of tau apart
};

struct StatisticCurve {
  Statistic statistic = Statistic::kOadev;
  std::vector<CurvePoint> points;
  // Of a series with gaps, for the statistics that can't bridge them; nothing: the whole series.
  std::optional<Stretch> stretch;
};

struct SeriesReport {
  SeriesFindings findings;
  std::uint64_t missing = 0;        // samples
  std::uint64_t interruptions = 0;  // between measured samples
  std::uint64_t too_large = 0;  // beyond what the cascade's angle can hold: left out as if missing
  SeriesMethod method = SeriesMethod::kFullOverlap;
  std::vector<GappedPoint> allan;      // the overlapping Allan deviation
  std::vector<StatisticCurve> curves;  // as asked for
  std::vector<Statistic> left_out;     // asked for, but the series was too long to be kept
  CoefficientReport coefficients;      // from `allan`
  PerNoiseTerm<std::optional<double>> slopes{};
  std::optional<AllanPoint> lowest;  // of the points with at least two degrees of freedom
};

class SeriesAnalysis {
 public:
  // Throws std::invalid_argument with validate()'s sentence.
  explicit SeriesAnalysis(const SeriesOptions& options);

  // Next sample; not finite: missing. O(1) amortised.
  void add(double rate_radps);
  void gap(std::uint64_t missing_samples);

  // `sample_interval_s`: what the whole record says of it; nominal_interval_s is what was known
  // before. O(samples) a tau, plus the fit. Allocates up to 20 bytes a sample kept.
  [[nodiscard]] SeriesReport report(double sample_interval_s) const;

 private:
  void pass_over_missing();
  void into_cascade(double rate_radps);
  void give_up_keeping();
  [[nodiscard]] std::vector<GappedPoint> allan(double sample_interval_s) const;
  [[nodiscard]] StatisticCurve curve(Statistic statistic, double sample_interval_s) const;

  SeriesOptions options_;
  SeriesCheck check_;
  std::vector<double> kept_;             // NaN: missing
  std::optional<RollingAllan> cascade_;  // from when the series was too long to be kept
  std::uint64_t place_ = 0;              // samples so far, missing ones included
  std::uint64_t missing_ = 0;
  std::uint64_t pending_missing_ = 0;  // since the last measured sample
  std::uint64_t interruptions_ = 0;
  std::uint64_t too_large_ = 0;
};

// Angle random walk over angle random walk and so on: what compensation did to the noise. Nothing
// where either is not known with an interval.
[[nodiscard]] std::optional<double> coefficient_ratio(const CoefficientReport& numerator,
                                                      const CoefficientReport& denominator,
                                                      NoiseTerm term);

}  // namespace zerodrift::allan
