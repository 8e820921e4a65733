// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "common/config/config_error.h"

namespace zerodrift::config {

// What follows `head`, with which it begins, in the one line of the error that `load` ends with.
template <typename Load>
std::string error_after(const std::string& head, const Load& load) {
  try {
    load();
  } catch (const ConfigError& problem) {
    const std::string line = problem.what();
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
    return line.substr(head.size());
  }
  return "no error";
}

}  // namespace zerodrift::config
