// SPDX-License-Identifier: Apache-2.0
// `zerodrift NAME ...` for what is a program of its own: one name to find them all by.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string_view>

namespace zerodrift::services {

struct Program {
  const char* command;  // `zerodrift command`; installed it is the file zerodrift-command
  const char* file;     // its name in a build folder
  const char* about;    // a line of `zerodrift --help`
};

// Null where `command` is none.
[[nodiscard]] const Program* find_program(std::string_view command);

// Lists all of them in the help.
void list_programs(CLI::App& app);

// Becomes the program, which lies beside the file that this process runs: process id, signals and
// exit code are its own. `arguments` begin with the command and end with a null pointer. Throws
// std::runtime_error where the program isn't there or can't be run.
[[noreturn]] void become(const Program& program, char** arguments);

}  // namespace zerodrift::services
