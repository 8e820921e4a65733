// SPDX-License-Identifier: Apache-2.0
// Input: the column map up to a line end, then the header of a record.
#include "common/record/column_map.h"

#include <cmath>
#include <string_view>

#include "common/files/file_error.h"
#include "common/record/csv_cells.h"
#include "common/record/record_layout.h"
#include "tests/fuzz/expectations.h"

namespace zerodrift::fuzz {
namespace {

void check(const record::ColumnMapping& mapping) {
  demand(record::unit_conversion(mapping.channel.quantity, mapping.unit).has_value(),
         "a mapping's unit is one of its quantity");
  demand(std::isfinite(mapping.factor) && mapping.factor != 0.0,
         "a mapping's factor is a number other than 0");
  demand(!mapping.column.empty(), "a mapping names a column");
  demand(!record::name(mapping.channel).empty(), "a channel has a name");
}

void check(const record::RecordLayout& layout, const std::vector<std::string>& header) {
  demand(layout.columns.size() == header.size(), "each column of the header has a meaning");
  for (const record::BoundColumn& column : layout.columns) {
    const bool is_probe = column.role == record::ColumnRole::kValue &&
                          column.channel.quantity == record::Quantity::kTemperature;
    demand(!is_probe || column.slot < layout.probes.size(), "a temperature has a probe");
    demand(column.role != record::ColumnRole::kExtra || column.slot < layout.extra.size(),
           "an extra column has a place");
  }
}

}  // namespace

void column_map(Bytes input) {
  std::string_view text = as_text(input);
  try {
    const auto map = record::parse_column_map(take_line(text));
    for (const auto& mapping : map) check(mapping);
    const auto header = record::split_cells(take_line(text));
    check(record::bind_columns("record.csv", header, map), header);
  } catch (const files::FileError& error) {
    demand_one_line(error.what());
  }
}

}  // namespace zerodrift::fuzz
