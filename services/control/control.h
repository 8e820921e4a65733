// SPDX-License-Identifier: Apache-2.0
// The commands of `ctl`, which look at the running system or tell it to do something.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace zerodrift::services {

// Each command sets `run` when it is chosen.
void add_control(CLI::App& app, std::function<int()>& run);

}  // namespace zerodrift::services
