// SPDX-License-Identifier: Apache-2.0
// Records as they come, for the diagnosis: what can't have been measured is taken out with a line
// that names the column, and what is of no use at all is refused with one line.
#include "common/measurement/measured_record.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/core/units.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::measurement {
namespace {

struct Cells {
  double rate = 0.0;
  double temperature = 0.0;
  double other = 0.0;
};

double noise(int i) {
  return std::sin(1.7 * i * i);
}

// A gyro at 1 Hz in a chamber that goes up and down.
Cells sound(int i) {
  const double temperature = 20.0 + 10.0 * std::sin(i / 500.0);
  return {1.0 + 0.1 * noise(i), temperature, temperature + 1.0};
}

class MeasuredRecordTest : public ScratchFolder {
 protected:
  static constexpr int kHour = 3600;

  std::string write_record(const std::string& header, const std::function<Cells(int)>& cells,
                           int rows = kHour, double period_s = 1.0,
                           const std::function<bool(int)>& is_lost = nullptr) const {
    std::string text = header + "\n";
    for (int i = 0; i < rows; ++i) {
      if (is_lost && is_lost(i)) continue;
      const Cells row = cells(i);
      char line[128];
      std::snprintf(line, sizeof line, "%.6f,%.9g,%.6g,%.6g\n", period_s * i, row.rate,
                    row.temperature, row.other);
      text += line;
    }
    return write("r.csv", text);
  }

  std::string write_sound(int rows = kHour, double period_s = 1.0) const {
    return write_record(kHeader, sound, rows, period_s);
  }

  static MeasuredRecord read(const std::string& file, const std::string& columns = "",
                             std::vector<core::Axis> axes = {}) {
    return read_measured_record(
        {.record = {.file = file, .columns = columns}, .axes = std::move(axes)}, [](double) {});
  }

  static std::string refusal(const std::string& file, std::vector<core::Axis> axes = {}) {
    try {
      static_cast<void>(read(file, "", std::move(axes)));
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  }

  static constexpr const char* kHeader =
      "time_s,rate_x_deg_h,temperature_coil_degC,temperature_case_degC";
};

// The line with this word, or "".
std::string warning(const MeasuredRecord& record, const std::string& word) {
  std::vector<std::string> all = lines_of(record.doubts);
  all.insert(all.end(), record.warnings.begin(), record.warnings.end());
  const auto found = std::find_if(all.begin(), all.end(), [&](const std::string& line) {
    return line.find(word) != std::string::npos;
  });
  return found == all.end() ? "" : *found;
}

TEST_F(MeasuredRecordTest, ASoundRecordComesThroughWithNothingButWhatItLacks) {
  const MeasuredRecord record = read(write_sound());
  EXPECT_TRUE(record.has(core::Axis::kX));
  EXPECT_FALSE(record.has(core::Axis::kY));
  EXPECT_EQ(record.series.probes.size(), 2U);
  EXPECT_EQ(record.series.rows, 3600U);
  EXPECT_TRUE(record.doubts.empty());
  EXPECT_DOUBLE_EQ(record.duration_s(), 3600.0);
  ASSERT_EQ(record.warnings.size(), 1U) << record.warnings.back();
  EXPECT_NE(record.warnings.front().find("no true rate"), std::string::npos);
}

TEST_F(MeasuredRecordTest, KelvinNamedCelsiusIsLeftOutAndTheRightUnitIsTold) {
  const std::string file = write_record(kHeader, [](int i) {
    Cells cells = sound(i);
    cells.temperature += 273.15;
    return cells;
  });
  const MeasuredRecord record = read(file);
  ASSERT_EQ(record.series.probes.size(), 1U);
  EXPECT_EQ(record.series.probes.front().name, "case");
  const std::string line = warning(record, "temperature_coil_degC");
  EXPECT_NE(line.find("--columns 'temperature_coil=temperature_coil_degC[K]'"), std::string::npos)
      << line;
  const MeasuredRecord mapped = read(file, "temperature_coil=temperature_coil_degC[K]");
  EXPECT_EQ(mapped.series.probes.size(), 2U);
  EXPECT_EQ(warning(mapped, "expected -100"), "");
}

TEST_F(MeasuredRecordTest, CelsiusNamedKelvinIsLeftOutAndTheRightUnitIsTold) {
  const MeasuredRecord record =
      read(write_record("time_s,rate_x_deg_h,temperature_coil_K,temperature_case_degC", sound));
  EXPECT_EQ(record.series.probes.size(), 1U);
  EXPECT_NE(warning(record, "temperature_coil_K").find("[degC]"), std::string::npos);
}

TEST_F(MeasuredRecordTest, ASingleImpossibleReadingIsTakenOutAlone) {
  const MeasuredRecord record = read(write_record(kHeader, [](int i) {
    Cells cells = sound(i);
    if (i == 1000) cells.temperature = -999.0;
    return cells;
  }));
  ASSERT_EQ(record.series.probes.size(), 2U);
  const auto& temperature = record.series.probes.front().temperature_degc;
  EXPECT_GT(*std::min_element(temperature.begin(), temperature.end()), 9.0);
  EXPECT_NE(warning(record, "1 of 3600 readings"), "");
  EXPECT_NE(warning(record, "1 reading that can't be is taken as not measured"), "");
}

TEST_F(MeasuredRecordTest, AnImpossibleRateIsNotARate) {
  const MeasuredRecord record = read(write_record(kHeader, [](int i) {
    Cells cells = sound(i);
    if (i % 100 == 0) cells.rate = 1e12;
    return cells;
  }));
  EXPECT_EQ(std::count(record.series.valid[0].begin(), record.series.valid[0].end(), 0), 36);
  EXPECT_NE(warning(record, "rate_x_deg_h"), "");
}

TEST_F(MeasuredRecordTest, ARateThatNoGyroAtRestShowsIsPointedOut) {
  const MeasuredRecord record =
      read(write_record("time_s,rate_x_rad_s,temperature_coil_degC,temperature_case_degC", sound));
  EXPECT_NE(warning(record, "too much for a gyro at rest"), "");
}

// Beside a moving probe a stuck one would pass for the other end of a gradient.
TEST_F(MeasuredRecordTest, AStuckProbeIsLeftOutBesideOneThatMoves) {
  const MeasuredRecord record = read(write_record(kHeader, [](int i) {
    Cells cells = sound(i);
    cells.other = 25.0;
    return cells;
  }));
  ASSERT_EQ(record.series.probes.size(), 1U);
  EXPECT_EQ(record.series.probes.front().name, "coil");
  EXPECT_NE(warning(record, "temperature_case_degC"), "");
  EXPECT_NE(warning(record, "probe case is left out"), "");
}

TEST_F(MeasuredRecordTest, AStuckAxisIsLeftOutAndAloneItIsRefused) {
  const auto stuck = [](int i) {
    Cells cells = sound(i);
    cells.temperature = cells.rate;
    cells.rate = 1.0;
    return cells;
  };
  const MeasuredRecord record =
      read(write_record("time_s,rate_x_deg_h,rate_y_deg_h,temperature_case_degC", stuck));
  EXPECT_FALSE(record.has(core::Axis::kX));
  EXPECT_TRUE(record.has(core::Axis::kY));
  EXPECT_NE(warning(record, "axis x is left out"), "");
  EXPECT_NE(refusal(write_record(kHeader, stuck)).find("every rate is equal"), std::string::npos);
}

TEST_F(MeasuredRecordTest, GapsAreCountedAndTheirTimeIsNotValid) {
  const MeasuredRecord record =
      read(write_record(kHeader, sound, kHour, 1.0, [](int i) { return i >= 600 && i < 900; }));
  const std::string line = warning(record, "1 gap");
  EXPECT_NE(line.find("301 s"), std::string::npos) << line;
  EXPECT_EQ(std::count(record.series.valid[0].begin(), record.series.valid[0].end(), 0), 300);
}

TEST_F(MeasuredRecordTest, AThousandHertzAreAveragedAndATenthIsTakenAsItIs) {
  const MeasuredRecord fast = read(write_sound(700'000, 0.001));
  EXPECT_DOUBLE_EQ(fast.series.interval_s, 1.0);
  EXPECT_NEAR(static_cast<double>(fast.series.size), 700.0, 1.0);
  EXPECT_NE(warning(fast, "min long"), "");
  const MeasuredRecord slow = read(write_sound(360, 10.0));
  EXPECT_DOUBLE_EQ(slow.series.interval_s, 10.0);
  EXPECT_NE(warning(slow, "a sample every 10.0 s"), "");
}

TEST_F(MeasuredRecordTest, NoTemperatureIsSaid) {
  const MeasuredRecord record = read(write_record("time_s,rate_x_deg_h,a,b", sound));
  EXPECT_TRUE(record.series.probes.empty());
  EXPECT_NE(warning(record, "no temperature"), "");
}

TEST_F(MeasuredRecordTest, ANumberOfAGyroThatChoosesNothingIsSaid) {
  const std::string file = write_sound();
  const auto read_as = [&](std::optional<std::uint32_t> gyro_id) {
    return read_measured_record({.record = {.file = file, .gyro_id = gyro_id}, .axes = {}},
                                [](double) {});
  };
  const std::string line = warning(read_as(7), "--gyro-id");
  EXPECT_TRUE(line.starts_with(file + ": --gyro-id 7 chooses nothing")) << line;
  EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  EXPECT_EQ(warning(read_as(std::nullopt), "--gyro-id"), "");
}

TEST_F(MeasuredRecordTest, GravityTellsTheUnitOfAnAccelerometer) {
  const auto record_of = [&](const char* unit) {
    const std::string u(unit);
    return read(
        write_record("time_s,rate_x_deg_h,acceleration_x_" + u + ",acceleration_z_" + u, [](int i) {
          return Cells{sound(i).rate, 0.0, 1.0};
        }));
  };
  // Two of three axes tell nothing.
  EXPECT_EQ(warning(record_of("m_s2"), "acceleration"), "");
  std::string text =
      "time_s,rate_x_deg_h,acceleration_x_m_s2,acceleration_y_m_s2,"
      "acceleration_z_m_s2\n";
  for (int i = 0; i < kHour; ++i)
    text += std::to_string(i) + "," + std::to_string(sound(i).rate) + ",0,0,1\n";
  EXPECT_NE(warning(read(write("g.csv", text)), "is their unit right"), "");
}

// White noise of known size: uniform, whose mean step is a third of its width where a normal one's
// is 2 sigma / sqrt(pi); the estimate is then width / 3 * sqrt(pi) / 2.
TEST_F(MeasuredRecordTest, TheNoiseFromSampleToSampleIsMeasured) {
  std::uint64_t state = 1;
  const MeasuredRecord record = read(write_record(kHeader, [&](int i) {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    Cells cells = sound(i);
    cells.rate = static_cast<double>(state >> 40U) / static_cast<double>(1U << 24U);
    return cells;
  }));
  const double expected = core::radps_from_deg_h(0.5 * std::sqrt(3.14159265358979) / 3.0);
  // Steps have a standard deviation of 0.236, neighbours share a sample: 5 sigma of the mean of
  // 3600 are 5 * 0.236 * sqrt(2) / 60 = 0.028 of 1/3.
  EXPECT_NEAR(record.sample_noise_radps[0], expected, 0.085 * expected);
}

TEST_F(MeasuredRecordTest, OnlyTheAxesAskedForAreRead) {
  const std::string file =
      write_record("time_s,rate_x_deg_h,rate_y_deg_h,temperature_case_degC", sound);
  const MeasuredRecord record = read(file, "", {core::Axis::kY});
  EXPECT_FALSE(record.has(core::Axis::kX));
  EXPECT_TRUE(record.has(core::Axis::kY));
  const std::string line = refusal(file, {core::Axis::kZ});
  EXPECT_NE(line.find("axis z"), std::string::npos) << line;
  EXPECT_NE(line.find("x, y"), std::string::npos) << line;
}

TEST_F(MeasuredRecordTest, WhatIsOfNoUseIsRefusedInOneLineThatNamesTheFile) {
  std::string all_blank = "time_s,rate_x_deg_h,temperature_coil_degC\n";
  for (int i = 0; i < kHour; ++i) all_blank += std::to_string(i) + ",,20\n";
  const std::vector<std::pair<std::string, std::string>> cases{
      {write("no_rate.csv", "time_s,temperature_coil_degC\n0,1\n1,2\n"),
       "no column is an angular rate"},
      {write("one.csv", "time_s,rate_x_deg_h\n0,1\n"), "a single sample"},
      {write("sparse.csv", "time_s,rate_x_deg_h\n0,1\n100,2\n200,1\n300,2\n400,1\n900,1\n"),
       "a sample every 100 s"},
      {write("blank.csv", all_blank), "no axis with two valid rates"}};
  for (const auto& [file, why] : cases) {
    const std::string line = refusal(file);
    EXPECT_TRUE(line.starts_with(file)) << line;
    EXPECT_NE(line.find(why), std::string::npos) << line;
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  }
}

}  // namespace
}  // namespace zerodrift::measurement
