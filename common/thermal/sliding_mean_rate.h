// SPDX-License-Identifier: Apache-2.0
// Temperature rate by the difference of two sliding means (Mao et al. 2022, section 3.1, eq. 12).
//
//   rate(n) = [ mean(T[n-K+1 .. n]) - mean(T[n-K .. n-1]) ] f  =  (T[n] - T[n-K]) f / K
//
// The two windows of K samples differ by one sample, so the difference telescopes: O(1) a sample.
// (The printed sums of eq. 12 run over K + 1 terms divided by K, which would read a ramp high by
// 1/K; the text says K, so K is used.)
//
// Lag: the value is the rate at the window's centre, K / (2 f) seconds before the newest sample:
// exactly so on a parabola. Noise: only the two end samples count, so white noise of sigma per
// sample gives sqrt(2) f / K sigma, and a thermometer of resolution q gives multiples of q f / K.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "common/core/ring_buffer.h"
#include "common/core/state_archive.h"
#include "common/core/time.h"

namespace zerodrift::thermal {

struct SlidingMeanRateOptions {
  std::size_t window_samples = 12000;  // K
  double sample_rate_hz = 200.0;       // f, of the grid the window is counted on
  double max_gap_s = 10.0;             // longest gap bridged; a longer one starts the window afresh

  // Nothing when usable, else one line that names the wrong key.
  [[nodiscard]] std::optional<std::string> validate() const;
};

// Readings are put on the uniform grid t0 + i / f that eq. 12 is defined on: each goes to its
// nearest grid point, as it is; grid points between two readings are filled by linear
// interpolation, and of several readings for one grid point the first counts. So a stream sampled
// at f is used sample by sample, and lost samples, or a stream slower than f, keep the window K / f
// seconds long. Cost of a reading: O(1) for each grid point it fills, at most max_gap_s f of them.
class SlidingMeanRate {
 public:
  // Allocates here only. Throws std::invalid_argument with validate()'s line.
  explicit SlidingMeanRate(const SlidingMeanRateOptions& options);

  // Readings that are not finite or not later than the last one are ignored.
  void add(core::SensorTime time, double temperature_degc) noexcept;
  void reset() noexcept;

  // °C/s at lag_s() before the newest reading; nothing until K + 1 grid points are filled.
  [[nodiscard]] std::optional<double> rate_degc_per_s() const noexcept { return rate_; }

  // K / (2 f), the age of the rate's value.
  [[nodiscard]] double lag_s() const noexcept;

  // Standard deviation of the rate for white noise of 1 °C a reading, 1/s.
  [[nodiscard]] double noise_gain_per_s() const noexcept;

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) {
    archive(window_, rate_, grid_origin_, grid_index_, newest_time_);
    archive.require(window_.empty() ||
                    (grid_origin_ != core::kNever && newest_time_ >= grid_origin_ &&
                     grid_index_ == nearest_grid_index(newest_time_)));
  }

 private:
  [[nodiscard]] std::int64_t nearest_grid_index(core::SensorTime time) const noexcept;
  void start_at(core::SensorTime time, double temperature_degc) noexcept;
  void fill_to(std::int64_t grid_index, double temperature_degc) noexcept;
  void append(double temperature_degc) noexcept;

  SlidingMeanRateOptions options_;
  core::SensorTime max_gap_;
  core::RingBuffer<double> window_;  // the last K grid points
  std::optional<double> rate_;
  core::SensorTime grid_origin_{0};
  std::int64_t grid_index_ = 0;  // of the newest grid point
  core::SensorTime newest_time_{core::kNever};
};

}  // namespace zerodrift::thermal
