// SPDX-License-Identifier: Apache-2.0
#include "common/thermal/sliding_mean_rate.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "common/core/integer_time.h"

namespace zerodrift::thermal {
namespace {

constexpr std::size_t kMaxWindowSamples = 10'000'000;
constexpr double kMaxGridPointsPerGap = 1e6;

const SlidingMeanRateOptions& checked(const SlidingMeanRateOptions& options) {
  if (const auto problem = options.validate()) throw std::invalid_argument(*problem);
  return options;
}

}  // namespace

std::optional<std::string> SlidingMeanRateOptions::validate() const {
  if (window_samples < 1 || window_samples > kMaxWindowSamples) {
    return "window_samples is " + std::to_string(window_samples) + ", must be 1 to " +
           std::to_string(kMaxWindowSamples);
  }
  if (!(sample_rate_hz >= 1e-3 && sample_rate_hz <= 1e6)) {
    return "sample_rate_hz is " + std::to_string(sample_rate_hz) + ", must be 0.001 to 1e6";
  }
  if (!(max_gap_s * sample_rate_hz >= 1.0 && max_gap_s * sample_rate_hz <= kMaxGridPointsPerGap)) {
    return "max_gap_s is " + std::to_string(max_gap_s) +
           ", must be at least one sample period and at most 1e6 of them";
  }
  return std::nullopt;
}

SlidingMeanRate::SlidingMeanRate(const SlidingMeanRateOptions& options)
    : options_(checked(options)),
      max_gap_(core::from_seconds(options.max_gap_s)),
      readings_(options.window_samples + 2) {}

void SlidingMeanRate::add(core::SensorTime time, double temperature_degc) noexcept {
  if (!std::isfinite(temperature_degc) || !core::is_usable(time)) return;
  if (readings_.empty()) {
    start_at(time, temperature_degc);
    return;
  }
  if (time <= newest_time_) return;
  if (time - newest_time_ > max_gap_) {
    reset();
    start_at(time, temperature_degc);
    return;
  }
  newest_time_ = time;
  const std::int64_t grid_index = nearest_grid_index(time);
  if (grid_index > readings_.back().grid_index) append({grid_index, temperature_degc});
}

void SlidingMeanRate::reset() noexcept {
  readings_.clear();
  rate_.reset();
}

double SlidingMeanRate::lag_s() const noexcept {
  return static_cast<double>(options_.window_samples) / (2.0 * options_.sample_rate_hz);
}

double SlidingMeanRate::noise_gain_per_s() const noexcept {
  return std::numbers::sqrt2 * options_.sample_rate_hz /
         static_cast<double>(options_.window_samples);
}

std::int64_t SlidingMeanRate::nearest_grid_index(core::SensorTime time) const noexcept {
  return std::llround(core::seconds(time - grid_origin_) * options_.sample_rate_hz);
}

void SlidingMeanRate::start_at(core::SensorTime time, double temperature_degc) noexcept {
  grid_origin_ = time;
  newest_time_ = time;
  append({0, temperature_degc});
}

void SlidingMeanRate::append(const Reading& reading) noexcept {
  readings_.push_overwriting(reading);
  const std::int64_t begin =
      reading.grid_index - static_cast<std::int64_t>(options_.window_samples);
  while (readings_.size() > 1 && readings_[1].grid_index <= begin) readings_.pop();
  const Reading& before = readings_.front();
  if (before.grid_index > begin) return;
  double begin_degc = before.degc;
  if (before.grid_index < begin) {
    const Reading& after = readings_[1];
    begin_degc +=
        (after.degc - before.degc) * (static_cast<double>(begin - before.grid_index) /
                                      static_cast<double>(after.grid_index - before.grid_index));
  }
  rate_ = (reading.degc - begin_degc) / static_cast<double>(options_.window_samples) *
          options_.sample_rate_hz;
}

}  // namespace zerodrift::thermal
