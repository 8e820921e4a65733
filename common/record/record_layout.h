// SPDX-License-Identifier: Apache-2.0
// What each column of one file means: the header's names and the --columns map, resolved once
// before the first row.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/record/column_map.h"

namespace zerodrift::record {

enum class ColumnRole : std::uint8_t { kTime, kValue, kExtra };

// How a time cell becomes nanoseconds.
struct TimeConversion {
  double factor = 1.0;          // other than 1: time = cell * factor * unit, through a double
  double unit_s = 1.0;          // the unit in seconds
  int nanosecond_exponent = 9;  // the unit is 10^this ns; with factor 1 the conversion is exact
  bool is_date = false;         // the cells are dates (parse_iso8601()), and no factor applies
};

struct BoundColumn {
  std::string header;  // the name in the file
  ColumnRole role = ColumnRole::kExtra;
  Channel channel;            // kTime, kValue
  UnitConversion conversion;  // kValue
  std::size_t slot = 0;       // temperature: index of the probe; kExtra: among the extra columns
};

struct RecordLayout {
  std::vector<BoundColumn> columns;  // in the file's order
  TimeConversion time;
  bool time_is_row_number = false;  // from 0, times time.factor: no column is the time
  std::vector<std::string> probes;  // in the file's order
  std::vector<std::string> extra;   // names of the columns without a known meaning
};

// Whether a record without a column of an angular rate is one.
enum class Rates : std::uint8_t { kOptional, kRequired };

// A mapped column has the meaning the map gives it; any other that is named <channel>_<unit> has
// that meaning unless the map gave the channel to another column; the rest are extra. Throws
// files::FileError where a mapped column is missing or there twice, a known quantity has an unknown
// unit, two columns are one channel, or there is no time, or no rate where one is required.
[[nodiscard]] RecordLayout bind_columns(const std::filesystem::path& path,
                                        const std::vector<std::string>& header,
                                        const std::vector<ColumnMapping>& map,
                                        Rates rates = Rates::kOptional);

}  // namespace zerodrift::record
