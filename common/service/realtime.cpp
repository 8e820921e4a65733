// SPDX-License-Identifier: Apache-2.0
#include "common/service/realtime.h"

#include <sched.h>
#include <sys/mman.h>

#include <cerrno>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>

namespace zerodrift::service {
namespace {

std::optional<cpu_set_t>& cores_before() {
  static std::optional<cpu_set_t> cores;
  return cores;
}

[[noreturn]] void refuse(const std::string& what, const std::string& remedy) {
  throw std::runtime_error("--realtime: " + what + ": " + std::strerror(errno) + "; " + remedy);
}

void stay_on(const std::vector<int>& cores) {
  if (cores.empty()) return;
  cpu_set_t before;
  CPU_ZERO(&before);
  if (sched_getaffinity(0, sizeof before, &before) == 0) cores_before() = before;
  cpu_set_t wanted;
  CPU_ZERO(&wanted);
  for (const int core : cores) CPU_SET(static_cast<std::size_t>(core), &wanted);
  if (sched_setaffinity(0, sizeof wanted, &wanted) != 0) {
    refuse("these cores are not to be had", "see --cores and the machine's cpuset");
  }
}

// A page stays once it was touched; stacks that are never used whole are not made resident whole.
void lock_memory() {
  if (mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) != 0) {
    refuse("memory can't be locked", "grant CAP_IPC_LOCK or raise 'ulimit -l' to unlimited");
  }
}

void run_first_in_first_out(int priority) {
  const sched_param parameters{.sched_priority = priority};
  if (sched_setscheduler(0, SCHED_FIFO, &parameters) != 0) {
    refuse("SCHED_FIFO with priority " + std::to_string(priority) + " is not to be had",
           "grant CAP_SYS_NICE or raise 'ulimit -r' to " + std::to_string(priority));
  }
}

}  // namespace

void add_realtime_options(CLI::App& app, RealtimeOptions& options) {
  auto* wanted = app.add_flag(
      "--realtime", options.wanted,
      "SCHED_FIFO and locked memory; needs CAP_SYS_NICE and CAP_IPC_LOCK, or ulimit -r and -l");
  app.add_option("--realtime-priority", options.priority, "of SCHED_FIFO")
      ->check(CLI::Range(1, 99))
      ->needs(wanted)
      ->capture_default_str();
  app.add_option("--cores", options.cores, "run on these only, e.g. 2,3")
      ->check(CLI::Range(0, CPU_SETSIZE - 1))
      ->delimiter(',')
      ->needs(wanted);
}

void apply(const RealtimeOptions& options) {
  if (!options.wanted) return;
  run_first_in_first_out(options.priority);
  stay_on(options.cores);
  lock_memory();
}

void leave_realtime() {
  const sched_param ordinary{.sched_priority = 0};
  sched_setscheduler(0, SCHED_OTHER, &ordinary);  // always permitted
  if (cores_before()) sched_setaffinity(0, sizeof(cpu_set_t), &*cores_before());
}

}  // namespace zerodrift::service
