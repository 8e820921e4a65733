// SPDX-License-Identifier: Apache-2.0
// What somebody else's reader printed of the samples that ours received.
#pragma once

#include <gtest/gtest.h>

#include <sstream>
#include <string>

namespace zerodrift::system_test {

// A line a sample, in order, each once.
template <typename Samples, typename LineOf>
void expect_lines(const std::string& printed, const Samples& samples, const LineOf& line_of) {
  std::istringstream lines(printed);
  std::string line;
  for (const auto& sample : samples) {
    ASSERT_TRUE(std::getline(lines, line));
    ASSERT_EQ(line, line_of(sample));
  }
  EXPECT_FALSE(std::getline(lines, line)) << "a sample came twice";
}

}  // namespace zerodrift::system_test
