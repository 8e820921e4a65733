// SPDX-License-Identifier: Apache-2.0
#include "tests/hosts/deployment.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <stdexcept>

#include "common/service/monotonic_clock.h"
#include "tests/system/files.h"

namespace zerodrift::hosts_test {
namespace {

using namespace std::chrono_literals;
using system_test::eventually;

constexpr std::uint64_t kSeed = 77;
constexpr auto kInSyncWithin = 60s;
constexpr double kComparedInSync = 200.0;  // a second of answers at 200 Hz
constexpr const char* kEnter = "/usr/bin/nsenter";

// Sensor time runs 8 times as fast as the hosts', so that there is a model within ten seconds. One
// is due for 2 s of each 5, so that the state can be handed over in the rest. What has to be there
// in time (temperatures, models) has 250 ms, 8 round trips of the slowest link here; a partition is
// shorter than temperatures are used.
constexpr const char* kSensorSpeed = "8";
constexpr const char* kConfig =
    "scheme: online-svr\n"
    "features:\n"
    "  - {kind: temperature, probe: coil}\n"
    "  - {kind: temperature_rate, probe: coil}\n"
    "learning: {label_interval_s: 5, confirm_s: 2, handover_s: 2}\n"
    "earth_rate: {mode: included}\n"
    "temperature_delay_s: 2\n"
    "temperature_stale_s: 60\n";

std::filesystem::path make_folder() {
  std::string name = (std::filesystem::temp_directory_path() / "zerodrift-hosts-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot make " + name);
  return name;
}

Arguments arguments_of(const dds::NetworkOptions& network) {
  Arguments arguments;
  const auto add = [&](const char* option, const std::vector<std::string>& values) {
    for (const auto& value : values) arguments.insert(arguments.end(), {option, value});
  };
  add("--interface", network.interfaces);
  add("--peer", network.peers);
  add("--discovery-server", network.discovery_servers);
  return arguments;
}

std::string service_name(int instance) {
  return instance == 0 ? "compensation" : "compensation/" + std::to_string(instance);
}

}  // namespace

Deployment::Deployment(const DeploymentOptions& options)
    : options_(options), folder_(make_folder()), network_(kHosts, kSeed) {
  network_.set_conditions(options.conditions);
  system_test::write(folder_ / "config.yaml", kConfig);
  subscribe();
  if (options.discovery == Discovery::kServers) start_discovery_servers();
  start_compensation(0);
  start_compensation(1);
  start_gyro();
}

Deployment::~Deployment() {
  for (auto& process : processes_) process.child->send(SIGTERM);
  if (::testing::Test::HasFailure()) {
    for (auto& process : processes_) {
      process.child->wait(2s);
      std::printf("---- %s\n%s%s", process.child->name().c_str(), process.child->out().c_str(),
                  process.child->err().c_str());
    }
  }
  processes_.clear();
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

// ---------------------------------------- processes

dds::NetworkOptions Deployment::network_of(std::size_t host) const {
  dds::NetworkOptions network;
  network.interfaces = {HostNetwork::address(host)};
  if (options_.discovery == Discovery::kServers) {
    network.discovery_servers = {HostNetwork::address(kPrimary), HostNetwork::address(kStandby)};
    return network;
  }
  for (std::size_t other = 0; other < kHosts; ++other) {
    if (other != host) network.peers.push_back(HostNetwork::address(other));
  }
  return network;
}

ChildProcess& Deployment::start(std::size_t host, const std::string& program,
                                const Arguments& arguments) {
  Arguments all = network_.entering(host);
  all.push_back((std::filesystem::path(ZERODRIFT_BIN_DIR) / program).string());
  const Arguments network = arguments_of(network_of(host));
  all.insert(all.end(), network.begin(), network.end());
  all.insert(all.end(), arguments.begin(), arguments.end());
  const std::string name = std::to_string(processes_.size()) + "-" + program;
  processes_.push_back({host, std::make_unique<ChildProcess>(
                                  system_test::Program{kEnter, all, {}, folder_ / name})});
  return *processes_.back().child;
}

void Deployment::start_discovery_servers() {
  start(kPrimary, "discovery_server", {"--id", "0"});
  start(kStandby, "discovery_server", {"--id", "1"});
}

void Deployment::start_compensation(int instance) {
  start(kPrimary + static_cast<std::size_t>(instance), "compensation",
        {"--config", (folder_ / "config.yaml").string(), "--instance", std::to_string(instance),
         "--redundant"});
}

void Deployment::start_gyro() {
  const std::string rate = std::to_string(options_.rate_hz);
  if (options_.gyro == Gyro::kHardware) {
    start(kPublishers, "host_gyro", {"--rate", rate, "--sensor-speed", kSensorSpeed});
    return;
  }
  const std::filesystem::path source(ZERODRIFT_SOURCE_DIR);
  const Arguments simulation{"--source",  "simulation",
                             "--model",   (source / "config/models/paper_fog.yaml").string(),
                             "--profile", (source / "config/profiles/paper_chamber.yaml").string(),
                             "--speed",   kSensorSpeed,
                             "--seed",    "1"};
  start(kPublishers, "thermal_publisher", simulation);
  Arguments gyro = simulation;
  const double simulated_hz = options_.rate_hz / std::atof(kSensorSpeed);
  gyro.insert(gyro.end(), {"--rate", std::to_string(simulated_hz), "--wait-for", ""});
  start(kPublishers, "gyro_publisher", gyro);
}

void Deployment::kill_host(std::size_t host) {
  network_.unplug(host);
  for (auto& process : processes_) {
    if (process.host == host) process.child->send(SIGKILL);
  }
  std::erase_if(processes_, [&](const Process& process) { return process.host == host; });
}

bool Deployment::all_run() {
  return std::all_of(processes_.begin(), processes_.end(),
                     [](Process& process) { return process.child->running(); });
}

// ---------------------------------------- the subscriber

void Deployment::subscribe() {
  const dds::NetworkOptions network = network_of(kSubscriber);
  network_.run_on(kSubscriber, [&] {
    participant_ = std::make_unique<dds::Participant>("test", network);
    status_reader_.emplace(*participant_, [this](const auto& status, const dds::SampleOrigin&) {
      const std::lock_guard lock(metrics_mutex_);
      auto& metrics = metrics_[status.service().c_str()];
      for (const auto& metric : status.metrics()) metrics[metric.name().c_str()] = metric.value();
    });
    events_.emplace(*participant_);
    raw_reader_.emplace(*participant_, [this](const auto& message, const dds::SampleOrigin&) {
      raw_.note(message.sequence_number(), message.publish_time_ns(), service::monotonic_ns());
    });
    compensated_reader_.emplace(
        *participant_, [this](const auto& message, const dds::SampleOrigin&) {
          compensated_.note(message.sequence_number(), message.publish_time_ns(),
                            service::monotonic_ns());
        });
  });
}

double Deployment::newest(const std::string& service, const std::string& metric) const {
  const std::lock_guard lock(metrics_mutex_);
  const auto metrics = metrics_.find(service);
  if (metrics == metrics_.end()) return std::numeric_limits<double>::quiet_NaN();
  const auto found = metrics->second.find(metric);
  return found == metrics->second.end() ? std::numeric_limits<double>::quiet_NaN() : found->second;
}

double Deployment::metric(int instance, const std::string& name) const {
  return newest(service_name(instance) + ":1", name);
}

double Deployment::total(int instance, const std::string& name) const {
  return newest(service_name(instance), name);
}

std::string Deployment::roles() const {
  std::string text;
  for (const char* name :
       {"active", "health", "takeovers", "step_backs", "compared", "differing", "model_epoch"}) {
    text += std::string(name) + ' ' + std::to_string(metric(0, name)) + " and " +
            std::to_string(metric(1, name)) + ", ";
  }
  return text;
}

bool Deployment::told(const std::string& code, const std::string& text) const {
  return system_test::told(*events_, code, text);
}

int Deployment::active_instance() const {
  const bool first = metric(0, "active") == 1.0;
  const bool second = metric(1, "active") == 1.0;
  if (first == second) return -1;
  return first ? 0 : 1;
}

void Deployment::wait_until_in_sync() {
  ASSERT_TRUE(eventually([&] { return compensated_.size() > 0; }, kInSyncWithin))
      << "nothing is answered";
  double compared = -1.0;
  ASSERT_TRUE(eventually(
      [&] {
        const int active = active_instance();
        if (active < 0) return false;
        const int standby = 1 - active;
        const bool follows = metric(standby, "health") == 0.0 &&
                             metric(active, "model_epoch") >= 2 &&
                             metric(standby, "model_epoch") >= 2;
        if (!follows) compared = -1.0;
        if (follows && compared < 0.0) compared = metric(standby, "compared");
        std::this_thread::sleep_for(20ms);
        return follows && metric(standby, "compared") >= compared + kComparedInSync;
      },
      kInSyncWithin))
      << roles();
}

void print_row(const std::string& scenario, const std::string& stream,
               const StreamVerdict& verdict) {
  static bool headed = false;
  if (!headed) {
    std::printf("%-26s %-12s %7s %8s %7s %7s %8s %11s %11s %9s %9s %9s\n", "scenario", "stream",
                "sent", "received", "missing", "doubled", "disorder", "longest gap", "silence[ms]",
                "p50[ms]", "p99[ms]", "max[ms]");
    headed = true;
  }
  std::printf("%-26s %-12s %7llu %8llu %7llu %7llu %8llu %11llu %11.1f %9.2f %9.2f %9.1f\n",
              scenario.c_str(), stream.c_str(), static_cast<unsigned long long>(verdict.sent),
              static_cast<unsigned long long>(verdict.received),
              static_cast<unsigned long long>(verdict.missing),
              static_cast<unsigned long long>(verdict.doubled),
              static_cast<unsigned long long>(verdict.out_of_order),
              static_cast<unsigned long long>(verdict.longest_gap), verdict.longest_silence_ms,
              verdict.latency_p50_ms, verdict.latency_p99_ms, verdict.latency_max_ms);
  std::fflush(stdout);
}

}  // namespace zerodrift::hosts_test
