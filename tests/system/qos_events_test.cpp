// SPDX-License-Identifier: Apache-2.0
// What the middleware notices between real processes: an event with topic and peer, and a total on
// service_status.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <string>
#include <thread>

#include "common/core/samples.h"
#include "common/dds/conversions.h"
#include "tests/support/other_terms.h"
#include "tests/system/files.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

// Somebody whose rates may get lost on the way.
using CarelessRate = dds::OnOtherTerms<msg::AngularRate, dds::with_best_effort>;

msg::AngularRate rate(std::uint64_t sequence, core::ClockSource clock) {
  core::AngularRateSample sample;
  sample.sequence = sequence;
  sample.time = core::from_seconds(1000.0 + 0.005 * static_cast<double>(sequence));
  sample.interval_s = 0.005;
  sample.valid = {true, true, true};
  sample.clock = clock;
  return dds::to_message(sample, 1, 0);
}

TEST(QosEvents, AWriterThatCannotMatchIsNamedWithTopicAndPolicy) {
  SystemUnderTest system(Domain::kQosIncompatible);
  dds::Participant participant("careless_gyro", system.network());
  const Collector<msg::Event> events(participant);
  const Collector<msg::ServiceStatus> statuses(participant);
  const dds::Writer<CarelessRate> writer(participant);
  ChildProcess& service = system.start("compensation", {});
  ASSERT_TRUE(eventually([&] { return told(events, "incompatible_qos", "careless_gyro"); }));
  EXPECT_TRUE(told(events, "incompatible_qos", "topic angular_rate: "));
  EXPECT_TRUE(told(events, "incompatible_qos", "reliability best_effort"));
  EXPECT_TRUE(eventually(
      [&] { return metric(statuses, "compensation", "angular_rate_incompatible_qos") == 1.0; }));
  service.send(SIGTERM);
  EXPECT_EQ(service.wait(2000ms), 0);
}

// A gyro of 200 Hz that pauses for three deadlines is one event; a replay that pauses is none.
TEST(QosEvents, AGyroThatFallsSilentIsNamedAndAReplayIsNot) {
  SystemUnderTest system(Domain::kQosDeadline);
  dds::Participant participant("quiet_gyro", system.network());
  const Collector<msg::Event> events(participant);
  const Collector<msg::ServiceStatus> statuses(participant);
  dds::Writer<msg::AngularRate> writer(participant);
  ChildProcess& service = system.start("compensation", {});
  ASSERT_TRUE(eventually([&] { return writer.matched() > 0; }));
  std::uint64_t sequence = 0;
  const auto send = [&](core::ClockSource clock) {
    auto message = rate(++sequence, clock);
    ASSERT_TRUE(writer.write(message));
    ASSERT_TRUE(writer.wait_until_received(30000ms));
  };
  send(core::ClockSource::kReplay);
  std::this_thread::sleep_for(600ms);
  EXPECT_FALSE(told(events, "deadline_missed"));
  send(core::ClockSource::kHardware);
  ASSERT_TRUE(eventually(
      [&] { return told(events, "deadline_missed", "topic angular_rate: quiet_gyro"); }));
  EXPECT_TRUE(eventually(
      [&] { return metric(statuses, "compensation", "angular_rate_deadline_missed") == 1.0; }));
  service.send(SIGTERM);
  EXPECT_EQ(service.wait(2000ms), 0);
}

// One that stands still is told after the topic's lease, and misses nothing.
TEST(QosEvents, AReplayWaitsForAConsumerThatStandsStillAndLetsGoOfOneThatLeaves) {
  SystemUnderTest system(Domain::kQosKilled);
  const auto profile = write_ramp_profile(system, 3600);
  dds::Participant participant("test", system.network());
  const Collector<msg::Event> events(participant);
  const Collector<msg::ServiceStatus> statuses(participant);
  ChildProcess& compensation = system.start("compensation", {});
  const Arguments source{
      "--source",  "simulation",
      "--model",   std::filesystem::path(ZERODRIFT_SOURCE_DIR) / "config/models/paper_fog.yaml",
      "--profile", profile};
  system.start("thermal_publisher", source);
  Arguments gyro = source;
  gyro.insert(gyro.end(), {"--speed", "max", "--wait-for", "compensation"});
  ChildProcess& publisher = system.start("gyro_publisher", gyro);
  const auto published = [&] { return metric(statuses, "gyro_publisher:1", "samples_published"); };
  ASSERT_TRUE(eventually([&] { return published() > 1000.0; }));
  const auto taken = [&] { return metric(statuses, "compensation", "samples_out"); };
  compensation.send(SIGSTOP);
  const double before = taken();
  ASSERT_TRUE(eventually([&] {  // by the one that waits; the other publisher tells it too
    return events.any([](const msg::Event& event) {
      return std::string("gyro_publisher") == event.service().c_str() &&
             std::string("liveliness_lost") == event.code().c_str() &&
             std::string(event.text().c_str()).find("topic replay_progress: compensation (pid") !=
                 std::string::npos;
    });
  }));
  compensation.send(SIGCONT);
  ASSERT_TRUE(eventually([&] { return taken() > before + 10000.0; }));
  EXPECT_EQ(metric(statuses, "compensation", "missing"), 0.0);
  EXPECT_TRUE(eventually([&] {
    return metric(statuses, "gyro_publisher", "replay_progress_liveliness_lost") == 1.0;
  }));
  compensation.send(SIGTERM);
  EXPECT_EQ(compensation.wait(2500ms), 0);
  const double at_rest = published();  // a window further than what was taken
  EXPECT_TRUE(eventually([&] { return published() > at_rest + 10000.0; }));
  publisher.send(SIGTERM);
  EXPECT_EQ(publisher.wait(2500ms), 0);
}

}  // namespace
}  // namespace zerodrift::system_test
