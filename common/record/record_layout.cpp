// SPDX-License-Identifier: Apache-2.0
#include "common/record/record_layout.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "common/files/file_error.h"
#include "common/record/csv_cells.h"

namespace zerodrift::record {
namespace {

constexpr std::string_view kRowNumber = "row";

std::string list_of(const std::vector<std::string>& names) {
  constexpr std::size_t kMostShown = 40;
  std::string list;
  for (std::size_t i = 0; i < std::min(names.size(), kMostShown); ++i) {
    if (i > 0) list += ", ";
    list += printable(names[i]);
  }
  if (names.size() > kMostShown) list += ", ... (" + std::to_string(names.size()) + " in all)";
  return list;
}

class Binder {
 public:
  Binder(const std::filesystem::path& path, const std::vector<std::string>& header)
      : path_(path), header_(header) {
    for (const std::string& column : header)
      layout_.columns.push_back({column, ColumnRole::kExtra, {}, {}, 0});
  }

  RecordLayout bind(const std::vector<ColumnMapping>& map, Rates rates) {
    for (const ColumnMapping& mapping : map) bind_mapped(mapping);
    bind_canonical();
    refuse_unknown_units();
    if (!has_time_) {
      refuse(
          "no column is the time (time_s); name one by --columns 'time=<column>[s]' or "
          "'time=row*<seconds>'; " +
          columns_there());
    }
    if (rates == Rates::kRequired && !has_rate()) {
      refuse(
          "no column is an angular rate (rate_x_deg_h); name one by --columns "
          "'rate_x=<column>[deg/s]'; " +
          columns_there());
    }
    number_slots();
    return std::move(layout_);
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const {
    throw files::FileError(path_.string() + ": " + why);
  }

  [[nodiscard]] std::string columns_there() const { return "the columns are: " + list_of(header_); }

  [[nodiscard]] bool has_rate() const {
    return std::any_of(layout_.columns.begin(), layout_.columns.end(), [](const auto& column) {
      return column.role == ColumnRole::kValue && column.channel.quantity == Quantity::kRate;
    });
  }

  [[nodiscard]] bool is_given(const Channel& channel) const {
    return channel.quantity == Quantity::kTime ? has_time_ : given_.contains(name(channel));
  }

  void bind_mapped(const ColumnMapping& mapping) {
    const auto found = std::find(header_.begin(), header_.end(), mapping.column);
    if (found == header_.end()) {
      if (mapping.channel.quantity == Quantity::kTime && mapping.column == kRowNumber) {
        layout_.time_is_row_number = true;
        set_time_unit(mapping.unit, mapping.factor);
        return;
      }
      refuse("no column '" + printable(mapping.column) + "', which --columns names for " +
             name(mapping.channel) + "; " + columns_there());
    }
    if (std::find(found + 1, header_.end(), mapping.column) != header_.end()) {
      refuse("column '" + printable(mapping.column) + "', which --columns names, is there twice; " +
             columns_there());
    }
    BoundColumn& column = layout_.columns[static_cast<std::size_t>(found - header_.begin())];
    if (column.role != ColumnRole::kExtra) {
      refuse("--columns maps column '" + printable(mapping.column) + "' to both " +
             name(column.channel) + " and " + name(mapping.channel) + "; a column has one meaning");
    }
    give_meaning(column, mapping.channel, mapping.unit, mapping.factor);
  }

  void bind_canonical() {
    std::map<std::string, const BoundColumn*> found_here;  // by channel
    for (BoundColumn& column : layout_.columns) {
      if (column.role != ColumnRole::kExtra) continue;
      const std::optional<CanonicalName> parsed = parse_canonical_name(column.header);
      if (!parsed || !unit_conversion(parsed->channel.quantity, parsed->unit)) continue;
      const auto rival = found_here.find(name(parsed->channel));
      if (rival != found_here.end()) {
        refuse("columns '" + rival->second->header + "' and '" + column.header + "' are both " +
               name(parsed->channel) + "; keep one, or choose by --columns");
      }
      if (is_given(parsed->channel)) continue;  // by the map
      give_meaning(column, parsed->channel, parsed->unit, 1.0);
      found_here.emplace(name(parsed->channel), &column);
    }
  }

  // Only where the channel is given by no other column: "time_of_day" beside "time_s" harms nobody.
  void refuse_unknown_units() const {
    for (const BoundColumn& column : layout_.columns) {
      if (column.role != ColumnRole::kExtra) continue;
      const std::optional<CanonicalName> parsed = parse_canonical_name(column.header);
      if (!parsed || is_given(parsed->channel)) continue;
      refuse("column '" + printable(column.header) + "': unknown unit '" + printable(parsed->unit) +
             "' of " + name(parsed->channel) +
             "; accepted: " + accepted_units(parsed->channel.quantity) +
             " (in a column's name '_' stands for '/'); or map it by --columns '" +
             name(parsed->channel) + "=" + printable(column.header) + "[<unit>]'");
    }
  }

  void give_meaning(BoundColumn& column, const Channel& channel, const std::string& unit,
                    double factor) {
    column.channel = channel;
    given_.insert(name(channel));
    if (channel.quantity == Quantity::kTime) {
      column.role = ColumnRole::kTime;
      set_time_unit(unit, factor);
      return;
    }
    column.role = ColumnRole::kValue;
    column.conversion = *unit_conversion(channel.quantity, unit);
    column.conversion.scale *= factor;
  }

  void set_time_unit(const std::string& unit, double factor) {
    layout_.time.factor = factor;
    layout_.time.is_date = unit == kIso8601;
    layout_.time.unit_s = unit_conversion(Quantity::kTime, unit)->scale;
    layout_.time.nanosecond_exponent =
        9 + static_cast<int>(std::lround(std::log10(layout_.time.unit_s)));
    has_time_ = true;
  }

  void number_slots() {
    for (BoundColumn& column : layout_.columns) {
      if (column.role == ColumnRole::kExtra) {
        column.slot = layout_.extra.size();
        layout_.extra.push_back(column.header);
      } else if (column.channel.quantity == Quantity::kTemperature) {
        column.slot = layout_.probes.size();
        layout_.probes.push_back(column.channel.probe);
      }
    }
  }

  const std::filesystem::path& path_;
  const std::vector<std::string>& header_;
  RecordLayout layout_;
  std::set<std::string> given_;  // names of the channels that a column has
  bool has_time_ = false;
};

}  // namespace

RecordLayout bind_columns(const std::filesystem::path& path, const std::vector<std::string>& header,
                          const std::vector<ColumnMapping>& map, Rates rates) {
  return Binder{path, header}.bind(map, rates);
}

}  // namespace zerodrift::record
