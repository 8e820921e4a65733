// SPDX-License-Identifier: Apache-2.0
// The navigation filter with the services around it, and alone against bad streams.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include "common/core/units.h"
#include "common/dds/conversions.h"
#include "tests/system/files.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;
using core::kRadPerDeg;
using core::radps_from_deg_h;

constexpr double kBytesPerMegabyte = 1048576.0;
constexpr const char* kName = "navigation_filter";
constexpr const char* kOfGyro = "navigation_filter:1";
const Arguments kAttitude{"--latitude", "48", "--heading", "30"};

// The first quarter of an hour of the shipped drive, with its truth.
std::filesystem::path short_drive(SystemUnderTest& system, int rate_hz) {
  const Simulation simulation{.profile = std::filesystem::path(ZERODRIFT_SOURCE_DIR) /
                                         "config/profiles/drive_with_stops.yaml",
                              .rate_hz = rate_hz};
  const auto record = system.path("drive.csv");
  simulate(system, simulation, record, {"--reference", "--duration", "900s"});
  return record;
}

// Earth rate is the filter's to know, and the truth is kept for the judgement.
std::filesystem::path vehicle_config(SystemUnderTest& system, const std::string& more = "") {
  const auto file = system.path("compensation.yaml");
  write(file, "earth_rate: {mode: unknown}\nreference: {truth: refuse, await_feedback: true" +
                  more + "}\n");
  return file;
}

struct LiveDrive {
  ChildProcess* filter = nullptr;
  double resident_at_a_fifth_mb = 0.0;
  double resident_at_the_end_mb = 0.0;
};

LiveDrive drive_live(SystemUnderTest& system, const std::filesystem::path& record,
                     const std::filesystem::path& config, const Arguments& filter_options,
                     double samples, const Collector<msg::ServiceStatus>& statuses) {
  LiveDrive live;
  live.filter = &system.start(kName, kAttitude + filter_options);
  ChildProcess& compensation =
      system.start("compensation", {"--await-subscribers", "1", "--config", config});
  const Arguments source{"--source", "record", "--record", record};
  ChildProcess& thermal = system.start("thermal_publisher", source);
  ChildProcess& gyro = system.start(
      "gyro_publisher",
      source + Arguments{"--speed", "max", "--wait-for", "compensation,navigation_filter"});
  const auto give_up = std::chrono::steady_clock::now() + 90s;
  while (gyro.running() && std::chrono::steady_clock::now() < give_up) {
    const double done = metric(statuses, kName, "samples");
    const auto bytes = live.filter->resident_bytes();
    const double megabytes = static_cast<double>(bytes.value_or(0)) / kBytesPerMegabyte;
    if (done >= 0.2 * samples && live.resident_at_a_fifth_mb == 0.0)
      live.resident_at_a_fifth_mb = megabytes;
    if (bytes) live.resident_at_the_end_mb = megabytes;
    std::this_thread::sleep_for(20ms);
  }
  EXPECT_EQ(gyro.wait(1s), 0);
  EXPECT_EQ(thermal.wait(10s), 0);
  EXPECT_TRUE(eventually([&] { return metric(statuses, kName, "samples") == samples; }));
  compensation.send(SIGTERM);
  EXPECT_EQ(compensation.wait(2s), 0);
  return live;
}

nlohmann::json offline(SystemUnderTest& system, const std::filesystem::path& record,
                       const std::filesystem::path& config, const Arguments& options) {
  const auto file = system.path("offline.json");
  const Finished done = system.run(
      "zerodrift", Arguments{"navigate", "--record", record, "--config", config, "--json", file} +
                       kAttitude + options);
  EXPECT_EQ(done.exit_code, 0) << done.err;
  return nlohmann::json::parse(std::ifstream(file));
}

TEST(NavigationFilter, NavigatesBothStreamsLiveAndItsRestReferencesAreLearnedFrom) {
  SystemUnderTest system(Domain::kNavigation);
  const auto record = short_drive(system, 50);
  const auto config = vehicle_config(system);
  dds::Participant participant("test", system.network());
  Collector<msg::ServiceStatus> statuses(participant);
  Collector<msg::NavigationState> states(participant);
  const Arguments free{"--alignment", "240", "--updates", "none"};
  const LiveDrive live = drive_live(system, record, config, free, 45000.0, statuses);

  // Learned, though Earth rate is unknown to the compensation: from what the filter gave back.
  EXPECT_GT(metric(statuses, "compensation:1", "labels"), 20.0);
  EXPECT_GT(metric(statuses, "compensation:1", "references_taken"), 1000.0);
  EXPECT_TRUE(std::isnan(metric(statuses, "compensation:1", "references_implausible")));
  ASSERT_TRUE(eventually([&] { return metric(statuses, kOfGyro, "truth") == 1.0; }));
  const double raw = metric(statuses, kOfGyro, "heading_largest_raw");
  const double compensated = metric(statuses, kOfGyro, "heading_largest_compensated");
  std::printf("largest heading error after 15 minutes: raw %.4f deg, compensated %.4f deg\n", raw,
              compensated);
  EXPECT_GT(raw, 5.0 * compensated);
  EXPECT_EQ(metric(statuses, kName, "gaps"), 0.0);
  EXPECT_EQ(metric(statuses, kOfGyro, "truth_missing"), 0.0);

  std::array<std::size_t, 3> published{};
  for (const auto& state : states.all()) {
    ASSERT_LT(state.stream(), 3U);
    ++published[state.stream()];
    const auto& q = state.attitude();
    EXPECT_NEAR(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], 1.0, 1e-12);
  }
  EXPECT_GT(published[0], 2U);
  EXPECT_GT(published[1], 2U);
  EXPECT_GT(published[2], 2U);

  // 45 000 samples: a leak of 50 bytes a sample would be 1.7 MB between a fifth and the end.
  std::printf("resident: %.2f MB at a fifth, %.2f MB at the end\n", live.resident_at_a_fifth_mb,
              live.resident_at_the_end_mb);
  EXPECT_LT(live.resident_at_the_end_mb, live.resident_at_a_fifth_mb + 1.0);
  live.filter->send(SIGTERM);
  EXPECT_EQ(live.filter->wait(2s), 0);

  // The command does the same without the services; the first references of the live run may be
  // lost to a match that is made while they are written.
  const auto json = offline(system, record, config, free);
  EXPECT_NEAR(json["raw"]["heading_error_largest_deg"].get<double>(), raw, 1e-9);
  EXPECT_NEAR(json["compensated"]["heading_error_largest_deg"].get<double>(), compensated,
              0.1 * raw);
}

TEST(NavigationFilter, ResidualsAreHeardOnlyWhereTheyAreAccepted) {
  for (const bool accepted : {false, true}) {
    SystemUnderTest system(accepted ? Domain::kNavigationResidual
                                    : Domain::kNavigationResidualRefused);
    const auto record = short_drive(system, 20);
    const auto config = vehicle_config(system, accepted ? ", navigation_residual: accept" : "");
    dds::Participant participant("test", system.network());
    Collector<msg::ServiceStatus> statuses(participant);
    drive_live(system, record, config, {"--residual-feedback", "--alignment", "240"}, 18000.0,
               statuses);
    EXPECT_GT(metric(statuses, kName, "residuals"), 100.0);
    // Refused by the configuration are the truth, with each sample, and the residuals or not.
    const double refused = metric(statuses, "compensation:1", "references_not_accepted") - 18000.0;
    if (accepted) {
      EXPECT_LE(refused, 0.0);
      EXPECT_GT(metric(statuses, "compensation:1", "references_at_rest"), 10.0);
    } else {
      EXPECT_GT(refused, 100.0);
      EXPECT_TRUE(std::isnan(metric(statuses, "compensation:1", "references_at_rest")));
    }
  }
}

// --------------------------------------------------------------------------------- alone, abused

// Plays the compensation.
class Source {
 public:
  Source(dds::Participant& participant, std::uint32_t id) : id_(id), writer_(participant) {}

  void connect() {
    ASSERT_TRUE(eventually([&] { return writer_.matched() > 0; }));
  }
  core::CompensatedSample next() {
    time_s += 0.02;
    core::CompensatedSample sample;
    sample.raw.sequence = sequence++;
    sample.raw.time = core::from_seconds(time_s);
    sample.raw.interval_s = 0.02;
    sample.raw.valid = {true, true, true};
    sample.raw.clock = core::ClockSource::kHardware;
    sample.drift_variance.fill(std::pow(radps_from_deg_h(0.02), 2));
    sample.sensor_variance.fill(std::pow(radps_from_deg_h(0.2), 2));
    for (double& rate : sample.rate_radps) rate = radps_from_deg_h(0.2) * normal_(random_);
    return sample;
  }
  void send(const core::CompensatedSample& sample) {
    msg::CompensatedRate message;
    dds::to_message(sample, id_, 0, message);
    send(message);
  }
  void send(msg::CompensatedRate& message) {
    ASSERT_TRUE(writer_.write(message));
    if (++in_flight_ % 400 == 0) {
      ASSERT_TRUE(writer_.wait_until_received(5000ms));
    }
  }
  void send_for(double duration_s) {
    for (int k = 0; k < static_cast<int>(duration_s * 50.0); ++k) send(next());
    ASSERT_TRUE(writer_.wait_until_received(5000ms));
  }

  double time_s = 1000.0;
  std::uint64_t sequence = 0;

 private:
  std::uint32_t id_;
  dds::Writer<msg::CompensatedRate> writer_;
  std::mt19937_64 random_{3};
  std::normal_distribution<double> normal_;
  std::size_t in_flight_ = 0;
};

TEST(NavigationFilter, BadStreamsAreToldAndPoisonNothing) {
  SystemUnderTest system(Domain::kNavigationAbuse);
  dds::Participant participant("test", system.network());
  Collector<msg::ServiceStatus> statuses(participant);
  Collector<msg::Event> events(participant);
  Collector<msg::NavigationState> states(participant);
  ChildProcess& filter = system.start(
      kName, kAttitude + Arguments{"--max-gyros", "2", "--alignment", "5", "--frame", "frd"});
  auto source = std::make_unique<Source>(participant, 1);
  Source second(participant, 4000000000U);
  Source third(participant, 8);
  source->connect();
  source->send_for(10.0);
  second.connect();
  second.send_for(10.0);
  third.connect();
  third.send_for(1.0);
  EXPECT_TRUE(eventually([&] { return told(events, "too_many_gyros"); }));

  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int k = 0; k < 200; ++k) {
    msg::CompensatedRate message;
    dds::to_message(source->next(), 1, 0, message);
    if (k % 20 == 1) message.rate_radps()[2] = nan;
    if (k % 20 == 5) message.rate_covariance_radps2().fill(nan);
    if (k % 20 == 9) message.drift_variance_radps2().fill(1e300);
    if (k % 20 == 13) message.interval_s(-nan);
    if (k % 20 == 17) message.applied_drift_radps()[0] = std::numeric_limits<double>::infinity();
    source->send(message);
    if (k % 20 == 19) {  // the same time again, as another sample
      message.sequence_number(source->sequence++);
      source->send(message);
    }
  }
  EXPECT_TRUE(eventually([&] { return told(events, "unusable_sample"); }));
  EXPECT_TRUE(eventually([&] { return told(events, "duplicate_time"); }));
  source->time_s += 0.1;
  source->send_for(1.0);
  EXPECT_TRUE(eventually([&] { return told(events, "gap"); }));
  source->time_s += 5.0;
  source->send_for(1.0);
  EXPECT_TRUE(eventually([&] { return told(events, "heading_lost"); }));
  source->time_s = 10.0;  // set back
  source->send_for(5.0);
  EXPECT_TRUE(eventually([&] { return told(events, "time_restarted"); }));
  // The publisher dies and another takes its place.
  source.reset();
  Source again(participant, 1);
  again.connect();
  again.send_for(10.0);
  // A reference from long ago, and one that is no number.
  dds::Writer<msg::RateReference> references(participant);
  ASSERT_TRUE(eventually([&] { return references.matched() > 0; }));
  for (const double rate : {0.0, nan, 1e300}) {
    msg::RateReference reference;
    reference.gyro_id(1);
    reference.kind(2);
    reference.sensor_time_ns(1);
    reference.rate_radps().fill(rate);
    reference.validity(7);
    references.write(reference);
  }
  again.send_for(5.0);
  EXPECT_TRUE(eventually([&] { return std::isfinite(metric(statuses, kOfGyro, "phase")); }));
  ASSERT_TRUE(eventually([&] { return states.size() > 20; }));
  for (const auto& state : states.all()) {
    EXPECT_NE(state.gyro_id(), 8U);
    EXPECT_TRUE(std::isfinite(state.heading_rad()) && std::isfinite(state.attitude()[0]));
    for (const double sigma : state.attitude_sigma_rad()) EXPECT_TRUE(std::isfinite(sigma));
  }
  EXPECT_TRUE(filter.running());
  filter.send(SIGTERM);
  EXPECT_EQ(filter.wait(2s), 0);
}

TEST(NavigationFilter, RefusesOptionsThatCannotWorkInOneLine) {
  SystemUnderTest system(Domain::kNavigationUsage);
  for (const Arguments& wrong :
       {Arguments{"--latitude", "91", "--heading", "0"}, Arguments{"--roll", "0"},
        Arguments{"--heading", "0", "--frame", "enu"},
        Arguments{"--heading", "0", "--updates", "x"}}) {
    const Finished done = system.run(kName, wrong, 5s);
    EXPECT_EQ(done.exit_code, 2) << wrong[0];
    EXPECT_NE(done.err.find("--"), std::string::npos) << done.err;
    EXPECT_EQ(std::count(done.err.begin(), done.err.end(), '\n'), 1) << done.err;
  }
}

}  // namespace
}  // namespace zerodrift::system_test
