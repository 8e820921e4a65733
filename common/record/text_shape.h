// SPDX-License-Identifier: Apache-2.0
// How a text file writes its rows, as its first lines show it: what separates cells and decimals,
// and whether the first line is a header.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "common/record/column_map.h"
#include "common/record/csv_cells.h"
#include "common/record/record_layout.h"

namespace zerodrift::record {

// Looked at by the functions below: the first line that is no comment, and rows behind it.
inline constexpr std::size_t kFirstLines = 21;

struct TextShape {
  Delimiter delimiter = Delimiter::kComma;
  bool has_header = true;
  bool has_decimal_comma = false;
};

// Separator and header; the decimals are not known before the columns are. Commas, where the header
// split at commas gives a meaning to the columns; else what splits header and first row into
// equally many cells. A first line of numbers alone is a row and no header, unless its numbers are
// the names that the map uses. Throws files::FileError with one line where two readings are
// possible.
[[nodiscard]] TextShape recognise_shape(const std::filesystem::path& path,
                                        const std::vector<std::string>& first_lines,
                                        const std::vector<ColumnMapping>& map);

// The names of the columns: the header's, or "1", "2", ...
[[nodiscard]] std::vector<std::string> column_names(const TextShape& shape,
                                                    const std::string& first_line);

// Whether numbers in the columns that have a meaning are written with a comma, which is possible
// where commas don't separate cells. Throws files::FileError where some have a comma and some a
// point: either could be between thousands.
[[nodiscard]] bool has_decimal_comma(const std::filesystem::path& path, const TextShape& shape,
                                     const RecordLayout& layout,
                                     const std::vector<std::string>& first_lines);

}  // namespace zerodrift::record
