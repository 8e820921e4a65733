// SPDX-License-Identifier: Apache-2.0
#include "common/measurement/plausibility.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/units.h"
#include "common/record/bag_files.h"
#include "common/report/numbers.h"
#include "common/report/plain_text.h"

namespace zerodrift::measurement {
namespace {

using record::BoundColumn;
using record::Quantity;
using report::significant;

constexpr std::size_t kLongestHeader = 60;
constexpr int kDigits = 3;

std::string header_of(const BoundColumn& column) {
  return report::shortened(column.header, kLongestHeader);
}

bool is_rate(Quantity quantity) {
  return quantity == Quantity::kRate || quantity == Quantity::kReference;
}

// Rates in deg/s, all else in its default unit.
std::string value_text(Quantity quantity, double value, int digits) {
  return significant(is_rate(quantity) ? value / core::kRadPerDeg : value, digits);
}

std::string unit_text(Quantity quantity) {
  return is_rate(quantity) ? "deg/s" : std::string(record::default_unit(quantity));
}

std::string range_text(Quantity quantity, const ValueRange& range, int digits) {
  return value_text(quantity, range.lowest, digits) + " and " +
         value_text(quantity, range.highest, digits) + " " + unit_text(quantity);
}

bool is_equal(const record::UnitConversion& a, const record::UnitConversion& b) {
  return a.scale == b.scale && a.offset == b.offset;
}

struct OtherUnit {
  std::string_view unit;
  record::UnitConversion conversion;
};

// The units that the cells of a column could be in besides the one that they were read in; none
// for counts, whose size nobody else knows.
std::vector<OtherUnit> other_units(const BoundColumn& column) {
  std::vector<OtherUnit> others;
  bool is_counts = true;
  for (const std::string_view unit : record::units_of(column.channel.quantity)) {
    const auto conversion = record::unit_conversion(column.channel.quantity, unit);
    if (is_equal(*conversion, column.conversion))
      is_counts = false;
    else
      others.push_back({unit, *conversion});
  }
  if (is_counts) others.clear();
  return others;
}

double reread(double value, const BoundColumn& column, const OtherUnit& other) {
  const double cell = (value - column.conversion.offset) / column.conversion.scale;
  return cell * other.conversion.scale + other.conversion.offset;
}

// The first unit in which the values that were read as `values` lie in `wanted`.
std::optional<OtherUnit> unit_that_fits(const BoundColumn& column, const ValueRange& values,
                                        const ValueRange& wanted) {
  for (const OtherUnit& other : other_units(column)) {
    if (wanted.holds({reread(values.lowest, column, other), reread(values.highest, column, other)}))
      return other;
  }
  return std::nullopt;
}

std::size_t probes_of(const std::vector<BoundColumn>& columns) {
  std::size_t probes = 0;
  for (const BoundColumn& column : columns) {
    const bool is_thermometer = column.role == record::ColumnRole::kValue &&
                                column.channel.quantity == Quantity::kTemperature;
    if (is_thermometer) probes = std::max(probes, column.slot + 1);
  }
  return probes;
}

}  // namespace

std::string_view name(DoubtKind kind) {
  switch (kind) {
    case DoubtKind::kNotMeasurable: return "not_measurable";
    case DoubtKind::kUnit: return "unit";
    case DoubtKind::kNotAtRest: return "not_at_rest";
    case DoubtKind::kStuck: return "stuck";
    case DoubtKind::kTooShort: return "too_short";
  }
  return "";
}

ColumnSource column_source_of(const std::filesystem::path& record) {
  return record::is_mcap_record(record) ? ColumnSource::kMcap : ColumnSource::kTable;
}

RecordWatch::RecordWatch(std::string record, ColumnSource source,
                         const std::vector<BoundColumn>& columns)
    : record_(std::move(record)), source_(source), standstills_(probes_of(columns)) {
  for (const BoundColumn& column : columns) {
    if (column.role != record::ColumnRole::kValue) continue;
    columns_.emplace_back(column);
    const record::Channel& channel = column.channel;
    if (channel.quantity == Quantity::kReference) has_reference_[core::index(channel.axis)] = true;
  }
  cleared_.temperature_degc.assign(probes_of(columns), record::kNotMeasured);
}

RecordWatch::RecordWatch(const record::RecordInfo& info, std::string_view columns)
    : RecordWatch(info.path.string(), column_source_of(info.path),
                  record::bind_columns(info.path, info.columns, record::parse_column_map(columns))
                      .columns) {}

const record::RecordRow& RecordWatch::add(const record::RecordRow& row) {
  ++rows_;
  first_ = std::min(first_, row.time);
  last_ = std::max(last_, row.time);
  cleared_.index = row.index;
  cleared_.time = row.time;
  cleared_.interval_s = row.interval_s;
  for (ColumnWatch& column : columns_) {
    record::value_of(cleared_, column.column()) =
        column.pass(record::value_of(row, column.column()));
  }
  standstills_.add(row.time, cleared_.temperature_degc);
  for (std::size_t axis = 0; axis < core::kAxisCount; ++axis) {
    const double drift = cleared_.rate_radps[axis] - cleared_.reference_radps[axis];
    if (!std::isfinite(drift)) continue;
    drift_[axis].sum_radps += std::abs(drift);
    ++drift_[axis].count;
  }
  return cleared_;
}

double RecordWatch::duration_s() const {
  if (rows_ == 0) return 0.0;
  const double spanned_s = core::seconds(last_ - first_);
  return rows_ > 1 ? spanned_s * static_cast<double>(rows_) / static_cast<double>(rows_ - 1) : 0.0;
}

std::vector<Doubt> RecordWatch::doubts() const {
  std::vector<Doubt> found;
  if (rows_ == 0) return found;
  for (const ColumnWatch& column : columns_) {
    const auto note = [&](DoubtKind kind, std::optional<std::string> text) {
      if (!text) return;
      const std::string& header = column.column().header;
      found.push_back(
          {kind, record_, header, "column " + header_of(column.column()) + ": " + *text});
    };
    note(DoubtKind::kNotMeasurable, not_measurable(column));
    note(DoubtKind::kUnit, other_unit(column));
    note(DoubtKind::kNotAtRest, not_at_rest(column));
    note(DoubtKind::kStuck, stuck(column));
  }
  if (duration_s() < kShortestRecordS) {
    found.push_back({DoubtKind::kTooShort,
                     record_,
                     {},
                     "it spans " + significant(duration_s(), kDigits) +
                         " s, less than the minute that means are taken over: too short for drift "
                         "to be distinguished from noise"});
  }
  return found;
}

// "; is it in degF? then --columns 'temperature_coil=temp[degF]'"
std::string RecordWatch::question_of(const BoundColumn& column, std::string_view unit) const {
  std::string text = "; is it in " + std::string(unit) + "?";
  if (source_ == ColumnSource::kLive)
    return text + " expected " + std::string(record::default_unit(column.channel.quantity));
  text += " then ";
  if (source_ == ColumnSource::kMcap) text += "zerodrift export to a .csv, and read that with ";
  return text + "--columns '" + record::name(column.channel) + "=" + header_of(column) + "[" +
         std::string(unit) + "]'";
}

std::optional<std::string> RecordWatch::not_measurable(const ColumnWatch& column) const {
  const std::uint64_t impossible = column.impossible_readings();
  if (impossible == 0) return std::nullopt;
  const Quantity quantity = column.quantity();
  std::string text = std::to_string(impossible) + " of " +
                     std::to_string(impossible + column.readings()) + " readings lie between " +
                     range_text(quantity, column.impossible(), 4) + ", expected " +
                     measurable_range(quantity).text;
  if (impossible < column.readings()) return text;  // a few spikes have no unit
  if (quantity == Quantity::kTemperature) {
    const auto other = unit_that_fits(column.column(), column.impossible(), kEndurableDegc);
    return other ? text + question_of(column.column(), other->unit) : text;
  }
  return text + "; is the unit right? accepted: " + record::accepted_units(quantity);
}

std::optional<std::string> RecordWatch::other_unit(const ColumnWatch& column) const {
  if (column.quantity() != Quantity::kTemperature || column.readings() == 0) return std::nullopt;
  const ValueRange& read = column.passed();
  const bool is_a_laboratory_in_degf = kLaboratoryInDegf.holds(read);
  if (kEndurableDegc.holds(read) && !is_a_laboratory_in_degf) return std::nullopt;
  const auto other = unit_that_fits(column.column(), read, kEndurableDegc);
  if (!other) return std::nullopt;
  return "all " + std::to_string(column.readings()) + " readings lie between " +
         range_text(Quantity::kTemperature, read, kDigits) + ", " +
         (is_a_laboratory_in_degf ? "no ordinary temperature of a gyro from first to last"
                                  : "more than a gyro endures") +
         question_of(column.column(), other->unit);
}

std::optional<std::string> RecordWatch::not_at_rest(const ColumnWatch& column) const {
  if (column.quantity() != Quantity::kRate) return std::nullopt;
  const std::size_t axis = core::index(column.column().channel.axis);
  const MeanSize& drift = drift_[axis];
  if (drift.count == 0) return std::nullopt;
  const double mean_radps = drift.sum_radps / static_cast<double>(drift.count);
  if (mean_radps < kLargestAtRestRadps) return std::nullopt;
  const std::string size = "the mean size of the rate" +
                           std::string(has_reference_[axis] ? " less its reference" : "") + " is " +
                           value_text(Quantity::kRate, mean_radps, kDigits) + " deg/s, ";
  const auto other =
      unit_that_fits(column.column(), {mean_radps, mean_radps}, {0.0, kLargestAtRestRadps});
  const std::string unit = other ? question_of(column.column(), other->unit) : "";
  if (has_reference_[axis])
    return size + "too much for drift: sign or unit of one of both is wrong" + unit;
  return size + "too much for a gyro at rest: it turned, and no true rate says how (reference_" +
         std::string(core::name(column.column().channel.axis)) + "_deg_s), or its unit is wrong" +
         unit;
}

double RecordWatch::widest_temperature_degc() const {
  double widest = 0.0;
  for (const ColumnWatch& column : columns_) {
    if (column.quantity() == Quantity::kTemperature) widest = std::max(widest, column.spanned());
  }
  return widest;
}

bool RecordWatch::is_stuck_beside_others(const ColumnWatch& thermometer) const {
  return thermometer.never_moves() && widest_temperature_degc() > kMovedDegc;
}

std::optional<std::string> RecordWatch::stuck(const ColumnWatch& column) const {
  if (!column.never_moves()) return standstill(column);
  const std::string all = "all " + std::to_string(column.readings()) + " readings are ";
  if (column.quantity() == Quantity::kRate) return all + "equal, a gyro's never are: it is stuck";
  if (column.quantity() != Quantity::kTemperature) return std::nullopt;
  const std::string equal = all + significant(column.passed().lowest, 4) + " degC";
  if (is_stuck_beside_others(column)) {
    return equal + " while another probe moves by " +
           significant(widest_temperature_degc(), kDigits) + " degC: it is stuck";
  }
  if (duration_s() < kLongestConstantTemperatureS) return std::nullopt;
  return equal + ": it is stuck, or too coarse to show drift";
}

std::optional<std::string> RecordWatch::standstill(const ColumnWatch& column) const {
  if (column.quantity() != Quantity::kTemperature) return std::nullopt;
  const Standstill& worst = standstills_.worst(column.column().slot);
  if (worst.duration_s < kLongestConstantTemperatureS || worst.moved_degc < kMovedDegc)
    return std::nullopt;
  return "stays at " + significant(worst.value_degc, 4) + " degC for " +
         significant(worst.duration_s, kDigits) + " s while another probe moves by " +
         significant(worst.moved_degc, kDigits) + " degC: is it stuck?";
}

std::vector<std::string> lines_of(const std::vector<Doubt>& doubts) {
  std::vector<std::string> lines;
  for (const Doubt& doubt : doubts)
    lines.push_back(report::one_line(doubt.record + ": " + doubt.text));
  return lines;
}

}  // namespace zerodrift::measurement
