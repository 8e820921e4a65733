// SPDX-License-Identifier: Apache-2.0
// Ids that somebody made up: they cost a bounded amount of memory, no gyro its answers, and no
// process its end.
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdio>
#include <string>

#include "tests/system/system_under_test.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t kForged = 300;
constexpr std::uint32_t kFirstForged = 1000;
constexpr double kMegabyte = 1048576.0;

msg::AngularRate rate(std::uint32_t gyro_id, std::uint64_t sequence) {
  msg::AngularRate message;
  message.gyro_id(gyro_id);
  message.validity(7);
  message.sequence_number(sequence);
  message.sensor_time_ns(static_cast<std::int64_t>(sequence + 1) * 10'000'000);
  message.interval_s(0.01);
  message.clock_source(1);
  return message;
}

TEST(TooManyGyros, CostABoundedAmountOfMemoryAndAreTold) {
  SystemUnderTest system(Domain::kTooManyGyros);
  dds::Participant participant("test", system.network());
  const Collector<msg::Event> events(participant);
  const Collector<msg::ServiceStatus> statuses(participant);
  const Collector<msg::CompensatedRate> answers(participant);
  dds::Writer<msg::AngularRate> true_gyro(participant);
  dds::Writer<msg::AngularRate> forged_rates(participant);
  dds::Writer<msg::Temperature> forged_temperatures(participant);
  dds::Writer<msg::RateReference> forged_references(participant);
  ChildProcess& compensation = system.start("compensation", {"--max-gyros", "3"});
  ASSERT_TRUE(eventually([&] {
    return true_gyro.matched() > 0 && forged_rates.matched() > 0 &&
           forged_temperatures.matched() > 0 && forged_references.matched() > 0;
  }));
  std::uint64_t sequence = 0;
  const auto answers_the_true_one = [&] {
    auto sample = rate(1, sequence);
    const std::uint64_t asked = sequence++;
    EXPECT_TRUE(true_gyro.write(sample));
    return answers.any([&](const msg::CompensatedRate& answer) {
      return answer.gyro_id() == 1 && answer.sequence_number() + 20 >= asked;
    });
  };
  ASSERT_TRUE(eventually(answers_the_true_one));
  const double before = static_cast<double>(*compensation.resident_bytes()) / kMegabyte;

  for (std::uint32_t id = kFirstForged; id < kFirstForged + kForged; ++id) {
    msg::Temperature temperature;
    temperature.gyro_id(id);
    temperature.probe("coil");
    temperature.measured(1);
    temperature.sensor_time_ns(10'000'000);
    EXPECT_TRUE(forged_temperatures.write(temperature));
    msg::RateReference reference;
    reference.gyro_id(id % 100);  // its keys are few
    reference.kind(3);
    EXPECT_TRUE(forged_references.write(reference));
  }
  ASSERT_TRUE(forged_temperatures.wait_until_received(10s));
  ASSERT_TRUE(forged_references.wait_until_received(10s));
  ASSERT_TRUE(eventually(answers_the_true_one));
  const double ids_only = static_cast<double>(*compensation.resident_bytes()) / kMegabyte;
  EXPECT_FALSE(told(events, "too_many_gyros")) << "only rates make a gyro";
  EXPECT_EQ(metric(statuses, "compensation", "gyros"), 1.0);

  for (std::uint32_t id = kFirstForged; id < kFirstForged + 100; ++id) {
    auto sample = rate(id, 0);
    EXPECT_TRUE(forged_rates.write(sample));
  }
  EXPECT_TRUE(eventually([&] { return told(events, "too_many_gyros", "--max-gyros"); }));
  EXPECT_TRUE(eventually([&] { return metric(statuses, "compensation", "gyros") == 3.0; }));
  ASSERT_TRUE(eventually(answers_the_true_one));
  const double with_rates = static_cast<double>(*compensation.resident_bytes()) / kMegabyte;
  std::printf("%.1f MB, %.1f MB with %u forged ids, %.1f MB with 3 of 101 gyros\n", before,
              ids_only, kForged, with_rates);
  // A gyro takes 5 MB; the middleware keeps an instance for each id, some kB.
  EXPECT_LT(ids_only, before + 10.0);
  EXPECT_LT(with_rates, ids_only + 25.0);
  compensation.send(SIGTERM);
  EXPECT_EQ(compensation.wait(2500ms), 0);
}

}  // namespace
}  // namespace zerodrift::system_test
