// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "common/files/file_error.h"
#include "common/record/bag_files.h"
#include "common/record/record_reader.h"
#include "common/record/record_samples.h"
#include "tests/unit/record/record_folder.h"
#include "tests/unit/record/ros2_bag_file.h"

namespace zerodrift::record {
namespace {

constexpr const char* kImuTopic = "/imu/data_raw";

class RosBag : public RecordFolder {
 protected:
  // What a reader warned of by its end.
  [[nodiscard]] std::vector<std::string> warnings(const std::filesystem::path& file,
                                                  const RecordOptions& options = {}) const {
    RecordReader reader(file, options);
    while (reader.next() != nullptr) {
    }
    std::vector<std::string> lines;
    for (const auto& line : reader.warnings()) lines.push_back(shown(line));
    return lines;
  }
  std::filesystem::path folder(const std::string& metadata) const {
    std::filesystem::create_directory(path("bag"));
    write("bag/metadata.yaml", metadata);
    return path("bag");
  }
};

std::string metadata_of(const std::string& files, const std::string& storage = "mcap",
                        const std::string& mode = "") {
  return "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: " + storage +
         "\n  compression_format: \"\"\n  compression_mode: \"" + mode +
         "\"\n  relative_file_paths: [" + files + "]\n  message_count: 3\n";
}

TEST_F(RosBag, RatesAndTemperaturesAreThoseOfTheMessagesToTheBitInAnyCompressionAndByteOrder) {
  for (const auto compression :
       {mcap::Compression::kNone, mcap::Compression::kLz4, mcap::Compression::kZstd}) {
    Ros2Bag bag(compression);
    bag.put("/chatter", "std_msgs/msg/String", "not for us");
    for (int n = 0; n < 200; ++n) {
      bag.imu(kImuTopic, imu_at(n), n % 2 == 0 ? std::endian::little : std::endian::big);
      if (n % 50 == 0) bag.temperature("/imu/temperature", temperature_at(n, 20.0 + n));
    }
    RecordReader reader(bag.write_to(path("run.mcap")));
    const RecordInfo& info = reader.info();
    EXPECT_EQ(info.gyro_id, 0U) << "a bag names no gyro";
    EXPECT_EQ(info.columns, (std::vector<std::string>{"time_s", "rate_x_rad_s", "rate_y_rad_s",
                                                      "rate_z_rad_s", "temperature_coil_degC"}));
    EXPECT_EQ(info.has_rate, (core::PerAxis<bool>{true, true, true}));
    EXPECT_DOUBLE_EQ(info.sample_period_s, 0.01);
    EXPECT_EQ(info.first_interval_s, info.sample_period_s);
    core::TemperatureSample reading;
    for (int n = 0; n < 200; ++n) {
      const RecordRow* row = reader.next();
      ASSERT_NE(row, nullptr);
      ASSERT_TRUE(brings_rate(*row));
      const core::AngularRateSample sample = to_angular_rate(*row);
      EXPECT_EQ(sample.time, core::sensor_time(imu_at(n).stamp));
      EXPECT_EQ(sample.sequence, static_cast<std::uint64_t>(n));
      EXPECT_EQ(sample.rate_radps, imu_at(n).rate_radps);
      EXPECT_EQ(row->rate_radps, imu_at(n).rate_radps);
      EXPECT_EQ(sample.valid, (core::PerAxis<bool>{true, true, true}));
      EXPECT_EQ(sample.interval_s, 0.01);
      EXPECT_EQ(sample.clock, core::ClockSource::kReplay);
      ASSERT_EQ(brings_temperature(*row, 0), n % 50 == 0);
      if (n % 50 != 0) continue;
      to_temperature(*row, info, 0, reading);
      EXPECT_EQ(reading.temperature_degc, 20.0 + n);
      EXPECT_EQ(reading.probe, "coil");
      EXPECT_TRUE(reading.measured);
    }
    EXPECT_EQ(reader.next(), nullptr);
  }
}

TEST_F(RosBag, TheOnlyTopicsAreTakenAndSaid) {
  Ros2Bag bag;
  bag.imu(kImuTopic, imu_at(0));
  bag.imu(kImuTopic, imu_at(1));
  bag.temperature("/imu/temperature", temperature_at(0, 20.0));
  EXPECT_EQ(warnings(bag.write_to(path("a.mcap"))),
            (std::vector<std::string>{
                "a.mcap: takes /imu/data_raw, the only topic of sensor_msgs/msg/Imu",
                "a.mcap: takes /imu/temperature for the temperature of 'coil', the only topic of "
                "sensor_msgs/msg/Temperature"}));
  EXPECT_EQ(warnings(path("a.mcap"), {.topics = {"imu/data_raw", {"case=/imu/temperature"}}}),
            std::vector<std::string>{})
      << "asked for, with and without the leading slash";
}

// A bag may come from anywhere: its names are looked up as they are, not taken apart.
TEST_F(RosBag, ATopicWithAnEqualsSignIsTakenAsItIs) {
  for (const char* topic : {"=x", "a b=c", "="}) {
    Ros2Bag bag;
    bag.imu(kImuTopic, imu_at(0));
    bag.temperature(topic, temperature_at(0, 20.0));
    RecordReader reader(bag.write_to(path("a.mcap")));
    EXPECT_EQ(reader.info().probes, std::vector<std::string>{"coil"});
    const RecordRow* row = reader.next();
    ASSERT_NE(row, nullptr);
    EXPECT_EQ(row->temperature_degc[0], 20.0);
  }
}

TEST_F(RosBag, OfSeveralTopicsOneIsChosen) {
  Ros2Bag bag;
  for (int n = 0; n < 3; ++n) {
    bag.imu("/a", imu_at(n));
    bag.imu("/b", imu_at(10 + n));
    bag.temperature("/t/left", temperature_at(n, 1.0));
    bag.temperature("/t/right", temperature_at(n, 2.0));
  }
  bag.put("/tf", "tf2_msgs/msg/TFMessage", "x");
  bag.put("/json", kImuType, "{}", "jsonschema", "json");
  const auto file = bag.write_to(path("two.mcap"));
  EXPECT_EQ(refusal(file),
            "two.mcap: holds several topics of sensor_msgs/msg/Imu: /a, /b; choose one by --topic");
  EXPECT_EQ(
      refusal(file, {.topics = {"/c", {}}}),
      "two.mcap: has no topic /c, which --topic names; topics of sensor_msgs/msg/Imu: /a, /b");
  EXPECT_EQ(refusal(file, {.topics = {"/tf", {}}}),
            "two.mcap: --topic: found /tf of tf2_msgs/msg/TFMessage in cdr with ros2msg, expected "
            "sensor_msgs/msg/Imu in cdr with ros2msg or ros2idl");
  EXPECT_EQ(refusal(file, {.topics = {"/json", {}}}),
            "two.mcap: --topic: found /json of sensor_msgs/msg/Imu in json with jsonschema, "
            "expected sensor_msgs/msg/Imu in cdr with ros2msg or ros2idl");
  EXPECT_EQ(refusal(file, {.topics = {"/a", {"/t/left", "coil=/t/right"}}}),
            "two.mcap: --temperature-topic: names probe 'coil' twice; expected PROBE=TOPIC, each "
            "probe once");
  EXPECT_EQ(
      refusal(file, {.topics = {"/a", {"a b=/t/left"}}}),
      "two.mcap: --temperature-topic: found 'a b=/t/left', expected TOPIC or PROBE=TOPIC, the "
      "probe of letters, digits and '_'");
  RecordReader reader(file, {.topics = {"/b", {"left=/t/left", "right=/t/right"}}});
  EXPECT_EQ(reader.info().probes, (std::vector<std::string>{"left", "right"}));
  EXPECT_EQ(reader.info().first_time, core::sensor_time(imu_at(10).stamp));
  EXPECT_EQ(warnings(file, {.topics = {"/b", {}}}),
            std::vector<std::string>{"two.mcap: takes no temperature: of /t/left, /t/right choose "
                                     "by --temperature-topic"});
}

TEST_F(RosBag, WithoutAnImuIsNoRecordAndSaysWhatThereIs) {
  Ros2Bag bag;
  bag.put("/scan", "sensor_msgs/msg/LaserScan", "x");
  EXPECT_EQ(
      refusal(bag.write_to(path("a.mcap"))),
      "a.mcap: has no topic of sensor_msgs/msg/Imu in cdr with ros2msg or ros2idl, of which a "
      "record is made; found /scan (sensor_msgs/msg/LaserScan)");
}

TEST_F(RosBag, AFolderIsReadInTheOrderOfItsMetadata) {
  const auto bag = folder(metadata_of("run_0.mcap, run_1.mcap"));
  for (int part = 0; part < 2; ++part) {
    Ros2Bag file;
    // Of another order of topics in each: ids of channels are a file's own.
    if (part == 1) file.temperature("/imu/temperature", temperature_at(100, 30.0));
    for (int n = 0; n < 100; ++n) file.imu(kImuTopic, imu_at(100 * part + n));
    file.write_to(bag / ("run_" + std::to_string(part) + ".mcap"));
  }
  RecordReader reader(bag);
  for (int n = 0; n < 200; ++n) {
    const RecordRow* row = reader.next();
    ASSERT_NE(row, nullptr);
    EXPECT_EQ(to_angular_rate(*row).sequence, static_cast<std::uint64_t>(n));
    EXPECT_EQ(to_angular_rate(*row).rate_radps, imu_at(n).rate_radps);
    EXPECT_EQ(brings_temperature(*row, 0), n == 100);
  }
  EXPECT_EQ(reader.next(), nullptr);
  EXPECT_EQ(
      input_files_of(bag.string()),
      (std::vector<std::string>{(bag / "metadata.yaml").string(), (bag / "run_0.mcap").string(),
                                (bag / "run_1.mcap").string()}));
  std::filesystem::remove(bag / "run_1.mcap");
  EXPECT_NE(refusal(bag).find("run_1.mcap"), std::string::npos);
}

TEST_F(RosBag, StoredOtherwiseIsRefusedWithTheCure) {
  const std::string sqlite = refusal(folder(metadata_of("run_0.db3", "sqlite3")));
  EXPECT_TRUE(sqlite.starts_with(
      "bag/metadata.yaml: storage_identifier: found 'sqlite3', expected 'mcap'; convert it with "
      "`ros2 bag convert"))
      << sqlite;
  EXPECT_TRUE(refusal(folder(metadata_of("run_0.mcap.zstd", "mcap", "FILE")))
                  .starts_with("bag/metadata.yaml: compression_mode: found 'file', expected none"));
  using namespace std::string_literals;
  EXPECT_TRUE(
      refusal(write("run.db3", "SQLite format 3\0and more"s))
          .starts_with("run.db3: is a bag of ROS 2 in SQLite, expected one in MCAP; convert "
                       "it with `ros2 bag convert"));
  EXPECT_TRUE(refusal(write("run.bag", "#ROSBAG V2.0\n"))
                  .starts_with("run.bag: is a bag of ROS 1, expected one of ROS 2 in MCAP"));
  EXPECT_TRUE(refusal(write("run.mcap.zstd", "\x28\xb5\x2f\xfd"))
                  .starts_with("run.mcap.zstd: is compressed as a whole, expected .mcap"));
  std::filesystem::create_directory(path("empty"));
  EXPECT_EQ(refusal(path("empty")),
            "empty: is a folder without metadata.yaml, expected a file, or the folder of a ROS 2 "
            "bag (`ros2 bag reindex` writes a lost metadata.yaml)");
}

TEST_F(RosBag, MetadataThatLeavesTheFolderOrIsNoneIsRefusedInOneLine) {
  const auto refused = [](const std::string& text) {
    try {
      static_cast<void>(parse_bag_metadata(text, "metadata.yaml"));
    } catch (const files::FileError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  for (const char* outside : {"../a.mcap", "/etc/passwd", "a/../../b", "''", "[a]"}) {
    EXPECT_NE(refused(metadata_of(outside)).find("expected the name of a file in the bag's folder"),
              std::string::npos)
        << outside << refused(metadata_of(outside));
  }
  EXPECT_EQ(parse_bag_metadata(metadata_of("bag/a_0.mcap"), "").files,
            std::vector<std::string>{"bag/a_0.mcap"});
  EXPECT_NE(refused(metadata_of("")).find("relative_file_paths: found no list"), std::string::npos);
  for (const char* none : {"", "[]", "a: b", "rosbag2_bagfile_information: 3", "&a [*a]"})
    EXPECT_NE(refused(none).find("rosbag2_bagfile_information"), std::string::npos) << none;
  EXPECT_NE(refused("a: [").find("metadata.yaml:"), std::string::npos);
}

TEST_F(RosBag, MessagesWithoutAStampOrUnreadableAreCountedAndLeftOut) {
  Ros2Bag bag;
  for (int n = 0; n < 10; ++n) {
    auto imu = imu_at(n);
    if (n == 3 || n == 4) imu.stamp = {};
    if (n == 7) {
      bag.put(kImuTopic, kImuType, "no message");
    } else {
      bag.imu(kImuTopic, imu);
    }
  }
  const auto file = bag.write_to(path("a.mcap"));
  const RecordOptions asked{.topics = {kImuTopic, {}}};
  EXPECT_EQ(warnings(file, asked),
            (std::vector<std::string>{
                "a.mcap: /imu/data_raw: 2 messages without a stamp (header.stamp is 0, or no time) "
                "are left out",
                "a.mcap: /imu/data_raw: 1 message that is no sensor_msgs/msg/Imu in cdr is left "
                "out"}));
  RecordReader reader(file, asked);
  std::vector<std::uint64_t> numbers;
  while (const RecordRow* row = reader.next()) numbers.push_back(to_angular_rate(*row).sequence);
  EXPECT_EQ(numbers, (std::vector<std::uint64_t>{0, 1, 2, 5, 6, 8, 9}));
}

TEST_F(RosBag, WithoutAnyStampOrAnyAngularVelocityIsRefusedWithTheReason) {
  Ros2Bag unstamped;
  for (int n = 0; n < 3; ++n) unstamped.imu(kImuTopic, {.rate_radps = {1.0, 2.0, 3.0}});
  EXPECT_EQ(refusal(unstamped.write_to(path("a.mcap"))),
            "a.mcap: no message of /imu/data_raw can be read; /imu/data_raw: 3 messages without a "
            "stamp (header.stamp is 0, or no time) are left out");
  Ros2Bag absent;
  for (int n = 0; n < 3; ++n) {
    auto imu = imu_at(n);
    imu.covariance_radps2[0] = -1.0;
    absent.imu(kImuTopic, imu);
  }
  EXPECT_EQ(refusal(absent.write_to(path("b.mcap"))),
            "b.mcap: /imu/data_raw: none of its messages has an angular velocity: its "
            "covariance begins with -1, or the rates are not finite");
}

TEST_F(RosBag, AMessageWithoutAngularVelocityIsASampleWithoutAValidAxis) {
  Ros2Bag bag;
  for (int n = 0; n < 3; ++n) {
    auto imu = imu_at(n);
    if (n == 1) imu.covariance_radps2[0] = -1.0;
    bag.imu(kImuTopic, imu);
  }
  RecordReader reader(bag.write_to(path("a.mcap")));
  ASSERT_NE(reader.next(), nullptr);
  const RecordRow* row = reader.next();
  EXPECT_EQ(to_angular_rate(*row).valid, (core::PerAxis<bool>{}));
  EXPECT_TRUE(std::isnan(row->rate_radps[0]));
}

TEST_F(RosBag, AStampThatGoesBackIsAnErrorUnlessTheStreamIsAskedForAsItWas) {
  Ros2Bag bag;
  for (const int n : {0, 1, 3, 2, 4}) bag.imu(kImuTopic, imu_at(n));
  const auto file = bag.write_to(path("a.mcap"));
  EXPECT_EQ(
      refusal(file),
      "a.mcap: /imu/data_raw, sequence number 3: time 1700000000.020000000 s is not after the "
      "one before (1700000000.030000000 s); a record's time strictly increases");
  RecordReader reader(file, {.time_order = TimeOrder::kAsFound});
  while (reader.next() != nullptr) {
  }
  EXPECT_EQ(reader.rows_out_of_order(), 1U);
}

TEST_F(RosBag, TopicsAreChosenOfBagsAlone) {
  EXPECT_EQ(refusal(write("a.csv", "time_s,rate_x_rad_s\n0,1\n"), {.topics = {"/imu", {}}}),
            "a.csv: is no bag of ROS 2, of which --topic and --temperature-topic choose");
}

}  // namespace
}  // namespace zerodrift::record
