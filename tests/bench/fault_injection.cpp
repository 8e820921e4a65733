// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/fault_injection.h"

#include <sys/ptrace.h>
#include <sys/wait.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace zerodrift::bench {
namespace {

pid_t thread_named(pid_t process, const std::string& name) {
  const std::string tasks = "/proc/" + std::to_string(process) + "/task";
  std::error_code error;
  for (const auto& task : std::filesystem::directory_iterator(tasks, error)) {
    std::ifstream file(task.path() / "comm");
    std::string comm;
    if (std::getline(file, comm) && comm == name)
      return static_cast<pid_t>(std::stol(task.path().filename().string()));
  }
  throw std::runtime_error("process " + std::to_string(process) + " has no thread named '" + name +
                           "'");
}

}  // namespace

HangingThread::HangingThread(pid_t process, const std::string& name)
    : thread_(thread_named(process, name)) {
  if (ptrace(PTRACE_SEIZE, thread_, nullptr, nullptr) != 0 ||
      ptrace(PTRACE_INTERRUPT, thread_, nullptr, nullptr) != 0) {
    throw std::runtime_error(std::string("a thread can't be stopped here: ptrace: ") +
                             std::strerror(errno));
  }
  waitpid(thread_, nullptr, __WALL);
}

HangingThread::~HangingThread() {
  ptrace(PTRACE_DETACH, thread_, nullptr, nullptr);
}

}  // namespace zerodrift::bench
