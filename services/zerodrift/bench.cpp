// SPDX-License-Identifier: Apache-2.0
// zerodrift bench end-to-end: the whole chain of processes as fast as it goes, without losing a
// sample.
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "common/service/host.h"
#include "common/service/main.h"
#include "services/zerodrift/commands.h"
#include "services/zerodrift/progress_bar.h"
#include "services/zerodrift/status_table.h"

extern char** environ;

namespace zerodrift::services {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr std::uint32_t kBenchDomain = 231;  // away from anything that runs

struct BenchOptions {
  dds::NetworkOptions network;
  std::string model;
  std::string profile;
  double duration_s = 18000.0;
};

// A service of this build, started quietly, ended with SIGTERM.
class Process {
 public:
  Process(const std::string& name, std::vector<std::string> arguments) {
    const auto program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / name;
    arguments.insert(arguments.begin(), program.string());
    std::vector<char*> argv;
    for (auto& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    const int error = posix_spawn(&pid_, program.c_str(), &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (error != 0) throw std::runtime_error("bench: cannot start " + program.string());
  }
  ~Process() {
    kill(pid_, SIGTERM);
    for (int tenth = 0; tenth < 20; ++tenth) {
      if (waitpid(pid_, nullptr, WNOHANG) != 0) return;
      std::this_thread::sleep_for(100ms);
    }
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  // Resident memory, kB; 0 when it has ended.
  [[nodiscard]] long resident_kb() const {
    std::ifstream status("/proc/" + std::to_string(pid_) + "/status");
    for (std::string line; std::getline(status, line);) {
      if (line.rfind("VmRSS:", 0) == 0) return std::stol(line.substr(6));
    }
    return 0;
  }

 private:
  pid_t pid_ = 0;
};

std::string text(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.9g", value);
  return buffer;
}

int end_to_end(const BenchOptions& options) {
  const std::vector<std::string> domain{"--domain", std::to_string(options.network.domain)};
  std::vector<std::string> source{
      "--source",      "simulation", "--model", options.model, "--profile",
      options.profile, "--speed",    "max",     "--duration",  text(options.duration_s)};
  source.insert(source.end(), domain.begin(), domain.end());
  const auto with = [](std::vector<std::string> base, std::vector<std::string> more) {
    base.insert(base.end(), more.begin(), more.end());
    return base;
  };
  dds::Participant participant("zerodrift_bench", options.network);
  StatusBoard board(participant);
  const Process monitor("allan_monitor", domain);
  const Process compensation("compensation", with(domain, {"--await-subscribers", "1"}));
  const Process thermal("thermal_publisher", source);
  const Process gyro("gyro_publisher", with(source, {"--wait-for", "compensation,allan_monitor"}));

  ProgressBar bar("end to end");
  std::optional<Clock::time_point> first;
  long monitor_early = 0;
  long compensation_early = 0;
  double answered = 0.0;
  auto progressed = Clock::now();
  while (!board.finished() || !board.nothing_lost()) {
    if (service::wait_for_stop(50ms)) return service::kExitNo;
    const double now = board.answered();
    if (now > 0.0 && !first) first = Clock::now();
    if (now != answered) progressed = Clock::now();
    answered = now;
    if (Clock::now() - progressed > 30s) {
      std::fprintf(stderr, "bench end-to-end: no progress for 30 s after %.0f samples\n", answered);
      return service::kExitNo;
    }
    bar.show(board.sensor_time_s() / options.duration_s);
    if (monitor_early == 0 && board.sensor_time_s() > 0.2 * options.duration_s) {
      monitor_early = monitor.resident_kb();
      compensation_early = compensation.resident_kb();
    }
  }
  const double elapsed_s =
      std::chrono::duration<double>(Clock::now() - first.value_or(Clock::now())).count();
  std::printf(
      "end to end: %.0f samples of 3 axes in %.1f s: %.0f samples/s, %.0f times real time\n",
      answered, elapsed_s, answered / elapsed_s, options.duration_s / elapsed_s);
  std::printf(
      "resident memory at 20 %% and at the end: compensation %ld and %ld kB, allan_monitor %ld and "
      "%ld kB\n",
      compensation_early, compensation.resident_kb(), monitor_early, monitor.resident_kb());
  std::printf("%s", board.summary().c_str());
  return service::kExitDone;
}

}  // namespace

void add_bench(CLI::App& app, Run& run) {
  auto* bench = app.add_subcommand("bench", "measure");
  bench->require_subcommand(1);
  auto* command =
      bench->add_subcommand("end-to-end", "samples a second through all processes, none lost");
  auto options = std::make_shared<BenchOptions>();
  options->network.domain = kBenchDomain;
  command->add_option("--model", options->model, "the twin's model file")->required();
  command->add_option("--profile", options->profile, "what the experiment does")->required();
  command->add_option("--duration", options->duration_s, "simulated seconds")
      ->capture_default_str();
  command->add_option("--domain", options->network.domain, "DDS domain")->capture_default_str();
  command->callback([options, &run] { run = [options] { return end_to_end(*options); }; });
  add_bench_svr(*bench, run);
  add_bench_allan(*bench, run);
}

}  // namespace zerodrift::services
