// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "services/compensation/compensation_node.h"

namespace zerodrift::services {

// The command line's part of the options, and the files that hold the rest.
struct CompensationArguments {
  CompensationNodeOptions node{};
  std::string config{};
  std::string prior{};
  std::vector<std::string> ros2_imu{};  // ID=TOPIC
  std::string gyro_frame = "flu";
  std::string ros2_frame = "flu";
  std::string ros2_frame_id{};
  std::uint32_t ownership_strength = 0;  // above 0: redundant

  // With the files read. Throws with one line where one can't be used.
  [[nodiscard]] CompensationNodeOptions complete() const;
};

void add_options(CLI::App& app, CompensationArguments& arguments);

}  // namespace zerodrift::services
