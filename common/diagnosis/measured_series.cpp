// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/measured_series.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "common/core/not_known.h"
#include "common/diagnosis/temperature_course.h"

namespace zerodrift::diagnosis {
namespace {

constexpr std::uint32_t kSamplesForVariance = 4;
constexpr double kLongestSpacing = 1.5;  // in sample periods; beyond, a sample is missing

// Places of the channels.
constexpr std::size_t kRate = 0;
constexpr std::size_t kReference = 3;
constexpr std::size_t kMagnetic = 6;
constexpr std::size_t kAcceleration = 9;
constexpr std::size_t kVibration = 12;
constexpr std::size_t kCurrent = 13;
constexpr std::size_t kSupply = 14;
constexpr std::size_t kProbes = 15;

}  // namespace

std::optional<std::string> SeriesOptions::validate() const {
  const auto positive = [](double v) { return std::isfinite(v) && v > 0.0; };
  if (!positive(sample_period_s)) {
    return "sample_period_s is " + std::to_string(sample_period_s) + ", must be > 0 s";
  }
  if (!positive(grid_interval_s)) {
    return "grid_interval_s is " + std::to_string(grid_interval_s) + ", must be > 0 s";
  }
  if (!positive(temperature_half_window_s)) {
    return "temperature_half_window_s is " + std::to_string(temperature_half_window_s) +
           ", must be > 0 s";
  }
  if (longest < 64) return "longest is " + std::to_string(longest) + ", must be >= 64";
  return std::nullopt;
}

void SeriesBuilder::Mean::add(double value) {
  if (!std::isfinite(value)) return;
  if (count == 0) first = value;
  const double d = value - first;
  sum += d;
  squares += d * d;
  ++count;
}

double SeriesBuilder::Mean::mean() const {
  return count == 0 ? core::kNaN : first + sum / count;
}

double SeriesBuilder::Mean::variance() const {
  if (count < 2) return core::kNaN;
  return std::max(0.0, (squares - sum * sum / count) / (count - 1));
}

void SeriesBuilder::Mean::merge(const Mean& other) {
  if (other.count == 0) return;
  if (count == 0) {
    *this = other;
    return;
  }
  const double shift = other.first - first;
  squares += other.squares + 2.0 * shift * other.sum + shift * shift * other.count;
  sum += other.sum + shift * other.count;
  count += other.count;
}

void SeriesBuilder::Holes::add(double time_s, double longest_s) {
  if (newest_s && time_s - *newest_s > longest_s) ++count;
  newest_s = time_s;
}

SeriesBuilder::SeriesBuilder(const SeriesOptions& options) : options_(options) {
  if (const auto error = options.validate()) throw std::invalid_argument(*error);
  interval_s_ = std::max(options.grid_interval_s, options.sample_period_s);
  blocks_ = options.sample_period_s < 0.75 * interval_s_;
  channels_.resize(kProbes + options.probes.size());
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    rate_steps_[i] = ReadingSteps(options.rate_unit_radps[i]);
    reference_steps_[i] = ReadingSteps(options.reference_unit_radps[i]);
  }
}

// A sample stands at the end of the interval it was integrated over.
std::size_t SeriesBuilder::cell_of(double time_s) const {
  const double steps = (time_s - *first_time_s_) / interval_s_;
  const double cell = blocks_ ? std::floor(steps + 1e-9) : std::round(steps);
  return static_cast<std::size_t>(std::max(cell, 0.0));
}

void SeriesBuilder::add(const MeasuredRow& row) {
  if (!std::isfinite(row.time_s)) return;
  if (!first_time_s_) first_time_s_ = row.time_s;
  while (cell_of(row.time_s) >= options_.longest) coarsen();
  const std::size_t cell = cell_of(row.time_s);
  if (cell >= cells_) {
    cells_ = cell + 1;
    for (Channel& channel : channels_) channel.resize(cells_);
  }
  ++rows_;
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    if (std::isfinite(row.rate_radps[i]))
      holes_[i].add(row.time_s, kLongestSpacing * options_.sample_period_s);
    channels_[kRate + i][cell].add(row.rate_radps[i]);
    rate_steps_[i].add(row.rate_radps[i]);
    reference_steps_[i].add(row.reference_radps[i]);
    channels_[kReference + i][cell].add(row.reference_radps[i]);
    channels_[kMagnetic + i][cell].add(row.magnetic_ut[i]);
    channels_[kAcceleration + i][cell].add(row.acceleration_mps2[i]);
  }
  channels_[kVibration][cell].add(row.vibration_g);
  channels_[kCurrent][cell].add(row.source_current_ma);
  channels_[kSupply][cell].add(row.supply_v);
  const std::size_t probes = std::min(row.temperature_degc.size(), options_.probes.size());
  for (std::size_t p = 0; p < probes; ++p)
    channels_[kProbes + p][cell].add(row.temperature_degc[p]);
}

// Twice the interval, half the cells.
void SeriesBuilder::coarsen() {
  interval_s_ *= 2.0;
  blocks_ = true;
  const std::size_t halves = (cells_ + 1) / 2;
  for (Channel& channel : channels_) {
    Channel merged(halves);
    for (std::size_t i = 0; i < channel.size(); ++i) merged[i / 2].merge(channel[i]);
    channel = std::move(merged);
  }
  cells_ = halves;
}

std::vector<double> SeriesBuilder::complete(const Channel& channel) const {
  std::vector<double> means(channel.size());
  std::transform(channel.begin(), channel.end(), means.begin(),
                 [](const Mean& m) { return m.mean(); });
  return bridged(std::move(means));
}

ProbeSeries SeriesBuilder::smoothed(const Channel& channel, const std::string& name) const {
  std::vector<double> means(channel.size());
  std::size_t readings = 0;
  for (std::size_t i = 0; i < channel.size(); ++i) {
    means[i] = channel[i].mean();
    if (channel[i].count > 0) ++readings;
  }
  ProbeSeries probe{.name = name};
  if (readings < 2) return probe;
  const double spacing_s =
      interval_s_ * static_cast<double>(channel.size()) / static_cast<double>(readings);
  probe.half_window_s = std::max(options_.temperature_half_window_s,
                                 static_cast<double>(kReadingsEachSide) * spacing_s);
  TemperatureCourse course = temperature_course(means, interval_s_, probe.half_window_s);
  probe.temperature_degc = std::move(course.degc);
  probe.rate_degc_per_s = std::move(course.degc_per_s);
  probe.readings_degc = std::move(means);
  return probe;
}

void SeriesBuilder::take_axis(MeasuredSeries& series, std::size_t axis) const {
  const Channel& rate = channels_[kRate + axis];
  const std::uint32_t wanted =
      blocks_ ? static_cast<std::uint32_t>(std::ceil(0.5 * interval_s_ / options_.sample_period_s))
              : 1;
  std::vector<double> values(cells_, 0.0);
  std::vector<std::uint8_t> valid(cells_, 0);
  std::vector<double> variances(cells_, core::kNaN);
  bool measured = false;
  bool many = blocks_;
  for (std::size_t i = 0; i < cells_; ++i) {
    if (rate[i].count < wanted) continue;
    values[i] = rate[i].mean();
    valid[i] = 1;
    measured = true;
    variances[i] = rate[i].variance();
    many = many && rate[i].count >= kSamplesForVariance;
  }
  if (!measured) return;
  series.rate_radps[axis] = std::move(values);
  series.valid[axis] = std::move(valid);
  series.holes[axis] = holes_[axis].count;
  if (many) series.sample_variance[axis] = std::move(variances);
}

// Where the supply falls below half of its highest value the gyro is off.
void SeriesBuilder::mark_power(MeasuredSeries& series) const {
  series.since_power_on_s.assign(cells_, 0.0);
  const double highest = series.supply_v.empty()
                             ? 0.0
                             : *std::max_element(series.supply_v.begin(), series.supply_v.end());
  double since_s = 0.0;
  for (std::size_t i = 0; i < cells_; ++i) {
    const bool off = highest > 0.0 && series.supply_v[i] < 0.5 * highest;
    since_s = off ? 0.0 : since_s + interval_s_;
    series.since_power_on_s[i] = since_s;
    if (!off) continue;
    for (auto& valid : series.valid) {
      if (!valid.empty()) valid[i] = 0;
    }
  }
}

MeasuredSeries SeriesBuilder::finish() {
  MeasuredSeries series;
  series.start_s = first_time_s_.value_or(0.0);
  series.interval_s = interval_s_;
  series.sample_period_s = options_.sample_period_s;
  series.size = cells_;
  series.rows = rows_;
  std::size_t most_valid = 0;
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    take_axis(series, i);
    most_valid = std::max(most_valid, static_cast<std::size_t>(std::count(
                                          series.valid[i].begin(), series.valid[i].end(), 1)));
    series.magnetic_ut[i] = complete(channels_[kMagnetic + i]);
    series.acceleration_mps2[i] = complete(channels_[kAcceleration + i]);
    series.reference_radps[i] = complete(channels_[kReference + i]);
    if (!options_.has_reference || series.reference_radps[i].empty())
      series.reference_radps[i].assign(cells_, 0.0);
  }
  if (most_valid < 2) throw std::invalid_argument("the record has no axis with two valid rates");
  series.has_reference = options_.has_reference;
  series.rate_steps = rate_steps_;
  series.reference_steps = reference_steps_;
  series.vibration_g = complete(channels_[kVibration]);
  series.source_current_ma = complete(channels_[kCurrent]);
  series.supply_v = complete(channels_[kSupply]);
  for (std::size_t p = 0; p < options_.probes.size(); ++p) {
    ProbeSeries probe = smoothed(channels_[kProbes + p], options_.probes[p]);
    if (!probe.temperature_degc.empty()) series.probes.push_back(std::move(probe));
  }
  mark_power(series);
  const double duration_s = interval_s_ * static_cast<double>(cells_);
  const double expected = std::round(duration_s / options_.sample_period_s);
  series.missing_samples = expected > static_cast<double>(rows_)
                               ? static_cast<std::uint64_t>(expected - static_cast<double>(rows_))
                               : 0;
  return series;
}

MeasuredSeries without_lags(MeasuredSeries series, const twin::Model& model) {
  for (const twin::ProbeSpec& spec : model.probes) {
    const auto probe =
        std::find_if(series.probes.begin(), series.probes.end(),
                     [&](const ProbeSeries& other) { return other.name == spec.name; });
    if (probe == series.probes.end() || !(spec.lag_s > 0.0) || probe->readings_degc.empty())
      continue;
    TemperatureCourse course = temperature_course(probe->readings_degc, series.interval_s,
                                                  probe->half_window_s, spec.lag_s);
    probe->temperature_degc = std::move(course.degc);
    probe->rate_degc_per_s = std::move(course.degc_per_s);
  }
  return series;
}

MeasuredSeries part_of(const MeasuredSeries& series, std::size_t begin, std::size_t end) {
  MeasuredSeries part = series;
  const auto cut = [&](auto& channel) {
    if (channel.empty()) return;
    channel.erase(channel.begin() + static_cast<std::ptrdiff_t>(end), channel.end());
    channel.erase(channel.begin(), channel.begin() + static_cast<std::ptrdiff_t>(begin));
  };
  for (std::size_t a = 0; a < core::kAxisCount; ++a) {
    cut(part.rate_radps[a]);
    cut(part.valid[a]);
    cut(part.sample_variance[a]);
    cut(part.reference_radps[a]);
    cut(part.magnetic_ut[a]);
    cut(part.acceleration_mps2[a]);
  }
  for (ProbeSeries& probe : part.probes) {
    cut(probe.temperature_degc);
    cut(probe.rate_degc_per_s);
    cut(probe.readings_degc);
  }
  for (auto* channel :
       {&part.vibration_g, &part.source_current_ma, &part.supply_v, &part.since_power_on_s})
    cut(*channel);
  part.start_s = series.time_s(begin);
  part.size = end - begin;
  return part;
}

}  // namespace zerodrift::diagnosis
