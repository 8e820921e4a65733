// SPDX-License-Identifier: Apache-2.0
#include "common/record/record_reader.h"

#include <algorithm>
#include <cmath>

#include "common/core/integer_time.h"
#include "common/core/median.h"
#include "common/files/file_error.h"
#include "common/record/bag_files.h"
#include "common/record/column_guess.h"
#include "common/record/csv_cells.h"
#include "common/record/decimal_time.h"
#include "common/record/mcap_rows.h"

namespace zerodrift::record {
namespace {

constexpr std::uint64_t kRowsForPeriod = 101;

bool measures_rate(const RecordRow& row) {
  return row.has_rate && std::any_of(row.rate_radps.begin(), row.rate_radps.end(), core::is_rate);
}

// -0.0 + 0.0 is +0.0: an offset of zero is left out so that a value in its default unit keeps its
// bits.
double convert(double cell, const UnitConversion& conversion) {
  const double scaled = cell * conversion.scale;
  return conversion.offset == 0.0 ? scaled : scaled + conversion.offset;
}

}  // namespace

double& value_of(RecordRow& row, const BoundColumn& column) {
  const std::size_t axis = core::index(column.channel.axis);
  switch (column.channel.quantity) {
    case Quantity::kRate: return row.rate_radps[axis];
    case Quantity::kReference: return row.reference_radps[axis];
    case Quantity::kMagnetic: return row.inputs.magnetic_ut[axis];
    case Quantity::kAcceleration: return row.inputs.acceleration_mps2[axis];
    case Quantity::kVibration: return row.inputs.vibration_g;
    case Quantity::kSourceCurrent: return row.inputs.source_current_ma;
    case Quantity::kSupply: return row.inputs.supply_v;
    case Quantity::kTemperature:
    case Quantity::kTime: break;
  }
  return row.temperature_degc[column.slot];
}

RecordOptions RecordInput::options() const {
  return {.columns = parse_column_map(columns),
          .gyro_id = gyro_id,
          .topics = topics,
          .rates = Rates::kRequired};
}

RecordInput RecordInput::beside(const std::string& other) const {
  RecordInput input = *this;
  input.file = other;
  return input;
}

RecordReader::RecordReader(const std::filesystem::path& path, RecordOptions options)
    : RecordReader(path, std::move(options), PeriodEstimate::kMake) {}

RecordReader::RecordReader(const std::filesystem::path& path, RecordOptions options,
                           PeriodEstimate estimate)
    : options_(std::move(options)) {
  if (is_mcap_record(path) || path.extension() == ".mcap") {
    mcap_ = std::make_unique<McapRows>(path, options_);
    info_ = mcap_->info();
    warnings_ = info_.warnings;
    return;
  }
  refuse_other_bags(path);
  if (options_.topics.any())
    throw files::FileError(path.string() +
                           ": is no bag of ROS 2, of which --topic and "
                           "--temperature-topic choose");
  info_.path = path;
  take_shape(first_lines());
  describe_layout();
  row_.temperature_degc.assign(layout_.probes.size(), kNotMeasured);
  row_.extra.resize(layout_.extra.size());
  if (estimate == PeriodEstimate::kMake) estimate_period();
  warnings_ = info_.warnings;
}

RecordReader::~RecordReader() = default;
RecordReader::RecordReader(RecordReader&&) noexcept = default;
RecordReader& RecordReader::operator=(RecordReader&&) noexcept = default;

// Leaves `lines_` before the first of them, the one that may be a header.
std::vector<std::string> RecordReader::first_lines() {
  LineReader ahead{info_.path};
  std::vector<std::string> found;
  std::size_t before_first = 0;
  std::string_view line;
  while (found.size() < kFirstLines && ahead.next(line)) {
    const std::string_view text = trim(line);
    if (text.empty()) continue;
    if (found.empty() && text.starts_with('#')) {
      note_metadata(text);
      continue;
    }
    if (found.empty()) before_first = ahead.line_number() - 1;
    found.emplace_back(line);
  }
  if (found.empty()) {
    throw files::FileError(info_.path.string() +
                           ": is empty; expected a header line with the columns' names");
  }
  lines_.emplace(info_.path);
  while (lines_->line_number() < before_first) lines_->next(line);
  return found;
}

void RecordReader::take_shape(const std::vector<std::string>& first_lines) {
  shape_ = recognise_shape(info_.path, first_lines, options_.columns);
  info_.columns = column_names(shape_, first_lines.front());
  layout_ = layout_or_guess(first_lines);
  shape_.has_decimal_comma = has_decimal_comma(info_.path, shape_, layout_, first_lines);
  std::string_view header;
  if (shape_.has_header) lines_->next(header);
}

// A record whose columns have no meaning is refused with what they probably mean.
RecordLayout RecordReader::layout_or_guess(const std::vector<std::string>& first_lines) {
  guess_ = guessed_meaning(first_lines);
  try {
    return bind_columns(info_.path, info_.columns, options_.columns, options_.rates);
  } catch (const files::FileError& error) {
    throw files::FileError(error.what() + guess_ + hint_of_other_lines(first_lines));
  }
}

// Lines of a report above the header have other numbers of cells than what follows.
std::string RecordReader::hint_of_other_lines(const std::vector<std::string>& first_lines) const {
  if (first_lines.size() < 2) return "";
  const std::size_t cells = split_cells(first_lines[1], shape_.delimiter).size();
  if (cells < 2 || cells == info_.columns.size()) return "";
  return "; lines above the header begin with '#'";
}

// "; a guess, not used: --columns '...'", or nothing where --columns says what to take.
std::string RecordReader::guessed_meaning(const std::vector<std::string>& first_lines) const {
  if (!options_.columns.empty()) return "";
  if (!shape_.has_header) {
    return "; the first line is numbers, so columns go by number, as --columns "
           "'time=1[s],rate_x=2[deg/s]'";
  }
  const std::string guess = guessed_columns(
      info_.columns, first_lines.size() > 1 ? split_cells(first_lines[1], shape_.delimiter)
                                            : std::vector<std::string>{});
  return guess.empty() ? "" : "; a guess, not used: " + guess;
}

void RecordReader::note_metadata(std::string_view comment) {
  comment = trim(comment.substr(1));
  const std::size_t colon = comment.find(':');
  if (colon == std::string_view::npos) return;
  info_.metadata.emplace_back(trim(comment.substr(0, colon)), trim(comment.substr(colon + 1)));
}

void RecordReader::describe_layout() {
  // From here on they go out, to terminals too; a column is chosen by its name as it stands.
  info_.columns = one_line_each(info_.columns);
  info_.probes = one_line_each(layout_.probes);
  info_.extra_columns = one_line_each(layout_.extra);
  for (const BoundColumn& column : layout_.columns) {
    if (column.role != ColumnRole::kValue) continue;
    const std::size_t axis = core::index(column.channel.axis);
    switch (column.channel.quantity) {
      case Quantity::kRate: info_.has_rate[axis] = true; break;
      case Quantity::kReference: info_.has_reference[axis] = true; break;
      case Quantity::kTemperature: break;
      default: break;
    }
    for (std::size_t i = 0; i < core::kEnvironmentChannels; ++i) {
      if (column.channel == environment_channel(i)) info_.environment |= 1U << i;
    }
  }
  std::string names;
  for (std::size_t slot = 0; slot < layout_.extra.size(); ++slot) {
    if (layout_.extra[slot] == kSequenceColumn) {
      sequence_slot_ = slot;
    } else {
      (names += names.empty() ? "" : ", ") += printable(layout_.extra[slot]);
    }
  }
  if (names.empty()) return;
  info_.warnings.push_back(info_.path.string() +
                           ": columns without a known meaning, kept and not used: " + names +
                           (info_.has_rate == core::PerAxis<bool>{} ? guess_ : ""));
}

// Through a second reader, so that this one stays before its first row. Rows that measure no rate
// tell it only where no others are there.
void RecordReader::estimate_period() {
  RecordReader ahead{info_.path, options_, PeriodEstimate::kSkip};
  std::vector<double> of_rates_s;
  std::vector<double> of_rows_s;
  std::optional<core::SensorTime> previous;
  std::optional<core::SensorTime> previous_rate;
  for (std::uint64_t i = 0; i < kRowsForPeriod; ++i) {
    const RecordRow* row = ahead.next();
    if (row == nullptr) break;
    if (!previous) info_.first_time = row->time;
    if (previous && row->time > *previous)
      of_rows_s.push_back(core::seconds(row->time - *previous));
    previous = row->time;
    if (!measures_rate(*row)) continue;
    if (previous_rate && row->time > *previous_rate)
      of_rates_s.push_back(core::seconds(row->time - *previous_rate));
    previous_rate = row->time;
  }
  if (!previous) {
    throw files::FileError(info_.path.string() +
                           ": has a header but no row; expected at least one row of " +
                           std::to_string(info_.columns.size()) + " cells");
  }
  info_.sample_period_s = core::median_of(of_rates_s.empty() ? of_rows_s : of_rates_s);
  info_.first_interval_s = info_.sample_period_s;
  rate_interval_ = core::SampleInterval(info_.sample_period_s);
}

bool RecordReader::next_data_line(std::string_view& line) {
  while (lines_->next(line)) {
    if (!trim(line).empty()) return true;
  }
  return false;
}

const RecordRow* RecordReader::next() {
  return mcap_ ? next_of_mcap() : next_of_csv();
}

const RecordRow* RecordReader::next_of_mcap() {
  const RecordRow* row = mcap_->next();
  rows_out_of_order_ = mcap_->rows_out_of_order();
  for (auto& line : mcap_->take_warnings()) warnings_.push_back(std::move(line));
  return row;
}

const RecordRow* RecordReader::next_of_csv() {
  std::string_view line;
  if (!next_data_line(line)) return nullptr;
  const bool complete = lines_->line_was_ended();
  try {
    decode(line);
  } catch (const files::FileError& error) {
    if (complete) throw;
    warnings_.push_back(std::string{error.what()} +
                        "; the file ends within this row, which is left out");
    return nullptr;
  }
  if (!complete) {
    warnings_.push_back(info_.path.string() + ":" + std::to_string(lines_->line_number()) +
                        ": the last row has no line end; taken as whole");
  }
  previous_time_ = row_.time;
  ++rows_read_;
  if (measures_rate(row_)) previous_rate_time_ = row_.time;
  return &row_;
}

void RecordReader::decode(std::string_view line) {
  row_.index = rows_read_;
  if (layout_.time_is_row_number) {
    const auto time = scaled_time(static_cast<double>(rows_read_));
    if (!time) refuse_time("row " + std::to_string(rows_read_), nullptr);
    row_.time = *time;
  }
  decode_cells(line);
  check_order_and_set_interval();
  number_rate();
}

// Where a record's rates were numbered, rows of other measurements lie between them. Where they
// weren't, a row without any is a rate that was not measured, and no part of the next one's time.
void RecordReader::number_rate() {
  if (row_.has_rate && rows_read_ > 0) ++row_.rate;
  row_.has_rate = !sequence_slot_ || !row_.extra[*sequence_slot_].empty();
  if (!row_.has_rate) return;
  row_.rate_interval_s = info_.sample_period_s;
  if (!measures_rate(row_) || !previous_rate_time_ || row_.time <= *previous_rate_time_) return;
  row_.rate_interval_s = rate_interval_.after(core::seconds(row_.time - *previous_rate_time_));
}

void RecordReader::decode_cells(std::string_view line) {
  CellCursor cursor{line, shape_.delimiter};
  for (const BoundColumn& column : layout_.columns) {
    if (cursor.done()) break;
    switch (column.role) {
      case ColumnRole::kTime: row_.time = decode_time(cursor.take(), column); break;
      case ColumnRole::kValue: decode_value(cursor, column); break;
      case ColumnRole::kExtra: row_.extra[column.slot] = cursor.take(); break;
    }
    if (cursor.done() && &column == &layout_.columns.back()) return;
  }
  const std::size_t found = split_cells(line, shape_.delimiter).size();
  const bool doubled =
      shape_.delimiter == Delimiter::kComma && found == 2 * layout_.columns.size() && found > 2;
  refuse_row(nullptr, "found " + std::to_string(found) + " cells, the header has " +
                          std::to_string(layout_.columns.size()) +
                          (doubled ? "; cells with decimal commas have to be separated by "
                                     "semicolons or tabs"
                                   : ""));
}

void RecordReader::decode_value(CellCursor& cursor, const BoundColumn& column) {
  double& slot = value_of(row_, column);
  double value = kNotMeasured;
  if (shape_.has_decimal_comma || !cursor.take_plain_number(value)) {
    const std::string_view cell = cursor.take();
    const std::optional<double> number =
        is_not_measured(cell) ? kNotMeasured : parse_number(as_point(cell));
    if (!number)
      refuse_row(&column, "found '" + printable(cell) + "', expected a number" +
                              (shape_.has_decimal_comma ? " with a decimal comma" : "") +
                              " (blank = not measured)");
    value = *number;
  }
  slot = convert(value, column.conversion);
}

std::string_view RecordReader::as_point(std::string_view cell) {
  return shape_.has_decimal_comma ? decimal_comma_.as_point(cell) : cell;
}

core::SensorTime RecordReader::decode_time(std::string_view cell, const BoundColumn& column) {
  if (const auto time = exact_time(cell)) {
    if (core::is_usable(*time)) return *time;
    refuse_time(printable(cell), &column);
  }
  const std::optional<double> number =
      layout_.time.is_date ? std::nullopt : parse_number(as_point(cell));
  if (!number || !std::isfinite(*number)) {
    refuse_row(&column, "found '" + printable(cell) + "', expected a " +
                            (layout_.time.is_date ? "date as 2024-05-01T12:00:00.5Z" : "time") +
                            ": every row needs one" +
                            (parse_iso8601(cell)
                                 ? "; a date has the unit iso8601" + (rows_read_ == 0 ? guess_ : "")
                                 : ""));
  }
  const auto time = scaled_time(*number);
  if (!time) refuse_time(printable(cell), &column);
  return *time;
}

// Without a double in between.
std::optional<core::SensorTime> RecordReader::exact_time(std::string_view cell) {
  if (layout_.time.is_date) return parse_iso8601(cell);
  if (layout_.time.factor != 1.0) return std::nullopt;
  return parse_decimal_time(as_point(cell), layout_.time.nanosecond_exponent);
}

// Nullopt beyond the usable times.
std::optional<core::SensorTime> RecordReader::scaled_time(double count) const {
  const double time_s = count * layout_.time.factor * layout_.time.unit_s;
  if (!(std::abs(time_s) <= core::seconds(core::kLatestUsableTime))) return std::nullopt;
  const core::SensorTime time = core::from_seconds(time_s);
  return core::is_usable(time) ? std::optional(time) : std::nullopt;
}

void RecordReader::check_order_and_set_interval() {
  row_.interval_s = info_.sample_period_s;
  if (!previous_time_) return;
  if (row_.time > *previous_time_) {
    row_.interval_s = core::seconds(row_.time - *previous_time_);
    return;
  }
  if (options_.time_order == TimeOrder::kStrictlyIncreasing) {
    refuse_row(nullptr, "time " + print_seconds(row_.time) + " s is not after the row before (" +
                            print_seconds(*previous_time_) +
                            " s); a record's time strictly increases: " +
                            (row_.time < *previous_time_
                                 ? "sort its rows by time, or split it where its clock or counter "
                                   "began anew"
                                 : "put what has one time into one row, or number the rows where "
                                   "stamps are too coarse (--columns 'time=row*<seconds>')"));
  }
  ++rows_out_of_order_;
}

void RecordReader::refuse_time(const std::string& found, const BoundColumn* column) const {
  refuse_row(column, "found '" + found + "', " +
                         (layout_.time.is_date
                              ? "expected a date from 1896-12-07 to 2043-01-25"
                              : "expected a time within ±2305843009 s (73 years): seconds from the "
                                "record's start, or since 1970; is the unit right?"));
}

void RecordReader::refuse_row(const BoundColumn* column, const std::string& why) const {
  std::string line = info_.path.string() + ":" + std::to_string(lines_->line_number()) + ": ";
  if (column != nullptr) line += "column '" + printable(column->header) + "': ";
  throw files::FileError(line + why);
}

RecordInfo inspect(const std::filesystem::path& path, const RecordOptions& options) {
  return RecordReader{path, options}.info();
}

}  // namespace zerodrift::record
