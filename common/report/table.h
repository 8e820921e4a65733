// SPDX-License-Identifier: Apache-2.0
// A table of a report, printed on the terminal or set into a page (html_document.h). Numbers come
// formatted (numbers.h).
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace zerodrift::report {

enum class Align { kLeft, kRight };

struct Column {
  std::string name;
  Align align = Align::kRight;
};

struct Row {
  std::vector<std::string> cells;  // one for each column; the first names the row
  bool highlighted = false;
};

struct Table {
  std::string caption;
  std::vector<Column> columns;
  std::vector<Row> rows;
  std::string footnote;  // none if empty
};

[[nodiscard]] std::optional<std::string> validate(const Table& table);

// Caption, header, rule and rows in aligned columns; a highlighted row begins with '*'; the
// footnote below. What goes beyond kTextWidth follows in a part of its own, with the columns that
// name the rows (the first, and left ones behind it) again. Ends with a line end. Throws
// std::invalid_argument where validate() objects.
[[nodiscard]] std::string text_table(const Table& table);

}  // namespace zerodrift::report
