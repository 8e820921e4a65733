// SPDX-License-Identifier: Apache-2.0
#include "common/report/table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>

#include "common/report/plain_text.h"

namespace zerodrift::report {
namespace {

Table small_table() {
  return {.caption = "Drift",
          .columns = {{"scheme", Align::kLeft}, {"N (deg/√h)"}},
          .rows = {{{"none", "0.0217"}}, {{"online-svr", "9.33e-4"}, true}},
          .footnote = "N read at 1 s."};
}

TEST(TextTable, AlignsByCharactersAndMarksTheHighlightedRow) {
  EXPECT_EQ(text_table(small_table()),
            "Drift\n"
            "  scheme      N (deg/√h)\n"
            "  ----------------------\n"
            "  none            0.0217\n"
            "* online-svr     9.33e-4\n"
            "N read at 1 s.\n");
}

TEST(TextTable, WithoutHighlightedRowsHasNoRoomForMarks) {
  EXPECT_EQ(text_table({.caption = "",
                        .columns = {{"a", Align::kLeft}, {"b", Align::kLeft}},
                        .rows = {{{"1", ""}}},
                        .footnote = ""}),
            "a  b\n"
            "----\n"
            "1\n");
}

// Law: of every table, whatever its columns, the parts hold each column once, behind the first one,
// in order, and no line is longer than the terminal unless two columns alone are.
TEST(TextTable, WhatIsWiderThanATerminalGoesOnBelow) {
  std::mt19937 random(7);
  for (int round = 0; round < 200; ++round) {
    Table table{.caption = std::string(60, 'c') + " " + std::string(40, 'd'),
                .columns = {{"row", Align::kLeft}},
                .rows = {{{"first"}, round % 2 == 0}},
                .footnote = ""};
    const std::size_t columns = 1 + random() % 14;
    for (std::size_t i = 0; i < columns; ++i) {
      table.columns.push_back({"n" + std::to_string(i) + std::string(random() % 20, 'x')});
      table.rows[0].cells.push_back("v" + std::to_string(i) + std::string(random() % 20, 'y'));
    }
    std::istringstream lines(text_table(table));
    std::string heads, cells;
    for (std::string line; std::getline(lines, line);) {
      EXPECT_LE(line.size(), kTextWidth);
      std::istringstream words(line);
      for (std::string word; words >> word;) {
        if (word[0] == 'n') heads += word + ' ';
        if (word[0] == 'v') cells += word + ' ';
      }
    }
    std::string expected_heads, expected_cells;
    for (std::size_t i = 1; i <= columns; ++i) {
      expected_heads += table.columns[i].name + ' ';
      expected_cells += table.rows[0].cells[i] + ' ';
    }
    EXPECT_EQ(heads, expected_heads);
    EXPECT_EQ(cells, expected_cells);
  }
}

TEST(TextTable, HostileCellsCantCommandTheTerminal) {
  Table table = small_table();
  table.rows[0].cells[0] = "\x1b]0;title\x07\nnone";
  const std::string text = text_table(table);
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  EXPECT_EQ(text.find('\x07'), std::string::npos);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 6);
}

TEST(TextTable, WrongNumberOfCellsIsAProgrammingError) {
  Table table = small_table();
  table.rows[1].cells.pop_back();
  EXPECT_EQ(validate(table), "table 'Drift': row 1 has 1 cells; its columns are 2");
  EXPECT_THROW(static_cast<void>(text_table(table)), std::invalid_argument);
  EXPECT_EQ(validate(Table{}), "table '' has no columns; it needs at least one");
}

}  // namespace
}  // namespace zerodrift::report
