// SPDX-License-Identifier: Apache-2.0
// The subcommands of `zerodrift`. Each adds itself to the command line and sets `run` when it is
// chosen.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

#include "services/zerodrift/provenance.h"

namespace zerodrift::services {

using Run = std::function<int()>;

// All of them, in the order of the help.
void add_commands(CLI::App& app, Run& run, const Invocation& made_by);

void add_simulate(CLI::App& app, Run& run);
void add_compensate(CLI::App& app, Run& run);
void add_compare(CLI::App& app, Run& run, const Invocation& made_by);
void add_navigate(CLI::App& app, Run& run, const Invocation& made_by);
void add_allan(CLI::App& app, Run& run, const Invocation& made_by);
void add_diagnose(CLI::App& app, Run& run, const Invocation& made_by);
void add_calibrate(CLI::App& app, Run& run, const Invocation& made_by);
void add_design(CLI::App& app, Run& run, const Invocation& made_by);
void add_history(CLI::App& app, Run& run, const Invocation& made_by);
void add_record(CLI::App& app, Run& run);
void add_replay(CLI::App& app, Run& run);
void add_info(CLI::App& app, Run& run, const Invocation& made_by);
void add_export(CLI::App& app, Run& run);
void add_config(CLI::App& app, Run& run);
void add_health(CLI::App& app, Run& run);

}  // namespace zerodrift::services
