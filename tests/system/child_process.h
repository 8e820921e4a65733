// SPDX-License-Identifier: Apache-2.0
// A program started by a test. It never outlives the test: not its object, not the test's process,
// however that ends.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace zerodrift::system_test {

using Arguments = std::vector<std::string>;
using Environment = std::vector<std::pair<std::string, std::string>>;

inline Arguments operator+(Arguments a, const Arguments& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

struct Program {
  std::filesystem::path file;
  Arguments arguments;
  Environment environment;       // added to the test's own
  std::filesystem::path output;  // standard output and error go to <output>.out and <output>.err
};

class ChildProcess {
 public:
  // Throws std::system_error where the process can't be made.
  explicit ChildProcess(Program program);
  // SIGTERM, then SIGKILL after two seconds.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  [[nodiscard]] bool running();
  void send(int signal);
  // It has begun: a stop signal no longer ends it at once, but is heeded in order.
  [[nodiscard]] bool heeds_stop_signals() const;
  // Exit code as a shell tells it: 128 + the number of the signal that ended the process. None: it
  // still runs. `at_most` is meant for a quiet machine: any but 0 is taken threefold, and for 10 s
  // at least, so that no test fails by load. That a stop takes effect within 2 s, whatever the
  // middleware does, is service::end_within()'s to hold.
  std::optional<int> wait(std::chrono::milliseconds at_most);

  // What it wrote so far.
  [[nodiscard]] std::string out() const;
  [[nodiscard]] std::string err() const;
  // Resident set, bytes; none once it has ended.
  [[nodiscard]] std::optional<std::uint64_t> resident_bytes();
  [[nodiscard]] std::string name() const { return program_.output.filename().string(); }

 private:
  Program program_;
  pid_t pid_ = -1;
  std::optional<int> exit_code_;
};

}  // namespace zerodrift::system_test
