// SPDX-License-Identifier: Apache-2.0
#include "common/record/text_shape.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

#include "common/files/file_error.h"
#include "common/record/decimal_time.h"

namespace zerodrift::record {
namespace {

constexpr std::array kDelimiters{Delimiter::kComma, Delimiter::kSemicolon, Delimiter::kTab,
                                 Delimiter::kBlanks};

std::string_view name_of(Delimiter delimiter) {
  switch (delimiter) {
    case Delimiter::kComma: return "','";
    case Delimiter::kSemicolon: return "';'";
    case Delimiter::kTab: return "tabs";
    case Delimiter::kBlanks: break;
  }
  return "blanks";
}

// "1,5", "-,5e3", "2.", with that mark for the decimals.
bool is_number_with(char mark, std::string_view cell) {
  std::string text{cell};
  if (std::count(text.begin(), text.end(), mark) != 1) return false;
  if (mark == ',' && text.find('.') != std::string::npos) return false;
  if (mark == ',' && text.back() == ',') return false;
  std::replace(text.begin(), text.end(), mark, '.');
  return parse_number(text).has_value();
}

bool is_measurement(std::string_view cell, Delimiter delimiter) {
  return parse_number(cell) || parse_iso8601(cell) ||
         (delimiter != Delimiter::kComma && is_number_with(',', cell));
}

// Cells that were measured or not, and at least one that was.
bool is_row_of_numbers(const std::vector<std::string>& cells, Delimiter delimiter) {
  bool any = false;
  for (const std::string& cell : cells) {
    if (is_not_measured(cell)) continue;
    if (!is_measurement(cell, delimiter)) return false;
    any = true;
  }
  return any;
}

// 0, 1, 2, ... or 1, 2, 3, ...: how programs number columns that have no name.
bool counts_up(const std::vector<std::string>& cells) {
  if (cells.front() != "0" && cells.front() != "1") return false;
  const std::size_t first = cells.front() == "0" ? 0 : 1;
  for (std::size_t i = 0; i < cells.size(); ++i)
    if (cells[i] != std::to_string(first + i)) return false;
  return true;
}

std::vector<std::string> numbers_to(std::size_t count) {
  std::vector<std::string> numbers;
  for (std::size_t i = 1; i <= count; ++i) numbers.push_back(std::to_string(i));
  return numbers;
}

class Recogniser {
 public:
  Recogniser(const std::filesystem::path& path, const std::vector<std::string>& lines,
             const std::vector<ColumnMapping>& map)
      : path_(path), lines_(lines), map_(map) {}

  [[nodiscard]] TextShape recognise() const {
    if (binds(Delimiter::kComma) && !is_unnamed(Delimiter::kComma)) return {};
    if (const auto of_numbers = unnamed()) return {*of_numbers, false, false};
    return {of_header(), true, false};
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const {
    throw files::FileError(path_.string() + ": " + why);
  }

  [[nodiscard]] std::vector<std::string> cells(Delimiter delimiter) const {
    return split_cells(lines_.front(), delimiter);
  }

  [[nodiscard]] bool binds(Delimiter delimiter) const {
    try {
      static_cast<void>(bind_columns(path_, cells(delimiter), map_));
      return true;
    } catch (const files::FileError&) {
      return false;
    }
  }

  // Header and first row fall into equally many cells, and more than one.
  [[nodiscard]] bool agrees(Delimiter delimiter) const {
    return lines_.size() > 1 && cells(delimiter).size() > 1 &&
           split_cells(lines_[1], delimiter).size() == cells(delimiter).size();
  }

  // The first line is a row: numbers alone, none of which is meant by a name of the map.
  [[nodiscard]] bool is_unnamed(Delimiter delimiter) const {
    const std::vector<std::string> row = cells(delimiter);
    if (!is_row_of_numbers(row, delimiter)) return false;
    const auto is_there = [&](const ColumnMapping& mapping) {
      return std::find(row.begin(), row.end(), mapping.column) != row.end();
    };
    if (!binds(delimiter) || std::none_of(map_.begin(), map_.end(), is_there)) return true;
    if (counts_up(row)) return false;
    refuse(
        "the first line is numbers, which may be a row or the columns' names that --columns uses; "
        "write names above it");
  }

  // What separates the cells of a first line of numbers: that which makes most of them.
  [[nodiscard]] std::optional<Delimiter> unnamed() const {
    std::optional<Delimiter> found;
    for (const Delimiter delimiter : kDelimiters) {
      if (!is_row_of_numbers(cells(delimiter), delimiter) || !is_unnamed(delimiter)) continue;
      if (!found || cells(delimiter).size() > cells(*found).size()) found = delimiter;
    }
    return found;
  }

  [[nodiscard]] Delimiter of_header() const {
    std::vector<Delimiter> possible;
    for (const Delimiter delimiter : {Delimiter::kSemicolon, Delimiter::kTab})
      if (agrees(delimiter) && binds(delimiter)) possible.push_back(delimiter);
    if (possible.empty() && agrees(Delimiter::kBlanks) && binds(Delimiter::kBlanks))
      return Delimiter::kBlanks;
    if (possible.empty()) possible = without_meaning();
    if (possible.size() > 1) refuse_ambiguous(possible);
    return possible.front();
  }

  // No columns have a meaning. What separates them is asked for the refusal's sake.
  [[nodiscard]] std::vector<Delimiter> without_meaning() const {
    std::vector<Delimiter> possible;
    for (const Delimiter delimiter : {Delimiter::kComma, Delimiter::kSemicolon, Delimiter::kTab})
      if (agrees(delimiter)) possible.push_back(delimiter);
    if (!possible.empty()) return possible;
    if (agrees(Delimiter::kBlanks)) return {Delimiter::kBlanks};
    for (const Delimiter delimiter : kDelimiters)
      if (cells(delimiter).size() > 1 && delimiter != Delimiter::kBlanks) return {delimiter};
    return {Delimiter::kComma};
  }

  [[noreturn]] void refuse_ambiguous(const std::vector<Delimiter>& possible) const {
    std::string readings;
    for (const Delimiter delimiter : possible) {
      if (!readings.empty()) readings += " and ";
      readings +=
          std::to_string(cells(delimiter).size()) + " by " + std::string{name_of(delimiter)};
    }
    refuse("the first two lines fall into equally many cells in more than one way: " + readings +
           "; put quotes around cells that hold the one that separates nothing");
  }

  const std::filesystem::path& path_;
  const std::vector<std::string>& lines_;
  const std::vector<ColumnMapping>& map_;
};

}  // namespace

TextShape recognise_shape(const std::filesystem::path& path,
                          const std::vector<std::string>& first_lines,
                          const std::vector<ColumnMapping>& map) {
  return Recogniser{path, first_lines, map}.recognise();
}

std::vector<std::string> column_names(const TextShape& shape, const std::string& first_line) {
  std::vector<std::string> cells = split_cells(first_line, shape.delimiter);
  return shape.has_header ? cells : numbers_to(cells.size());
}

bool has_decimal_comma(const std::filesystem::path& path, const TextShape& shape,
                       const RecordLayout& layout, const std::vector<std::string>& first_lines) {
  if (shape.delimiter == Delimiter::kComma) return false;
  std::string with_comma;
  std::string with_point;
  for (std::size_t i = shape.has_header ? 1 : 0; i < first_lines.size(); ++i) {
    const std::vector<std::string> cells = split_cells(first_lines[i], shape.delimiter);
    for (std::size_t k = 0; k < std::min(cells.size(), layout.columns.size()); ++k) {
      if (layout.columns[k].role == ColumnRole::kExtra) continue;
      if (is_number_with(',', cells[k])) with_comma = cells[k];
      if (is_number_with('.', cells[k])) with_point = cells[k];
    }
  }
  if (!with_comma.empty() && !with_point.empty()) {
    throw files::FileError(path.string() + ": found '" + printable(with_comma) + "' and '" +
                           printable(with_point) +
                           "', expected decimals with a comma or with a point, not with both");
  }
  return !with_comma.empty();
}

}  // namespace zerodrift::record
