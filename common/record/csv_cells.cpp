// SPDX-License-Identifier: Apache-2.0
#include "common/record/csv_cells.h"

#include <algorithm>
#include <charconv>
#include <system_error>

#include "common/core/one_line.h"

namespace zerodrift::record {
namespace {

constexpr bool is_blank(char c) noexcept {
  return c == ' ' || c == '\t';
}

}  // namespace

std::string_view trim(std::string_view text) noexcept {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string printable(std::string_view text) {
  constexpr std::size_t kLongest = 60;
  return core::one_line(text, kLongest) + (text.size() > kLongest ? "..." : "");
}

std::vector<std::string> one_line_each(const std::vector<std::string>& names) {
  std::vector<std::string> lines;
  for (const std::string& name : names) lines.push_back(core::one_line(name));
  return lines;
}

std::optional<double> parse_number(std::string_view cell) noexcept {
  if (cell.starts_with('+') && !cell.starts_with("+-")) cell.remove_prefix(1);
  double value = 0.0;
  const char* end = cell.data() + cell.size();
  const auto [stop, error] = std::from_chars(cell.data(), end, value);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return value;
}

bool is_not_measured(std::string_view cell) noexcept {
  return cell.empty() || cell == "nan" || cell == "NaN" || cell == "NAN" || cell == "NA";
}

std::string_view DecimalComma::as_point(std::string_view cell) noexcept {
  if (cell.size() > text_.size() || cell.find('.') != std::string_view::npos) return "no number";
  std::replace_copy(cell.begin(), cell.end(), text_.begin(), ',', '.');
  return {text_.data(), cell.size()};
}

// Blanks in front of the first cell and behind the last one separate nothing.
CellCursor::CellCursor(std::string_view line, Delimiter delimiter) noexcept
    : delimiter_(delimiter) {
  if (delimiter == Delimiter::kBlanks) line = trim(line);
  position_ = line.data();
  end_ = line.data() + line.size();
}

bool CellCursor::is_padding(char c) const noexcept {
  return c == ' ' || (c == '\t' && delimiter_ != Delimiter::kTab);
}

bool CellCursor::ends_cell(char c) const noexcept {
  return delimiter_ == Delimiter::kBlanks ? is_blank(c) : c == static_cast<char>(delimiter_);
}

std::string_view CellCursor::without_padding(std::string_view cell) const noexcept {
  while (!cell.empty() && is_padding(cell.front())) cell.remove_prefix(1);
  while (!cell.empty() && is_padding(cell.back())) cell.remove_suffix(1);
  return cell;
}

std::string_view CellCursor::take() {
  while (position_ != end_ && is_padding(*position_)) ++position_;
  if (position_ != end_ && *position_ == '"') return take_quoted();
  const char* begin = position_;
  position_ = std::find_if(position_, end_, [this](char c) { return ends_cell(c); });
  const std::string_view cell =
      without_padding({begin, static_cast<std::size_t>(position_ - begin)});
  step_over_delimiter();
  return cell;
}

// A cell whose quote never closes, or with text behind the closing one, stays as it is written, for
// the caller to refuse.
std::string_view CellCursor::take_quoted() {
  const char* begin = position_;
  unquoted_.clear();
  ++position_;
  bool is_closed = false;
  while (position_ != end_ && !is_closed) {
    const char c = *position_++;
    if (c != '"') {
      unquoted_ += c;
    } else if (position_ != end_ && *position_ == '"') {
      unquoted_ += *position_++;
    } else {
      is_closed = true;
    }
  }
  const char* behind = position_;
  position_ = std::find_if(position_, end_, [this](char c) { return ends_cell(c); });
  const bool is_whole =
      is_closed && std::all_of(behind, position_, [this](char c) { return is_padding(c); });
  const std::string_view written =
      without_padding({begin, static_cast<std::size_t>(position_ - begin)});
  step_over_delimiter();
  return is_whole ? trim(unquoted_) : written;
}

bool CellCursor::take_plain_number(double& value) noexcept {
  double parsed = 0.0;
  const auto [stop, error] = std::from_chars(position_, end_, parsed);
  if (error != std::errc{} || (stop != end_ && *stop != static_cast<char>(delimiter_)))
    return false;
  value = parsed;
  position_ = stop;
  step_over_delimiter();
  return true;
}

void CellCursor::step_over_delimiter() noexcept {
  if (position_ == end_) {
    done_ = true;
    return;
  }
  ++position_;
  if (delimiter_ != Delimiter::kBlanks) return;
  while (position_ != end_ && is_blank(*position_)) ++position_;
}

std::vector<std::string> split_cells(std::string_view line, Delimiter delimiter) {
  std::vector<std::string> cells;
  CellCursor cursor{line, delimiter};
  while (!cursor.done()) cells.emplace_back(cursor.take());
  return cells;
}

std::string quoted_if_needed(std::string_view cell) {
  if (cell.find_first_of(",\"\r\n") == std::string_view::npos && trim(cell).size() == cell.size()) {
    return std::string{cell};
  }
  std::string quoted = "\"";
  for (const char c : cell) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted += '"';
}

}  // namespace zerodrift::record
