// SPDX-License-Identifier: Apache-2.0
#include "common/measurement/live_rows.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/median.h"
#include "common/measurement/probe_order.h"

namespace zerodrift::measurement {
namespace {

constexpr std::size_t kStepsForPeriod = 100;
// A true rate holds so long; a record's comes with every sample.
constexpr core::SensorTime kReferenceHolds = std::chrono::seconds(1);

double median_step_s(const std::deque<core::AngularRateSample>& rates) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < rates.size() && i <= kStepsForPeriod; ++i)
    steps.push_back(core::seconds(rates[i].time - rates[i - 1].time));
  return core::median_of(std::move(steps));
}

}  // namespace

bool TimeGate::admits(core::SensorTime time) noexcept {
  if (newest_ && time <= *newest_) return false;
  const bool is_near = !newest_ || time - *newest_ <= kLargestStep;
  const bool is_confirmed = doubted_ && time > *doubted_ && time - *doubted_ <= kLargestStep;
  if (!is_near && !is_confirmed) {
    doubted_ = time;
    return false;
  }
  newest_ = time;
  doubted_.reset();
  return true;
}

void LiveRows::Stream::advance(core::SensorTime time) noexcept {
  spoken_to = std::max(spoken_to, time);
  waited_for = true;
}

void LiveRows::push(const core::AngularRateSample& sample) {
  if (!gate_.admits(sample.time)) {
    ++counts_.rates_refused;
    return;
  }
  rates_.push_back(sample);
  if (rates_.size() > options_.most_waiting) stop_waiting(rates_.front().time);
}

void LiveRows::push(const core::RateReferenceSample& reference) {
  if (!core::is_true_rate(reference.kind)) return;
  if (started_ && !has_reference_) {
    ++counts_.late_references;
    return;
  }
  if (!reference_.gate.admits(reference.time)) return;
  reference_.advance(reference.time);
  references_.push_back(reference);
  if (references_.size() > options_.most_waiting) references_.pop_front();
}

void LiveRows::push(const core::TemperatureSample& reading) {
  if (started_ && !probes_.contains(reading.probe)) {
    ++counts_.late_probes;
    return;
  }
  Sensor* probe = probes_.find_or_make(reading.probe);
  if (probe == nullptr) {
    ++counts_.readings_refused;
    return;
  }
  take(*probe, reading.time, reading.measured ? reading.temperature_degc : record::kNotMeasured);
}

void LiveRows::push(const core::EnvironmentSample& sample) {
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (!core::has_channel(sample.channels, i)) continue;
    if (started_ && !core::has_channel(environment_, i)) {
      ++counts_.late_channels;
    } else {
      take(channels_[i], sample.time, core::channel(sample.values, i));
    }
  }
}

// NaN: nothing was measured up to `time`.
void LiveRows::take(Sensor& sensor, core::SensorTime time, double value) {
  if (std::isnan(value)) return sensor.advance(time);
  if (!sensor.gate.admits(time)) {
    ++counts_.readings_refused;
    return;
  }
  sensor.advance(time);
  if (previous_ && time <= *previous_) {
    ++counts_.readings_lost;
    return;
  }
  sensor.readings.push_back({time, value});
  if (sensor.readings.size() <= options_.most_readings) return;
  sensor.readings.pop_front();
  ++counts_.readings_lost;
}

void LiveRows::finish() {
  finished_ = true;
}

void LiveRows::start() {
  started_ = true;
  for (const auto& [name, probe] : probes_.entries()) probe_names_.push_back(name);
  std::sort(probe_names_.begin(), probe_names_.end(), is_probe_before);
  has_reference_ = !references_.empty();
  sample_period_s_ = median_step_s(rates_);
  row_.temperature_degc.assign(probe_names_.size(), record::kNotMeasured);
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (channels_[i].spoken_to != core::kNever) environment_ |= 1U << i;
  }
  // What was read before the first rate belongs to no row.
  const auto forget = [&](Sensor& sensor) {
    while (!sensor.readings.empty() && sensor.readings.front().time < rates_.front().time)
      sensor.readings.pop_front();
  };
  for (auto& [name, probe] : probes_.entries()) forget(probe);
  for (Sensor& channel : channels_) forget(channel);
}

bool LiveRows::is_complete(core::SensorTime time) const {
  if (finished_) return true;
  if (has_reference_ && reference_.holds_up(time)) return false;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (core::has_channel(environment_, i) && channels_[i].holds_up(time)) return false;
  }
  return std::none_of(probes_.entries().begin(), probes_.entries().end(),
                      [time](const auto& entry) { return entry.second.holds_up(time); });
}

void LiveRows::stop_waiting() {
  if (!rates_.empty()) stop_waiting(rates_.front().time);
}

// One that speaks again is waited for again.
void LiveRows::stop_waiting(core::SensorTime time) {
  const auto leave = [time](Stream& stream) {
    if (stream.holds_up(time)) stream.waited_for = false;
  };
  leave(reference_);
  for (Sensor& channel : channels_) leave(channel);
  for (auto& [name, probe] : probes_.entries()) leave(probe);
}

const record::RecordRow* LiveRows::next() {
  if (rates_.empty()) return nullptr;
  if (!started_) {
    if (!finished_ && rates_.size() < options_.rates_before_start) return nullptr;
    start();
  }
  const core::AngularRateSample& rate = rates_.front();
  if (!is_complete(rate.time)) return nullptr;
  row_.index = previous_ ? row_.index + 1 : 0;
  row_.time = rate.time;
  row_.interval_s = previous_ ? core::seconds(rate.time - *previous_) : sample_period_s_;
  for (std::size_t i = 0; i < core::kAxisCount; ++i)
    row_.rate_radps[i] = rate.valid[i] ? rate.rate_radps[i] : record::kNotMeasured;
  take_readings(rate.time);
  if (has_reference_) take_reference(rate.time);
  previous_ = rate.time;
  rates_.pop_front();
  return &row_;
}

double LiveRows::Sensor::take_mean(core::SensorTime time) {
  double sum = 0.0;
  double count = 0.0;
  while (!readings.empty() && readings.front().time <= time) {
    sum += readings.front().value;
    count += 1.0;
    readings.pop_front();
  }
  return count > 0.0 ? sum / count : record::kNotMeasured;
}

void LiveRows::take_readings(core::SensorTime time) {
  for (std::size_t p = 0; p < probe_names_.size(); ++p)
    row_.temperature_degc[p] = probes_.find(probe_names_[p])->take_mean(time);
  for (std::size_t i = 0; i < channels_.size(); ++i)
    core::channel(row_.inputs, i) = channels_[i].take_mean(time);
}

void LiveRows::take_reference(core::SensorTime time) {
  while (!references_.empty() && references_.front().time <= time) {
    newest_reference_ = references_.front();
    references_.pop_front();
  }
  const bool is_known = newest_reference_ && time - newest_reference_->time <= kReferenceHolds;
  if (!is_known) {
    row_.rate_radps = record::kNoAxisMeasured;
    row_.reference_radps = record::kNoAxisMeasured;
    ++counts_.without_reference;
    return;
  }
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    row_.reference_radps[i] =
        newest_reference_->valid[i] ? newest_reference_->rate_radps[i] : record::kNotMeasured;
  }
}

}  // namespace zerodrift::measurement
