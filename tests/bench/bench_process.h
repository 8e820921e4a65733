// SPDX-License-Identifier: Apache-2.0
// A program of this build, started by a bench and never outliving it.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace zerodrift::bench {

// The folder this program was started from, which has the services too.
std::filesystem::path program_folder();

// What a process has used so far.
struct ProcessUsage {
  double cpu_s = 0.0;
  std::int64_t resident_kb = 0;
};

class BenchProcess {
 public:
  // kQuiet: standard error is thrown away. kTalks: standard input and output are pipes to the
  // bench, standard error is the bench's.
  enum class Streams : std::uint8_t { kQuiet, kTalks };

  // `name`: a program in program_folder(). Throws std::runtime_error.
  BenchProcess(const std::string& name, std::vector<std::string> arguments, Streams streams);
  // SIGTERM; SIGKILL after two seconds.
  ~BenchProcess();
  BenchProcess(const BenchProcess&) = delete;
  BenchProcess& operator=(const BenchProcess&) = delete;

  // kTalks only. Both throw std::runtime_error where the process has ended or says nothing for so
  // long.
  void say(const std::string& line);
  std::string receive(std::chrono::milliseconds at_most);

  // Zeros once it has ended.
  [[nodiscard]] ProcessUsage usage() const;
  [[nodiscard]] pid_t pid() const { return pid_; }

 private:
  std::string name_;
  pid_t pid_ = 0;
  int to_ = -1;
  int from_ = -1;
  std::string received_;
};

}  // namespace zerodrift::bench
