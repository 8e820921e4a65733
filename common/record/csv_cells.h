// SPDX-License-Identifier: Apache-2.0
// Cells of one line of text (as RFC 4180 quotes them, without line ends inside quotes), and numbers
// in them.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace zerodrift::record {

// Without blanks and tabs at either end.
[[nodiscard]] std::string_view trim(std::string_view text) noexcept;

// The text as it may stand in an error line: one line, printable, cut to 60 characters.
[[nodiscard]] std::string printable(std::string_view text);

// Names that anybody may have written, as they may go out.
[[nodiscard]] std::vector<std::string> one_line_each(const std::vector<std::string>& names);

// A whole cell as a number: decimal or exponent notation, a leading '+', "nan", "inf". Correctly
// rounded.
[[nodiscard]] std::optional<double> parse_number(std::string_view cell) noexcept;

// A cell that is written with a decimal comma, with a point in its place, for the parsers of this
// folder. One that has a point already, or is longer than any number, stays as it is and becomes no
// number. Valid until the next call.
class DecimalComma {
 public:
  [[nodiscard]] std::string_view as_point(std::string_view cell) noexcept;

 private:
  std::array<char, 64> text_{};
};

// What separates two cells of a line.
enum class Delimiter : char { kComma = ',', kSemicolon = ';', kTab = '\t', kBlanks = ' ' };

// True for what stands for "not measured": blank, "nan" or "NA".
[[nodiscard]] bool is_not_measured(std::string_view cell) noexcept;

// Walks over the cells of one line.
class CellCursor {
 public:
  CellCursor(std::string_view line, Delimiter delimiter) noexcept;

  // True after the last cell was taken.
  [[nodiscard]] bool done() const noexcept { return done_; }

  // The next cell without surrounding blanks and quotes. Valid until the next call.
  std::string_view take();

  // As take(), for a cell that should be a plain number: where it is, `value` holds it, and the
  // text isn't built.
  bool take_plain_number(double& value) noexcept;

 private:
  [[nodiscard]] bool is_padding(char c) const noexcept;
  [[nodiscard]] bool ends_cell(char c) const noexcept;
  [[nodiscard]] std::string_view without_padding(std::string_view cell) const noexcept;
  std::string_view take_quoted();
  void step_over_delimiter() noexcept;

  const char* position_;
  const char* end_;
  Delimiter delimiter_;
  bool done_ = false;
  std::string unquoted_;
};

// All cells of a line, copied.
[[nodiscard]] std::vector<std::string> split_cells(std::string_view line,
                                                   Delimiter delimiter = Delimiter::kComma);

// The cell as RFC 4180 wants it written: quoted where it holds a comma, a quote, a line end or
// outer blanks.
[[nodiscard]] std::string quoted_if_needed(std::string_view cell);

}  // namespace zerodrift::record
