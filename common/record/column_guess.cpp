// SPDX-License-Identifier: Apache-2.0
#include "common/record/column_guess.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>

#include "common/core/one_line.h"
#include "common/files/file_error.h"
#include "common/record/column_map.h"
#include "common/record/csv_cells.h"
#include "common/record/decimal_time.h"
#include "common/record/record_layout.h"

namespace zerodrift::record {
namespace {

struct UnitSpelling {
  std::string_view spelled;  // letters and digits alone, small
  Quantity quantity;
  std::string_view unit;
};

constexpr std::array kSpellings{
    UnitSpelling{"rads", Quantity::kRate, "rad/s"},
    UnitSpelling{"radps", Quantity::kRate, "rad/s"},
    UnitSpelling{"radsec", Quantity::kRate, "rad/s"},
    UnitSpelling{"degs", Quantity::kRate, "deg/s"},
    UnitSpelling{"dps", Quantity::kRate, "deg/s"},
    UnitSpelling{"degps", Quantity::kRate, "deg/s"},
    UnitSpelling{"degsec", Quantity::kRate, "deg/s"},
    UnitSpelling{"degh", Quantity::kRate, "deg/h"},
    UnitSpelling{"dph", Quantity::kRate, "deg/h"},
    UnitSpelling{"deghr", Quantity::kRate, "deg/h"},
    UnitSpelling{"c", Quantity::kTemperature, "degC"},
    UnitSpelling{"degc", Quantity::kTemperature, "degC"},
    UnitSpelling{"celsius", Quantity::kTemperature, "degC"},
    UnitSpelling{"k", Quantity::kTemperature, "K"},
    UnitSpelling{"kelvin", Quantity::kTemperature, "K"},
    UnitSpelling{"f", Quantity::kTemperature, "degF"},
    UnitSpelling{"degf", Quantity::kTemperature, "degF"},
    UnitSpelling{"fahrenheit", Quantity::kTemperature, "degF"},
    UnitSpelling{"s", Quantity::kTime, "s"},
    UnitSpelling{"sec", Quantity::kTime, "s"},
    UnitSpelling{"seconds", Quantity::kTime, "s"},
    UnitSpelling{"ms", Quantity::kTime, "ms"},
    UnitSpelling{"msec", Quantity::kTime, "ms"},
    UnitSpelling{"us", Quantity::kTime, "us"},
    UnitSpelling{"usec", Quantity::kTime, "us"},
    UnitSpelling{"ns", Quantity::kTime, "ns"},
    UnitSpelling{"nsec", Quantity::kTime, "ns"},
};

constexpr std::array<std::string_view, 4> kShortRates{"g", "w", "gyr", "rate"};
constexpr std::array<std::string_view, 7> kLongRates{
    "gyro", "gyroscope", "angularvelocity", "angularrate", "rotationrate", "omega", "angvel"};
constexpr std::array<std::string_view, 15> kTimes{
    "t",           "ts",       "time",           "timestamp", "stamp",
    "sec",         "seconds",  "date",           "epoch",     "elapsed",
    "elapsedtime", "datetime", "secondselapsed", "unixtime",  "loggingtime"};

// Words of letters and digits, in small letters; a degree sign is "deg", a micro sign "u".
std::vector<std::string> words_of(std::string text) {
  const auto replace = [&text](std::string_view sign, std::string_view by) {
    for (std::size_t at = text.find(sign); at != std::string::npos; at = text.find(sign))
      text.replace(at, sign.size(), by);
  };
  replace("\xC2\xB0", "deg");
  replace("\xC2\xB5", "u");
  replace("\xCE\xBC", "u");
  std::vector<std::string> words(1);
  for (const char c : text) {
    if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) {
      words.back() += c;
    } else if (c >= 'A' && c <= 'Z') {
      words.back() += static_cast<char>(c - 'A' + 'a');
    } else if (!words.back().empty()) {
      words.emplace_back();
    }
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

std::string joined(const std::vector<std::string>& words, std::size_t begin, std::size_t end) {
  std::string text;
  for (std::size_t i = begin; i < end; ++i) text += words[i];
  return text;
}

struct Column {
  std::string header;
  std::vector<std::string> words;
  std::string cell;
};

// The column's name without a unit of this quantity behind it, and the unit.
struct NameAndUnit {
  std::string name;
  std::string_view unit;  // empty: not said
};

NameAndUnit split_unit(const Column& column, Quantity quantity) {
  const std::size_t count = column.words.size();
  for (const std::size_t of_unit : {std::size_t{2}, std::size_t{1}}) {
    if (count <= of_unit) continue;
    const std::string spelled = joined(column.words, count - of_unit, count);
    for (const UnitSpelling& known : kSpellings) {
      if (known.quantity == quantity && known.spelled == spelled)
        return {joined(column.words, 0, count - of_unit), known.unit};
    }
  }
  return {joined(column.words, 0, count), {}};
}

bool is_rate_word(std::string_view word) {
  return std::find(kShortRates.begin(), kShortRates.end(), word) != kShortRates.end() ||
         std::any_of(kLongRates.begin(), kLongRates.end(),
                     [&](std::string_view known) { return word.ends_with(known); });
}

// "gyrox", "xgyro", "wx", "imuangularvelocityxaxis".
std::optional<core::Axis> rate_axis(std::string_view name) {
  if (name.ends_with("axis")) name.remove_suffix(4);
  if (name.size() < 2) return std::nullopt;
  for (const core::Axis axis : core::kAxes) {
    const char letter = core::name(axis).front();
    if (name.back() == letter && is_rate_word(name.substr(0, name.size() - 1))) return axis;
    if (name.front() == letter && is_rate_word(name.substr(1)) && name.size() > 2) return axis;
  }
  return std::nullopt;
}

// It can stand between the quotes of a command line that is shown to be copied: a file's names are
// anybody's.
bool is_in_a_map(std::string_view header) {
  return !header.empty() && core::is_one_line(header) &&
         header.find_first_of(",*'\"") == std::string_view::npos;
}

class Guess {
 public:
  void add(const Column& column) {
    if (!is_in_a_map(column.header)) return;
    add_time(column) || add_rate(column) || add_temperature(column);
  }

  [[nodiscard]] std::string map() const {
    return (time_.empty() ? "time=row*0.01" : time_) + rates_ + temperatures_;
  }

  [[nodiscard]] bool has_rate() const { return !rates_.empty(); }

  [[nodiscard]] std::string assumptions() const {
    std::string text;
    if (time_.empty()) text += "rows 0.01 s apart";
    if (assumes_unit_) text += std::string(text.empty() ? "" : ", ") + "rates in deg/s";
    return text.empty() ? "" : " (assumed: " + text + ")";
  }

 private:
  bool add_time(const Column& column) {
    const NameAndUnit found = split_unit(column, Quantity::kTime);
    if (!time_.empty() || std::find(kTimes.begin(), kTimes.end(), found.name) == kTimes.end())
      return false;
    time_ = "time=" + column.header + "[" + unit_of_time(column, found.unit) + "]";
    return true;
  }

  // A count that has run since 1970 shows its unit by its size.
  static std::string unit_of_time(const Column& column, std::string_view said) {
    if (parse_iso8601(column.cell)) return std::string{kIso8601};
    if (!said.empty()) return std::string{said};
    const double count = std::abs(parse_number(column.cell).value_or(0.0));
    return count > 1e17 ? "ns" : count > 1e14 ? "us" : count > 1e11 ? "ms" : "s";
  }

  bool add_rate(const Column& column) {
    const NameAndUnit found = split_unit(column, Quantity::kRate);
    const std::optional<core::Axis> axis = rate_axis(found.name);
    if (!axis || has_[core::index(*axis)]) return false;
    has_[core::index(*axis)] = true;
    assumes_unit_ = assumes_unit_ || found.unit.empty();
    rates_ += ",rate_" + std::string{core::name(*axis)} + "=" + column.header + "[" +
              std::string{found.unit.empty() ? "deg/s" : found.unit} + "]";
    return true;
  }

  // The first one is named as the shipped configurations name theirs.
  bool add_temperature(const Column& column) {
    const NameAndUnit found = split_unit(column, Quantity::kTemperature);
    if (found.name.find("temp") == std::string::npos || !temperatures_.empty()) return false;
    temperatures_ = ",temperature_coil=" + column.header + "[" +
                    std::string{found.unit.empty() ? "degC" : found.unit} + "]";
    return true;
  }

  std::string time_;
  std::string rates_;
  std::string temperatures_;
  core::PerAxis<bool> has_{};
  bool assumes_unit_ = false;
};

bool is_possible(const std::string& map, const std::vector<std::string>& header) {
  try {
    static_cast<void>(bind_columns("", header, parse_column_map(map)));
    return true;
  } catch (const files::FileError&) {
    return false;
  }
}

}  // namespace

std::string guessed_columns(const std::vector<std::string>& header,
                            const std::vector<std::string>& first_row) {
  Guess guess;
  for (std::size_t i = 0; i < header.size(); ++i)
    guess.add({header[i], words_of(header[i]), i < first_row.size() ? first_row[i] : ""});
  if (!guess.has_rate() || !is_possible(guess.map(), header)) return "";
  return "--columns '" + guess.map() + "'" + guess.assumptions();
}

}  // namespace zerodrift::record
