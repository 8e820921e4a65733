// SPDX-License-Identifier: Apache-2.0
// A record the way Mao et al. (2022) prepare theirs before they compensate it (section 4.1): a
// moving average over one minute, 15 000 points of it, evenly over the record; and the figures of
// their tables 1 and 3 for such a series.
//
// The minute's mean changes the noise below a few minutes. White noise of N has the Allan variance
//     N²/tau                         as measured
//     2/3 N² tau/W²                  after the mean over W, for tau <= W/2: the slope of a rate
//                                    random walk of K = sqrt(2) N/W, which is not there
//     N²/tau (1 - W/(2 tau))         after it, for tau >= W: 10 % low still at 5 min
// so N can't be read off the prepared series' short clusters; the coefficients of a gyro belong to
// the unsmoothed stream. What is below is for like-with-like comparison with the paper only.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace zerodrift::comparison {

inline constexpr double kPaperWindowS = 60.0;
inline constexpr std::size_t kPaperPoints = 15'000;

// Fed one sample after the other; any unit. A point is the mean over the minute that ends with its
// sample, so it belongs to the time half a minute earlier (a ramp comes out as the ramp of then).
// Only full minutes count: the first point ends the record's first minute, the last ends the
// record, the others lie evenly between, each at its nearest sample. Over 5 h at 200 Hz that is a
// point every 1.196 s. A record of fewer full minutes than 15 000 (one for each sample from the
// first minute's last on) gives them all, one shorter than a minute none.
//
// Samples that are not finite are left out of their means; a minute without any other is NaN.
// Rounding doesn't build up: the sums of a minute are made anew every minute, nothing is ever
// subtracted. O(1) a sample on average (once a minute the minute is summed).
class PaperPreparation {
 public:
  // The record has round(duration / interval) samples; later ones are ignored. Allocates here only.
  // Throws std::invalid_argument unless both are positive and finite and a minute has a sample.
  PaperPreparation(double sample_interval_s, double duration_s);

  // True if that made a point: points().back() ends with this sample.
  bool add(double value) noexcept;

  [[nodiscard]] std::span<const double> points() const noexcept { return points_; }
  // From point to point; the minute's own length when there is but one.
  [[nodiscard]] double interval_s() const noexcept { return interval_s_; }

 private:
  struct Sum {
    double value = 0.0;
    std::size_t count = 0;  // finite samples in it

    void add(double sample) noexcept;
  };

  void close_block() noexcept;
  [[nodiscard]] double window_mean(std::size_t place) const noexcept;

  std::size_t window_ = 0;       // samples of a minute
  std::size_t samples_ = 0;      // of the record
  std::size_t point_count_ = 0;  // the record will give
  double interval_s_ = 0.0;
  std::vector<double> block_;  // the present minute's samples
  std::vector<Sum> tails_;  // of the minute before: sum from each place to its end; [window_] = 0
  Sum head_;                // the present minute so far
  std::size_t next_sample_ = 0;
  std::size_t next_end_ = 0;  // sample that ends the next point
  std::vector<double> points_;
};

struct PreparedSeries {
  double interval_s = 0.0;
  std::vector<double> points{};
};

// All of a record at once.
[[nodiscard]] PreparedSeries prepare(std::span<const double> samples, double sample_interval_s);

// Table 1. Square roots of means over all points, also for the deviation.
struct Moments {
  double mean = 0.0;
  double standard_deviation = 0.0;   // about the mean
  double mean_absolute_error = 0.0;  // about zero: eq. 15 of a residual
  double root_mean_square = 0.0;     // about zero: eq. 14
  std::size_t points = 0;            // finite ones; the others are left out
};

[[nodiscard]] Moments moments(std::span<const double> points) noexcept;

// Table 3, SI (common/allan/noise_units.h converts).
struct PaperCoefficients {
  double angle_random_walk_rad_rts = 0.0;   // N
  double bias_instability_radps = 0.0;      // B
  double rate_random_walk_radps_rts = 0.0;  // K
};

// The paper names the coefficients and not how it found them. This is one reading: ordinary least
// squares without weights (what Lv et al., Optik 126 (2015) 2529, call traditional),
//     sigma(tau) = A-2 tau^-1 + A-1 tau^-1/2 + A0 + A1 tau^1/2 + A2 tau
// on the overlapping Allan deviation at 100 logarithmically spaced clusters (rounded up, repeats
// dropped) from 1 point to the largest power of two within half the series (the grid of MathWorks'
// example "Inertial Sensor Noise Analysis Using Allan Variance"); N = |A-1|, B = |A0| / 0.664,
// K = sqrt(3) |A1|. It was chosen among several because a drift of the paper's deviation can have
// the paper's N, B and K in it (config/models/paper_fog.yaml). Of the others, weighted fits and
// slopes find no N in a prepared series, and a fit of sigma² on the same clusters came no nearer
// than 22 % below the paper's N.
//
// Every term takes part whether the data have it or not, the longest clusters decide, and signs are
// dropped (A-1 of a prepared series is mostly negative), so a slow drift shows in all three: they
// describe the drift's shape more than the gyro's noise. What to believe is fit_coefficients of
// common/allan, on the unsmoothed stream.
//
// Rates in rad/s at one interval. Nothing for fewer than 16 points or if any is not finite. O(100
// points); allocates.
[[nodiscard]] std::optional<PaperCoefficients> paper_coefficients(
    std::span<const double> points_radps, double interval_s);

}  // namespace zerodrift::comparison
