// SPDX-License-Identifier: Apache-2.0
#include "common/service/supervision.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "tests/support/scratch_folder.h"

namespace zerodrift::service {
namespace {

using Verdict = FlowWatch::Verdict;
namespace fs = std::filesystem;

Flow after(std::uint64_t samples) {
  return {.topic = "angular_rate", .samples = samples};
}

TEST(FlowWatch, AFlowThatNeverBeganIsNotStale) {
  FlowWatch watch({.stale_after_s = 2.0}, 100.0);
  EXPECT_EQ(watch.judge(after(0), 1, 1000.0), Verdict::kFine);
}

TEST(FlowWatch, SilenceLongerThanTheLimitIsStaleUntilItMovesAgain) {
  FlowWatch watch({.stale_after_s = 2.0}, 0.0);
  EXPECT_EQ(watch.judge(after(10), 1, 1.0), Verdict::kFine);
  EXPECT_EQ(watch.judge(after(10), 1, 3.0), Verdict::kFine);  // not longer
  EXPECT_EQ(watch.judge(after(10), 1, 3.1), Verdict::kStale);
  EXPECT_NEAR(watch.silent_s(3.1), 2.1, 1e-12);
  EXPECT_EQ(watch.judge(after(11), 1, 3.2), Verdict::kFine);
}

TEST(FlowWatch, WhoEndedInOrderIsNotStale) {
  FlowWatch watch({.stale_after_s = 2.0}, 0.0);
  watch.judge(after(10), 1, 1.0);
  EXPECT_EQ(watch.judge(after(10), 0, 100.0), Verdict::kFine);
}

TEST(FlowWatch, WhatItsConsumersHoldIsNotStale) {
  FlowWatch watch({.stale_after_s = 2.0}, 0.0);
  Flow flow = after(10);
  flow.paced = true;
  watch.judge(flow, 1, 1.0);
  EXPECT_EQ(watch.judge(flow, 1, 100.0), Verdict::kFine);
}

TEST(FlowWatch, ASlowFlowHasThreeOfItsIntervals) {
  FlowWatch watch({.stale_after_s = 2.0}, 0.0);
  Flow flow = after(1);
  flow.interval_s = 10.0;
  watch.judge(flow, 1, 0.0);
  EXPECT_EQ(watch.judge(flow, 1, 30.0), Verdict::kFine);
  EXPECT_EQ(watch.judge(flow, 1, 30.1), Verdict::kStale);
}

TEST(FlowWatch, NobodyIsToldOnlyWhereItWasAskedForAndNobodyEverCame) {
  FlowWatch patient({}, 0.0);
  EXPECT_EQ(patient.judge(after(0), 0, 1e6), Verdict::kFine);
  FlowWatch waiting({.peer_within_s = 5.0}, 10.0);
  EXPECT_EQ(waiting.judge(after(0), 0, 15.0), Verdict::kFine);
  EXPECT_EQ(waiting.judge(after(0), 0, 15.1), Verdict::kNobody);
  FlowWatch met({.peer_within_s = 5.0}, 10.0);
  EXPECT_EQ(met.judge(after(0), 1, 11.0), Verdict::kFine);
  EXPECT_EQ(met.judge(after(0), 0, 1e6), Verdict::kFine);
}

class HealthFile : public ScratchFolder {
 protected:
  template <typename Action>
  static std::string refusal(const Action& action) {
    try {
      action();
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "no error";
  }
};

TEST_F(HealthFile, IsReadAsItWasWrittenAndNothingIsLeftBesideIt) {
  const fs::path file = folder_ / "health";
  write_health(file, {.monotonic_ns = 12345678901,
                      .process_id = 42,
                      .service = "compensation/1",
                      .state = "running",
                      .summary = "two\nlines"});
  const Health health = read_health(file);
  EXPECT_EQ(health.monotonic_ns, 12345678901);
  EXPECT_EQ(health.process_id, 42);
  EXPECT_EQ(health.service, "compensation/1");
  EXPECT_EQ(health.state, "running");
  EXPECT_EQ(health.summary.find('\n'), std::string::npos);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

TEST_F(HealthFile, OfNowAndNotDegradedIsWell) {
  const Health running{.monotonic_ns = 10'000'000'000, .service = "s", .state = "running"};
  using std::chrono_literals::operator""s;
  EXPECT_EQ(why_unhealthy(running, 13'000'000'000, 3s), "");
  EXPECT_NE(why_unhealthy(running, 13'000'000'001, 3s).find("3.0 s ago"), std::string::npos);
  EXPECT_EQ(why_unhealthy(running, 10'200'000'000, std::chrono::duration<double>(0.25)), "");
  EXPECT_NE(why_unhealthy(running, 10'300'000'000, std::chrono::duration<double>(0.25)), "");
  // Of before this computer was started.
  EXPECT_NE(why_unhealthy(running, 9'000'000'000, 3s), "");
  for (const char* state : {"starting", "waiting", "running", "degraded", "stopping"}) {
    Health health = running;
    health.state = state;
    health.summary = "because";
    const std::string reason = why_unhealthy(health, 10'000'000'000, 3s);
    const bool well = health.state != "degraded" && health.state != "stopping";
    EXPECT_EQ(reason.empty(), well) << state;
    EXPECT_EQ(reason.find("because") != std::string::npos, !well);
  }
}

// Before: `--health-file /dev/null` put a file in the place of the device.
TEST_F(HealthFile, ADeviceOrAPipeIsNotReplaced) {
  const fs::path pipe = folder_ / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_NE(refusal([&] { write_health(pipe, {}); }).find("would be replaced"), std::string::npos);
  EXPECT_TRUE(fs::is_fifo(pipe));
  EXPECT_NE(refusal([&] { write_health(folder_, {}); }).find("would be replaced"),
            std::string::npos);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

TEST_F(HealthFile, WhatCannotBeWrittenOrReadIsToldInOneLine) {
  const fs::path nowhere = folder_ / "no" / "health";
  EXPECT_NE(refusal([&] { write_health(nowhere, {}); }).find("cannot be written (No such file"),
            std::string::npos);
  EXPECT_NE(refusal([&] { read_health(nowhere); }).find("cannot be read (No such file"),
            std::string::npos);
  for (const char* content : {"", "x", "1 2", "1 x compensation running\n"}) {
    std::ofstream(folder_ / "bad") << content;
    EXPECT_NE(refusal([&] { read_health(folder_ / "bad"); }).find("is none that a service writes"),
              std::string::npos)
        << content;
  }
}

}  // namespace
}  // namespace zerodrift::service
