// SPDX-License-Identifier: Apache-2.0
// What the main functions of all services share: the network options and the one place where a
// start-up exception becomes one line and an exit code.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "common/dds/participant.h"

namespace zerodrift::service {

inline constexpr int kExitDone = 0;
inline constexpr int kExitNo = 1;        // ran, and the answer is no
inline constexpr int kExitBadInput = 2;  // wrong usage or bad input

void add_network_options(CLI::App& app, dds::NetworkOptions& network);

// Parses, then runs `body`, whose result is the exit code. Every exception ends as one line on
// standard error and kExitBadInput.
int run_main(CLI::App& app, int argc, char** argv, const std::function<int()>& body);

}  // namespace zerodrift::service
