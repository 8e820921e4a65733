// SPDX-License-Identifier: Apache-2.0
// The console as a process: what a page gets of a running system, what it may ask of it, and what
// nobody may do to it.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <memory>
#include <thread>
#include <vector>

#include "idl/proto/telemetry.pb.h"
#include "tests/support/exposition_format.h"
#include "tests/system/console_client.h"
#include "tests/system/secured_system.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

// A gyro of a hardware clock on a thread of its own; sensor time runs as the host's.
class RunningGyro {
 public:
  RunningGyro(const dds::NetworkOptions& network, std::chrono::milliseconds interval)
      : interval_(interval),
        participant_("gyro_publisher", network),
        writer_(participant_),
        temperatures_(participant_),
        thread_([this] { run(); }) {}
  ~RunningGyro() {
    stopping_ = true;
    thread_.join();
  }
  RunningGyro(const RunningGyro&) = delete;
  RunningGyro& operator=(const RunningGyro&) = delete;

 private:
  void run() {
    core::AngularRateSample sample;
    sample.interval_s = std::chrono::duration<double>(interval_).count();
    sample.rate_radps = {1e-6, 2e-6, 3e-6};
    sample.valid = {true, true, true};
    sample.clock = core::ClockSource::kHardware;
    for (auto due = std::chrono::steady_clock::now(); !stopping_; due += interval_) {
      std::this_thread::sleep_until(due);
      if (writer_.matched() == 0) continue;
      ++sample.sequence;
      sample.time = interval_ * sample.sequence;
      if (sample.sequence % 200 == 1) {
        core::TemperatureSample reading{.probe = "coil",
                                        .sequence = sample.sequence / 200,
                                        .time = sample.time,
                                        .temperature_degc = 25.0,
                                        .clock = core::ClockSource::kHardware};
        auto message = dds::to_message(reading, 1);
        temperatures_.write(message);
      }
      auto message = dds::to_message(sample, 1, dds::detail::steady_ns());
      writer_.write(message);
    }
  }
  std::chrono::milliseconds interval_;
  dds::Participant participant_;
  dds::Writer<msg::AngularRate> writer_;
  dds::Writer<msg::Temperature> temperatures_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

class ConsoleSystem {
 public:
  explicit ConsoleSystem(Domain domain, Arguments of_console = {}, Arguments all = {})
      : system(domain),
        address{"127.0.0.1", static_cast<std::uint16_t>(20000 + static_cast<int>(domain))},
        console_arguments_(std::move(of_console)),
        all_(std::move(all)) {}

  void start_chain(const dds::NetworkOptions& network, std::chrono::milliseconds interval = 5ms) {
    compensation = &system.start("compensation", all_);
    gyro = std::make_unique<RunningGyro>(network, interval);
  }
  void start_console() {
    Arguments arguments = console_arguments_;
    arguments.insert(arguments.end(), {"--listen", address.text()});
    arguments.insert(arguments.end(), all_.begin(), all_.end());
    console = &system.start("console", arguments);
    EXPECT_TRUE(eventually([&] {
      try {
        return web::BlockingClient(address).get("/health").status != 0;
      } catch (const web::WebError&) {
        return false;
      }
    }));
  }
  void expect_stops(ChildProcess& process) const {
    process.send(SIGTERM);
    EXPECT_EQ(process.wait(2s), 0) << process.err();
  }
  [[nodiscard]] web::BlockingClient::Reply get(const std::string& target,
                                               const web::HeaderLines& headers = {}) const {
    return web::BlockingClient(address).get(target, headers);
  }

  SystemUnderTest system;
  web::Address address;
  ChildProcess* compensation = nullptr;
  ChildProcess* console = nullptr;
  std::unique_ptr<RunningGyro> gyro;

 private:
  Arguments console_arguments_;
  Arguments all_;
};

// The next batches of a client: sensor times, which grow by one sample each.
void expect_complete(ConsoleClient& client, int batches, std::chrono::nanoseconds interval = 5ms) {
  std::int64_t before = 0;
  for (int i = 0; i < batches; ++i) {
    const auto batch = client.next_as<telemetry::SampleBatch>("/gyro_1/samples");
    ASSERT_TRUE(batch);
    ASSERT_EQ(batch->raw_x_deg_h_size(), batch->sensor_time_ns_size());
    for (const std::int64_t time : batch->sensor_time_ns()) {
      if (before != 0) {
        ASSERT_EQ(time - before, interval.count());
      }
      before = time;
    }
    EXPECT_EQ(batch->missing(), 0U);
    EXPECT_NE(batch->publish_unix_ns(), 0);
  }
}

TEST(Console, SamplesStateAndCommandsReachAClientAndOneThatComesLate) {
  ConsoleSystem run(Domain::kConsole);
  run.start_chain(run.system.network());
  run.start_console();
  {
    ConsoleClient client(run.address);
    client.subscribe("/gyro_1/samples");
    client.subscribe("/event");
    client.subscribe("/service_status");
    client.subscribe("/gateway");
    expect_complete(client, 50);

    const auto json = client.call("json", R"({"service":"compensation","name":"freeze"})");
    ASSERT_TRUE(json);
    EXPECT_FALSE(json->failed) << json->text;
    EXPECT_NE(json->text.find("\"accepted\":true"), std::string::npos) << json->text;
    telemetry::Command learn;
    learn.set_service("compensation");
    learn.set_name("learn");
    const auto protobuf = client.call("protobuf", learn.SerializeAsString());
    ASSERT_TRUE(protobuf);
    telemetry::CommandReply reply;
    ASSERT_TRUE(reply.ParseFromString(protobuf->text));
    EXPECT_TRUE(reply.accepted()) << reply.text();

    const auto nonsense = client.call("json", R"({"service":"compensation","nam":"x"})");
    EXPECT_TRUE(nonsense && nonsense->failed);
    const auto unknown = client.call("json", R"({"service":"compensation","name":"explode"})");
    EXPECT_TRUE(unknown && unknown->text.find("\"accepted\":false") != std::string::npos);
    const auto nobody = client.call("json", R"({"service":"nobody","name":"freeze"})");
    ASSERT_TRUE(nobody);
    EXPECT_TRUE(nobody->failed);
    EXPECT_EQ(nobody->text, "no service 'nobody' answered within 5 s");

    bool audited = false;
    while (!audited) {
      const auto event = client.next_as<telemetry::Event>("/event");
      ASSERT_TRUE(event) << "no event tells of the command";
      audited = event->code() == "command" &&
                event->text().find("compensation freeze: done") != std::string::npos;
    }
    const auto gateway = client.next_as<telemetry::GatewayStatus>("/gateway");
    ASSERT_TRUE(gateway);
    EXPECT_EQ(gateway->frames_dropped(), 0U);
    EXPECT_TRUE(std::any_of(gateway->endpoints().begin(), gateway->endpoints().end(),
                            [](const telemetry::Endpoint& endpoint) {
                              return endpoint.is_writer() && endpoint.problem().empty() &&
                                     endpoint.process().starts_with("compensation") &&
                                     endpoint.ownership() == "shared";
                            }));
  }
  // A console that is started anew: what a late client needs is there again.
  run.expect_stops(*run.console);
  run.start_console();
  ConsoleClient late(run.address);
  late.subscribe("/service_status");
  late.subscribe("/event");
  const auto status = late.next_as<telemetry::ServiceStatus>("/service_status");
  ASSERT_TRUE(status);
  EXPECT_TRUE(status->alive());
  EXPECT_TRUE(late.next_as<telemetry::Event>("/event"));
  late.subscribe("/gyro_1/history");
  const auto backlog = late.next_as<telemetry::History>("/gyro_1/history");
  ASSERT_TRUE(backlog);
  EXPECT_TRUE(backlog->is_backlog());
  const auto row = late.next_as<telemetry::History>("/gyro_1/history");
  ASSERT_TRUE(row);
  EXPECT_EQ(row->sensor_time_ns_size(), 1);
  late.subscribe("/gyro_1/coverage");
  EXPECT_TRUE(late.next_as<telemetry::ThermalCoverage>("/gyro_1/coverage"));
  // A service that is killed is said to be gone.
  run.compensation->send(SIGKILL);
  bool said = false;
  while (!said) {
    const auto gone = late.next_as<telemetry::ServiceStatus>("/service_status");
    ASSERT_TRUE(gone) << "nobody says that compensation is gone";
    said = gone->service() == "compensation" && !gone->alive();
  }
  run.expect_stops(*run.console);
}

TEST(Console, ASlowClientLosesFramesAndIsToldOthersLoseNothing) {
  ConsoleSystem run(Domain::kConsoleSlow);
  run.start_chain(run.system.network(), 1ms);
  run.start_console();
  ConsoleClient other(run.address);
  other.subscribe("/gyro_1/samples");
  ConsoleClient slow(run.address, {}, 4096);
  slow.subscribe("/gyro_1/compensated_rate");
  slow.subscribe("/gateway");
  // 1000 frames of 270 bytes a second, read by nobody: the kernel holds some 600 kB of them, the
  // queue 1024 frames, so that the fifth second's are lost.
  for (int second = 0; second < 8; ++second) expect_complete(other, 50, 1ms);
  std::uint64_t dropped = 0;
  for (int told = 0; told < 20 && dropped == 0; ++told) {
    const auto gateway = slow.next_as<telemetry::GatewayStatus>("/gateway");
    ASSERT_TRUE(gateway) << "the slow client is told nothing; close code " << slow.close_code();
    dropped = gateway->frames_dropped();
  }
  EXPECT_GT(dropped, 0U);
  expect_complete(other, 50, 1ms);
  run.expect_stops(*run.console);
}

TEST(Console, ASecondOneOnThePortAndBadUsageEndWithOneLine) {
  ConsoleSystem run(Domain::kConsoleAccess);
  run.start_console();
  const auto expect_refused = [&](Arguments arguments, const std::string& line) {
    arguments.insert(arguments.end(), {"--domain", std::to_string(run.system.network().domain)});
    const Finished finished = run.system.run("console", arguments);
    EXPECT_EQ(finished.exit_code, 2);
    EXPECT_NE(finished.err.find(line), std::string::npos) << finished.err;
    EXPECT_EQ(std::count(finished.err.begin(), finished.err.end(), '\n'), 1) << finished.err;
  };
  expect_refused({"--listen", run.address.text()}, "is taken by another process");
  expect_refused({"--listen", "0.0.0.0:20999"}, "--token-file");
  expect_refused({"--listen", "nonsense"}, "is not an address");
  expect_refused({"--token-file", "/nowhere"}, "can't read a token");
  run.expect_stops(*run.console);
}

TEST(Console, TokenOriginAndHostDecideWhoConnects) {
  const std::filesystem::path file = std::filesystem::temp_directory_path() /
                                     ("zerodrift_console_token_" + std::to_string(getpid()));
  constexpr const char* kToken = "a-token-of-this-test";
  std::ofstream(file) << kToken << '\n';
  ConsoleSystem run(Domain::kConsoleAccess,
                    {"--token-file", file.string(), "--allow-origin", "https://app.foxglove.dev"});
  run.start_console();
  const auto connect = [&](const web::HeaderLines& headers) {
    return ConsoleClient(run.address, headers).status();
  };
  const std::pair<std::string, std::string> token{"Authorization", std::string("Bearer ") + kToken};
  EXPECT_EQ(connect({}), 401U);
  EXPECT_EQ(connect({{"Authorization", "Bearer wrong"}}), 401U);
  EXPECT_EQ(connect({token}), 101U);
  EXPECT_EQ(connect({token, {"Origin", "http://" + run.address.text()}}), 101U);
  EXPECT_EQ(connect({token, {"Origin", "https://app.foxglove.dev"}}), 101U);
  EXPECT_EQ(connect({token, {"Origin", "https://evil.example"}}), 403U);
  EXPECT_EQ(connect({token, {"Host", "evil.example"}}), 403U);
  EXPECT_EQ(web::BlockingClient(run.address)
                .upgrade(std::string("/?token=") + kToken, "foxglove.websocket.v1")
                .status,
            101U);
  EXPECT_EQ(run.get("/metrics").status, 401U);
  EXPECT_EQ(run.get("/metrics", {token}).status, 200U);
  EXPECT_EQ(run.get("/").status, 200U);
  EXPECT_EQ(run.get("/health").status, 200U);
  EXPECT_EQ(run.get("/health", {{"Host", "evil.example"}}).status, 403U);
  run.expect_stops(*run.console);
  EXPECT_EQ(run.console->err().find(kToken), std::string::npos) << "the token is in the log";
  std::filesystem::remove(file);
}

TEST(Console, HealthAndMetricsTellOfTheSystem) {
  ConsoleSystem run(Domain::kConsoleMetrics);
  run.start_console();
  EXPECT_EQ(run.get("/health").status, 200U);
  EXPECT_EQ(run.get("/health?max_age=5").status, 503U);  // no sample yet
  EXPECT_EQ(run.get("/health?max_age=x").status, 400U);
  run.start_chain(run.system.network());
  EXPECT_TRUE(eventually([&] { return run.get("/health?max_age=5").status == 200U; }));
  EXPECT_EQ(run.get("/health?max_age=5&gyro=1").status, 200U);
  EXPECT_EQ(run.get("/health?max_age=5&gyro=2").status, 503U);
  EXPECT_EQ(run.get("/health?gyro=one").status, 400U);
  const auto json = nlohmann::json::parse(run.get("/health").body);
  EXPECT_EQ(json.at("dds_alive"), true);
  const auto has = [&](const std::string& line) {
    return run.get("/metrics").body.find(line) != std::string::npos;
  };
  for (const char* line :
       {"zerodrift_samples_out_total{service=\"compensation\"} ", "zerodrift_service_up{",
        "zerodrift_hop_latency_seconds_bucket{hop=\"arrival\",service=\"compensation\",le=\"+Inf\"}"
        " ",
        "zerodrift_build_info{commit=\"", "zerodrift_axis_mode{axis=\"x\",gyro=\"1\"} ",
        "zerodrift_last_sample_age_seconds{gyro=\"1\"} ", "zerodrift_console_clients 0"})
    EXPECT_TRUE(eventually([&] { return has(line); })) << line;
  EXPECT_EQ(test_support::exposition_problems(run.get("/metrics").body),
            std::vector<std::string>{});
  const auto page = run.get("/");
  EXPECT_NE(page.head.find("Content-Security-Policy: default-src 'self'"), std::string::npos);
  EXPECT_NE(page.head.find("X-Content-Type-Options: nosniff"), std::string::npos);
  for (const char* path : {"/docs/", "/docs/glossary.html"}) {
    const auto document = run.get(path);
    EXPECT_EQ(document.status, 200U) << path;
    EXPECT_NE(document.head.find("Content-Security-Policy: default-src 'self'"), std::string::npos);
  }
  for (const char* path : {"/%2e%2e/%2e%2e/etc/passwd", "/docs/%2e%2e/%2e%2e/etc/passwd"})
    EXPECT_EQ(run.get(path).status, 400U) << path;
  EXPECT_EQ(run.get("/nothing").status, 404U);
  run.expect_stops(*run.console);
}

TEST(Console, HostileClientsEndNothingAndCostNoMemory) {
  ConsoleSystem run(Domain::kConsoleHostile);
  run.start_chain(run.system.network());
  run.start_console();
  ConsoleClient good(run.address);
  good.subscribe("/gyro_1/samples");
  expect_complete(good, 20);
  // More connections than there are places, none of which ever asks for anything.
  std::vector<std::unique_ptr<web::BlockingClient>> idle;
  for (int i = 0; i < 100; ++i) {
    idle.push_back(std::make_unique<web::BlockingClient>(run.address));
    if (i % 2 == 0) idle.back()->send_raw("GET /metrics HT");
  }
  EXPECT_EQ(run.get("/metrics").status, 200U);
  const auto attack = [&] {
    for (int i = 0; i < 20; ++i) {
      ConsoleClient bad(run.address);
      auto& socket = bad.socket();
      switch (i % 5) {
        case 0:
          socket.send_raw("\x81\x02hi");  // not masked
          break;
        case 1:
          socket.send(ConsoleClient::Opcode::kText, "\xff\xff");  // no UTF-8
          break;
        case 2:
          socket.send(ConsoleClient::Opcode::kBinary, std::string(70000, 'x'));  // too long
          break;
        case 3:
          for (int k = 0; k < 200; ++k)
            socket.send(ConsoleClient::Opcode::kText, R"({"op":"subscribe","subscriptions":[{}]})");
          break;
        default:
          for (unsigned id = 0; id < 200; ++id)
            socket.send(ConsoleClient::Opcode::kText,
                        nlohmann::json{{"op", "subscribe"},
                                       {"subscriptions", {{{"id", id}, {"channelId", id}}}}}
                            .dump());
      }
      socket.receive_raw(10ms);
      web::BlockingClient garbage(run.address);
      garbage.send_raw("\x16\x03\x01 not HTTP\r\n\r\n");
      garbage.receive_raw(100ms);
    }
  };
  attack();
  const auto before = run.console->resident_bytes();
  for (int round = 0; round < 5; ++round) attack();
  const auto after = run.console->resident_bytes();
  ASSERT_TRUE(before && after) << "the console has ended";
  // 200 attacks more: a leak of one connection's buffers (64 kB) each would be 12 MB.
  EXPECT_LT(*after, *before + (std::uint64_t{8} << 20U));
  expect_complete(good, 20);
  run.expect_stops(*run.console);
  const std::string log = run.console->err();
  EXPECT_LT(std::count(log.begin(), log.end(), '\n'), 50) << "240 bad clients, not a line for each";
}

TEST(Console, WorksWithSecurity) {
  ConsoleSystem made(Domain::kConsoleSecured);
  const auto folder = made.system.path("keys");
  ASSERT_EQ(make_certificates(made.system, {folder.string()}).exit_code, 0);
  ConsoleSystem run(Domain::kConsoleSecured2, {}, {"--security", folder.string()});
  run.start_chain(with_security(run.system, folder));
  run.start_console();
  ConsoleClient client(run.address);
  client.subscribe("/gyro_1/samples", 30s);
  client.subscribe("/service_status");
  expect_complete(client, 20);
  EXPECT_TRUE(client.next("/service_status"));
  const auto reply = client.call("json", R"({"service":"compensation","name":"freeze"})");
  ASSERT_TRUE(reply);
  EXPECT_FALSE(reply->failed) << reply->text;
  run.expect_stops(*run.console);
}

}  // namespace
}  // namespace zerodrift::system_test
