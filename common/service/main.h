// SPDX-License-Identifier: Apache-2.0
// What the main functions of all services share: the network options and the one place where a
// start-up exception becomes one line and an exit code.
#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
#include <exception>
#include <functional>
#include <string>
#include <string_view>

#include "common/dds/participant.h"
#include "common/service/exit_code.h"
#include "common/service/version.h"

namespace zerodrift::service {

// For end_within(): of the 2 s within which a stop takes effect.
inline constexpr std::chrono::milliseconds kStopWithin{1500};

void add_network_options(CLI::App& app, dds::NetworkOptions& network);

// To be called when a stop begins and nothing durable is left to do: if ending takes longer, the
// process ends with `exit_code` all the same, and what it said goes out. A publisher was once seen
// not to end when all processes of a run were stopped together, and a stop has to take effect
// within 2 s.
void end_within(std::chrono::milliseconds at_most, int exit_code);

// What ended a program, as its last line says it, and the exit code: kExitNo where memory ended,
// kExitBadInput for any other reason.
struct Refusal {
  std::string_view reason;  // as long as the error lives
  int exit_code;
};
[[nodiscard]] Refusal refusal_of(const std::exception& error) noexcept;

// Takes the signals (stop_signals.h), parses, then runs `body`, whose result is the exit code.
// Every exception ends as one line on standard error and by its refusal_of(). `version` answers
// --version.
int run_version(const char* version, CLI::App& app, int argc, char** argv,
                const std::function<int()>& body);

// The same with this build's version. Here, so that programs alone link what knows it.
inline int run_main(CLI::App& app, int argc, char** argv, const std::function<int()>& body) {
  return run_version(version_line(), app, argc, argv, body);
}

}  // namespace zerodrift::service
