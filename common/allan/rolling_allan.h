// SPDX-License-Identifier: Apache-2.0
// Overlapping Allan deviation of a stream of angular rates, since start and over a rolling window
// at once, in fixed memory.
//
// Cascade: the rate is summed to an angle theta; level l keeps every 2^l-th theta in a ring. There
// the second differences d_k = theta_k - 2 theta_{k-m} + theta_{k-2m} are taken for m = lag * 2^l,
// lag = 16 (octave) or 16, 19, 23, 27; level 0 serves the small m too. sigma²(tau) = sum(d²) / (2
// tau² M), tau = m tau0. A stride of tau/16 keeps 99.5 % of the full overlap's degrees of freedom.
//
// The angle is 64-bit fixed point and wraps around: second differences stay exact however long it
// runs and however large the mean is. Each sample is rounded to the nearest step and the remainder
// carried to the next, so theta is off by half a step at most, in a way that does not follow the
// sample: with steps of q and a noise of s rad a sample the deviation at tau0 is too large by
// (q/s)²/8 of itself, 2.4e-8 with the default q for a gyro of 1e-4 deg/√h at 200 Hz. (Rounding
// toward zero would make it 0.6 q/s, 3e-4.)
//
// Window: a ring of panes that hold sum(d²) and counts; whole panes are added and dropped, nothing
// is ever subtracted. A d belongs to the pane of its end time, so a figure at tau reaches up to 2
// tau before the window.
//
// Gaps: a d counts only if no sample is missing between k-2m and k.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/allan/allan_point.h"
#include "common/allan/span.h"
#include "common/allan/tau_grid.h"

namespace zerodrift::allan {

struct RollingAllanOptions {
  double sample_interval_s = 0.005;
  TauGrid grid = TauGrid::kOctave;
  double longest_tau_s = 1e5;
  double window_s = 3600.0;  // rolling window; it covers this and up to one pane more
  std::size_t panes = 32;    // window granularity
  double angle_resolution_rad = 0x1.0p-40;  // fixed-point step; 2^-40 rad = 0.19 microarcseconds

  // Names the first wrong key.
  [[nodiscard]] std::optional<std::string> validate() const;
};

class RollingAllan {  // More members than other classes: sums and panes are one state.
 public:
  // Throws std::invalid_argument with validate()'s sentence. All memory is taken here.
  explicit RollingAllan(const RollingAllanOptions& options);

  // Next sample, one sample interval after the one before. O(1) amortised, O(levels + panes) at
  // worst, no allocation. A rate that is not finite or beyond largest_rate_radps() counts as one
  // missing sample.
  void add(double rate_radps) noexcept;

  // Time passed without that many samples. O(panes * taus) at worst.
  void gap(std::uint64_t missing_samples) noexcept;

  // The rate beyond which second differences could overflow: 0.99 * 2^62 steps over the longest tau
  // (41 rad/s with the default options).
  [[nodiscard]] double largest_rate_radps() const noexcept { return largest_rate_radps_; }

  [[nodiscard]] std::size_t tau_count() const noexcept { return taus_.size(); }
  [[nodiscard]] double tau_s(std::size_t i) const noexcept;
  [[nodiscard]] std::uint64_t samples() const noexcept { return samples_; }  // valid ones
  [[nodiscard]] std::uint64_t gaps() const noexcept {
    return gaps_;
  }  // interruptions, not missing samples
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

  // Deviation at the i-th tau with bounds at the two-sided confidence; nothing before the first
  // second difference. O(panes + taus), no allocation.
  [[nodiscard]] std::optional<AllanPoint> point(std::size_t i, Span span,
                                                double confidence = 0.95) const noexcept;

  // Every point there is. Allocates the result.
  [[nodiscard]] std::vector<AllanPoint> points(Span span, double confidence = 0.95) const;

 private:
  // Angles of one level since the last gap, newest at head.
  struct Level {
    std::size_t ring = 0;  // where it begins in rings_
    std::uint32_t head = 0;
    std::uint32_t stored = 0;  // capped at what the longest lag needs
    std::uint32_t needed = 0;  // 3 * longest lag + 1
    std::uint32_t first_tau = 0;
    std::uint32_t end_tau = 0;
  };

  // Of one tau in one pane, in squared steps.
  struct PaneSums {
    double squares = 0.0;   // sum of d_k²
    double products = 0.0;  // sum of d_k d_{k-m}, for the noise type
    std::uint32_t square_count = 0;
    std::uint32_t product_count = 0;
  };

  struct Sums {
    double squares = 0.0;
    double products = 0.0;
    std::uint64_t square_count = 0;
    std::uint64_t product_count = 0;

    void operator+=(const PaneSums& pane) noexcept;
  };

  void build_levels();
  void begin_segment() noexcept;
  void push(Level& level) noexcept;
  void accumulate(const Level& level, std::uint32_t lag, PaneSums& sums) const noexcept;
  void advance_panes(std::uint64_t samples) noexcept;
  void close_pane() noexcept;
  [[nodiscard]] Sums sums(std::size_t tau, Span span) const noexcept;
  [[nodiscard]] NoiseType noise(std::size_t tau, Span span) const noexcept;

  double sample_interval_s_;
  double angle_resolution_rad_;
  double largest_rate_radps_;
  double steps_per_radps_;  // steps of angle one sample of 1 rad/s adds
  std::uint64_t pane_samples_;
  std::size_t pane_count_;

  std::vector<Cluster> taus_;
  std::vector<Level> levels_;
  std::vector<std::uint64_t> rings_;
  std::uint32_t ring_mask_ = 0;

  std::vector<PaneSums> open_pane_;     // by tau
  std::vector<PaneSums> closed_panes_;  // pane_count_ rows by tau; a ring
  std::size_t oldest_pane_ = 0;
  std::vector<Sums> closed_total_;  // since start, without the open pane; by tau

  std::uint64_t angle_ = 0;  // theta in steps, wraps around
  double remainder_ = 0.0;   // fraction of a step not yet in angle_
  std::uint64_t index_ = 0;  // samples since start, missing ones included
  std::uint64_t samples_in_pane_ = 0;
  std::uint64_t samples_ = 0;
  std::uint64_t gaps_ = 0;
  bool segment_open_ = false;
};

}  // namespace zerodrift::allan
