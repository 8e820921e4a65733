// SPDX-License-Identifier: Apache-2.0
#include "common/measurement/measured_record.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "common/core/not_known.h"
#include "common/core/units.h"
#include "common/measurement/probe_order.h"
#include "common/record/record_reader.h"
#include "common/record/record_rows.h"
#include "common/report/numbers.h"
#include "common/report/plain_text.h"

namespace zerodrift::measurement {
namespace {

using record::BoundColumn;
using record::Quantity;
using report::significant;

constexpr core::PerAxis<double> kNoAxis{core::kNaN, core::kNaN, core::kNaN};
constexpr double kLongestPeriodS = 60.0;
// Below it slow effects and slow noise look alike.
constexpr double kShortS = 1800.0;
// A step in time is a gap from so many sample periods on.
constexpr double kGapPeriods = 2.5;
constexpr int kDigits = 3;
constexpr std::uint64_t kRowsPerProgress = 8192;

// Noise from sample to sample. E|x - y| of white noise is 2 sigma / sqrt(pi).
class StepNoise {
 public:
  void add(double value) {
    if (!std::isfinite(value)) return;
    if (readings_ > 0) sum_ += std::abs(value - last_);
    ++readings_;
    last_ = value;
  }
  [[nodiscard]] double standard_deviation() const {
    if (readings_ < 2) return core::kNaN;
    return 0.5 * sum_ / static_cast<double>(readings_ - 1) / std::numbers::inv_sqrtpi;
  }

 private:
  std::uint64_t readings_ = 0;
  double last_ = 0.0;
  double sum_ = 0.0;
};

// Steps in time that are longer than a sample period.
struct Gaps {
  std::uint64_t count = 0;
  double longest_s = 0.0;
  double lost_s = 0.0;

  void add(double step_s, double period_s) {
    if (step_s <= kGapPeriods * period_s) return;
    ++count;
    longest_s = std::max(longest_s, step_s);
    lost_s += step_s - period_s;
  }
};

std::string axis_names(const core::PerAxis<bool>& has) {
  std::string names;
  for (const auto axis : core::kAxes) {
    if (!has[core::index(axis)]) continue;
    (names += names.empty() ? "" : ", ") += core::name(axis);
  }
  return names.empty() ? "none" : names;
}

void require_axes(const record::RecordInfo& info, const MeasuredRecordRequest& request) {
  for (const auto axis : request.axes) {
    if (info.has_rate[core::index(axis)]) continue;
    throw std::invalid_argument(request.record.file + ": found no rate of axis " +
                                std::string(core::name(axis)) + ", expected one of the axes " +
                                axis_names(info.has_rate));
  }
}

double require_period(double period_s, const std::string& file) {
  if (period_s > 0.0 && period_s <= kLongestPeriodS) return period_s;
  throw std::invalid_argument(
      file + ": found " +
      (period_s > 0.0 ? "a sample every " + significant(period_s, kDigits) + " s"
                      : "a single sample") +
      ", expected one every minute or more often: means of 60 s are compared");
}

MeasuredColumns columns_of(const record::RecordInfo& info, const MeasuredRecordRequest& request,
                           const std::vector<record::ColumnMapping>& map) {
  require_axes(info, request);
  MeasuredColumns columns{.file = request.record.file,
                          .probes = info.probes,
                          .has_reference = info.has_reference != core::PerAxis<bool>{},
                          .sample_period_s = info.sample_period_s,
                          .source = column_source_of(info.path)};
  const auto is_wanted = [&](core::Axis axis) {
    return request.axes.empty() ||
           std::find(request.axes.begin(), request.axes.end(), axis) != request.axes.end();
  };
  for (const BoundColumn& column : record::bind_columns(info.path, info.columns, map).columns) {
    if (column.role != record::ColumnRole::kValue) continue;
    if (column.channel.quantity == Quantity::kRate && !is_wanted(column.channel.axis)) continue;
    columns.columns.push_back(column);
  }
  return columns;
}

core::PerAxis<double> units_of(const MeasuredColumns& columns, Quantity quantity) {
  core::PerAxis<double> units = diagnosis::kDegPerHour;
  for (const BoundColumn& column : columns.columns) {
    if (column.channel.quantity != quantity) continue;
    units[core::index(column.channel.axis)] = std::abs(column.conversion.scale);
  }
  return units;
}

}  // namespace

// Takes the rows of one record.
class MeasuredRecordBuilder::Implementation {
 public:
  explicit Implementation(MeasuredColumns columns)
      : columns_(std::move(columns)),
        series_({.probes = columns_.probes,
                 .has_reference = columns_.has_reference,
                 .rate_unit_radps = units_of(columns_, Quantity::kRate),
                 .reference_unit_radps = units_of(columns_, Quantity::kReference),
                 .sample_period_s = require_period(columns_.sample_period_s, columns_.file)}),
        watch_(columns_.file, columns_.source, columns_.columns) {}

  void add(const record::RecordRow& row) {
    if (watch_.rows() > 0) gaps_.add(row.interval_s, columns_.sample_period_s);
    const record::RecordRow& cleared = watch_.add(row);
    const diagnosis::MeasuredRow measured{.time_s = core::seconds(row.time),
                                          .rate_radps = cleared.rate_radps,
                                          .reference_radps = cleared.reference_radps,
                                          .temperature_degc = cleared.temperature_degc,
                                          .magnetic_ut = cleared.inputs.magnetic_ut,
                                          .acceleration_mps2 = cleared.inputs.acceleration_mps2,
                                          .vibration_g = cleared.inputs.vibration_g,
                                          .source_current_ma = cleared.inputs.source_current_ma,
                                          .supply_v = cleared.inputs.supply_v};
    // Turns are no noise.
    for (std::size_t axis = 0; axis < core::kAxisCount; ++axis)
      noise_[axis].add(measured.rate_radps[axis] - measured.reference_radps[axis]);
    series_.add(measured);
  }

  MeasuredRecord finish() {
    MeasuredRecord measured{.file = columns_.file};
    measured.series = finished_series();
    measured.doubts = watch_.doubts();
    measured.sample_noise_radps = kNoAxis;
    report_columns(measured);
    report_rest(measured);
    report_time(measured);
    std::sort(measured.series.probes.begin(), measured.series.probes.end(),
              [](const auto& a, const auto& b) { return is_probe_before(a.name, b.name); });
    return measured;
  }

 private:
  [[nodiscard]] diagnosis::MeasuredSeries finished_series() {
    try {
      return series_.finish();
    } catch (const std::invalid_argument& error) {
      std::string why;
      for (const Doubt& doubt : watch_.doubts()) {
        if (doubt.kind == DoubtKind::kNotMeasurable) why = "; " + doubt.text;
      }
      throw std::invalid_argument(columns_.file + ": " + error.what() + why);
    }
  }

  void warn(MeasuredRecord& measured, const std::string& text) const {
    measured.warnings.push_back(columns_.file + ": " + text);
  }

  void report_columns(MeasuredRecord& measured) const {
    std::uint64_t impossible = 0;
    for (const ColumnWatch& watch : watch_.columns()) {
      impossible += watch.impossible_readings();
      if (watch.quantity() == Quantity::kRate) report_rate(measured, watch);
      if (watch.quantity() == Quantity::kTemperature) report_probe(measured, watch);
    }
    if (impossible > 0) {
      warn(measured,
           std::to_string(impossible) +
               (impossible == 1 ? " reading that can't be is" : " readings that can't be are") +
               " taken as not measured");
    }
    report_acceleration(measured);
    const core::PerAxis<std::vector<double>> none{};
    if (measured.series.rate_radps != none) return;
    throw std::invalid_argument(columns_.file +
                                ": every reading of every rate is equal, a gyro's never are; "
                                "expected an axis that moves");
  }

  void report_rate(MeasuredRecord& measured, const ColumnWatch& watch) const {
    const std::size_t axis = core::index(watch.column().channel.axis);
    measured.rate_column[axis] = watch.column().header;
    if (watch.never_moves()) {
      warn(measured, "axis " + std::string(core::name(watch.column().channel.axis)) +
                         " is left out, its rate is stuck");
      measured.series.rate_radps[axis].clear();
      measured.series.valid[axis].clear();
      measured.series.sample_variance[axis].clear();
      return;
    }
    measured.sample_noise_radps[axis] = noise_[axis].standard_deviation();
  }

  // A stuck probe beside moving ones would pass for the other end of a gradient.
  void report_probe(MeasuredRecord& measured, const ColumnWatch& watch) const {
    if (!watch_.is_stuck_beside_others(watch)) return;
    const std::string& name = watch.column().channel.probe;
    std::erase_if(measured.series.probes, [&](const auto& probe) { return probe.name == name; });
    warn(measured, "probe " + report::shortened(name, 60) + " is left out, it is stuck");
  }

  // Gravity tells the unit of an accelerometer.
  void report_acceleration(MeasuredRecord& measured) const {
    double square = 0.0;
    for (const auto& axis : measured.series.acceleration_mps2) {
      if (axis.empty()) return;
      double sum = 0.0;
      for (const double value : axis) sum += value * value;
      square += sum / static_cast<double>(axis.size());
    }
    const double in_g = std::sqrt(square) / core::kStandardGravityMps2;
    const auto near = [&](double factor) { return in_g > 0.8 * factor && in_g < 1.25 * factor; };
    if (!near(1.0 / core::kStandardGravityMps2) && !near(core::kStandardGravityMps2)) return;
    warn(measured, "columns of acceleration: the root mean square is " +
                       significant(in_g, kDigits) + " g; is their unit right? accepted: " +
                       record::accepted_units(Quantity::kAcceleration));
  }

  void report_rest(MeasuredRecord& measured) const {
    if (columns_.has_reference) return;
    warn(measured,
         "no true rate (reference_x_deg_h, ...): taken as 0, so the gyro must have been at rest");
  }

  void report_time(MeasuredRecord& measured) const {
    if (measured.series.probes.empty())
      warn(measured, "no temperature (temperature_coil_degC, ...): its effects can't be tested");
    if (gaps_.count > 0) {
      warn(measured, std::to_string(gaps_.count) + (gaps_.count == 1 ? " gap" : " gaps") +
                         ", the longest of " + significant(gaps_.longest_s, kDigits) +
                         " s; in all " + significant(gaps_.lost_s, kDigits) + " s are missing");
    }
    if (measured.duration_s() < kShortS) {
      warn(measured, "only " + significant(measured.duration_s() / 60.0, kDigits) +
                         " min long: slow effects and slow noise look alike in it");
    }
    if (columns_.sample_period_s > 1.0) {
      warn(measured, "a sample every " + significant(columns_.sample_period_s, kDigits) +
                         " s: nothing faster than that can be seen");
    }
  }

  const MeasuredColumns columns_;
  diagnosis::SeriesBuilder series_;
  RecordWatch watch_;
  core::PerAxis<StepNoise> noise_;
  Gaps gaps_;
};

MeasuredRecordBuilder::MeasuredRecordBuilder(MeasuredColumns columns)
    : implementation_(std::make_unique<Implementation>(std::move(columns))) {}
MeasuredRecordBuilder::~MeasuredRecordBuilder() = default;
MeasuredRecordBuilder::MeasuredRecordBuilder(MeasuredRecordBuilder&&) noexcept = default;
MeasuredRecordBuilder& MeasuredRecordBuilder::operator=(MeasuredRecordBuilder&&) noexcept = default;

void MeasuredRecordBuilder::add(const record::RecordRow& row) {
  implementation_->add(row);
}

MeasuredRecord MeasuredRecordBuilder::finish() {
  return implementation_->finish();
}

MeasuredRecord read_measured_record(const MeasuredRecordRequest& request,
                                    const std::function<void(double)>& progress) {
  const record::RecordOptions how = request.record.options();
  record::RecordReader reader(request.record.file, how);
  MeasuredRecordBuilder builder(columns_of(reader.info(), request, how.columns));
  const std::optional<double> expected_rows = record::estimated_rows(request.record.file);
  std::uint64_t rows = 0;
  while (const record::RecordRow* row = reader.next()) {
    builder.add(*row);
    if (expected_rows && ++rows % kRowsPerProgress == 0)
      progress(static_cast<double>(rows) / *expected_rows);
  }
  MeasuredRecord measured = builder.finish();
  measured.warnings.insert(measured.warnings.begin(), reader.warnings().begin(),
                           reader.warnings().end());
  if (request.record.gyro_id && reader.info().gyro_id == 0) {
    measured.warnings.push_back(measured.file + ": --gyro-id " +
                                std::to_string(*request.record.gyro_id) +
                                " chooses nothing here: rates without a gyro's number are one "
                                "gyro's, as in every file but .mcap of `zerodrift record`");
  }
  return measured;
}

}  // namespace zerodrift::measurement
