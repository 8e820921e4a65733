// SPDX-License-Identifier: Apache-2.0
// What of a record can hardly be as it says, reported before anything is made of it: one set of
// rules for every command that reads a record. A doubt refuses nothing.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/axis.h"
#include "common/core/plausible.h"
#include "common/core/time.h"
#include "common/core/units.h"
#include "common/measurement/column_watch.h"
#include "common/measurement/standstill_watch.h"
#include "common/record/record_reader.h"

namespace zerodrift::measurement {

enum class DoubtKind : std::uint8_t {
  kNotMeasurable,  // readings that no sensor of the quantity gives
  kUnit,           // temperatures that another unit makes ordinary
  kNotAtRest,      // a rate too large for rest, and no true rate that explains it
  kStuck,          // a channel that never moves, or a thermometer that stops
  kTooShort,       // for drift to be distinguished from noise
};
[[nodiscard]] std::string_view name(DoubtKind kind);  // "not_measurable", ...

// Where the columns of a record come from, and so how one is read in another unit.
enum class ColumnSource : std::uint8_t {
  kTable,  // of text: by --columns
  kMcap,   // which has no --columns: as a table, by zerodrift export
  kLive,   // in the unit of its topic alone
};
[[nodiscard]] ColumnSource column_source_of(const std::filesystem::path& record);

struct Doubt {
  DoubtKind kind = DoubtKind::kNotMeasurable;
  std::string record{};  // the file's name
  std::string column{};  // as in the header; empty: of the whole record
  std::string text{};    // for people, without the file's name
};

// A record shorter than the minute that means are taken over gives none, and drift lasts longer.
inline constexpr double kShortestRecordS = 60.0;
// Mean size of a rate in which no gyro at rest is: consumer MEMS are specified to a bias of up to
// 10 deg/s and a noise of about 1 deg/s; a FOG shows a thousandth of that and the Earth 0.004.
inline constexpr double kLargestAtRestRadps = 10.0 * core::kRadPerDeg;
// A thermometer that never moves is stuck if another one moves by so much.
inline constexpr double kMovedDegc = 1.0;
// Alone it is doubted from so long a record on: the parts of a gyro warm up for longer. One that
// stops moving for so long while another moves is doubted too.
inline constexpr double kLongestConstantTemperatureS = 600.0;
// What lies beyond is looked at in other units.
inline constexpr ValueRange kEndurableDegc{core::kColdestStoreDegc, core::kHottestElectronicsDegc};
// 15 to 50 degC in degF: a laboratory, up to the self-heating of electronics. Read as degC, all of
// a record from first to last, it would be a chamber that is hot at switch-on and never leaves
// there.
inline constexpr ValueRange kLaboratoryInDegf{59.0, 122.0};

// Looks at each row of one record. No allocation a row.
class RecordWatch {
 public:
  // Of columns that are values; others are left out.
  RecordWatch(std::string record, ColumnSource source,
              const std::vector<record::BoundColumn>& columns);
  // `columns`: the text of --columns that the record is read with.
  RecordWatch(const record::RecordInfo& info, std::string_view columns);

  // The row without what can't have been measured, valid until the next call. In any order of time.
  const record::RecordRow& add(const record::RecordRow& row);

  [[nodiscard]] const std::vector<ColumnWatch>& columns() const { return columns_; }
  // From the first to the last time, plus one sample. 0: no row.
  [[nodiscard]] double duration_s() const;
  [[nodiscard]] std::uint64_t rows() const { return rows_; }

  // Columns in the file's order, then the record as a whole. Nothing of a record without a row.
  [[nodiscard]] std::vector<Doubt> doubts() const;
  // Readings of a thermometer that is stuck beside one that moves say something wrong.
  [[nodiscard]] bool is_stuck_beside_others(const ColumnWatch& thermometer) const;

 private:
  struct MeanSize {
    double sum_radps = 0.0;
    std::uint64_t count = 0;
  };
  [[nodiscard]] std::optional<std::string> not_measurable(const ColumnWatch& column) const;
  [[nodiscard]] std::optional<std::string> other_unit(const ColumnWatch& column) const;
  [[nodiscard]] std::optional<std::string> not_at_rest(const ColumnWatch& column) const;
  [[nodiscard]] std::optional<std::string> stuck(const ColumnWatch& column) const;
  [[nodiscard]] std::optional<std::string> standstill(const ColumnWatch& column) const;
  [[nodiscard]] double widest_temperature_degc() const;

  [[nodiscard]] std::string question_of(const record::BoundColumn& column,
                                        std::string_view unit) const;

  std::string record_;
  ColumnSource source_;
  std::vector<ColumnWatch> columns_;
  core::PerAxis<bool> has_reference_{};
  core::PerAxis<MeanSize> drift_{};  // of rate less reference
  StandstillWatch standstills_;      // of thermometers, by slot
  record::RecordRow cleared_;
  std::uint64_t rows_ = 0;
  core::SensorTime first_{core::SensorTime::max()};
  core::SensorTime last_{core::SensorTime::min()};
};

// "<record>: <text>", a line each.
[[nodiscard]] std::vector<std::string> lines_of(const std::vector<Doubt>& doubts);

}  // namespace zerodrift::measurement
