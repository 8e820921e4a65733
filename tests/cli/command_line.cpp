// SPDX-License-Identifier: Apache-2.0
#include "tests/cli/command_line.h"

#include <stdlib.h>

#include <algorithm>
#include <stdexcept>

namespace zerodrift::cli_test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

const fs::path kZerodrift = fs::path(ZERODRIFT_BIN_DIR) / "zerodrift";
const fs::path kSource = ZERODRIFT_SOURCE_DIR;
constexpr auto kAtMost = 60s;

}  // namespace

CommandLine::CommandLine() {
  std::string name = (fs::temp_directory_path() / "zerodrift-cli-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no folder for the test");
  output_ = fs::path(name) / "output";
  folder_ = fs::path(name) / "folder";
  fs::create_directory(folder_);
}

CommandLine::~CommandLine() {
  fs::remove_all(folder_.parent_path());
}

Arguments CommandLine::in_folder(Arguments arguments) const {
  for (std::string& argument : arguments) {
    if (argument.starts_with('@')) argument = path(argument.substr(1)).string();
  }
  return arguments;
}

system_test::Program CommandLine::command(const Arguments& arguments,
                                          const Environment& environment) const {
  return {kZerodrift, in_folder(arguments), environment, output_};
}

Finished CommandLine::finish(ChildProcess& process) {
  const auto exit_code = process.wait(kAtMost);
  return {exit_code.value_or(-1), process.out(), process.err()};
}

Finished CommandLine::run(const Arguments& arguments, const Environment& environment) {
  ChildProcess process(command(arguments, environment));
  return finish(process);
}

Finished CommandLine::shell(const std::string& line) {
  ChildProcess process({"/bin/bash",
                        {"-c", "cd '" + folder_.string() + "'; " + line},
                        {{"zerodrift", kZerodrift.string()}},
                        output_});
  return finish(process);
}

void CommandLine::make_record(int duration_s) {
  system_test::write(path("profile.yaml"),
                     "name: ramp\nduration_s: " + std::to_string(duration_s) +
                         "\ninitial_temperature_degc: 0\npower_on_s: 0\nchamber:\n"
                         "  - {time_s: 3600, temperature_degc: 60}\n");
  const Finished made =
      run({"simulate", "--model", (kSource / "config/models/paper_fog.yaml").string(), "--profile",
           "@profile.yaml", "--rate", "10", "--reference", "--out", "@record.csv"});
  if (made.exit_code != 0) throw std::runtime_error("no record: " + made.err);
}

std::map<std::string, std::string> CommandLine::files() const {
  std::map<std::string, std::string> all;
  for (const auto& entry : fs::directory_iterator(folder_))
    all[entry.path().filename().string()] = entry.is_regular_file() ? content(entry.path()) : "";
  return all;
}

std::size_t lines_of(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace zerodrift::cli_test
