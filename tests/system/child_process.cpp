// SPDX-License-Identifier: Apache-2.0
#include "tests/system/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <string_view>
#include <system_error>
#include <thread>

#include "tests/support/sanitized.h"
#include "tests/system/files.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

constexpr std::chrono::milliseconds kLoadedMachine = 10s;

std::vector<std::string> environment_with(const Environment& added) {
  std::vector<std::string> all;
  for (char** entry = environ; *entry != nullptr; ++entry) all.emplace_back(*entry);
  for (const auto& [name, value] : added) all.push_back(name + "=" + value);
  return all;
}

std::vector<char*> pointers_to(std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (auto& text : texts) pointers.push_back(text.data());
  pointers.push_back(nullptr);
  return pointers;
}

std::filesystem::path with_suffix(std::filesystem::path path, const char* suffix) {
  return path += suffix;
}

int open_output(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0644);
  if (file < 0) throw std::system_error(errno, std::generic_category(), path.string());
  return file;
}

}  // namespace

ChildProcess::ChildProcess(Program program) : program_(std::move(program)) {
  // All memory is had before the fork: a child of a process with threads may only make system
  // calls.
  std::vector<std::string> arguments{program_.file.string()};
  arguments.insert(arguments.end(), program_.arguments.begin(), program_.arguments.end());
  std::vector<std::string> variables = environment_with(program_.environment);
  const std::vector<char*> argv = pointers_to(arguments);
  const std::vector<char*> envp = pointers_to(variables);
  const int out = open_output(with_suffix(program_.output, ".out"));
  const int err = open_output(with_suffix(program_.output, ".err"));
  const pid_t parent = ::getpid();

  pid_ = ::fork();
  if (pid_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(127);
    ::dup2(out, STDOUT_FILENO);
    ::dup2(err, STDERR_FILENO);
    ::close_range(3, ~0U, 0);  // the test's sockets are not for its children
    ::execve(argv[0], argv.data(), envp.data());
    ::_exit(127);
  }
  ::close(out);
  ::close(err);
  if (pid_ < 0) throw std::system_error(errno, std::generic_category(), program_.file.string());
}

ChildProcess::~ChildProcess() {
  send(SIGTERM);
  if (wait(2s)) return;
  send(SIGKILL);
  wait(10s);
}

bool ChildProcess::running() {
  return !wait(0ms);
}

void ChildProcess::send(int signal) {
  if (running()) ::kill(pid_, signal);
}

std::optional<int> ChildProcess::wait(std::chrono::milliseconds at_most) {
  constexpr int kTimesAsSlow = kIsSanitized ? 12 : 3;
  const auto patience = at_most > 0ms ? std::max(kTimesAsSlow * at_most, kLoadedMachine) : at_most;
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!exit_code_) {
    int status = 0;
    if (::waitpid(pid_, &status, WNOHANG) == pid_) {
      exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    } else if (std::chrono::steady_clock::now() >= end) {
      break;
    } else {
      std::this_thread::sleep_for(2ms);
    }
  }
  return exit_code_;
}

bool ChildProcess::heeds_stop_signals() const {
  std::ifstream status("/proc/" + std::to_string(pid_) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (!line.starts_with("SigBlk:")) continue;
    const auto blocked = std::stoull(line.substr(7), nullptr, 16);
    return (blocked >> (SIGTERM - 1) & 1U) != 0;
  }
  return false;
}

std::string ChildProcess::out() const {
  return content(with_suffix(program_.output, ".out"));
}
std::string ChildProcess::err() const {
  return content(with_suffix(program_.output, ".err"));
}

std::optional<std::uint64_t> ChildProcess::resident_bytes() {
  if (!running()) return std::nullopt;
  std::ifstream statm("/proc/" + std::to_string(pid_) + "/statm");
  std::uint64_t all_pages = 0;
  std::uint64_t resident_pages = 0;
  if (!(statm >> all_pages >> resident_pages)) return std::nullopt;
  return resident_pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace zerodrift::system_test
