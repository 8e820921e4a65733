// SPDX-License-Identifier: Apache-2.0
// Rates and temperatures that a ROS 2 node publishes: same topic names, type names, wire form and
// quality of service, by another vendor's middleware.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "common/dds/ros2_imu.h"
#include "tests/support/cyclone_loopback.h"
#include "tests/system/system_under_test.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kSecond = 1'000'000'000;
// The peer's messages before the test's word are older.
constexpr std::int64_t kBegin = 1'700'000'000 * kSecond;

std::string stamp(std::int64_t time_ns) {
  return std::to_string(time_ns / kSecond) + " " + std::to_string(time_ns % kSecond);
}

std::string hexadecimal(double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), " %a", value);
  return text.data();
}

// The line that the peer prints of what it sends.
std::string line_of(const msg::AngularRate& sample) {
  std::string line = "imu " + stamp(sample.sensor_time_ns());
  for (const double rate : sample.rate_radps()) line += hexadecimal(rate);
  return line;
}

std::string line_of(const msg::Temperature& reading) {
  return "temperature " + stamp(reading.sensor_time_ns()) + hexadecimal(reading.temperature_degc());
}

template <typename Message>
std::vector<Message> since_the_word(const Collector<Message>& collector, std::uint32_t gyro_id) {
  std::vector<Message> messages;
  collector.for_each([&](const Message& message) {
    if (message.gyro_id() == gyro_id && message.sensor_time_ns() >= kBegin)
      messages.push_back(message);
  });
  return messages;
}

std::vector<std::string> lines_of(const std::string& text, const std::string& kind) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    if (line.starts_with(kind + " ")) lines.push_back(line);
  }
  return lines;
}

class Ros2Node {
 public:
  explicit Ros2Node(SystemUnderTest& system, std::uint32_t domain, std::uint64_t samples)
      : process_(system.start_foreign("ros2_sensor_peer",
                                      {std::to_string(domain), std::to_string(samples)},
                                      {{"CYCLONEDDS_URI", kLoopbackOnly}})) {}
  // All that it had to say was said.
  [[nodiscard]] bool ended() const { return process_.out().ends_with("end\n"); }
  [[nodiscard]] std::string out() const { return process_.out(); }
  [[nodiscard]] bool running() { return process_.running(); }

 private:
  ChildProcess& process_;
};

void write_rate(dds::Writer<msg::AngularRate>& writer, std::uint32_t gyro_id) {
  msg::AngularRate rate;
  rate.gyro_id(gyro_id);
  ASSERT_TRUE(writer.write(rate));
}

// The test's word to the peer that everybody is there.
constexpr std::uint32_t kWord = 99;

// Writes rates of these gyros until the first sample behind the word is there: a volatile reader of
// another vendor may leave out what was written before it had met the writer.
void write_until_heard(dds::Writer<msg::AngularRate>& writer,
                       const std::vector<std::uint32_t>& gyros,
                       const Collector<msg::AngularRate>& rates, std::uint32_t gyro_id) {
  ASSERT_TRUE(eventually([&] {
    for (const std::uint32_t gyro : gyros) write_rate(writer, gyro);
    std::this_thread::sleep_for(20ms);
    return !since_the_word(rates, gyro_id).empty();
  }));
}

TEST(Ros2Input, EverySampleOfANodeOfAnotherVendorArrivesToTheBitAndItsSilenceIsTold) {
  SystemUnderTest system(Domain::kRos2Input);
  constexpr std::uint64_t kSamples = 2000;
  dds::Participant participant("test", system.network());
  Collector<msg::AngularRate> rates(participant);
  Collector<msg::Temperature> temperatures(participant);
  Collector<msg::Event> events(participant);
  Collector<msg::ServiceStatus> statuses(participant);
  dds::Writer<msg::AngularRate> word(participant);
  system.start("gyro_publisher", {"--source", "ros2:/imu/data_raw", "--gyro-id", "3"});
  system.start("thermal_publisher", {"--source", "ros2:case=/imu/temperature", "--gyro-id", "3"});
  Ros2Node node(system, system.network().domain, kSamples);

  // Of rates the test and the peer are readers.
  ASSERT_TRUE(eventually(
      [&] { return rates.size() > 0 && temperatures.size() > 0 && word.matched() == 2; }));
  write_until_heard(word, {kWord}, rates, 3);
  ASSERT_TRUE(eventually([&] { return node.ended(); }, 60s)) << node.out().size();
  ASSERT_TRUE(eventually([&] { return since_the_word(rates, 3).size() == kSamples; }));
  const auto sent = lines_of(node.out(), "imu");
  const auto received = since_the_word(rates, 3);
  ASSERT_EQ(sent.size(), received.size());
  for (std::size_t i = 0; i < sent.size(); ++i) {
    ASSERT_EQ(line_of(received[i]), sent[i]);
    ASSERT_EQ(received[i].sequence_number() - received[0].sequence_number(), i);
    ASSERT_EQ(received[i].validity(), 0b111U);
    ASSERT_EQ(received[i].clock_source(), static_cast<std::uint32_t>(core::ClockSource::kHardware));
    if (i > 0) {
      ASSERT_EQ(received[i].interval_s(), 0.005);
    }
  }

  const auto sent_readings = lines_of(node.out(), "temperature");
  ASSERT_EQ(sent_readings.size(), kSamples / 100);
  ASSERT_TRUE(
      eventually([&] { return since_the_word(temperatures, 3).size() == sent_readings.size(); }));
  const auto readings = since_the_word(temperatures, 3);
  for (std::size_t i = 0; i < readings.size(); ++i) {
    ASSERT_EQ(line_of(readings[i]), sent_readings[i]);
    ASSERT_STREQ(readings[i].probe().c_str(), "case");
  }

  EXPECT_TRUE(node.running()) << "it is there, and says nothing";
  EXPECT_TRUE(eventually([&] { return told(events, "input_stale", "rt/imu/data_raw"); }));
  EXPECT_EQ(metric(statuses, "gyro_publisher:3", "ros2_messages_missing"), 0.0);
}

TEST(Ros2Input, ANodeInADomainOfItsOwnIsHeardThere) {
  SystemUnderTest system(Domain::kRos2InputOurs);
  constexpr std::uint64_t kSamples = 200;
  const auto other = static_cast<std::uint32_t>(Domain::kRos2InputTheirs);
  dds::NetworkOptions theirs = system.network();
  theirs.domain = other;
  dds::Participant participant("test", system.network());
  dds::Participant there("test", theirs);
  Collector<msg::AngularRate> rates(participant);
  dds::Writer<msg::AngularRate> word(there);
  system.start("gyro_publisher",
               {"--source", "ros2:imu/data_raw", "--ros2-domain", std::to_string(other)});
  // It never hears the rates of the other domain: it is let go ahead by the test's own.
  Ros2Node node(system, other, kSamples);
  ASSERT_TRUE(eventually([&] { return rates.size() > 0 && word.matched() > 0; }));
  write_until_heard(word, {1, kWord}, rates, 1);
  for (std::uint64_t n = 0; n < kSamples; ++n) {
    ASSERT_TRUE(eventually([&] { return since_the_word(rates, 1).size() > n; }));
    write_rate(word, 1);
  }
  ASSERT_TRUE(eventually([&] { return node.ended(); }));
  const auto sent = lines_of(node.out(), "imu");
  const auto received = since_the_word(rates, 1);
  ASSERT_EQ(sent.size(), received.size());
  for (std::size_t i = 0; i < sent.size(); ++i) ASSERT_EQ(line_of(received[i]), sent[i]);
}

TEST(Ros2Input, WithoutANodeItSaysWhomItWaitsForAndAnotherTypeIsTold) {
  SystemUnderTest system(Domain::kRos2InputAlone);
  dds::Participant participant("test", system.network());
  Collector<msg::Event> events(participant);
  system.start("gyro_publisher", {"--source", "ros2:/imu/temperature"});
  EXPECT_TRUE(eventually([&] {
    return told(events, "ros2_no_publisher",
                "nobody publishes rt/imu/temperature (sensor_msgs::msg::dds_::Imu_) in domain " +
                    std::to_string(system.network().domain));
  }));
  Ros2Node node(system, system.network().domain, 1);
  EXPECT_TRUE(eventually([&] { return told(events, "type_mismatch", "rt/imu/temperature"); }));
}

// Rule: who can use nothing of what is published is not well. Before: it waited, in good health.
TEST(Ros2Input, ATopicOfWhichNoMessageHasAStampIsDegraded) {
  SystemUnderTest system(Domain::kRos2InputAlone);
  dds::Participant participant("test", system.network());
  Collector<msg::Event> events(participant);
  Collector<msg::ServiceStatus> statuses(participant);
  dds::RosImuWriter node(participant, {.name = "imu/unstamped"}, 1);
  system.start("gyro_publisher", {"--source", "ros2:/imu/unstamped"});
  const auto is = [&](std::uint32_t state, const std::string& summary) {
    return statuses.any([&](const msg::ServiceStatus& status) {
      return std::string(status.service().c_str()) == "gyro_publisher" && status.state() == state &&
             std::string(status.summary().c_str()).ends_with(summary);
    });
  };
  constexpr std::uint32_t kRunning = 2;
  constexpr std::uint32_t kDegraded = 3;
  EXPECT_TRUE(eventually([&] {
    node.write(msg::CompensatedRate{});
    std::this_thread::sleep_for(20ms);
    return is(kDegraded,
              "0 samples published: all messages of rt/imu/unstamped lack a header.stamp");
  }));
  EXPECT_TRUE(eventually([&] { return told(events, "ros2_stamp_missing", "rt/imu/unstamped"); }));
  msg::CompensatedRate stamped;
  stamped.sensor_time_ns(kBegin);
  EXPECT_TRUE(eventually([&] {
    stamped.sensor_time_ns(stamped.sensor_time_ns() + kSecond / 100);
    node.write(stamped);
    std::this_thread::sleep_for(10ms);
    return is(kRunning, " published");
  }));
}

TEST(Ros2Input, ATopicThatRos2WouldRefuseIsRefusedAtTheStart) {
  SystemUnderTest system(Domain::kRos2InputBad);
  const std::string domain = std::to_string(system.network().domain);
  for (const char* wrong : {"ros2:", "ros2:/", "ros2:/imu//data", "ros2:/imu data"}) {
    const Finished finished = system.run("gyro_publisher", {"--source", wrong, "--domain", domain});
    EXPECT_EQ(finished.exit_code, 2) << wrong;
    EXPECT_NE(finished.err.find("expected the name of a ROS 2 topic such as /imu/data_raw"),
              std::string::npos)
        << finished.err;
  }
  const Finished probe =
      system.run("thermal_publisher", {"--source", "ros2:a b=/t", "--domain", domain});
  EXPECT_EQ(probe.exit_code, 2);
  EXPECT_NE(probe.err.find("expected TOPIC or PROBE=TOPIC"), std::string::npos) << probe.err;
}

}  // namespace
}  // namespace zerodrift::system_test
