// SPDX-License-Identifier: Apache-2.0
// `zerodrift` on files of a folder of its own.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <string>

#include "tests/system/child_process.h"
#include "tests/system/files.h"

namespace zerodrift::cli_test {

using system_test::Arguments;
using system_test::ChildProcess;
using system_test::content;
using system_test::Environment;

struct Finished {
  int exit_code = -1;  // 128 + the signal that ended it; -1: it took too long
  std::string out{};
  std::string err{};
};

class CommandLine : public testing::Test {
 protected:
  CommandLine();
  ~CommandLine() override;

  [[nodiscard]] std::filesystem::path path(const std::string& name) const { return folder_ / name; }
  // Arguments that begin with '@' name a file of the folder.
  [[nodiscard]] Arguments in_folder(Arguments arguments) const;
  [[nodiscard]] system_test::Program command(const Arguments& arguments,
                                             const Environment& environment = {}) const;
  Finished run(const Arguments& arguments, const Environment& environment = {});
  // By a shell; "zerodrift" is the program's path in $zerodrift.
  Finished shell(const std::string& line);

  // A record of `duration_s` at 10 Hz with one thermometer and a reference, record.csv.
  void make_record(int duration_s);
  // What is in the folder, by name.
  [[nodiscard]] std::map<std::string, std::string> files() const;

 private:
  static Finished finish(ChildProcess& process);

  std::filesystem::path folder_;
  std::filesystem::path output_;  // beside it
};

[[nodiscard]] std::size_t lines_of(const std::string& text);

}  // namespace zerodrift::cli_test
