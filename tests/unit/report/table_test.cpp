// SPDX-License-Identifier: Apache-2.0
#include "common/report/table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

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
