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
// seconds long. Only readings are kept, as many as the window has. Cost of a reading: O(1) in the
// mean, O(readings of the window) at worst.
class SlidingMeanRate {
 public:
  // Allocates here only. Throws std::invalid_argument with validate()'s line.
  explicit SlidingMeanRate(const SlidingMeanRateOptions& options);

  // Readings that are not finite or not later than the last one are ignored.
  void add(core::SensorTime time, double temperature_degc) noexcept;
  void reset() noexcept;

  // °C/s at lag_s() before the newest reading; nothing until K + 1 grid points are there.
  [[nodiscard]] std::optional<double> rate_degc_per_s() const noexcept { return rate_; }

  // K / (2 f), the age of the rate's value.
  [[nodiscard]] double lag_s() const noexcept;

  // Standard deviation of the rate for white noise of 1 °C a reading, 1/s.
  [[nodiscard]] double noise_gain_per_s() const noexcept;

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) {
    archive(readings_, rate_, grid_origin_, newest_time_);
    archive.require(readings_.empty() ||
                    (grid_origin_ != core::kNever && newest_time_ >= grid_origin_ &&
                     readings_.back().grid_index == nearest_grid_index(newest_time_)));
    for (std::size_t i = 0; archive.ok() && i < readings_.size(); ++i) {
      archive.require(readings_[i].grid_index >= 0 &&
                      (i == 0 || readings_[i].grid_index > readings_[i - 1].grid_index));
    }
  }

 private:
  struct Reading {
    std::int64_t grid_index = 0;
    double degc = 0.0;

    void carry(core::StateArchive& archive) { archive(grid_index, degc); }
  };
  [[nodiscard]] std::int64_t nearest_grid_index(core::SensorTime time) const noexcept;
  void start_at(core::SensorTime time, double temperature_degc) noexcept;
  void append(const Reading& reading) noexcept;

  SlidingMeanRateOptions options_;
  core::SensorTime max_gap_;
  // The last one at n - K or before, n being the newest one's grid point, and all after it.
  core::RingBuffer<Reading> readings_;
  std::optional<double> rate_;
  core::SensorTime grid_origin_{0};
  core::SensorTime newest_time_{core::kNever};
};

}  // namespace zerodrift::thermal
