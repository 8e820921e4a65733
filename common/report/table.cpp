// SPDX-License-Identifier: Apache-2.0
#include "common/report/table.h"

#include <algorithm>
#include <cstddef>
#include <stdexcept>

#include "common/report/plain_text.h"

namespace zerodrift::report {
namespace {

constexpr std::string_view kGap = "  ";

using Cells = std::vector<std::string>;

Cells clean(const Cells& cells) {
  Cells lines;
  for (const std::string& cell : cells) lines.push_back(one_line(cell));
  return lines;
}

void widen(std::vector<std::size_t>& widths, const Cells& cells) {
  for (std::size_t i = 0; i < cells.size(); ++i) {
    widths[i] = std::max(widths[i], character_count(cells[i]));
  }
}

// One line without blanks at its end.
std::string line(std::string_view lead, const Cells& cells, const std::vector<Column>& columns,
                 const std::vector<std::size_t>& widths) {
  std::string text{lead};
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (i > 0) text += kGap;
    const std::string padding(widths[i] - character_count(cells[i]), ' ');
    text += columns[i].align == Align::kRight ? padding + cells[i] : cells[i] + padding;
  }
  text.erase(text.find_last_not_of(' ') + 1);
  return text + '\n';
}

// Width of the columns from `begin` to `end` beside each other.
std::size_t total(const std::vector<std::size_t>& widths, std::size_t begin, std::size_t end) {
  std::size_t sum = 0;
  for (std::size_t i = begin; i < end; ++i) sum += widths[i] + (i > begin ? kGap.size() : 0);
  return sum;
}

// Columns that name a row: the first one, and what is set left behind it where that takes no more
// than half a line.
std::size_t naming_columns(const std::vector<Column>& columns,
                           const std::vector<std::size_t>& widths) {
  std::size_t count = 1;
  while (count + 1 < columns.size() && columns[count].align == Align::kLeft &&
         total(widths, 0, count + 1) <= kTextWidth / 2)
    ++count;
  return count;
}

// The first `naming` ones and those from `begin` to `end`.
template <typename Item>
std::vector<Item> part_of(const std::vector<Item>& all, std::size_t naming, std::size_t begin,
                          std::size_t end) {
  const auto at = [&](std::size_t i) { return all.begin() + static_cast<std::ptrdiff_t>(i); };
  std::vector<Item> part(at(0), at(naming));
  part.insert(part.end(), at(begin), at(end));
  return part;
}

// Behind the last of the columns from `begin` that fit into the room; at least one does.
std::size_t end_of_part(const std::vector<std::size_t>& widths, std::size_t begin,
                        std::size_t room) {
  std::size_t end = begin + 1;
  while (end < widths.size() && total(widths, begin, end + 1) <= room) ++end;
  return std::min(end, widths.size());
}

}  // namespace

std::optional<std::string> validate(const Table& table) {
  const std::string name = "table '" + one_line(table.caption) + "'";
  if (table.columns.empty()) return name + " has no columns; it needs at least one";
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    if (table.rows[i].cells.size() == table.columns.size()) continue;
    return name + ": row " + std::to_string(i) + " has " +
           std::to_string(table.rows[i].cells.size()) + " cells; its columns are " +
           std::to_string(table.columns.size());
  }
  return std::nullopt;
}

std::string text_table(const Table& table) {
  if (const auto wrong = validate(table)) throw std::invalid_argument(*wrong);
  Cells header;
  for (const Column& column : table.columns) header.push_back(one_line(column.name));
  std::vector<std::size_t> widths(table.columns.size(), 0);
  widen(widths, header);
  std::vector<Cells> rows;
  for (const Row& row : table.rows) widen(widths, rows.emplace_back(clean(row.cells)));

  const bool marks = std::any_of(table.rows.begin(), table.rows.end(),
                                 [](const Row& row) { return row.highlighted; });
  const std::string_view plain = marks ? "  " : "";
  std::string text;
  if (!table.caption.empty()) text += wrapped(one_line(table.caption), kTextWidth) + '\n';
  const std::size_t naming = naming_columns(table.columns, widths);
  const std::size_t taken = plain.size() + total(widths, 0, naming) + kGap.size();
  const std::size_t room = kTextWidth - std::min(kTextWidth, taken);
  std::size_t begin = naming;
  do {
    const std::size_t end = end_of_part(widths, begin, room);
    if (begin > naming) text += '\n';
    const auto columns = part_of(table.columns, naming, begin, end);
    const auto part_widths = part_of(widths, naming, begin, end);
    text += line(plain, part_of(header, naming, begin, end), columns, part_widths);
    text.append(plain).append(total(part_widths, 0, part_widths.size()), '-').append("\n");
    for (std::size_t i = 0; i < rows.size(); ++i) {
      text += line(table.rows[i].highlighted ? "* " : plain, part_of(rows[i], naming, begin, end),
                   columns, part_widths);
    }
    begin = end;
  } while (begin < widths.size());
  if (!table.footnote.empty()) text += wrapped(one_line(table.footnote), kTextWidth) + '\n';
  return text;
}

}  // namespace zerodrift::report
