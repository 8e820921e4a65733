// SPDX-License-Identifier: Apache-2.0
// zerodrift_bench console: what the console costs while one page looks at all samples of a fast
// gyro, and how old they are when they reach it.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/files/atomic_file.h"
#include "common/service/host.h"
#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
#include "common/web/web_error.h"
#include "idl/proto/telemetry.pb.h"
#include "tests/bench/bench.h"
#include "tests/bench/bench_process.h"
#include "tests/bench/synthetic_gyro.h"
#include "tests/support/web_client.h"

namespace zerodrift::bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Opcode = web::BlockingClient::Opcode;

constexpr std::uint32_t kDomain = 227;
constexpr double kCpuGoal = 0.05;  // of a core
constexpr auto kConnectWithin = 10s;
constexpr auto kSilentAtMost = 2000ms;
constexpr std::size_t kFrameHead = 13;  // opcode, subscription, time
constexpr double kNsPerMs = 1e6;

struct ConsoleBenchOptions {
  dds::NetworkOptions network;
  double rate_hz = 2000.0;
  double warm_up_s = 3.0;
  double seconds = 10.0;
  std::uint16_t port = 18765;
  std::string json;
};

std::unique_ptr<web::BlockingClient> connect(const web::Address& address) {
  const auto give_up = Clock::now() + kConnectWithin;
  for (;;) {
    try {
      auto client = std::make_unique<web::BlockingClient>(address);
      const auto reply = client->upgrade("/", "foxglove.sdk.v1");
      if (reply.status == 101) return client;
      throw std::runtime_error("bench console: the console answers " + reply.head);
    } catch (const web::WebError& error) {
      if (Clock::now() > give_up) throw;
    }
    if (service::wait_for_stop(50ms)) throw std::runtime_error("bench console: stopped");
  }
}

std::optional<std::uint32_t> samples_channel(const std::string& text) {
  const auto json = nlohmann::json::parse(text);
  if (json.at("op") != "advertise") return std::nullopt;
  for (const auto& channel : json.at("channels")) {
    if (channel.at("topic") == "/gyro_1/samples") return channel.at("id").get<std::uint32_t>();
  }
  return std::nullopt;
}

void subscribe(web::BlockingClient& client) {
  const auto give_up = Clock::now() + kConnectWithin;
  while (Clock::now() < give_up) {
    const auto message = client.receive(kSilentAtMost);
    if (!message || message->opcode != Opcode::kText) continue;
    const auto channel = samples_channel(message->payload);
    if (!channel) continue;
    client.send(Opcode::kText,
                nlohmann::json{{"op", "subscribe"},
                               {"subscriptions", {{{"id", 1}, {"channelId", *channel}}}}}
                    .dump());
    return;
  }
  throw std::runtime_error("bench console: no samples are offered");
}

struct Figures {
  std::vector<double> age_ms{};  // of each sample when it reached the client
  std::uint64_t frames = 0;
  std::uint64_t missing = 0;
  std::uint64_t out_of_order = 0;
  double cpu = 0.0;  // of a core
};

// Sensor time runs as the host's clock does, so it dates the samples before the newest.
void note(const telemetry::SampleBatch& batch, Figures& figures) {
  const std::int64_t now_ns = service::unix_time_ns();
  const std::int64_t newest_ns = *batch.sensor_time_ns().rbegin();
  std::int64_t before = batch.sensor_time_ns(0) - 1;
  for (const std::int64_t time_ns : batch.sensor_time_ns()) {
    figures.age_ms.push_back(
        static_cast<double>(now_ns - batch.publish_unix_ns() + newest_ns - time_ns) / kNsPerMs);
    if (time_ns <= before) ++figures.out_of_order;
    before = time_ns;
  }
  ++figures.frames;
}

Figures listen(web::BlockingClient& client, const BenchProcess& console,
               const ConsoleBenchOptions& options) {
  const auto since = [](Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
  };
  Figures figures;
  const auto begin = Clock::now();
  std::optional<Clock::time_point> measured_since;
  std::uint64_t missing_before = 0;
  double cpu_before_s = 0.0;
  telemetry::SampleBatch batch;
  while (!measured_since || since(*measured_since) < options.seconds) {
    const auto message = client.receive(kSilentAtMost);
    if (!message) throw std::runtime_error("bench console: no samples come any more");
    if (message->opcode != Opcode::kBinary || message->payload.size() < kFrameHead) continue;
    if (!batch.ParseFromString(message->payload.substr(kFrameHead)) ||
        batch.sensor_time_ns().empty())
      throw std::runtime_error("bench console: a frame that is no batch of samples");
    if (!measured_since) {
      missing_before = batch.missing();
      cpu_before_s = console.usage().cpu_s;
      if (since(begin) >= options.warm_up_s) measured_since = Clock::now();
      continue;
    }
    note(batch, figures);
  }
  figures.cpu = (console.usage().cpu_s - cpu_before_s) / since(*measured_since);
  figures.missing = batch.missing() - missing_before;
  return figures;
}

double quantile(std::vector<double>& values, double share) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

int report(const ConsoleBenchOptions& options, Figures& figures, std::int64_t resident_kb) {
  const double p50_ms = quantile(figures.age_ms, 0.5);
  const double p99_ms = quantile(figures.age_ms, 0.99);
  const std::size_t samples = figures.age_ms.size();
  const bool is_good = figures.cpu <= kCpuGoal && figures.missing + figures.out_of_order == 0;
  std::printf(
      "console at %.0f Hz x 3 axes, one client of /gyro_1/samples, %.1f s: %zu samples in %llu "
      "frames, missing %llu, out of order %llu\n"
      "CPU of the console %.2f %% of a core (goal: at most %.0f %%), resident %lld kB\n"
      "age of a sample at the client, from the publisher's stamp: p50 %.2f ms, p99 %.2f ms\n",
      options.rate_hz, options.seconds, samples, static_cast<unsigned long long>(figures.frames),
      static_cast<unsigned long long>(figures.missing),
      static_cast<unsigned long long>(figures.out_of_order), 100.0 * figures.cpu, 100.0 * kCpuGoal,
      static_cast<long long>(resident_kb), p50_ms, p99_ms);
  if (!options.json.empty()) {
    const nlohmann::json json{{"rate_hz", options.rate_hz}, {"seconds", options.seconds},
                              {"samples", samples},         {"frames", figures.frames},
                              {"missing", figures.missing}, {"out_of_order", figures.out_of_order},
                              {"cpu", figures.cpu},         {"cpu_goal", kCpuGoal},
                              {"age_p50_ms", p50_ms},       {"age_p99_ms", p99_ms},
                              {"resident_kb", resident_kb}};
    files::AtomicFile file(options.json);
    file.append(json.dump(2) + "\n");
    file.commit();
  }
  return is_good ? service::kExitDone : service::kExitNo;
}

int bench_console(const ConsoleBenchOptions& options) {
  const web::Address address{"127.0.0.1", options.port};
  const std::vector<std::string> domain{"--domain", std::to_string(options.network.domain)};
  const BenchProcess compensation("compensation", domain, BenchProcess::Streams::kQuiet);
  auto arguments = domain;
  arguments.insert(arguments.end(), {"--listen", address.text()});
  const BenchProcess console("console", arguments, BenchProcess::Streams::kQuiet);
  dds::Participant participant("zerodrift_bench", options.network);
  const SyntheticGyro gyro(participant, {.rate_hz = options.rate_hz, .sensor_speed = 1.0});
  const auto client = connect(address);
  subscribe(*client);
  Figures figures = listen(*client, console, options);
  return report(options, figures, console.usage().resident_kb);
}

}  // namespace

void add_bench_console(CLI::App& bench, Run& run) {
  auto* command =
      bench.add_subcommand("console", "what the console costs, and how old its samples are");
  auto options = std::make_shared<ConsoleBenchOptions>();
  options->network.domain = kDomain;
  command->add_option("--rate", options->rate_hz, "samples a second")
      ->check(CLI::Range(10.0, 20000.0))
      ->capture_default_str();
  command->add_option("--seconds", options->seconds, "to measure, after 3 s")
      ->check(CLI::Range(1.0, 86400.0))
      ->capture_default_str();
  command->add_option("--port", options->port, "that the console listens at")
      ->check(CLI::Range(1, 65535))
      ->capture_default_str();
  command->add_option("--json", options->json, "also as JSON, to this file");
  command->add_option("--domain", options->network.domain, "DDS domain")->capture_default_str();
  command->callback([options, &run] { run = [options] { return bench_console(*options); }; });
}

}  // namespace zerodrift::bench
