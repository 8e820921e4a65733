// SPDX-License-Identifier: Apache-2.0
#include "services/console/history.h"

#include <algorithm>
#include <cmath>

#include "common/core/not_known.h"
#include "common/core/samples.h"
#include "common/core/time.h"
#include "common/core/units.h"
#include "services/console/telemetry.h"

namespace zerodrift::services {
namespace {

using core::kNsPerS;
constexpr std::int64_t kReadingHoldsNs = 60 * kNsPerS;
constexpr std::size_t kReadingsKept = 4096;  // of a probe, ahead of the samples
constexpr int kBeginsAnewAfter = 3;
using core::kNaN;

// Seconds before zero are seconds too.
std::int64_t second_of(std::int64_t time_ns) {
  return time_ns / kNsPerS - (time_ns % kNsPerS < 0 ? 1 : 0);
}

float single(double value) {
  return static_cast<float>(value);
}

}  // namespace

void GyroHistory::Spread::add(double value) {
  if (!std::isfinite(value)) return;
  min = count == 0 ? value : std::min(min, value);
  max = count == 0 ? value : std::max(max, value);
  sum += value;
  ++count;
}

double GyroHistory::Spread::mean() const {
  return count == 0 ? kNaN : sum / static_cast<double>(count);
}

void GyroHistory::add(const msg::CompensatedRate& sample) {
  const std::int64_t second = second_of(sample.sensor_time_ns());
  const bool is_out_of_order = sample.order() != 0;
  if (is_out_of_order && second != open_second_) {
    // Late, or of a time that is doubted: it moves nothing.
    ++left_out_;
    earlier_in_a_row_ = 0;
    return;
  }
  if (open_second_ && second < *open_second_) {
    ++left_out_;
    const bool is_late = second + 1 >= *open_second_;
    earlier_in_a_row_ = is_late ? 0 : earlier_in_a_row_ + 1;
    if (earlier_in_a_row_ < kBeginsAnewAfter) return;
    rows_.clear();
    comparisons_ = {};
    taken_ = 0;
    began_anew_ = true;
    open_ = {};
    open_second_ = second;
    for (Probe& probe : probes_) probe.readings.clear();
  }
  earlier_in_a_row_ = 0;
  if (!open_second_) open_second_ = second;
  if (second > *open_second_) {
    close_row();
    open_second_ = second;
  }
  for (std::size_t i = 0; i < open_.size(); ++i) {
    OpenAxis& axis = open_[i];
    axis.mode = sample.mode()[i];
    const auto reason = static_cast<core::Reason>(sample.reason()[i]);
    axis.moves = axis.moves || says_motion(reason);
    axis.rests = axis.rests || says_rest(static_cast<core::Mode>(axis.mode), reason);
    if (!is_valid(sample, i)) continue;
    axis.raw.add(raw_deg_h(sample, i));
    axis.compensated.add(compensated_deg_h(sample, i));
    axis.drift.add(core::deg_h_from_radps(sample.applied_drift_radps()[i]));
    axis.sigma = sigma_deg_h(sample.drift_variance_radps2()[i]);
  }
}

void GyroHistory::add(const msg::RateReference& reference) {
  constexpr auto kResidual = static_cast<std::uint32_t>(core::ReferenceKind::kNavigationResidual);
  if (reference.kind() == 0 || reference.kind() >= kResidual) return;  // no true rate
  const std::int64_t second = second_of(reference.sensor_time_ns());
  const auto slot =
      static_cast<std::size_t>(static_cast<std::uint64_t>(second)) % kReferenceSeconds;
  OpenReference& open = references_[slot];
  if (open.second != second) open = {.second = second};
  for (std::size_t i = 0; i < open.axes.size(); ++i) {
    if ((reference.validity() >> i & 1U) != 0)
      open.axes[i].add(core::deg_h_from_radps(reference.rate_radps()[i]));
  }
}

void GyroHistory::add(const std::string& name, const ProbeReading& reading) {
  auto probe = std::find_if(probes_.begin(), probes_.end(),
                            [&](const Probe& known) { return known.name == name; });
  if (probe == probes_.end()) {
    if (probes_.size() >= options_.most_probes) return;
    probe = probes_.insert(probe, {.name = name});
  }
  probe->readings.push_back(reading);
  if (probe->readings.size() > kReadingsKept) probe->readings.pop_front();
}

// What was read before the newest reading of a complete second is of no row any more.
void GyroHistory::forget_readings(Probe& probe, std::int64_t second) {
  auto& readings = probe.readings;
  while (readings.size() > 1 && second_of(readings[1].sensor_time_ns) <= second)
    readings.pop_front();
}

const ProbeReading* GyroHistory::reading_of(const Probe& probe, std::int64_t second) const {
  const ProbeReading* newest = nullptr;
  for (const ProbeReading& reading : probe.readings) {
    const std::int64_t at = second_of(reading.sensor_time_ns);
    if (at <= second && (second - at) * kNsPerS <= kReadingHoldsNs &&
        (newest == nullptr || reading.sensor_time_ns >= newest->sensor_time_ns))
      newest = &reading;
  }
  return newest;
}

void GyroHistory::close_row() {
  const std::int64_t second = *open_second_;
  const OpenReference& reference =
      references_[static_cast<std::size_t>(static_cast<std::uint64_t>(second)) % kReferenceSeconds];
  Row row{.second = second};
  // A gyro is at rest as a whole; an axis may have another reason that is told before this one.
  const bool moves =
      std::any_of(open_.begin(), open_.end(), [](const OpenAxis& axis) { return axis.moves; });
  const bool rests =
      std::any_of(open_.begin(), open_.end(), [](const OpenAxis& axis) { return axis.rests; });
  for (std::size_t i = 0; i < open_.size(); ++i) {
    const OpenAxis& axis = open_[i];
    const auto known = [&](const Spread& spread, double value) {
      return single(spread.count > 0 ? value : kNaN);
    };
    row.axes[i] = {known(axis.raw, axis.raw.min),
                   single(axis.raw.mean()),
                   known(axis.raw, axis.raw.max),
                   known(axis.compensated, axis.compensated.min),
                   single(axis.compensated.mean()),
                   known(axis.compensated, axis.compensated.max),
                   single(axis.drift.mean()),
                   known(axis.drift, axis.sigma),
                   single(reference.second == second ? reference.axes[i].mean() : kNaN),
                   axis.mode};
    const AxisRow& closed = row.axes[i];
    comparisons_[i].add({.second = second,
                         .raw_deg_h = static_cast<double>(closed.raw_mean),
                         .compensated_deg_h = static_cast<double>(closed.compensated_mean),
                         .reference_deg_h = static_cast<double>(closed.reference_mean),
                         .mode = closed.mode,
                         .moves = moves,
                         .rests = rests});
    comparisons_[i].forget_before(second - options_.kept_s);
  }
  for (Probe& probe : probes_) {
    const ProbeReading* reading = reading_of(probe, second);
    row.probes.push_back({single(reading != nullptr ? reading->temperature_degc : kNaN),
                          single(reading != nullptr ? reading->rate_degc_per_min : kNaN)});
    forget_readings(probe, second);
  }
  rows_.push_back(std::move(row));
  open_ = {};
  while (rows_.front().second <= second - options_.kept_s ||
         rows_.size() > static_cast<std::size_t>(options_.kept_s)) {
    rows_.pop_front();
    if (taken_ > 0) --taken_;
  }
}

void GyroHistory::append_row(const Row& row, telemetry::History& out) const {
  out.add_sensor_time_ns(row.second * kNsPerS);
  for (int i = 0; i < 3; ++i) {
    const AxisRow& from = row.axes[static_cast<std::size_t>(i)];
    auto& axis = *out.mutable_axes(i);
    axis.add_raw_min_deg_h(static_cast<double>(from.raw_min));
    axis.add_raw_mean_deg_h(static_cast<double>(from.raw_mean));
    axis.add_raw_max_deg_h(static_cast<double>(from.raw_max));
    axis.add_compensated_min_deg_h(static_cast<double>(from.compensated_min));
    axis.add_compensated_mean_deg_h(static_cast<double>(from.compensated_mean));
    axis.add_compensated_max_deg_h(static_cast<double>(from.compensated_max));
    axis.add_drift_mean_deg_h(static_cast<double>(from.drift_mean));
    axis.add_drift_sigma_deg_h(static_cast<double>(from.drift_sigma));
    axis.add_reference_mean_deg_h(static_cast<double>(from.reference_mean));
    axis.mutable_mode()->push_back(static_cast<char>(from.mode));
  }
  for (std::size_t p = 0; p < probes_.size(); ++p) {
    auto& probe = *out.mutable_probes(static_cast<int>(p));
    const bool known = p < row.probes.size();
    probe.add_temperature_degc(known ? static_cast<double>(row.probes[p].temperature_degc) : kNaN);
    probe.add_rate_degc_per_min(known ? static_cast<double>(row.probes[p].rate_degc_per_min)
                                      : kNaN);
  }
}

telemetry::History GyroHistory::table(std::size_t from) const {
  telemetry::History out;
  out.set_gyro_id(gyro_id_);
  for (int i = 0; i < 3; ++i) out.add_axes();
  for (const Probe& probe : probes_) out.add_probes()->set_probe(probe.name);
  for (std::size_t i = from; i < rows_.size(); ++i) append_row(rows_[i], out);
  return out;
}

telemetry::History GyroHistory::backlog() const {
  telemetry::History out = table(0);
  out.set_is_backlog(true);
  return out;
}

std::optional<telemetry::History> GyroHistory::take_new() {
  if (taken_ == rows_.size() && !began_anew_) return std::nullopt;
  telemetry::History out = began_anew_ ? backlog() : table(taken_);
  taken_ = rows_.size();
  began_anew_ = false;
  return out;
}

}  // namespace zerodrift::services
