// SPDX-License-Identifier: Apache-2.0
// Every process ends with 0 within two seconds of SIGINT or SIGTERM, whatever it is waiting for.
// (That nothing is left in /dev/shm, SystemUnderTest checks in every test.) A process that is
// killed takes no other with it.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <random>
#include <string>
#include <thread>

#include "common/core/mode.h"
#include "common/core/units.h"
#include "common/dds/conversions.h"
#include "common/service/monotonic_clock.h"
#include "tests/system/files.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

using core::Mode;
using core::Reason;
using core::Rung;
using namespace std::chrono_literals;

// 10 s on a loaded machine (ChildProcess::wait). A consumer that was killed is remembered for 20 s:
// who waits for it ends later.
constexpr auto kStopsWithin = 3s;

bool is_received(const Collector<msg::ServiceStatus>& statuses, const std::string& service) {
  return eventually([&] {
    return statuses.any([&](const auto& status) { return service == status.service().c_str(); });
  });
}

TEST(Stop, EveryProcessThatRunsAloneEndsOnEitherSignal) {
  SystemUnderTest system(Domain::kStopAlone);
  const Arguments source = Arguments{"--source", "simulation"} +
                           Simulation{.profile = write_ramp_profile(system, 3600)}.arguments();
  write(system.path("sys/class/hwmon/hwmon0/temp1_input"), "21500\n");
  struct Service {
    std::string heard_as;
    std::string program;
    Arguments arguments;
  };
  const std::vector<Service> services{
      {"compensation", "compensation", {}},
      {"allan_monitor", "allan_monitor", {}},
      {"gyro_publisher", "gyro_publisher", source},
      {"thermal_publisher", "thermal_publisher", source},
      {"thermal_publisher",
       "thermal_publisher",
       {"--source", "sysfs", "--sysfs-root", system.path("sys")}},
      {"recorder", "zerodrift", {"record", "--out", system.path("out.csv")}},
      {"", "zerodrift", {"ctl", "status", "--follow"}}};
  dds::Participant participant("test", system.network());
  for (const Service& service : services) {
    for (const int signal : {SIGINT, SIGTERM}) {
      SCOPED_TRACE(service.program + " " + std::to_string(signal));
      Collector<msg::ServiceStatus> statuses(participant);
      ChildProcess& process = system.start(service.program, service.arguments);
      if (service.heard_as.empty()) {
        ASSERT_TRUE(eventually([&] { return process.heeds_stop_signals(); }));
      } else {
        ASSERT_TRUE(is_received(statuses, service.heard_as));
      }
      process.send(signal);
      EXPECT_EQ(process.wait(kStopsWithin), 0);
    }
  }
}

// All that run beside each other at full speed on an endless simulation.
struct Chain {
  explicit Chain(SystemUnderTest& system, const Arguments& speed)
      : source(Arguments{"--source", "simulation"} +
               Simulation{.profile = write_ramp_profile(system, 100000)}.arguments() + speed),
        monitor(system.start("allan_monitor", {})),
        compensation(system.start("compensation", {})),
        thermal(system.start("thermal_publisher", source)),
        gyro(system.start("gyro_publisher", source + Arguments{"--rate", "50", "--wait-for",
                                                               "compensation,allan_monitor"})) {}
  Arguments source;
  ChildProcess& monitor;
  ChildProcess& compensation;
  ChildProcess& thermal;
  ChildProcess& gyro;
};

bool count_reaches(const Collector<msg::ServiceStatus>& statuses, const std::string& service,
                   const std::string& name, double value) {
  return eventually([&] { return metric(statuses, service, name) >= value; });
}

TEST(Stop, AllProcessesOfARunEndOnCtrlC) {
  SystemUnderTest system(Domain::kStopInMidRun);
  dds::Participant participant("test", system.network());
  Collector<msg::ServiceStatus> statuses(participant);
  Chain chain(system, {"--speed", "max"});
  ASSERT_TRUE(count_reaches(statuses, "allan_monitor", "samples", 1000));
  for (ChildProcess* process : {&chain.monitor, &chain.compensation, &chain.thermal, &chain.gyro}) {
    process->send(SIGINT);
  }
  const auto signalled = std::chrono::steady_clock::now();
  for (ChildProcess* process : {&chain.monitor, &chain.compensation, &chain.thermal, &chain.gyro}) {
    EXPECT_EQ(process->wait(kStopsWithin), 0) << process->name();
  }
  EXPECT_LT(std::chrono::steady_clock::now() - signalled, 10s);
}

// A consumer that was killed stays matched for the participants' lease (20 s): whoever waits for
// its receipts or its progress must still stop.
TEST(Stop, PublishersWhoseConsumerWasKilledEndWhenTold) {
  SystemUnderTest system(Domain::kStopWithoutConsumer);
  dds::Participant participant("test", system.network());
  Collector<msg::ServiceStatus> statuses(participant);
  Chain chain(system, {"--speed", "max"});
  ASSERT_TRUE(count_reaches(statuses, "compensation", "samples_out", 1000));
  chain.compensation.send(SIGKILL);
  ASSERT_EQ(chain.compensation.wait(kStopsWithin), 128 + SIGKILL);
  std::this_thread::sleep_for(500ms);  // they run into the waiting
  chain.gyro.send(SIGTERM);
  chain.thermal.send(SIGTERM);
  EXPECT_EQ(chain.gyro.wait(kStopsWithin), 0);
  EXPECT_EQ(chain.thermal.wait(kStopsWithin), 0);
}

TEST(Stop, PublishersThatSleepThroughAPauseOfTheRecordEndWhenTold) {
  SystemUnderTest system(Domain::kStopInPause);
  dds::Participant participant("test", system.network());
  Collector<msg::ServiceStatus> statuses(participant);
  write(system.path("pause.csv"),
        "time_s,rate_x_rad_s,temperature_coil_degC\n0.0,1e-6,20\n0.1,1e-6,20\n3600.0,1e-6,20\n");
  const Arguments source{"--source", "record", "--record",   system.path("pause.csv"),
                         "--speed",  "1",      "--wait-for", ""};
  ChildProcess& gyro = system.start("gyro_publisher", source);
  ChildProcess& thermal = system.start("thermal_publisher", source);
  ASSERT_TRUE(count_reaches(statuses, "gyro_publisher:1", "samples_published", 2));
  ASSERT_TRUE(count_reaches(statuses, "thermal_publisher:1", "readings_published", 2));
  gyro.send(SIGTERM);
  thermal.send(SIGTERM);
  EXPECT_EQ(gyro.wait(kStopsWithin), 0);
  EXPECT_EQ(thermal.wait(kStopsWithin), 0);
}

bool is_stale(const msg::CompensatedRate& answer) {
  return answer.mode()[0] == static_cast<std::uint8_t>(Mode::kFallback) &&
         answer.reason()[0] == static_cast<std::uint8_t>(Reason::kTemperatureStale);
}

bool has_a_bias(const msg::CompensatedRate& answer) {
  return answer.rung()[0] >= static_cast<std::uint8_t>(Rung::kStationaryBias);
}

void expect_every_sequence_once(const std::vector<msg::CompensatedRate>& answers) {
  for (std::size_t k = 0; k < answers.size(); ++k)
    ASSERT_EQ(answers[k].sequence_number(), answers[0].sequence_number() + k);
}

// A replay waits for the temperatures that belong to its rates until their publisher has left, then
// goes on without. (One that is killed has left when its lease of 20 s is over.)
TEST(Stop, OfTheThermalPublisherOfASimulationLeavesTheServiceInItsFallback) {
  SystemUnderTest system(Domain::kThermalKilled);
  dds::Participant participant("test", system.network());
  Collector<msg::CompensatedRate> answers(participant);
  Collector<msg::Event> events(participant);
  Chain chain(system, {"--speed", "60"});
  ASSERT_TRUE(eventually([&] { return answers.any(has_a_bias); }));
  chain.thermal.send(SIGTERM);
  EXPECT_TRUE(eventually([&] { return answers.any(is_stale); }));
  EXPECT_TRUE(eventually(
      [&] { return told(events, "stream_ended") && told(events, "temperature_stale"); }));
  EXPECT_TRUE(chain.compensation.running());
  EXPECT_TRUE(chain.gyro.running());
  expect_every_sequence_once(answers.all());
}

// A gyro at 50 Hz with the host's clock, as long as the object lives.
class RealTimeGyro {
 public:
  explicit RealTimeGyro(dds::Participant& participant)
      : writer_(participant), thread_([this](std::stop_token stop) { publish_until(stop); }) {}

 private:
  void publish_until(const std::stop_token& stop) {
    std::mt19937_64 random(11);
    std::normal_distribution<double> noise(0.0, core::radps_from_deg_h(0.5));
    for (auto due = std::chrono::steady_clock::now(); !stop.stop_requested(); due += 20ms) {
      std::this_thread::sleep_until(due);
      core::AngularRateSample sample;
      sample.sequence = sequence_++;
      sample.time = core::SensorTime{service::unix_time_ns()};
      sample.interval_s = 0.02;
      sample.rate_radps = {noise(random), noise(random), noise(random)};
      sample.valid = {true, true, true};
      sample.clock = core::ClockSource::kHost;
      auto message = dds::to_message(sample, 1, service::monotonic_ns());
      writer_.write(message);
    }
  }

  dds::Writer<msg::AngularRate> writer_;
  std::uint64_t sequence_ = 0;
  std::jthread thread_;
};

// Some 12 s for the first bias: ten blocks, a label of one second and its confirmation.
TEST(Killed, AThermalPublisherInRealTimeLeavesTheServiceInItsFallbackAfterTemperatureStaleS) {
  SystemUnderTest system(Domain::kThermalKilledAtRealTime);
  write(system.path("sys/class/hwmon/hwmon0/temp1_label"), "coil\n");
  write(system.path("sys/class/hwmon/hwmon0/temp1_input"), "21500\n");
  write(system.path("compensation.yaml"),
        "temperature_stale_s: 2\nearth_rate: {mode: included}\n"
        "learning: {label_interval_s: 1, confirm_s: 1}\nfeatures: [{kind: temperature, probe: "
        "coil}]\n");
  dds::Participant participant("test", system.network());
  Collector<msg::CompensatedRate> answers(participant);
  Collector<msg::Temperature> temperatures(participant);
  ChildProcess& compensation =
      system.start("compensation", {"--config", system.path("compensation.yaml")});
  ChildProcess& thermal = system.start("thermal_publisher", {"--source", "sysfs", "--sysfs-root",
                                                             system.path("sys"), "--rate", "10"});
  RealTimeGyro gyro(participant);
  ASSERT_TRUE(eventually([&] { return answers.any(has_a_bias); }));
  EXPECT_FALSE(answers.any(is_stale));

  thermal.send(SIGKILL);
  ASSERT_EQ(thermal.wait(kStopsWithin), 128 + SIGKILL);
  ASSERT_TRUE(eventually([&] { return answers.any(is_stale); }));
  const double last_reading_s = static_cast<double>(temperatures.newest().sensor_time_ns()) * 1e-9;
  const auto all = answers.all();
  const auto first = std::find_if(all.begin(), all.end(), is_stale);
  const double stale_after_s = static_cast<double>(first->sensor_time_ns()) * 1e-9 - last_reading_s;
  // Ages are looked at once a block of one second.
  EXPECT_GT(stale_after_s, 2.0);
  EXPECT_LT(stale_after_s, 3.1);
  expect_every_sequence_once(all);
  compensation.send(SIGTERM);
  EXPECT_EQ(compensation.wait(kStopsWithin), 0);
}

// A reader that doesn't acknowledge keeps the writer's heartbeats going while it is deleted.
TEST(Stop, AWriterWhoseReaderHangsCanBeDeleted) {
  SystemUnderTest system(Domain::kStopHangingReader);
  dds::Participant participant("test", system.network());
  ChildProcess& reader = system.start("allan_monitor", {});
  {
    dds::Writer<msg::CompensatedRate> writer(participant);
    ASSERT_TRUE(eventually([&] { return writer.matched() == 1; }));
  }
  reader.send(SIGSTOP);
  for (int k = 0; k < 100; ++k) {
    dds::Writer<msg::CompensatedRate> writer(participant);
    ASSERT_TRUE(eventually([&] { return writer.matched() == 1; }));
    msg::CompensatedRate message;
    message.gyro_id(1);
    for (std::uint64_t n = 1; n <= 500; ++n) {
      message.sequence_number(n);
      writer.write(message);
    }
  }
  reader.send(SIGCONT);
}

}  // namespace
}  // namespace zerodrift::system_test
