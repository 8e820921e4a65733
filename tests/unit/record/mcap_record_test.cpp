// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "common/record/record_reader.h"
#include "common/record/record_samples.h"
#include "tests/unit/record/record_folder.h"
#include "tests/unit/record/recording.h"

namespace zerodrift::record {
namespace {

class McapRecord : public RecordFolder {};

TEST_F(McapRecord, RowsAreTheTimesAtWhichSomethingWasMeasured) {
  Recording recording;
  // The thermometers were heard 10 s ahead, as live.
  recording.add(3, reading_at(0.5, "coil", 20.0));
  recording.add(3, reading_at(1.25, "coil", 21.0));
  recording.add(3, reading_at(1.0, "case", 30.0));
  recording.add(3, rate_at(1.0, 41));
  recording.add(3, rate_at(1.5, 43));
  RecordReader reader(recording.write_to(path("a.mcap")));
  const RecordInfo& info = reader.info();
  EXPECT_EQ(info.gyro_id, 3U);
  EXPECT_EQ(info.probes, (std::vector<std::string>{"coil", "case"}));
  EXPECT_EQ(info.has_rate, (core::PerAxis<bool>{true, true, true}));
  EXPECT_EQ(info.has_reference, (core::PerAxis<bool>{}));
  EXPECT_EQ(info.first_time, core::from_seconds(1.0));
  EXPECT_EQ(info.sample_period_s, 0.5);
  EXPECT_EQ(info.columns,
            (std::vector<std::string>{"time_s", "rate_x_rad_s", "rate_y_rad_s", "rate_z_rad_s",
                                      "temperature_coil_degC", "temperature_case_degC"}));

  const RecordRow* row = reader.next();
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->time, core::from_seconds(0.5));
  EXPECT_FALSE(brings_rate(*row));
  EXPECT_TRUE(brings_temperature(*row, 0));
  EXPECT_FALSE(brings_temperature(*row, 1));
  EXPECT_EQ(row->temperature_degc[0], 20.0);
  EXPECT_TRUE(std::isnan(row->temperature_degc[1]));
  EXPECT_TRUE(std::isnan(row->rate_radps[0]));

  row = reader.next();
  ASSERT_NE(row, nullptr);
  EXPECT_TRUE(brings_rate(*row));
  EXPECT_EQ(row->interval_s, 0.5);
  const core::AngularRateSample sample = to_angular_rate(*row);
  EXPECT_EQ(sample.sequence, 41U);
  EXPECT_EQ(sample.interval_s, 0.0049) << "as recorded, not the step of the rows";
  EXPECT_EQ(sample.clock, core::ClockSource::kSimulation);
  EXPECT_FALSE(brings_temperature(*row, 0));
  EXPECT_EQ(row->temperature_degc[1], 30.0);

  row = reader.next();
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->time, core::from_seconds(1.25));
  EXPECT_FALSE(brings_rate(*row));
  row = reader.next();
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(to_angular_rate(*row).sequence, 43U);
  EXPECT_EQ(reader.next(), nullptr);
  EXPECT_EQ(reader.warnings(), std::vector<std::string>{});
}

// Before: what came after a restart of the publisher was dropped as repeats, without a word.
TEST_F(McapRecord, ARestartOfThePublisherIsAGapInTheRecord) {
  Recording recording;
  std::uint64_t k = 0;
  for (const std::uint64_t length : {200U, 50U, 120U}) {
    for (std::uint64_t own = 0; own < length; ++own)
      recording.add(1, rate_at(1.0 + 0.01 * static_cast<double>(k++), own));
  }
  RecordReader reader(recording.write_to(path("a.mcap")));
  std::uint64_t expected = 0;
  while (const RecordRow* row = reader.next())
    EXPECT_EQ(to_angular_rate(*row).sequence, expected++);
  EXPECT_EQ(expected, k);
  ASSERT_EQ(reader.warnings().size(), 1U);
  EXPECT_NE(reader.warnings()[0].find("was started again (2x)"), std::string::npos);
}

TEST_F(McapRecord, TwoPublishersOfAGyroAtOnceAreRefused) {
  Recording recording;
  for (std::uint64_t k = 0; k < 500; ++k) {
    const double time_s = 1.0 + 0.01 * static_cast<double>(k);
    recording.add(1, rate_at(time_s, k));
    if (k >= 300) recording.add(1, rate_at(time_s + 0.005, k - 300));
  }
  RecordReader reader(recording.write_to(path("a.mcap")));
  const auto read_all = [&] {
    while (reader.next() != nullptr) {
    }
  };
  EXPECT_THROW(read_all(), files::FileError);
}

TEST_F(McapRecord, TheEnvironmentHasTheColumnsOfAllItsPublishers) {
  Recording recording;
  core::EnvironmentSample vibration;
  vibration.time = core::from_seconds(1.25);
  vibration.channels = 1U << 6U;
  vibration.values.vibration_g = 0.5;
  recording.add(1, environment_at(1.0, 5.25));
  recording.add(1, rate_at(1.0, 0));
  recording.add(1, vibration);
  recording.add(2, environment_at(1.5, 9.0));  // of another gyro
  recording.add(1, rate_at(1.5, 1));
  RecordReader reader(recording.write_to(path("a.mcap")));
  EXPECT_EQ(reader.info().environment, 0b1'0100'0111U);
  EXPECT_EQ(reader.info().columns,
            (std::vector<std::string>{"time_s", "rate_x_rad_s", "rate_y_rad_s", "rate_z_rad_s",
                                      "magnetic_x_uT", "magnetic_y_uT", "magnetic_z_uT",
                                      "vibration_g", "supply_V"}));
  const RecordRow* row = reader.next();
  EXPECT_EQ(row->inputs.supply_v, 5.25);
  EXPECT_TRUE(std::isnan(row->inputs.magnetic_ut[0]));
  const auto found = to_environment(*row, reader.info());
  ASSERT_TRUE(found);
  EXPECT_EQ(found->channels, 0b1'0000'0111U) << "as it was said";
  EXPECT_EQ(found->clock, core::ClockSource::kSimulation);
  row = reader.next();
  EXPECT_FALSE(brings_rate(*row));
  EXPECT_EQ(row->inputs.vibration_g, 0.5);
  EXPECT_TRUE(std::isnan(row->inputs.supply_v));
  row = reader.next();
  EXPECT_FALSE(to_environment(*row, reader.info())) << "nobody said anything at 1.5 s";
  EXPECT_EQ(reader.next(), nullptr);
}

TEST_F(McapRecord, AReferenceKeepsItsVarianceKindAndTime) {
  Recording recording;
  core::RateReferenceSample reference;
  reference.kind = core::ReferenceKind::kRateTable;
  reference.time = core::from_seconds(1.0);
  reference.rate_radps = {0.25, 0.5, 0.75};
  reference.variance = {1e-9, 2e-9, 3e-9};
  reference.valid = {true, false, true};
  recording.add(1, rate_at(1.0, 0));
  recording.add(1, reference);
  recording.add(1, rate_at(1.5, 1));
  RecordReader reader(recording.write_to(path("a.mcap")));
  EXPECT_EQ(reader.info().has_reference, (core::PerAxis<bool>{true, false, true}));
  const RecordRow* row = reader.next();
  const auto found = to_rate_reference(*row, reader.info());
  ASSERT_TRUE(found);
  EXPECT_EQ(found->kind, core::ReferenceKind::kRateTable);
  EXPECT_EQ(found->variance, reference.variance);
  EXPECT_EQ(row->reference_radps, (core::PerAxis<double>{0.25, 0.0, 0.75}));
  row = reader.next();
  EXPECT_FALSE(to_rate_reference(*row, reader.info())) << "nobody said anything at 1.5 s";
  EXPECT_TRUE(std::isnan(row->reference_radps[0]));
}

// Before: an axis that was invalid in the first 1001 samples was none of the record, without a
// word; and so were an axis of the reference and a channel of the environment that came later.
TEST_F(McapRecord, WhatWasMeasuredAnywhereIsAColumn) {
  constexpr std::uint64_t kSamples = 2500;
  for (const std::uint64_t first : {1U, 1000U, 1001U, 1002U, 2499U}) {
    SCOPED_TRACE(first);
    Recording recording;
    for (std::uint64_t k = 0; k < kSamples; ++k) {
      const double time_s = 0.001 * static_cast<double>(k);
      auto rate = rate_at(time_s, k);
      rate.valid = {k >= first, true, false};
      core::RateReferenceSample reference;
      reference.time = rate.time;
      reference.kind = k >= first ? core::ReferenceKind::kRateTable : core::ReferenceKind::kRest;
      reference.valid = {k >= first, k + 1 >= kSamples, false};
      auto environment = environment_at(time_s, 5.0);
      environment.channels = k >= first ? 1U << 6U : 1U << 8U;
      recording.add(1, rate);
      recording.add(1, reference);
      recording.add(1, environment);
    }
    const RecordReader reader(recording.write_to(path("a.mcap")));
    EXPECT_EQ(reader.info().has_rate, (core::PerAxis<bool>{true, true, false}));
    EXPECT_EQ(reader.info().has_reference, (core::PerAxis<bool>{true, true, false}));
    EXPECT_EQ(reader.info().environment, 0b1'0100'0000U);
    EXPECT_EQ(
        reader.info().columns,
        (std::vector<std::string>{"time_s", "rate_x_rad_s", "rate_y_rad_s", "reference_x_rad_s",
                                  "reference_y_rad_s", "vibration_g", "supply_V"}));
  }
}

TEST_F(McapRecord, OfSeveralGyrosOneIsChosen) {
  for (const auto channels : {Channels::kPerGyro, Channels::kPerTopic}) {
    Recording recording(channels);
    recording.add(2, reading_at(0.0, "coil", 20.0));
    recording.add(2, rate_at(1.0, 20));
    recording.add(9, rate_at(1.0, 90));
    recording.add(9, rate_at(2.0, 91));
    recording.add(2, rate_at(2.0, 21));
    const auto file = recording.write_to(path("two.mcap"));
    EXPECT_EQ(refusal(file), "two.mcap: holds gyros 2, 9; choose one by --gyro-id");
    EXPECT_EQ(refusal(file, {.gyro_id = 5}),
              "two.mcap: has no gyro 5, expected --gyro-id to be one of 2, 9");
    RecordReader reader(file, {.gyro_id = 9});
    EXPECT_TRUE(reader.info().probes.empty());
    EXPECT_EQ(to_angular_rate(*reader.next()).sequence, 90U);
    EXPECT_EQ(to_angular_rate(*reader.next()).sequence, 91U);
    EXPECT_EQ(reader.next(), nullptr);
    EXPECT_EQ(RecordReader(file, {.preferred_gyro_id = 2}).info().gyro_id, 2U);
    EXPECT_EQ(RecordReader(file, {.preferred_gyro_id = 2}).info().probes.size(), 1U);
  }
}

TEST_F(McapRecord, WithoutRatesIsNoRecord) {
  Recording recording;
  recording.add(1, reading_at(0.0, "coil", 20.0));
  EXPECT_EQ(refusal(recording.write_to(path("a.mcap"))),
            "a.mcap: has no message of angular_rate, of which a record is made; found temperature");
}

TEST_F(McapRecord, ColumnsAreForCsv) {
  Recording recording;
  recording.add(1, rate_at(1.0, 0));
  EXPECT_EQ(refusal(recording.write_to(path("a.mcap")),
                    {.columns = parse_column_map("rate_x=gyro[deg/s]")}),
            "a.mcap: is an MCAP file, which --columns says nothing of; zerodrift export makes a "
            ".csv of it, which --columns can be used with");
}

TEST_F(McapRecord, TimeThatGoesBackIsAnErrorUnlessTheStreamIsAskedForAsItWas) {
  Recording recording;
  recording.add(1, rate_at(2.0, 0));
  recording.add(1, rate_at(1.0, 1));
  const auto file = recording.write_to(path("a.mcap"));
  EXPECT_NE(refusal(file).find("sequence number 1: time 1.000000000 s is not after"),
            std::string::npos);
  RecordReader reader(file, {.time_order = TimeOrder::kAsFound});
  EXPECT_EQ(to_angular_rate(*reader.next()).sequence, 0U);
  EXPECT_EQ(to_angular_rate(*reader.next()).sequence, 1U);
  EXPECT_EQ(reader.rows_out_of_order(), 1U);
}

// What a recording of 300 s gives, with a rate, a reading, a reference and an environment each
// second, of which some have another stamp.
class StampedAhead : public McapRecord {
 protected:
  struct Found {
    std::uint64_t rates = 0;
    std::uint64_t temperatures = 0;
    std::uint64_t references = 0;
    std::uint64_t environments = 0;
    std::vector<std::string> warnings{};
    double farthest_s = 0.0;  // from the rate before, of anything but rates

    [[nodiscard]] std::vector<std::uint64_t> counts() const {
      return {rates, temperatures, references, environments};
    }
  };
  using StampS = std::function<double(int)>;  // of what belongs to a second
  struct Stamps {
    StampS rate = &in_time;
    StampS reading = &in_time;
    StampS reference = &in_time;
    StampS environment = &in_time;
  };
  static constexpr std::uint64_t kAll = 300;
  static constexpr const char* kLeftOut = " of temperature, reference or environment, stamped ";

  static double in_time(int second) { return second; }
  static StampS ahead_by(double by_s, int first, int count) {
    return [=](int second) {
      return second >= first && second < first + count ? second + by_s : second;
    };
  }

  Found read(const Stamps& stamps, TimeOrder order = TimeOrder::kStrictlyIncreasing) {
    Recording recording;
    for (int second = 0; second < static_cast<int>(kAll); ++second) {
      core::RateReferenceSample reference;
      reference.kind = core::ReferenceKind::kRateTable;
      reference.time = core::from_seconds(stamps.reference(second));
      reference.valid = {true, true, true};
      recording.add(1, reading_at(stamps.reading(second), "coil", 20.0));
      recording.add(1, reference);
      recording.add(1, environment_at(stamps.environment(second), 5.0));
      recording.add(1, rate_at(stamps.rate(second), static_cast<std::uint64_t>(second)));
    }
    RecordReader reader(recording.write_to(path("a.mcap")), {.time_order = order});
    Found found;
    core::SensorTime rate_time{0};
    while (const RecordRow* row = reader.next()) {
      found.temperatures += brings_temperature(*row, 0) ? 1U : 0U;
      found.references += row->recorded->reference ? 1U : 0U;
      found.environments += row->recorded->environment ? 1U : 0U;
      if (brings_rate(*row)) {
        ++found.rates;
        rate_time = row->time;
      } else {
        found.farthest_s = std::max(found.farthest_s, core::seconds(row->time - rate_time));
      }
    }
    found.warnings = reader.warnings();
    return found;
  }

  void expect_warning(const Found& found, const std::string& what) {
    ASSERT_EQ(found.warnings.size(), 1U);
    EXPECT_EQ(found.warnings[0], path("a.mcap").string() + ": left out: " + what);
  }
};

TEST_F(StampedAhead, InTimeNothingIsLeftOutAndNothingSaid) {
  const Found found = read({});
  EXPECT_EQ(found.counts(), (std::vector<std::uint64_t>(4, kAll)));
  EXPECT_EQ(found.warnings, std::vector<std::string>{});
}

// Before: one held up its stream until the rates got there, or for good, without a word.
TEST_F(StampedAhead, ReadingsAreLeftOutAndCountedAndTheOthersGivenOut) {
  for (const double by_s : {200.0, 7200.0, 1e5, 1.7e9}) {
    for (const int first : {0, 1, 150}) {
      for (const int count : {1, 2, 30}) {
        SCOPED_TRACE(std::to_string(by_s) + " s from " + std::to_string(first) + ", " +
                     std::to_string(count));
        for (const auto order : {TimeOrder::kStrictlyIncreasing, TimeOrder::kAsFound}) {
          const Found found = read({.reading = ahead_by(by_s, first, count)}, order);
          EXPECT_EQ(found.counts(),
                    (std::vector<std::uint64_t>{kAll, kAll - static_cast<std::uint64_t>(count),
                                                kAll, kAll}));
          expect_warning(found, std::to_string(count) + (count == 1 ? " sample" : " samples") +
                                    kLeftOut + "more than 60 s ahead of a later one");
        }
      }
    }
  }
}

TEST_F(StampedAhead, ReferencesAndEnvironmentToo) {
  const Found found =
      read({.reference = ahead_by(3600.0, 100, 1), .environment = ahead_by(3600.0, 200, 2)});
  EXPECT_EQ(found.counts(), (std::vector<std::uint64_t>{kAll, kAll, kAll - 1, kAll - 2}));
  expect_warning(found,
                 "3 samples" + std::string(kLeftOut) + "more than 60 s ahead of a later one");
}

// Before: all that was measured in the hour up to its stamp came in before the next rate.
TEST_F(StampedAhead, ARateDrawsNothingAlong) {
  const Found found = read({.rate = ahead_by(3600.0, 100, 1)}, TimeOrder::kAsFound);
  EXPECT_EQ(found.counts(), (std::vector<std::uint64_t>(4, kAll)));
  EXPECT_LE(found.farthest_s, 1.0);
  EXPECT_EQ(found.warnings, std::vector<std::string>{});
  EXPECT_THROW(read({.rate = ahead_by(3600.0, 100, 1)}), files::FileError) << "as in a CSV record";
}

// A thermometer by another clock: no stamp is ahead of the others, and none comes due.
TEST_F(StampedAhead, AStreamThatNeverComesDueIsNamedAtTheEnd) {
  const Found found = read({.reading = ahead_by(1.7e9, 0, 300)});
  EXPECT_EQ(found.temperatures, 0U);
  expect_warning(found,
                 "300 samples" + std::string(kLeftOut) + "more than 60 s after the last rate");
}

// Before: the end marks of each replay, an hour behind its last rate, were said to be lost.
TEST_F(StampedAhead, WhatHasNoValueIsNotLost) {
  for (const int runs : {1, 2}) {
    Recording recording;
    for (int second = 0; second < 200 * runs; ++second) {
      recording.add(1, reading_at(second, "coil", 20.0));
      recording.add(1, environment_at(second, 5.0));
      recording.add(1, rate_at(second, static_cast<std::uint64_t>(second)));
      if (second % 200 != 199) continue;
      auto end = reading_at(second + 3600.0, "coil", 0.0);
      end.measured = false;
      recording.add(1, end);
      recording.add(1, environment_at(second + 3600.0, core::kNotMeasured));
    }
    RecordReader reader(recording.write_to(path("a.mcap")));
    while (reader.next() != nullptr) {
    }
    EXPECT_EQ(reader.warnings(), std::vector<std::string>{}) << runs;
  }
}

TEST_F(StampedAhead, WhatWaitedBehindAStampUntilTheEndIsNamed) {
  const Found found = read({.reading = ahead_by(50.0, 290, 1)});
  EXPECT_EQ(found.temperatures, 290U);
  ASSERT_EQ(found.warnings.size(), 1U);
  EXPECT_NE(found.warnings[0].find("whose time went back are left out"), std::string::npos);
}

TEST_F(StampedAhead, AGapOfOneStreamAndReadingsBehindTheLastRateAreOrdinary) {
  const Found gap =
      read({.reading = [](int second) { return second < 10 ? second : second + 100.0; }});
  EXPECT_EQ(gap.temperatures, 200U);
  expect_warning(gap, "40 samples" + std::string(kLeftOut) + "more than 60 s after the last rate");
  const Found rate_gap =
      read({.rate = [](int second) { return second < 200 ? second : second + 3600.0; }});
  EXPECT_EQ(rate_gap.counts(), (std::vector<std::uint64_t>(4, kAll)));
  EXPECT_EQ(rate_gap.warnings, std::vector<std::string>{});
  const Found later = read({.reading = ahead_by(30.0, 0, 300)});
  EXPECT_EQ(later.temperatures, 270U);
  EXPECT_EQ(later.warnings, std::vector<std::string>{});
}

// A recording whose clocks are set back: what was recorded before that comes before it.
class SetBack : public McapRecord {
 protected:
  struct Clocks {
    double rates_back_s = 0.0;  // halfway
    double readings_back_s = 0.0;
    double every_s = 1.0;  // a reading
    double late_s = 0.0;   // how long after its time one is recorded; below 0: ahead
  };
  static constexpr double kEveryS = 0.1;  // a rate
  static constexpr int kHalf = 3000;      // rates

  // Readings tell the true time, in which the record was made.
  void expect_in_place(const Clocks& clocks) {
    SCOPED_TRACE(std::to_string(clocks.rates_back_s) + " s back, readings " +
                 std::to_string(clocks.readings_back_s) + " s back, one every " +
                 std::to_string(clocks.every_s) + " s, late by " + std::to_string(clocks.late_s));
    const auto stamp_s = [](double true_s, double back_s) {
      return true_s < kHalf * kEveryS ? true_s : true_s - back_s;
    };
    Recording recording;
    std::uint64_t recorded = 0;
    for (int k = 0; k < 2 * kHalf; ++k) {
      const double now_s = kEveryS * k;
      for (;; ++recorded) {
        const double of_s = clocks.every_s * static_cast<double>(recorded) + 0.025;
        if (of_s + clocks.late_s > now_s) break;
        recording.add(1, reading_at(stamp_s(of_s, clocks.readings_back_s), "coil", of_s));
        recording.add(1, environment_at(stamp_s(of_s, clocks.readings_back_s), of_s));
      }
      recording.add(1, rate_at(stamp_s(now_s, clocks.rates_back_s), static_cast<std::uint64_t>(k)));
    }
    RecordReader reader(recording.write_to(path("a.mcap")), {.time_order = TimeOrder::kAsFound});
    std::uint64_t rates = 0;
    std::uint64_t readings = 0;
    std::uint64_t environments = 0;
    const double near_s = std::abs(clocks.late_s) + clocks.every_s + 2 * kEveryS;
    while (const RecordRow* row = reader.next()) {
      if (brings_rate(*row)) {
        ASSERT_EQ(to_angular_rate(*row).sequence, rates++);
      }
      environments += row->recorded->environment ? 1U : 0U;
      if (!brings_temperature(*row, 0)) continue;
      ++readings;
      ASSERT_NEAR(kEveryS * static_cast<double>(rates), row->temperature_degc[0], near_s);
    }
    EXPECT_EQ(rates, 2U * kHalf);
    EXPECT_EQ(environments, readings);
    // Those that are stamped after the last rate are none of the record.
    EXPECT_LE(readings, recorded);
    EXPECT_GE(static_cast<double>(readings),
              static_cast<double>(recorded) + std::min(clocks.late_s, 0.0) / clocks.every_s - 1.0);
    EXPECT_EQ(reader.warnings(), std::vector<std::string>{});
  }
};

// Before: all readings behind the step were given out before the rates that precede them.
TEST_F(SetBack, ReadingsComeBetweenTheRatesThatTheyWereRecordedBetween) {
  for (const double back_s : {0.0, 1.0, 5.0, 45.0, 100.0, 300.0, 1e6}) {
    for (const double every_s : {0.5, 1.0, 10.0}) {
      for (const double late_s : {-10.0, -0.3, 0.0, 0.3, 2.0}) {
        expect_in_place({.rates_back_s = back_s,
                         .readings_back_s = back_s,
                         .every_s = every_s,
                         .late_s = late_s});
      }
    }
  }
}

// As long as it isn't back where it was; then the stamps tell again what belongs together.
TEST_F(SetBack, OneAloneAlso) {
  for (const double back_s : {400.0, 1e6}) {
    for (const double late_s : {-0.3, 0.3}) {
      expect_in_place({.rates_back_s = back_s, .late_s = late_s});
      expect_in_place({.readings_back_s = back_s, .late_s = late_s});
    }
  }
}

// The reader goes by what is in the file, not by its name: also by that of a recording that is
// still being written.
TEST_F(McapRecord, ACutOneGivesWhatIsWholeAndSaysSo) {
  Recording recording;
  for (std::uint64_t i = 0; i < 50; ++i)
    recording.add(1, rate_at(0.01 * static_cast<double>(i), i));
  const std::string bytes = recording.bytes_so_far();
  for (const std::size_t cut : {bytes.size(), bytes.size() / 2}) {
    RecordReader reader(write("run.mcap.active", bytes.substr(0, cut)));
    std::uint64_t rows = 0;
    while (const RecordRow* row = reader.next()) EXPECT_EQ(to_angular_rate(*row).sequence, rows++);
    EXPECT_GT(rows, cut == bytes.size() ? 49U : 10U);
    ASSERT_EQ(reader.warnings().size(), 1U);
    EXPECT_NE(reader.warnings()[0].find("it was cut, or is still being written"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace zerodrift::record
