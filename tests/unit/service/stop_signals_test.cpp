// SPDX-License-Identifier: Apache-2.0
#include "common/service/stop_signals.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <cstdlib>
#include <thread>

namespace zerodrift::service {
namespace {

using namespace std::chrono_literals;

constexpr int kStopped = 17;

// Each in a process of its own: signals are of a process.
class StopSignal : public testing::TestWithParam<int> {
 protected:
  StopSignal() { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
};

void stop_when_told(int signal_number) {
  take_signals();
  kill(getpid(), signal_number);
  std::_Exit(wait_for_stop(5s) ? kStopped : 1);
}

TEST_P(StopSignal, DeathTestIsSeenByTheWaitAlone) {
  EXPECT_EXIT(stop_when_told(GetParam()), testing::ExitedWithCode(kStopped), "");
}

void hang_when_told(int signal_number) {
  take_signals(50ms);
  kill(getpid(), signal_number);
  std::this_thread::sleep_for(1h);
}

// Rule: a program that hangs, or never asks, ends all the same, by the signal.
TEST_P(StopSignal, DeathTestThatNobodyTakesEndsTheProcess) {
  EXPECT_EXIT(hang_when_told(GetParam()), testing::KilledBySignal(GetParam()), "");
}

INSTANTIATE_TEST_SUITE_P(All, StopSignal, testing::Values(SIGINT, SIGTERM, SIGHUP));

void take_long_over_a_stop() {
  take_signals(2s);
  kill(getpid(), SIGTERM);
  const bool first = wait_for_stop(2s);
  kill(getpid(), SIGHUP);  // a terminal that closes sends it more than once
  std::this_thread::sleep_for(2500ms);
  std::_Exit(first ? kStopped : 1);
}

TEST(TakenStopDeathTest, IsTheProgramsToEnd) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(take_long_over_a_stop(), testing::ExitedWithCode(kStopped), "");
}

void be_hung_up_under_nohup() {
  signal(SIGHUP, SIG_IGN);
  take_signals();
  kill(getpid(), SIGHUP);
  std::_Exit(wait_for_stop(300ms) ? 1 : kStopped);
}

TEST(NohupDeathTest, StillIgnoresSighup) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(be_hung_up_under_nohup(), testing::ExitedWithCode(kStopped), "");
}

void write_to_nobody() {
  take_signals();
  int ends[2];
  if (pipe(ends) != 0) std::_Exit(1);
  close(ends[0]);
  std::_Exit(write(ends[1], "x", 1) < 0 && errno == EPIPE ? kStopped : 1);
}

TEST(BrokenPipeDeathTest, IsAnErrorOfTheWrite) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(write_to_nobody(), testing::ExitedWithCode(kStopped), "");
}

void open_a_file_without_standard_descriptors() {
  for (const int descriptor : {0, 1, 2}) close(descriptor);
  take_signals();
  std::_Exit(open("/dev/null", O_RDONLY) > STDERR_FILENO ? kStopped : 1);
}

// Rule: a log line never lands in a file that took standard error's number.
TEST(ClosedDescriptorsDeathTest, AreTakenByNoFile) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(open_a_file_without_standard_descriptors(), testing::ExitedWithCode(kStopped), "");
}

}  // namespace
}  // namespace zerodrift::service
