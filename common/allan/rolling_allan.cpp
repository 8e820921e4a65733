// SPDX-License-Identifier: Apache-2.0
#include "common/allan/rolling_allan.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "common/allan/confidence.h"
#include "common/core/require.h"

namespace zerodrift::allan {
namespace {

constexpr double kMaxPaneSamples = std::numeric_limits<std::uint32_t>::max();
constexpr double kMaxClusterSize = 0x1.0p48;

RollingAllanOptions checked(const RollingAllanOptions& options) {
  if (const auto error = options.validate()) throw std::invalid_argument(*error);
  return options;
}

std::uint64_t samples_in(double duration_s, double sample_interval_s) {
  return static_cast<std::uint64_t>(std::floor(duration_s / sample_interval_s * (1.0 + 1e-12)));
}

// theta_k - 2 theta_{k-m} + theta_{k-2m}, exact while it fits 63 bits.
double second_difference(std::uint64_t newest, std::uint64_t middle, std::uint64_t oldest) {
  return static_cast<double>(static_cast<std::int64_t>(newest - 2 * middle + oldest));
}

}  // namespace

std::optional<std::string> RollingAllanOptions::validate() const {
  const auto positive = [](double value) { return std::isfinite(value) && value > 0.0; };
  const auto found = [](const char* key, double value, const char* right) {
    return std::string(key) + " is " + std::to_string(value) + ", must be " + right;
  };
  if (!positive(sample_interval_s)) return found("sample_interval_s", sample_interval_s, "> 0 s");
  if (!(longest_tau_s >= sample_interval_s &&
        longest_tau_s <= kMaxClusterSize * sample_interval_s)) {
    return found("longest_tau_s", longest_tau_s, "from 1 to 2^48 sample intervals");
  }
  if (panes < 1 || panes > 4096) return found("panes", static_cast<double>(panes), "1 to 4096");
  const double pane_samples = window_s / sample_interval_s / static_cast<double>(panes);
  if (!(pane_samples >= 1.0 && pane_samples <= kMaxPaneSamples)) {
    return found("window_s", window_s, "1 to 2^32 - 1 sample intervals for each pane");
  }
  if (!positive(angle_resolution_rad)) {
    return found("angle_resolution_rad", angle_resolution_rad, "> 0 rad");
  }
  return std::nullopt;
}

void RollingAllan::Sums::operator+=(const PaneSums& pane) noexcept {
  squares += pane.squares;
  products += pane.products;
  square_count += pane.square_count;
  product_count += pane.product_count;
}

RollingAllan::RollingAllan(const RollingAllanOptions& options)
    : sample_interval_s_(checked(options).sample_interval_s),
      angle_resolution_rad_(options.angle_resolution_rad),
      largest_rate_radps_(0.99 * 0x1.0p62 * options.angle_resolution_rad / options.longest_tau_s),
      steps_per_radps_(options.sample_interval_s / options.angle_resolution_rad),
      pane_samples_(static_cast<std::uint64_t>(
          std::ceil(options.window_s / options.sample_interval_s /
                    static_cast<double>(options.panes) * (1.0 - 1e-12)))),
      pane_count_(options.panes),
      taus_(clusters(options.grid, samples_in(options.longest_tau_s, options.sample_interval_s))),
      open_pane_(taus_.size()),
      closed_panes_(taus_.size() * pane_count_),
      closed_total_(taus_.size()) {
  build_levels();
}

void RollingAllan::build_levels() {
  std::uint32_t longest_lag = 0;
  for (const Cluster& tau : taus_) longest_lag = std::max(longest_lag, tau.lag);
  const std::uint32_t ring_size = std::bit_ceil(3 * longest_lag + 1);
  ring_mask_ = ring_size - 1;
  levels_.resize(taus_.back().level + 1);
  rings_.resize(std::size_t{ring_size} * levels_.size());
  for (std::uint32_t i = 0; i < taus_.size(); ++i) {
    Level& level = levels_[taus_[i].level];
    if (level.end_tau == 0) level.first_tau = i;
    level.end_tau = i + 1;
    level.needed = std::max(level.needed, 3 * taus_[i].lag + 1);
  }
  for (std::size_t l = 0; l < levels_.size(); ++l) levels_[l].ring = l * ring_size;
}

void RollingAllan::add(double rate_radps) noexcept {
  if (!(std::abs(rate_radps) <= largest_rate_radps_)) {  // also NaN
    gap(1);
    return;
  }
  if (!segment_open_) begin_segment();
  const double steps = rate_radps * steps_per_radps_ + remainder_;
  const auto whole_steps = static_cast<std::int64_t>(steps + std::copysign(0.5, steps));
  remainder_ = steps - static_cast<double>(whole_steps);
  angle_ += static_cast<std::uint64_t>(whole_steps);
  ++index_;
  ++samples_;
  const auto due = std::min(static_cast<std::size_t>(std::countr_zero(index_)) + 1, levels_.size());
  for (std::size_t l = 0; l < due; ++l) push(levels_[l]);
  if (++samples_in_pane_ == pane_samples_) {
    samples_in_pane_ = 0;
    close_pane();
  }
}

void RollingAllan::gap(std::uint64_t missing_samples) noexcept {
  if (missing_samples == 0) return;
  if (segment_open_) ++gaps_;
  segment_open_ = false;
  index_ += missing_samples;
  advance_panes(missing_samples);
}

// The angle at the start of the segment is the first one of every level whose stride it lies on.
void RollingAllan::begin_segment() noexcept {
  segment_open_ = true;
  for (Level& level : levels_) level.stored = 0;
  const auto due = std::min(static_cast<std::size_t>(std::countr_zero(index_)) + 1, levels_.size());
  for (std::size_t l = 0; l < due; ++l) push(levels_[l]);
}

void RollingAllan::push(Level& level) noexcept {
  level.head = (level.head + 1) & ring_mask_;
  rings_[level.ring + level.head] = angle_;
  level.stored += level.stored < level.needed ? 1 : 0;
  for (std::uint32_t i = level.first_tau; i < level.end_tau; ++i)
    accumulate(level, taus_[i].lag, open_pane_[i]);
}

void RollingAllan::accumulate(const Level& level, std::uint32_t lag,
                              PaneSums& sums) const noexcept {
  if (level.stored <= 2 * lag) return;
  const std::uint64_t* ring = &rings_[level.ring];
  const auto angle = [&](std::uint32_t lags) {
    return ring[(level.head - lags * lag) & ring_mask_];
  };
  const std::uint64_t middle = angle(1);
  const std::uint64_t oldest = angle(2);
  const double d = second_difference(angle_, middle, oldest);
  sums.squares += d * d;
  ++sums.square_count;
  if (level.stored <= 3 * lag) return;
  sums.products += d * second_difference(middle, oldest, angle(3));
  ++sums.product_count;
}

void RollingAllan::advance_panes(std::uint64_t samples) noexcept {
  std::uint64_t panes = samples / pane_samples_;
  samples_in_pane_ += samples % pane_samples_;
  if (samples_in_pane_ >= pane_samples_) {
    samples_in_pane_ -= pane_samples_;
    ++panes;
  }
  // One more than there are panes empties them all and the open one.
  for (std::uint64_t i = std::min<std::uint64_t>(panes, pane_count_ + 1); i > 0; --i) close_pane();
}

void RollingAllan::close_pane() noexcept {
  PaneSums* slot = &closed_panes_[oldest_pane_ * taus_.size()];
  for (std::size_t i = 0; i < taus_.size(); ++i) {
    closed_total_[i] += open_pane_[i];
    slot[i] = open_pane_[i];
    open_pane_[i] = PaneSums{};
  }
  oldest_pane_ = oldest_pane_ + 1 == pane_count_ ? 0 : oldest_pane_ + 1;
}

double RollingAllan::tau_s(std::size_t i) const noexcept {
  core::require(i < taus_.size(), "a rolling Allan deviation is asked for one of its taus");
  return static_cast<double>(taus_[i].size()) * sample_interval_s_;
}

std::size_t RollingAllan::memory_bytes() const noexcept {
  const auto bytes = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  return sizeof(*this) + bytes(taus_) + bytes(levels_) + bytes(rings_) + bytes(open_pane_) +
         bytes(closed_panes_) + bytes(closed_total_);
}

RollingAllan::Sums RollingAllan::sums(std::size_t tau, Span span) const noexcept {
  Sums result;
  if (span == Span::kSinceStart) {
    result = closed_total_[tau];
  } else {
    for (std::size_t age = 0, pane = oldest_pane_; age < pane_count_; ++age) {
      result += closed_panes_[pane * taus_.size() + tau];
      pane = pane + 1 == pane_count_ ? 0 : pane + 1;
    }
  }
  result += open_pane_[tau];
  return result;
}

// Of the longest tau up to this one that has enough clusters to tell.
NoiseType RollingAllan::noise(std::size_t tau, Span span) const noexcept {
  for (std::size_t i = tau + 1; i-- > 0;) {
    const Sums s = sums(i, span);
    const double clusters =
        static_cast<double>(s.product_count) / static_cast<double>(taus_[i].lag);
    if (clusters < kClustersToIdentifyNoise || !(s.squares > 0.0)) continue;
    const double mean_square = s.squares / static_cast<double>(s.square_count);
    const double mean_product = s.products / static_cast<double>(s.product_count);
    return noise_type_from_lag1(mean_product / mean_square, clusters);
  }
  return NoiseType::kAngleRandomWalk;
}

std::optional<AllanPoint> RollingAllan::point(std::size_t i, Span span,
                                              double confidence) const noexcept {
  core::require(i < taus_.size(), "a rolling Allan deviation is asked for one of its taus");
  const Sums s = sums(i, span);
  if (s.square_count == 0) return std::nullopt;
  AllanPoint point;
  point.tau_s = tau_s(i);
  point.pairs = s.square_count;
  const auto terms = static_cast<double>(s.square_count);
  point.clusters = terms / static_cast<double>(taus_[i].lag);
  point.deviation_radps = angle_resolution_rad_ / point.tau_s * std::sqrt(0.5 * s.squares / terms);
  point.noise = noise(i, span);
  point.degrees_of_freedom =
      equivalent_degrees_of_freedom({.noise = point.noise,
                                     .cluster_size = static_cast<double>(taus_[i].size()),
                                     .terms = terms,
                                     .terms_per_tau = static_cast<double>(taus_[i].lag)});
  const Bounds bounds =
      deviation_bounds(point.deviation_radps, point.degrees_of_freedom, confidence);
  point.lower_radps = bounds.lower;
  point.upper_radps = bounds.upper;
  return point;
}

std::vector<AllanPoint> RollingAllan::points(Span span, double confidence) const {
  std::vector<AllanPoint> result;
  result.reserve(taus_.size());
  for (std::size_t i = 0; i < taus_.size(); ++i) {
    if (const auto p = point(i, span, confidence)) result.push_back(*p);
  }
  return result;
}

}  // namespace zerodrift::allan
