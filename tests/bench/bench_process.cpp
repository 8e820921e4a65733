// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/bench_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

extern char** environ;

namespace zerodrift::bench {
namespace {

using namespace std::chrono_literals;

// Ends of a pipe, closed in every program started later.
std::array<int, 2> make_pipe() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("bench: no pipe to be had");
  return ends;
}

}  // namespace

std::filesystem::path program_folder() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

BenchProcess::BenchProcess(const std::string& name, std::vector<std::string> arguments,
                           Streams streams)
    : name_(name) {
  const auto program = program_folder() / name;
  std::string path = program.string();
  std::vector<char*> argv{path.data()};
  for (auto& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  std::array<int, 2> in{-1, -1};
  std::array<int, 2> out{-1, -1};
  if (streams == Streams::kTalks) {
    signal(SIGPIPE, SIG_IGN);  // say() tells of a process that has ended
    in = make_pipe();
    out = make_pipe();
    posix_spawn_file_actions_adddup2(&actions, in[0], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
  } else {
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  }
  const int error = posix_spawn(&pid_, program.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (streams == Streams::kTalks) {
    close(in[0]);
    close(out[1]);
    to_ = in[1];
    from_ = out[0];
  }
  if (error != 0) {
    if (to_ >= 0) close(to_);
    if (from_ >= 0) close(from_);
    throw std::runtime_error("bench: cannot start " + program.string());
  }
}

BenchProcess::~BenchProcess() {
  if (to_ >= 0) close(to_);
  if (from_ >= 0) close(from_);
  kill(pid_, SIGTERM);
  for (int hundredth = 0; hundredth < 200; ++hundredth) {
    if (waitpid(pid_, nullptr, WNOHANG) != 0) return;
    std::this_thread::sleep_for(10ms);
  }
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

void BenchProcess::say(const std::string& line) {
  const std::string text = line + '\n';
  if (write(to_, text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
    throw std::runtime_error("bench: " + name_ + " has ended before its time");
  }
}

std::string BenchProcess::receive(std::chrono::milliseconds at_most) {
  const auto until = std::chrono::steady_clock::now() + at_most;
  for (;;) {
    if (const auto end = received_.find('\n'); end != std::string::npos) {
      std::string line = received_.substr(0, end);
      received_.erase(0, end + 1);
      return line;
    }
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        until - std::chrono::steady_clock::now());
    pollfd waiting{from_, POLLIN, 0};
    if (left <= 0ms || poll(&waiting, 1, static_cast<int>(left.count())) == 0) {
      throw std::runtime_error("bench: " + name_ + " says nothing for " +
                               std::to_string(at_most.count()) + " ms");
    }
    std::array<char, 65536> buffer;
    const ssize_t got = read(from_, buffer.data(), buffer.size());
    if (got <= 0) throw std::runtime_error("bench: " + name_ + " has ended before its time");
    received_.append(buffer.data(), static_cast<std::size_t>(got));
  }
}

ProcessUsage BenchProcess::usage() const {
  ProcessUsage result;
  const std::string folder = "/proc/" + std::to_string(pid_);
  std::ifstream status(folder + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmRSS:", 0) == 0) result.resident_kb = std::stol(line.substr(6));
  }
  std::ifstream stat(folder + "/stat");
  std::string line;
  std::getline(stat, line);
  if (const auto name_end = line.rfind(')'); name_end != std::string::npos) {
    // proc(5): utime and stime are fields 14 and 15; ")" ends the second.
    std::istringstream fields(line.substr(name_end + 1));
    std::string skipped;
    for (int field = 3; field < 14; ++field) fields >> skipped;
    double user = 0.0;
    double system = 0.0;
    fields >> user >> system;
    result.cpu_s = (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
  }
  return result;
}

}  // namespace zerodrift::bench
