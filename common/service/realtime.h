// SPDX-License-Identifier: Apache-2.0
// Real-time scheduling of a process: SCHED_FIFO, memory that is never swapped out, chosen cores.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace zerodrift::service {

struct RealtimeOptions {
  bool wanted = false;
  int priority = 50;         // SCHED_FIFO, 1 to 99
  std::vector<int> cores{};  // empty: any
};

// --realtime, --realtime-priority, --cores.
void add_realtime_options(CLI::App& app, RealtimeOptions& options);

// For the calling thread and all that it starts later: call it before a participant is made, whose
// threads inherit the policy. Does nothing unless wanted. Throws std::runtime_error with one line
// that names what the machine refuses and the remedy.
void apply(const RealtimeOptions& options);

// Takes the calling thread back to ordinary scheduling, on the cores it had before apply(). For
// work that must never delay the data path. Memory stays locked.
void leave_realtime();

}  // namespace zerodrift::service
