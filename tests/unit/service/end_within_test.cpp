// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <thread>

#include "common/service/main.h"

namespace zerodrift::service {
namespace {

using namespace std::chrono_literals;

void hang_after_the_end() {
  end_within(20ms, 7);
  std::this_thread::sleep_for(1h);
}

// Rule: a stop takes effect whatever the middleware does.
TEST(EndWithinDeathTest, AProcessThatHangsAtItsEndEndsAllTheSame) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(hang_after_the_end(), testing::ExitedWithCode(7), "did not let go in time");
}

// Rule: what it said is read, though standard output to a pipe or a file is buffered.
TEST(EndWithinDeathTest, WhatAProcessThatHangsAtItsEndHasSaidGoesOut) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        ::dup2(STDERR_FILENO, STDOUT_FILENO);
        std::printf("1 sample replayed");
        hang_after_the_end();
      },
      testing::ExitedWithCode(7), "1 sample replayed");
}

// Rule: one that ends in time ends with its own code.
TEST(EndWithinDeathTest, AProcessThatEndsInTimeKeepsItsExitCode) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        end_within(1h, 7);
        std::exit(3);
      },
      testing::ExitedWithCode(3), "");
}

}  // namespace
}  // namespace zerodrift::service
