// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "services/compensation/compensation_node.h"

namespace zerodrift::services {

// The command line's part of the options, and the files that hold the rest.
struct CompensationArguments {
  CompensationNodeOptions node{};
  std::string config{};
  std::string prior{};

  // With the files read. Throws with one line where one can't be used.
  [[nodiscard]] CompensationNodeOptions complete() const;
};

void add_options(CLI::App& app, CompensationArguments& arguments);

}  // namespace zerodrift::services
