// SPDX-License-Identifier: Apache-2.0
// The system on four hosts: a gyro on one, an instance of the compensation on each of two, a
// subscriber on the fourth. Real processes; the subscriber is the test itself, with its
// participant in the fourth host's network.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "tests/hosts/host_network.h"
#include "tests/hosts/sample_stream.h"
#include "tests/system/child_process.h"
#include "tests/system/system_under_test.h"

namespace zerodrift::hosts_test {

using system_test::Arguments;
using system_test::ChildProcess;

// Numbers of the hosts; the instances of the compensation are kPrimary - 1 and kStandby - 1.
inline constexpr std::size_t kPublishers = 0;
inline constexpr std::size_t kPrimary = 1;
inline constexpr std::size_t kStandby = 2;
inline constexpr std::size_t kSubscriber = 3;
inline constexpr std::size_t kHosts = 4;

enum class Gyro : std::uint8_t {
  kHardware,    // host_gyro: real time, nobody waits
  kSimulation,  // the publishers' own, at real time
};

enum class Discovery : std::uint8_t {
  kPeers,    // every host looks at every other
  kServers,  // two discovery servers, on the hosts of the compensation
};

struct DeploymentOptions {
  Gyro gyro = Gyro::kHardware;
  double rate_hz = 200.0;
  LinkConditions conditions{};  // from the start on, discovery and catching up included
  Discovery discovery = Discovery::kPeers;
};

class Deployment {
 public:
  explicit Deployment(const DeploymentOptions& options);
  // Stops everything; shows what the processes wrote where the test failed.
  ~Deployment();
  Deployment(const Deployment&) = delete;
  Deployment& operator=(const Deployment&) = delete;

  HostNetwork& network() { return network_; }
  SampleStream& raw() { return raw_; }
  SampleStream& compensated() { return compensated_; }
  // A failure of the test where this takes more than a minute: both answer the same, one leads, and
  // both learn.
  void wait_until_in_sync();
  // Link down for good and every process of the host ended by SIGKILL.
  void kill_host(std::size_t host);
  [[nodiscard]] bool all_run();

  // What an instance (0 or 1) last said of itself as it arrived here; NaN: not yet.
  [[nodiscard]] double metric(int instance, const std::string& name) const;
  [[nodiscard]] bool told(const std::string& code, const std::string& text = "") const;
  // As metric(), of the service as a whole.
  [[nodiscard]] double total(int instance, const std::string& name) const;
  [[nodiscard]] int active_instance() const;  // the one that leads; -1: not exactly one says so

 private:
  [[nodiscard]] double newest(const std::string& service, const std::string& metric) const;
  [[nodiscard]] std::string roles() const;  // for a failure's text

  struct Process {
    std::size_t host;
    std::unique_ptr<ChildProcess> child;
  };
  ChildProcess& start(std::size_t host, const std::string& program, const Arguments& arguments);
  void start_discovery_servers();
  void start_compensation(int instance);
  void start_gyro();
  void subscribe();
  // What this host's processes are told of the network.
  [[nodiscard]] dds::NetworkOptions network_of(std::size_t host) const;

  DeploymentOptions options_;
  std::filesystem::path folder_;
  HostNetwork network_;
  std::vector<Process> processes_;
  SampleStream raw_;
  SampleStream compensated_;
  std::unique_ptr<dds::Participant> participant_;
  mutable std::mutex metrics_mutex_;
  std::map<std::string, std::map<std::string, double>> metrics_;  // the newest, by service
  std::optional<dds::Reader<msg::ServiceStatus>> status_reader_;
  std::optional<system_test::Collector<msg::Event>> events_;
  std::optional<dds::Reader<msg::AngularRate>> raw_reader_;
  std::optional<dds::Reader<msg::CompensatedRate>> compensated_reader_;
};

// A line of the table of figures, with the heading where it is the first.
void print_row(const std::string& scenario, const std::string& stream,
               const StreamVerdict& verdict);

}  // namespace zerodrift::hosts_test
