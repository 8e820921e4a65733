// SPDX-License-Identifier: Apache-2.0
// Temperature and its rate at the newest reading, by least squares of a polynomial over a trailing
// window (a one-sided Savitzky-Golay filter for irregular times; Savitzky & Golay 1964, Gorry 1990
// for the window's end).
//
// With x = (t - t_newest) / window in [-1, 0], the fit is T = c0 + c1 x + c2 x². Value c0, rate c1
// / window. Readings are collected in at most 64 bins of equal width; each bin that has readings
// gives one equation, its mean temperature against its means of 1, x and x², weighted by its number
// of readings. So the fit is unbiased for any polynomial of its degree, whatever the spacing of the
// readings, and an empty bin is simply absent.
//
// Degree 2 has no lag on a parabola. Degree 1 is four times quieter but sees a turning ramp half a
// window late. Noise of the rate for n evenly spread readings of white noise sigma over window W:
//   degree 1: sqrt(12 / n) sigma / W,   degree 2: sqrt(192 / n) sigma / W;   noise_gain_per_s()
//   gives it exactly.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "common/core/state_archive.h"
#include "common/core/time.h"

namespace zerodrift::thermal {

struct LocalPolynomialRateOptions {
  int degree = 2;            // 1 or 2
  double window_s = 60.0;    // trailing window
  std::size_t bins = 60;     // degree + 2 to 64
  std::size_t min_bins = 6;  // with readings, before there is a rate
  double min_span_fraction =
      0.5;                  // of the window that the readings must span before there is a rate
  double max_gap_s = 15.0;  // a longer gap between two readings starts the window afresh

  // Nothing when usable, else one line that names the wrong key.
  [[nodiscard]] std::optional<std::string> validate() const;
};

struct LocalPolynomialFit {
  double temperature_degc;  // at the newest reading's time
  double rate_degc_per_s;   // at the newest reading's time
  double noise_gain_per_s;  // standard deviation of the rate for white noise of 1 °C a reading
};

// No allocation at all. One reading costs a few additions; one fit costs sums over the bins and a 3
// x 3 solve.
class LocalPolynomialRate {
 public:
  static constexpr std::size_t kMaxBins = 64;

  // Throws std::invalid_argument with validate()'s line.
  explicit LocalPolynomialRate(const LocalPolynomialRateOptions& options);

  // Readings that are not finite or not later than the last one are ignored.
  void add(core::SensorTime time, double temperature_degc) noexcept;
  void reset() noexcept;

  // Nothing until at least min_bins bins have readings that span min_span_fraction of the window.
  [[nodiscard]] std::optional<LocalPolynomialFit> fit() const noexcept;
  [[nodiscard]] std::optional<double> rate_degc_per_s() const noexcept;

  // Age of the rate on a parabola with a full window: 0 for degree 2, window / 2 for degree 1.
  [[nodiscard]] double lag_s() const noexcept;

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) {
    archive(bins_, empty_, newest_time_, newest_temperature_degc_);
    archive.require(newest_time_ != core::kNever);
  }

 private:
  struct Bin {
    std::int64_t index = 0;      // bin start = index * bin width
    std::uint64_t readings = 0;  // 0: empty
    double offset_sum_s = 0.0;   // times since the bin's start
    double offset_square_sum_s2 = 0.0;
    double temperature_sum_degc = 0.0;

    void carry(core::StateArchive& archive) {
      archive(index, readings, offset_sum_s, offset_square_sum_s2, temperature_sum_degc);
    }
  };

  struct NormalEquations;
  [[nodiscard]] std::optional<NormalEquations> accumulate() const noexcept;
  [[nodiscard]] std::size_t slot(std::int64_t bin_index) const noexcept;

  LocalPolynomialRateOptions options_;
  core::SensorTime bin_width_;
  core::SensorTime max_gap_;
  std::array<Bin, kMaxBins> bins_{};
  bool empty_ = true;
  core::SensorTime newest_time_{0};
  double newest_temperature_degc_ = 0.0;
};

}  // namespace zerodrift::thermal
