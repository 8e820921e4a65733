// SPDX-License-Identifier: Apache-2.0
#include "common/thermal/decimated_history.h"

#include <cassert>
#include <cmath>

#include "common/core/integer_time.h"
#include "common/core/require.h"

namespace zerodrift::thermal {
namespace {

// The points lie one to a step, so span / step of them cover the span but for the two steps cut at
// its ends; the third extra point is the neighbour before the oldest look-up.
std::size_t points_for(double span_s, double step_s) {
  core::require(span_s >= 0.0 && step_s > 0.0, "a history has a span and a step above 0");
  return static_cast<std::size_t>(std::ceil(span_s / step_s)) + 3;
}

}  // namespace

DecimatedHistory::DecimatedHistory(double span_s, double step_s, double max_interpolation_s)
    : step_(core::from_seconds(step_s)),
      max_interpolation_(core::from_seconds(max_interpolation_s)),
      points_(points_for(span_s, step_s)) {
  core::require(step_ > core::SensorTime{0} && max_interpolation_ > core::SensorTime{0},
                "a history has a step and an interpolation of at least a nanosecond");
}

void DecimatedHistory::add(const Reading& reading) noexcept {
  assert(core::is_usable(reading.time) && (!newest_ || reading.time > newest_->time));
  const std::int64_t step = core::interval_index(reading.time, step_);
  if (step != open_step_) close_step();
  open_step_ = step;
  ++open_readings_;
  open_offset_sum_s_ += core::seconds(reading.time - step * step_);
  open_temperature_sum_degc_ += reading.temperature_degc;
  newest_ = reading;
}

void DecimatedHistory::reset() noexcept {
  points_.clear();
  newest_.reset();
  open_readings_ = 0;
  open_offset_sum_s_ = 0.0;
  open_temperature_sum_degc_ = 0.0;
}

void DecimatedHistory::carry(core::StateArchive& archive, const std::optional<Reading>& newest) {
  archive(points_, newest_, open_step_, open_readings_, open_offset_sum_s_,
          open_temperature_sum_degc_);
  archive.require(newest_.has_value() == newest.has_value());
  archive.require(!newest_ || !newest || newest_->time == newest->time);
  archive.require(!newest_ || (newest_->time != core::kNever &&
                               open_step_ == core::interval_index(newest_->time, step_)));
  // With room for rounding.
  archive.require(open_offset_sum_s_ >= 0.0 &&
                  open_offset_sum_s_ <=
                      1.001 * core::seconds(step_) * static_cast<double>(open_readings_));
  for (std::size_t i = 0; i < points_.size(); ++i) {
    archive.require(points_[i].time != core::kNever &&
                    (i == 0 || points_[i].time > points_[i - 1].time));
  }
}

std::optional<double> DecimatedHistory::at(core::SensorTime time) const noexcept {
  if (!newest_ || time > newest_->time) return std::nullopt;
  if (time == newest_->time) return newest_->temperature_degc;
  const std::size_t after = first_point_after(time);
  if (after == 0) return std::nullopt;
  return interpolate(points_[after - 1], after < points_.size() ? points_[after] : *newest_, time);
}

void DecimatedHistory::close_step() noexcept {
  if (open_readings_ == 0) return;
  const auto readings = static_cast<double>(open_readings_);
  points_.push_overwriting({
      .time = open_step_ * step_ + core::from_seconds(open_offset_sum_s_ / readings),
      .temperature_degc = open_temperature_sum_degc_ / readings,
  });
  open_readings_ = 0;
  open_offset_sum_s_ = 0.0;
  open_temperature_sum_degc_ = 0.0;
}

std::size_t DecimatedHistory::first_point_after(core::SensorTime time) const noexcept {
  std::size_t low = 0;
  std::size_t high = points_.size();
  while (low < high) {
    const std::size_t middle = low + (high - low) / 2;
    if (points_[middle].time > time) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return low;
}

std::optional<double> DecimatedHistory::interpolate(const Reading& before, const Reading& after,
                                                    core::SensorTime time) const noexcept {
  const core::SensorTime distance = after.time - before.time;
  if (time == before.time) return before.temperature_degc;
  if (distance > max_interpolation_) return std::nullopt;
  const double share = core::seconds(time - before.time) / core::seconds(distance);
  return before.temperature_degc + share * (after.temperature_degc - before.temperature_degc);
}

}  // namespace zerodrift::thermal
