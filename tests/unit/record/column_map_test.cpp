// SPDX-License-Identifier: Apache-2.0
#include "common/record/column_map.h"

#include <gtest/gtest.h>

#include "common/core/units.h"
#include "common/files/file_error.h"

namespace zerodrift::record {
namespace {

std::string error_of(std::string_view map) {
  try {
    (void)parse_column_map(map);
  } catch (const files::FileError& error) {
    return error.what();
  }
  return "no error";
}

TEST(ColumnMap, ReadsTheExampleOfTheFormatPage) {
  const auto map =
      parse_column_map("time=stamp[ns],rate_x=gyro_x[rad/s],temperature_coil=temp_c[degC]");
  ASSERT_EQ(map.size(), 3U);
  EXPECT_EQ(map[0].channel, (Channel{Quantity::kTime, core::Axis::kX, ""}));
  EXPECT_EQ(map[0].column, "stamp");
  EXPECT_EQ(map[0].unit, "ns");
  EXPECT_EQ(map[1].channel, (Channel{Quantity::kRate, core::Axis::kX, ""}));
  EXPECT_EQ(map[2].channel, (Channel{Quantity::kTemperature, core::Axis::kX, "coil"}));
  EXPECT_EQ(map[2].factor, 1.0);
}

TEST(ColumnMap, ACountIsWorthAPartOfAUnitThatIsNamedAndOfATimeOneOfSeconds) {
  const auto map = parse_column_map("time=row*0.005,rate_z=gz_lsb*0.05[deg/s]");
  ASSERT_EQ(map.size(), 2U);
  EXPECT_EQ(map[0].unit, "s");
  EXPECT_EQ(map[0].factor, 0.005);
  EXPECT_EQ(map[1].column, "gz_lsb");
  EXPECT_EQ(map[1].unit, "deg/s");
  EXPECT_EQ(map[1].factor, 0.05);
}

// A data sheet gives a rate's factor in deg/s; what was meant is the reader's to say.
TEST(ColumnMap, NoFactorOfAMeasuredQuantityGoesWithoutItsUnit) {
  for (const char* channel : {"rate_x", "reference_y", "temperature_coil", "magnetic_y",
                              "acceleration_x", "vibration", "source_current", "supply"}) {
    const std::string entry = std::string{channel} + "=c*0.05";
    EXPECT_NE(error_of(entry).find("no unit; write '" + entry + "[<unit>]' with one of "),
              std::string::npos)
        << error_of(entry);
  }
}

TEST(ColumnMap, BlanksAroundItsPartsDoNotMatterAndColumnsMayHoldBlanksAndBrackets) {
  const auto map = parse_column_map(" time = t [s] , rate_x = Gyro X [deg/s] [rad/s] ");
  ASSERT_EQ(map.size(), 2U);
  EXPECT_EQ(map[0].column, "t");
  EXPECT_EQ(map[1].column, "Gyro X [deg/s]");
  EXPECT_EQ(map[1].unit, "rad/s");
}

TEST(ColumnMap, EmptyTextMapsNothing) {
  EXPECT_TRUE(parse_column_map(" ").empty());
}

TEST(ColumnMap, EveryNameOfAChannelReadsBack) {
  for (const char* text :
       {"time", "rate_x", "rate_y", "rate_z", "reference_z", "temperature_coil_outer", "magnetic_y",
        "acceleration_x", "vibration", "source_current", "supply"}) {
    const std::string channel{text};
    const std::string unit{default_unit(parse_canonical_name(channel)->channel.quantity)};
    EXPECT_EQ(name(parse_column_map(channel + "=c*2[" + unit + "]")[0].channel), text);
  }
}

TEST(ColumnMap, RefusalsNameTheEntryWhatWasFoundAndWhatWouldBeRight) {
  EXPECT_EQ(error_of("rate_x"), "--columns: 'rate_x': expected <channel>=<column>[<unit>]");
  EXPECT_EQ(error_of("rate_x=a[deg/min]"),
            "--columns: 'rate_x=a[deg/min]': unknown unit 'deg/min'; accepted: rad/s deg/s deg/h");
  EXPECT_EQ(
      error_of("rate_x=a"),
      "--columns: 'rate_x=a': no unit; write 'rate_x=a[<unit>]' with one of rad/s deg/s deg/h");
  EXPECT_EQ(
      error_of("time=row*fast"),
      "--columns: 'time=row*fast': 'fast' is no factor; expected a number other than 0 behind '*'");
  EXPECT_EQ(error_of("time=row*0"),
            "--columns: 'time=row*0': '0' is no factor; expected a number other than 0 behind '*'");
  EXPECT_EQ(error_of("time=a[s],time=b[s]"), "--columns: 'time=b[s]': 'time' is mapped twice");
  EXPECT_EQ(error_of("temperature_coil_degC=t[degC]"),
            "--columns: 'temperature_coil_degC=t[degC]': the unit belongs behind the column: "
            "'temperature_coil=<column>[degC]'");
  EXPECT_EQ(error_of("rate_w=a[rad/s]").substr(0, 66),
            "--columns: 'rate_w=a[rad/s]': 'rate_w' is no channel; channels are");
  EXPECT_EQ(error_of("time=[s]"), "--columns: 'time=[s]': no column is named");
  EXPECT_EQ(error_of("time=a]"), "--columns: 'time=a]': ']' without '['");
  EXPECT_EQ(error_of("rate_x=a[lsb*3]"),
            "--columns: 'rate_x=a[lsb*3]': unknown unit 'lsb*3'; accepted: rad/s deg/s deg/h; "
            "counts, each worth a part of one: '<column>*<factor>[<unit>]'");
  EXPECT_EQ(error_of("time=a[s],"), "--columns: '': expected <channel>=<column>[<unit>]");
}

TEST(Units, EveryAcceptedUnitOfTheFormatPageHasItsTextbookValue) {
  struct Known {
    Quantity quantity;
    const char* unit;
    double one_is;  // in the default unit
  };
  const Known known[] = {
      {Quantity::kTime, "s", 1.0},
      {Quantity::kTime, "ms", 1e-3},
      {Quantity::kTime, "us", 1e-6},
      {Quantity::kTime, "ns", 1e-9},
      {Quantity::kRate, "deg/h", core::radps_from_deg_h(1.0)},
      {Quantity::kRate, "deg/s", core::kRadPerDeg},
      {Quantity::kRate, "rad/s", 1.0},
      {Quantity::kReference, "deg/h", core::radps_from_deg_h(1.0)},
      {Quantity::kTemperature, "degC", 1.0},
      {Quantity::kTemperature, "K", 1.0 - 273.15},
      {Quantity::kMagnetic, "uT", 1.0},
      {Quantity::kMagnetic, "mT", 1e3},
      {Quantity::kMagnetic, "T", 1e6},
      {Quantity::kMagnetic, "G", 100.0},
      {Quantity::kAcceleration, "g", 9.80665},
      {Quantity::kAcceleration, "m/s^2", 1.0},
      {Quantity::kVibration, "g", 1.0},
      {Quantity::kSourceCurrent, "mA", 1.0},
      {Quantity::kSourceCurrent, "A", 1e3},
      {Quantity::kSupply, "V", 1.0},
      {Quantity::kSupply, "mV", 1e-3},
  };
  for (const Known& k : known) {
    const auto conversion = unit_conversion(k.quantity, k.unit);
    ASSERT_TRUE(conversion.has_value()) << k.unit;
    EXPECT_EQ(conversion->scale + conversion->offset, k.one_is) << k.unit;
  }
  EXPECT_FALSE(unit_conversion(Quantity::kRate, "degC").has_value());
  EXPECT_FALSE(unit_conversion(Quantity::kRate, "").has_value());
}

TEST(CanonicalNames, SplitIntoChannelAndUnit) {
  const auto acceleration = parse_canonical_name("acceleration_y_m_s2");
  ASSERT_TRUE(acceleration.has_value());
  EXPECT_EQ(acceleration->channel, (Channel{Quantity::kAcceleration, core::Axis::kY, ""}));
  EXPECT_EQ(acceleration->unit, "m_s2");

  const auto temperature = parse_canonical_name("temperature_coil_inner_degC");
  ASSERT_TRUE(temperature.has_value());
  EXPECT_EQ(temperature->channel.probe, "coil_inner");
  EXPECT_EQ(temperature->unit, "degC");

  EXPECT_EQ(parse_canonical_name("source_current_mA")->channel.quantity, Quantity::kSourceCurrent);
  EXPECT_EQ(parse_canonical_name("rate_x")->unit, "");
}

TEST(CanonicalNames, OthersAreUnknown) {
  for (const char* column : {"gyro_x", "rate_total", "rate_xy_deg_h", "timestamp", "temperature",
                             "temperature_degC", "temperature__degC", "suppl", "", "rate_"}) {
    EXPECT_FALSE(parse_canonical_name(column).has_value()) << column;
  }
}

}  // namespace
}  // namespace zerodrift::record
