// SPDX-License-Identifier: Apache-2.0
// What a client hears on each channel, without a socket and without DDS.
#include "services/console/gateway.h"

#include <gtest/gtest.h>

#include "tests/unit/console/fake_client.h"
#include "tests/unit/console/samples.h"

namespace zerodrift::services {
namespace {

class GatewayOfOne : public testing::Test {
 protected:
  GatewayOfOne() { hub_.opened(client_); }
  void subscribe(const std::string& topic) {
    const std::string id = std::to_string(client_.channels.at(topic));
    hub_.received(
        client_, Kind::kText,
        R"({"op":"subscribe","subscriptions":[{"id":)" + id + R"(,"channelId":)" + id + "}]}");
  }
  void unsubscribe(const std::string& topic) {
    hub_.received(client_, Kind::kText,
                  R"({"op":"unsubscribe","subscriptionIds":[)" +
                      std::to_string(client_.channels.at(topic)) + "]}");
  }
  void sample(std::int64_t ms, std::uint64_t sequence) {
    gateway_.take(sample_at(ms * 1'000'000, 1.0, 0.5, sequence), {.unix_ns = kNow});
  }

  static constexpr std::int64_t kNow = 1'700'000'000'000'000'000;
  foxglove::Hub hub_{{.name = "test"}, {.subscribed = [this](auto client, auto channel) {
                       gateway_.subscribed(client, channel);
                     }}};
  Gateway gateway_{{.version = "1", .domain = 3}, hub_};
  FakeClient client_{1};
};

TEST_F(GatewayOfOne, ChannelsAreThoseOfTheContract) {
  sample(0, 1);
  for (const char* name : {"compensated_rate", "samples", "history", "temperature", "allan",
                           "navigation", "twin", "coverage"})
    EXPECT_TRUE(client_.channels.contains(std::string("/gyro_1/") + name)) << name;
  for (const char* name : {"/service_status", "/event", "/gateway", "/fleet"})
    EXPECT_TRUE(client_.channels.contains(name)) << name;
  EXPECT_EQ(client_.channels.size(), 12U);
}

// Before: a gyro of which no sample ever came was nowhere on the page.
TEST_F(GatewayOfOne, AGyroThatOnlyAServiceTellsOfHasItsChannels) {
  for (const char* service : {"gyro_publisher:7", "gyro_publisher", "gateway:latency", "a:", "b:8x",
                              "c:-1", "d:4294967296", "e:0", "compensation/2:7"}) {
    msg::ServiceStatus status;
    status.service(service);
    gateway_.take(status, {}, {kNow, kNow});
  }
  EXPECT_TRUE(client_.channels.contains("/gyro_7/samples"));
  EXPECT_EQ(client_.channels.size(), 12U);
}

// Before: of a gyro that was silent since the console's start no age was served, so no alert came.
TEST_F(GatewayOfOne, AGyroThatIsPublishedAndNeverAnsweredHasAnAge) {
  msg::ServiceStatus status;
  for (const char* service : {"compensation:6", "thermal_publisher:6", "gyro_publisher:7"}) {
    for (const std::int64_t later : {0, 5}) {
      status.service(service);
      gateway_.take(status, {}, {kNow, kNow + later});
    }
  }
  const auto figures = gateway_.gyro_figures();
  ASSERT_EQ(figures.size(), 1U);
  EXPECT_EQ(figures.at(7).samples, 0U);
  EXPECT_EQ(figures.at(7).newest_monotonic_ns, kNow);
  EXPECT_FALSE(figures.at(7).newest);
}

TEST_F(GatewayOfOne, AnAxisIsMeasuredOnceASampleOfItWasValid) {
  auto sample = sample_at(0, 1.0, 0.5, 1);
  const auto take = [&](std::uint32_t validity) {
    sample.validity(validity);
    gateway_.take(sample, {.unix_ns = kNow});
    sample.sequence_number(sample.sequence_number() + 1);
    return gateway_.gyro_figures().at(1).measured;
  };
  EXPECT_EQ(take(0), (core::PerAxis<bool>{true, true, true})) << "none is known to be missing";
  EXPECT_EQ(take(0b001), (core::PerAxis<bool>{true, false, false}));
  EXPECT_EQ(take(0b100), (core::PerAxis<bool>{true, false, true}));
  EXPECT_EQ(take(0), (core::PerAxis<bool>{true, false, true})) << "one that fails is still one";
}

TEST_F(GatewayOfOne, NothingIsSentThatNobodyAskedFor) {
  for (int i = 0; i < 3000; ++i) sample(i, static_cast<std::uint64_t>(i));
  gateway_.flush(kNow);
  gateway_.report_gateway({}, kNow);
  gateway_.report_fleet({.unix_ns = kNow});
  EXPECT_TRUE(client_.data.empty());
  EXPECT_FALSE(gateway_.is_watched());
}

TEST_F(GatewayOfOne, SamplesComeInBatchesInOrderAndHolesAreCounted) {
  sample(0, 1);
  subscribe("/gyro_1/samples");
  for (const std::uint64_t sequence : {2U, 3U, 5U, 6U})
    sample(static_cast<std::int64_t>(sequence), sequence);
  EXPECT_TRUE(client_.data.empty());
  gateway_.flush(kNow);
  EXPECT_TRUE(gateway_.is_watched());
  const auto batches = client_.take<telemetry::SampleBatch>();
  ASSERT_EQ(batches.size(), 1U);
  EXPECT_EQ(batches[0].sensor_time_ns_size(), 4);
  EXPECT_EQ(batches[0].missing(), 1U);
  EXPECT_EQ(batches[0].sequence_number(), 6U);
  EXPECT_NEAR(batches[0].compensated_x_deg_h(0), 0.5, 1e-12);
  gateway_.flush(kNow);
  EXPECT_TRUE(client_.data.empty());
  // The answer that came late fills the hole.
  auto late = sample_at(4'000'000, 1.0, 0.5, 4);
  late.order(1);
  gateway_.take(late, {.unix_ns = kNow});
  gateway_.flush(kNow);
  EXPECT_EQ(client_.take<telemetry::SampleBatch>().at(0).missing(), 0U);
}

// Rule: one wild number is no loss of all the numbers before it; where the source goes on behind
// it, those between are missing and it is not.
// Numbers further away than any loss are another count. Before: the jump was added, and the sum
// wrapped.
TEST_F(GatewayOfOne, ANumberThatIsDoubtedMakesAHoleOnlyWhereTheSourceGoesOnBehindIt) {
  constexpr std::uint64_t kWild = 1'000'000'000;
  constexpr std::uint64_t kOtherCount = ~std::uint64_t{0} - 10;
  sample(1, 1);
  subscribe("/gyro_1/samples");
  const auto doubted = [&](std::int64_t ms, std::uint64_t sequence) {
    auto answer = sample_at(ms * 1'000'000, 1.0, 0.5, sequence);
    answer.order(1);
    gateway_.take(answer, {.unix_ns = kNow});
  };
  const auto missing = [&] {
    gateway_.flush(kNow);
    return client_.take<telemetry::SampleBatch>().at(0).missing();
  };
  sample(2, 2);
  doubted(3, kWild);
  sample(4, 4);
  EXPECT_EQ(missing(), 1U) << "number 3, in whose place the wild one came";
  doubted(5, kWild);
  sample(6, kWild + 1);
  EXPECT_EQ(missing(), 1U + kWild - 5U);
  doubted(7, kOtherCount);
  sample(8, kOtherCount + 3);
  EXPECT_EQ(missing(), 1U + kWild - 5U + 2U);
}

// Rule: a sample whose time is doubted came in its place: nothing is missing, and no page takes its
// time for the newest. Before: one lost at every step of a clock, for good.
TEST_F(GatewayOfOne, ASampleOfADoubtedTimeIsNoLossAndNoTime) {
  sample(0, 1);
  subscribe("/gyro_1/samples");
  for (const std::uint64_t sequence : {2U, 3U})
    sample(static_cast<std::int64_t>(sequence), sequence);
  auto doubted = sample_at(86'400'000'000'000, 1.0, 0.5, 4);
  doubted.order(1);
  gateway_.take(doubted, {.unix_ns = kNow});
  sample(5, 5);
  gateway_.flush(kNow);
  const auto batch = client_.take<telemetry::SampleBatch>().at(0);
  EXPECT_EQ(batch.missing(), 0U);
  EXPECT_EQ(batch.sequence_number(), 5U);
  EXPECT_EQ(batch.sensor_time_ns_size(), 3);
  // Far behind it would look like a source that began anew: pages forgot all that they had.
  sample(10'000, 6);
  auto behind = sample_at(3'000'000'000, 1.0, 0.5, 7);
  behind.order(1);
  gateway_.take(behind, {.unix_ns = kNow});
  gateway_.flush(kNow);
  const auto next = client_.take<telemetry::SampleBatch>().at(0);
  EXPECT_EQ(next.missing(), 0U);
  EXPECT_EQ(next.sensor_time_ns_size(), 1);
}

// Rule: who asks again and again waits for one backlog. Before: it was sent each, and what waited
// grew without bound.
TEST_F(GatewayOfOne, ABacklogIsSentOnceToWhoAskedOften) {
  for (int i = 0; i < 100; ++i) sample(100 * i, static_cast<std::uint64_t>(i));
  client_.waiting = 1U << 30U;
  for (int k = 0; k < 100; ++k) {
    subscribe("/gyro_1/history");
    unsubscribe("/gyro_1/history");
  }
  subscribe("/gyro_1/history");
  gateway_.flush(kNow);
  EXPECT_TRUE(client_.data.empty());
  client_.waiting = 0;
  for (int k = 0; k < 3; ++k) gateway_.flush(kNow);
  EXPECT_EQ(client_.take<telemetry::History>().size(), 1U);
}

TEST_F(GatewayOfOne, HistoryIsABacklogFirstThenEachRowOnce) {
  for (int i = 0; i < 100; ++i) sample(100 * i, static_cast<std::uint64_t>(i));
  subscribe("/gyro_1/history");
  gateway_.flush(kNow);
  auto backlog = client_.take<telemetry::History>();
  ASSERT_EQ(backlog.size(), 1U);
  EXPECT_TRUE(backlog[0].is_backlog());
  EXPECT_EQ(backlog[0].sensor_time_ns_size(), 9);
  for (int i = 100; i < 130; ++i) sample(100 * i, static_cast<std::uint64_t>(i));
  gateway_.flush(kNow);
  const auto rows = client_.take<telemetry::History>();
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_FALSE(rows[0].is_backlog());
  EXPECT_EQ(rows[0].sensor_time_ns_size(), 3);
  EXPECT_EQ(rows[0].sensor_time_ns(0), 9'000'000'000);
}

TEST_F(GatewayOfOne, ABacklogWaitsForAClientThatIsBusy) {
  for (int i = 0; i < 30; ++i) sample(100 * i, static_cast<std::uint64_t>(i));
  subscribe("/gyro_1/history");
  client_.waiting = 10'000'000;
  gateway_.flush(kNow);
  EXPECT_TRUE(client_.data.empty());
  client_.waiting = 0;
  gateway_.flush(kNow);
  EXPECT_EQ(client_.data.size(), 1U);
}

TEST_F(GatewayOfOne, ALateClientHearsTheNewestOfEach) {
  for (const double value : {1.0, 2.0}) {
    msg::AllanReport report;
    report.gyro_id(1);
    report.axis(2);
    report.stream(1);
    report.window_s(value);
    gateway_.take(report, kNow);
    msg::TwinReport twin;
    twin.gyro_id(1);
    twin.verdict("consistent");
    twin.wall_time_ns(static_cast<std::int64_t>(value));
    gateway_.take(twin, kNow);
    msg::ThermalCoverage coverage;
    coverage.gyro_id(1);
    coverage.model_epoch(static_cast<std::uint64_t>(value));
    gateway_.take(coverage, kNow);
    msg::ServiceStatus status;
    status.service("compensation");
    status.uptime_ms(static_cast<std::uint64_t>(value) * 1000);
    gateway_.take(status, {}, {.unix_ns = kNow});
  }
  subscribe("/gyro_1/allan");
  EXPECT_EQ(client_.take<telemetry::AllanReport>().at(0).window_s(), 2.0);
  subscribe("/gyro_1/twin");
  EXPECT_EQ(client_.take<telemetry::TwinReport>().at(0).wall_time_ns(), 2);
  subscribe("/gyro_1/coverage");
  EXPECT_EQ(client_.take<telemetry::ThermalCoverage>().at(0).model_epoch(), 2U);
  subscribe("/service_status");
  const auto statuses = client_.take<telemetry::ServiceStatus>();
  ASSERT_EQ(statuses.size(), 1U);
  EXPECT_EQ(statuses[0].uptime_s(), 2.0);
  EXPECT_TRUE(statuses[0].alive());
  gateway_.take_gone({}, kNow);
  EXPECT_FALSE(client_.take<telemetry::ServiceStatus>().at(0).alive());
}

TEST_F(GatewayOfOne, OfEachGyroIsSaidWhatItsHeadlineNeeds) {
  constexpr std::int64_t kS = 1'000'000'000;
  msg::Temperature of_another;  // of which no sample came
  of_another.gyro_id(2);
  gateway_.take(of_another, kNow);
  msg::AllanReport report;
  report.gyro_id(1);
  report.axis(1);
  report.stream(1);
  report.worse_than_raw(1);
  gateway_.take(report, kNow);
  for (int s = 0; s < 600; ++s) {
    auto next = sample_at(s * kS, s / 60 + (s % 2 == 0 ? 0.1 : -0.1), 0.5 * (s / 60),
                          static_cast<std::uint64_t>(s + 1));
    next.mode()[2] = 0;
    gateway_.take(next, {.unix_ns = kNow, .monotonic_ns = s * kS});
  }
  subscribe("/fleet");
  gateway_.report_fleet({.unix_ns = kNow, .monotonic_ns = 602 * kS});
  const auto fleets = client_.take<telemetry::Fleet>();
  ASSERT_EQ(fleets.size(), 1U);
  ASSERT_EQ(fleets[0].gyros_size(), 1);
  const telemetry::GyroSummary& gyro = fleets[0].gyros(0);
  EXPECT_EQ(gyro.gyro_id(), 1U);
  EXPECT_DOUBLE_EQ(gyro.age_s(), 3.0);
  EXPECT_EQ(gyro.sensor_time_ns(), 599 * kS);
  EXPECT_EQ(gyro.validity(), 7U);
  EXPECT_EQ(gyro.missing(), 0U);
  EXPECT_EQ(gyro.block_s(), 60.0);
  ASSERT_EQ(gyro.axes_size(), 3);
  EXPECT_EQ(gyro.axes(0).state().mode(), telemetry::LEARNING);
  EXPECT_EQ(gyro.axes(0).comparison().blocks(), 10U);
  EXPECT_NEAR(gyro.axes(0).comparison().raw_deg_h() / gyro.axes(0).comparison().compensated_deg_h(),
              2.0, 1e-3);  // the open second is in no row: the last mean is off by 0.1 / 59
  EXPECT_FALSE(gyro.axes(0).worse_than_raw());
  EXPECT_TRUE(gyro.axes(1).worse_than_raw());
  EXPECT_EQ(gyro.axes(2).comparison().obstacle(), telemetry::RateComparison::NOTHING_TAKEN_OFF);
}

// Rule: what a monitor that has gone said judges nothing any more. Before: an alert that was
// decided on it stayed for ever, or never came.
TEST_F(GatewayOfOne, AnAllanReportGoesWithItsMonitor) {
  sample(0, 1);
  msg::ServiceStatus status;
  status.service("allan_monitor");
  gateway_.take(status, {}, {.unix_ns = kNow});
  msg::AllanReport report;
  report.gyro_id(1);
  report.stream(1);
  report.worse_than_raw(1);
  gateway_.take(report, kNow);
  EXPECT_EQ(gateway_.allan_reports().size(), 1U);
  gateway_.take_gone({}, kNow);
  EXPECT_TRUE(gateway_.allan_reports().empty());
}

TEST_F(GatewayOfOne, TheNewest256EventsAreKept) {
  for (int i = 0; i < 300; ++i) {
    msg::Event event;
    event.code("code");
    event.count(static_cast<std::uint64_t>(i));
    gateway_.take(event, kNow);
  }
  subscribe("/event");
  const auto events = client_.take<telemetry::Event>();
  ASSERT_EQ(events.size(), 256U);
  EXPECT_EQ(events.front().count(), 44U);
  EXPECT_EQ(events.back().count(), 299U);
}

TEST_F(GatewayOfOne, TemperaturesHaveTheirRate) {
  msg::Temperature reading;
  reading.gyro_id(1);
  reading.probe("coil");
  reading.measured(1);
  gateway_.take(reading, kNow);
  subscribe("/gyro_1/temperature");
  for (int i = 1; i < 120; ++i) {
    reading.sensor_time_ns(i * 1'000'000'000LL);
    reading.temperature_degc(20.0 + i * 0.5 / 60.0);  // half a degree a minute
    gateway_.take(reading, kNow);
  }
  const auto readings = client_.take<telemetry::Temperature>();
  ASSERT_EQ(readings.size(), 119U);
  // A ramp is within the fit's degree: what is left is rounding.
  EXPECT_NEAR(readings.back().rate_degc_per_min(), 0.5, 1e-9);
  reading.measured(0);
  reading.sensor_time_ns(120'000'000'000);
  gateway_.take(reading, kNow);
  EXPECT_TRUE(std::isnan(client_.take<telemetry::Temperature>().at(0).temperature_degc()));
}

TEST_F(GatewayOfOne, TheGatewayTellsAClientOfItselfAndOfEndpoints) {
  subscribe("/gateway");
  dds::RemoteEndpoint endpoint;
  endpoint.topic = "event";
  endpoint.problem = "it offers reliability best_effort, here is asked for reliable";
  gateway_.report_gateway({endpoint}, kNow);
  const auto told = client_.take<telemetry::GatewayStatus>();
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].clients(), 1U);
  EXPECT_EQ(told[0].frames_dropped(), 2U);
  EXPECT_EQ(told[0].queue_fill(), 0.5);
  EXPECT_EQ(told[0].endpoints(0).problem(), endpoint.problem);
}

TEST(GatewayAbuse, MoreGyrosAndServicesThanAreKeptAreCounted) {
  foxglove::Hub hub({.name = "test"}, {});
  Gateway gateway({.version = "1", .most_gyros = 2, .most_services = 2}, hub);
  for (std::uint32_t id = 0; id < 5; ++id) {
    auto sample = sample_at(0, 1.0, 0.0);
    sample.gyro_id(id);
    gateway.take(sample, {});
    msg::ServiceStatus status;
    status.service(std::to_string(id).c_str());
    gateway.take(status, {}, {});
  }
  EXPECT_EQ(gateway.gyro_figures().size(), 2U);
  EXPECT_EQ(gateway.services().size(), 2U);
  EXPECT_EQ(gateway.left_out(), 6U);
}

class GatewayOfServices : public testing::Test {
 protected:
  void status(const std::string& service, unsigned char writer, std::int64_t unix_ns = 0) {
    msg::ServiceStatus said;
    said.service(service);
    gateway_.take(said, guid(writer), {.unix_ns = unix_ns});
  }
  void gone(unsigned char writer) { gateway_.take_gone(guid(writer), 0); }
  [[nodiscard]] std::string names() const {
    std::string all;
    for (const auto& [name, said] : gateway_.services()) all += name + (said.alive() ? " " : "! ");
    return all;
  }
  static Gateway::WriterId guid(unsigned char writer) {
    Gateway::WriterId id;
    id.guidPrefix.value[0] = writer;
    return id;
  }

  foxglove::Hub hub_{{.name = "test"}, {}};
  Gateway gateway_{{.version = "1", .most_services = 2}, hub_};
};

// Rule: who is gone gives its place to who comes, and never who is there. Before: names that others
// had once written kept the console from a service for the rest of its life.
TEST_F(GatewayOfServices, AServiceThatIsGoneGivesItsPlaceToANewOne) {
  status("a", 1, 30);
  status("b", 2, 20);
  status("c", 3);
  EXPECT_EQ(names(), "a b ");
  EXPECT_EQ(gateway_.left_out(), 1U);
  gone(1);
  gone(2);
  EXPECT_EQ(names(), "a! b! ");
  status("c", 3, 40);
  EXPECT_EQ(names(), "a! c ") << "b is gone the longest";
  status("a", 1, 50);
  status("b", 2, 60);
  EXPECT_EQ(names(), "a c ");
  EXPECT_EQ(gateway_.left_out(), 2U);
  gone(3);
  EXPECT_EQ(names(), "a c! ") << "as long as nobody needs the place";
}

// One that stops says so before its writer is gone.
TEST_F(GatewayOfServices, AServiceThatStoppedAndLostItsPlaceIsGoneWithoutATrace) {
  msg::ServiceStatus stopping;
  stopping.service("a");
  stopping.state(static_cast<std::uint32_t>(service::State::kStopping));
  gateway_.take(stopping, guid(1), {});
  status("b", 2);
  status("c", 3);
  EXPECT_EQ(names(), "b c ");
  gone(1);
  EXPECT_EQ(names(), "b c ");
}

// Rule: as many services are kept as the topic has keys. Before: 512, and 128 gyros have 640 names.
TEST(GatewayAbuse, EveryServiceThatTheTopicHoldsIsKept) {
  foxglove::Hub hub({.name = "test"}, {});
  Gateway gateway({.version = "1"}, hub);
  msg::ServiceStatus status;
  for (std::int32_t i = 0; i < dds::kServiceStatus.keys; ++i) {
    status.service("name" + std::to_string(i));
    gateway.take(status, {}, {});
  }
  EXPECT_EQ(gateway.services().size(), 1024U);
  EXPECT_EQ(gateway.left_out(), 0U);
}

}  // namespace
}  // namespace zerodrift::services
