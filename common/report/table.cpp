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

std::size_t total(const std::vector<std::size_t>& widths) {
  std::size_t sum = kGap.size() * (widths.size() - 1);
  for (const std::size_t width : widths) sum += width;
  return sum;
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
  for (const Row& row : table.rows) widen(widths, clean(row.cells));

  const bool marks = std::any_of(table.rows.begin(), table.rows.end(),
                                 [](const Row& row) { return row.highlighted; });
  const std::string_view plain = marks ? "  " : "";
  std::string text;
  if (!table.caption.empty()) text += one_line(table.caption) + '\n';
  text += line(plain, header, table.columns, widths);
  text.append(plain).append(total(widths), '-').append("\n");
  for (const Row& row : table.rows) {
    text += line(row.highlighted ? "* " : plain, clean(row.cells), table.columns, widths);
  }
  if (!table.footnote.empty()) text += one_line(table.footnote) + '\n';
  return text;
}

}  // namespace zerodrift::report
