// SPDX-License-Identifier: Apache-2.0
#include "common/service/realtime.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <thread>
#include <vector>

namespace zerodrift::service {
namespace {

RealtimeOptions parsed(std::vector<std::string> arguments) {
  CLI::App app;
  RealtimeOptions options;
  add_realtime_options(app, options);
  std::reverse(arguments.begin(), arguments.end());  // as CLI11 takes them
  app.parse(arguments);
  return options;
}

// Without root's rights and limits: what an ordinary user's process may do. Never returns.
[[noreturn]] void apply_without_rights(const RealtimeOptions& options) {
  const rlimit none{0, 0};
  setrlimit(RLIMIT_RTPRIO, &none);
  constexpr uid_t kNobody = 65534;
  if (getuid() == 0 && setuid(kNobody) != 0) std::_Exit(3);
  try {
    apply(options);
  } catch (const std::exception& error) {
    std::fputs(error.what(), stderr);
    std::_Exit(2);
  }
  std::_Exit(0);
}

TEST(Realtime, IsOffUnlessAskedFor) {
  const RealtimeOptions options = parsed({});
  EXPECT_FALSE(options.wanted);
  const int before = sched_getscheduler(0);
  apply(options);
  EXPECT_EQ(sched_getscheduler(0), before);
}

TEST(Realtime, OptionsAreReadFromArguments) {
  const RealtimeOptions options =
      parsed({"--realtime", "--realtime-priority", "17", "--cores", "0,1"});
  EXPECT_TRUE(options.wanted);
  EXPECT_EQ(options.priority, 17);
  EXPECT_EQ(options.cores, (std::vector<int>{0, 1}));
}

TEST(Realtime, PriorityAndCoresNeedTheFlag) {
  EXPECT_THROW(parsed({"--realtime-priority", "10"}), CLI::ParseError);
  EXPECT_THROW(parsed({"--cores", "0"}), CLI::ParseError);
  EXPECT_THROW(parsed({"--realtime", "--realtime-priority", "100"}), CLI::ParseError);
}

TEST(RealtimeDeathTest, WhatIsNotPermittedIsNamedWithItsRemedy) {
  EXPECT_EXIT(apply_without_rights({.wanted = true, .priority = 30}), testing::ExitedWithCode(2),
              "--realtime: SCHED_FIFO with priority 30 .*CAP_SYS_NICE.*ulimit -r. to 30");
}

// Where the machine permits real time; elsewhere there is nothing to leave.
[[noreturn]] void leave_in_a_thread() {
  const RealtimeOptions options{.wanted = true, .priority = 1};
  try {
    apply(options);
  } catch (const std::exception&) {
    std::_Exit(0);
  }
  int left = -1;
  std::thread learner([&] {
    leave_realtime();
    left = sched_getscheduler(0);
  });
  learner.join();
  std::_Exit(left == SCHED_OTHER && sched_getscheduler(0) == SCHED_FIFO ? 0 : 1);
}

TEST(RealtimeDeathTest, AThreadLeavesForItselfAlone) {
  EXPECT_EXIT(leave_in_a_thread(), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace zerodrift::service
