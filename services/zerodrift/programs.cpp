// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/programs.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <stdexcept>
#include <string>
#include <system_error>

namespace zerodrift::services {
namespace {

constexpr std::array<Program, 9> kPrograms{{
    {"compensation", "compensation", "takes the drift off, live"},
    {"gyro-publisher", "gyro_publisher", "rates of a gyro, a record or a simulation onto DDS"},
    {"thermal-publisher", "thermal_publisher", "temperatures and environment onto DDS"},
    {"allan-monitor", "allan_monitor", "rolling Allan statistics, raw beside compensated"},
    {"navigation-filter", "navigation_filter", "attitude; tells the compensation about rest"},
    {"ctl", "ctl", "looks at the running system, or commands it"},
    {"console", "console", "the page at http://127.0.0.1:8765, Foxglove, Prometheus"},
    {"discovery-server", "discovery_server", "for networks without multicast"},
    {"bench", "zerodrift_bench", "what all that costs; built with the tests"},
}};

}  // namespace

const Program* find_program(std::string_view command) {
  const auto found = std::find_if(kPrograms.begin(), kPrograms.end(),
                                  [&](const auto& one) { return one.command == command; });
  return found == kPrograms.end() ? nullptr : &*found;
}

void list_programs(CLI::App& app) {
  for (const Program& one : kPrograms)
    app.add_subcommand(one.command, one.about)->group("Programs of their own");
}

void become(const Program& program, char** arguments) {
  const auto folder = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  // The prefixed one first: in a folder of many, a `console` may be anybody's.
  const std::string installed = std::string("zerodrift-") + program.command;
  for (const std::string& name : {installed, std::string(program.file)}) {
    std::string path = (folder / name).string();
    arguments[0] = path.data();
    ::execv(path.c_str(), arguments);
    if (errno != ENOENT) throw std::system_error(errno, std::generic_category(), path);
  }
  throw std::runtime_error(std::string(program.command) + ": neither " + installed + " nor " +
                           program.file + " is in " + folder.string());
}

}  // namespace zerodrift::services
