// SPDX-License-Identifier: Apache-2.0
#include "common/dds/ros2_input.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>
#include <vector>

#include "common/dds/raw_reader.h"
#include "tests/unit/dds/test_domain.h"

namespace zerodrift::dds {
namespace {

using Imu = sensor_msgs::msg::dds_::Imu_;
using Temperature = sensor_msgs::msg::dds_::Temperature_;

TEST(RosInput, ATopicIsNamedWithOrWithoutItsSlash) {
  EXPECT_EQ(dds_name_of_ros_topic("/imu/data_raw"), "rt/imu/data_raw");
  EXPECT_EQ(dds_name_of_ros_topic("imu/data_raw"), "rt/imu/data_raw");
  for (const char* bad : {"", "/", "//imu", "/imu/", "imu data", "~/imu", "/1imu", "rt/imu\n"})
    EXPECT_FALSE(dds_name_of_ros_topic(bad)) << bad;
}

TEST(RosInput, AMessageSaysWhatItsFieldsSayToTheBit) {
  Imu imu;
  imu.header_().stamp_().sec_(-7);
  imu.header_().stamp_().nanosec_(3);
  imu.angular_velocity_().x_(0.1);
  imu.angular_velocity_().y_(-0.2);
  imu.angular_velocity_().z_(1e-300);
  imu.angular_velocity_covariance_() = {-1, 2, 3, 4, 5, 6, 7, 8, 9};
  const core::RosImu said = from_message(imu);
  EXPECT_EQ(said.stamp.sec, -7);
  EXPECT_EQ(said.stamp.nanosec, 3U);
  EXPECT_EQ(said.rate_radps, (core::PerAxis<double>{0.1, -0.2, 1e-300}));
  EXPECT_EQ(said.covariance_radps2, imu.angular_velocity_covariance_());

  Temperature temperature;
  temperature.header_().stamp_().sec_(9);
  temperature.temperature_(-40.1);
  EXPECT_EQ(from_message(temperature).temperature_degc, -40.1);
  EXPECT_EQ(from_message(temperature).stamp.sec, 9);
}

TEST(MissingSamples, AreThoseBetweenTwoNumbersOfTheSameWriter) {
  SampleOrigin one;
  one.writer.entityId.value[0] = 1;
  SampleOrigin other;
  other.writer.entityId.value[0] = 2;
  const auto numbered = [](SampleOrigin origin, std::uint64_t number) {
    origin.number = number;
    return origin;
  };
  MissingSamples missing;
  EXPECT_EQ(missing.before(numbered(one, 40)), 0U) << "it was there before we were";
  EXPECT_EQ(missing.before(numbered(one, 41)), 0U);
  EXPECT_EQ(missing.before(numbered(one, 45)), 3U);
  EXPECT_EQ(missing.before(numbered(one, 45)), 0U);
  EXPECT_EQ(missing.before(numbered(one, 44)), 0U);
  EXPECT_EQ(missing.before(numbered(other, 1000)), 0U) << "started again";
  EXPECT_EQ(missing.before(numbered(other, 1002)), 1U);
}

TEST(RosReader, HearsEveryMessageOfATopicInOrderAndMissesNone) {
  const TestDomain domain(113);
  Participant writing("writing", domain.network());
  Participant reading("reading", domain.network());
  std::mutex mutex;
  std::vector<double> heard;
  MissingSamples missing;
  std::uint64_t all_missing = 0;
  const RosReader<Temperature> reader(
      reading, "/imu/temperature",
      [&](const core::RosTemperature& said, const SampleOrigin& origin) {
        const std::lock_guard lock(mutex);
        heard.push_back(said.temperature_degc);
        all_missing += missing.before(origin);
      });
  TopicSpec spec = kRos2TemperatureInput;
  spec.name = reader.topic();
  Writer<Temperature> writer(writing, spec, {});
  ASSERT_TRUE(eventually([&] { return writer.matched() > 0 && reader.matched() > 0; }));
  // Best effort: each is heard before the next is sent.
  for (int n = 0; n < 20; ++n) {
    Temperature message;
    message.temperature_(20.0 + n);
    ASSERT_TRUE(writer.write(message));
    ASSERT_TRUE(eventually([&] {
      const std::lock_guard lock(mutex);
      return heard.size() == static_cast<std::size_t>(n) + 1;
    }));
    EXPECT_EQ(heard.back(), 20.0 + n);
  }
  EXPECT_EQ(all_missing, 0U);
}

// The receiving thread is held until a burst is over that no socket has room for: 5000 samples of
// 400 bytes, a buffer of some 200 kB.
TEST(RosReader, WhatABurstLosesIsCountedToTheLastSample) {
  const TestDomain domain(114);
  Participant writing("writing", domain.network());
  Participant reading("reading", domain.network());
  constexpr std::uint64_t kBurst = 5000;
  std::mutex held;
  MissingSamples missing;
  std::atomic<std::uint64_t> heard{0};
  std::atomic<std::uint64_t> missed{0};
  std::atomic<bool> is_last{false};
  std::atomic<std::uint64_t> told{0};
  const RosReader<Imu> reader(
      reading, "imu/data_raw",
      [&](const core::RosImu& said, const SampleOrigin& origin) {
        const std::lock_guard lock(held);
        ++heard;
        missed += missing.before(origin);
        is_last = said.stamp.sec == 1;
      },
      [&](const EndpointEvent& event) {
        if (event.kind == EndpointEvent::Kind::kSampleLost) told += event.count;
      });
  TopicSpec spec = kRos2ImuInput;
  spec.name = reader.topic();
  Writer<Imu> writer(writing, spec, {});
  ASSERT_TRUE(eventually([&] { return writer.matched() > 0 && reader.matched() > 0; }));
  Imu message;
  ASSERT_TRUE(writer.write(message));
  ASSERT_TRUE(eventually([&] { return heard == 1; }));
  {
    const std::lock_guard lock(held);
    for (std::uint64_t n = 0; n < kBurst; ++n) writer.write(message);
  }
  std::uint64_t more = 0;
  message.header_().stamp_().sec_(1);
  // A message that is lost is counted with the next one that comes, so the last one may not be
  // lost.
  ASSERT_TRUE(eventually([&] {
    writer.write(message);
    ++more;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return is_last && heard + missed == 1 + kBurst + more;
  })) << heard
      << " heard, " << missed << " missed of " << 1 + kBurst + more;
  if (missed == 0) GTEST_SKIP() << "the sockets of this computer have room for the burst";
  reading.report_events();
  EXPECT_EQ(told, missed) << "the middleware tells the same";
}

TEST(RosReader, ANameThatIsNoTopicsIsRefused) {
  const TestDomain domain(115);
  Participant participant("reading", domain.network());
  EXPECT_THROW(
      RosReader<Imu>(participant, "imu//data", [](const core::RosImu&, const SampleOrigin&) {}),
      std::invalid_argument);
}

}  // namespace
}  // namespace zerodrift::dds
