// SPDX-License-Identifier: Apache-2.0
// Commands that act where samples come from: what is injected is seen by everybody behind, and a
// replay that is paused goes on where it was.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <string>
#include <thread>

#include "common/core/units.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

constexpr int kLongestS = 600;       // of sensor time; two minutes of it at the tests' speed
constexpr double kStepDegH = 500.0;  // a thousand times what the simulated gyro does by itself

class SourceCommands : public ::testing::Test {
 protected:
  SourceCommands() {
    const Arguments source =
        Arguments{"--source", "simulation", "--speed", "5"} +
        Simulation{.profile = write_ramp_profile(system_, kLongestS)}.arguments();
    system_.start("compensation", {"--await-subscribers", "1"});
    system_.start("thermal_publisher", source);
    system_.start("gyro_publisher", source + Arguments{"--rate", "100"});
  }

  bool grows(std::size_t by = 100) {
    const std::size_t before = rates_.size();
    return eventually([&] { return rates_.size() >= before + by; });
  }
  double newest_x_deg_h() { return core::deg_h_from_radps(rates_.newest().rate_radps()[0]); }

  SystemUnderTest system_{Domain::kSourceCommands};
  dds::Participant participant_{"test", system_.network()};
  Collector<msg::AngularRate> rates_{participant_};
  Collector<msg::Event> events_{participant_};
  Collector<msg::CompensatedRate> answers_{participant_};
};

TEST_F(SourceCommands, AStepIsInTheSamplesUntilItIsCleared) {
  ASSERT_TRUE(grows());
  const double before = newest_x_deg_h();
  const Finished injected = system_.control({"inject", "step:x:500:3600"});
  EXPECT_EQ(injected.exit_code, 0) << injected.out << injected.err;
  // The gyro's white noise at 100 Hz is some deg/h: far below half the step.
  EXPECT_TRUE(eventually([&] { return newest_x_deg_h() > before + kStepDegH / 2.0; }));
  EXPECT_EQ(system_.control({"inject", "clear"}).exit_code, 0);
  EXPECT_TRUE(eventually([&] { return newest_x_deg_h() < before + kStepDegH / 2.0; }));
  EXPECT_TRUE(eventually([&] {
    return events_.any([](const msg::Event& event) {
      return std::string(event.code().c_str()) == "command_inject" &&
             std::string(event.text().c_str()).find("step:x:500:3600") != std::string::npos;
    });
  }));
}

TEST_F(SourceCommands, AGapLosesItsSamplesAndNoOthers) {
  ASSERT_TRUE(grows());
  ASSERT_EQ(system_.control({"inject", "gap:xyz:0:5"}).exit_code, 0);
  const auto widest = [&] {
    std::uint64_t gap = 1;
    std::optional<std::uint64_t> before;
    rates_.for_each([&](const msg::AngularRate& sample) {
      if (before) gap = std::max(gap, sample.sequence_number() - *before);
      before = sample.sequence_number();
    });
    return gap;
  };
  EXPECT_TRUE(eventually([&] { return widest() > 1; }));
  EXPECT_EQ(widest(), 501U);  // 5 s at 100 Hz
  ASSERT_TRUE(grows());
}

// Before: whoever followed a run in which a sample was missing waited for it for good.
TEST_F(SourceCommands, ARunWithAGapIsFollowedToItsEndAndFailsThere) {
  system_.start("allan_monitor", {});
  ASSERT_TRUE(grows());
  ASSERT_EQ(system_.control({"inject", "gap:xyz:0:5"}).exit_code, 0);
  ASSERT_EQ(system_.control({"replay", "speed max"}).exit_code, 0);
  const Finished followed = system_.control({"status", "--follow", "--until-finished"});
  EXPECT_EQ(followed.exit_code, 1) << followed.err;
  EXPECT_TRUE(
      followed.out.ends_with("samples are missing: published, in, out and monitored differ\n"))
      << followed.out;
}

TEST_F(SourceCommands, APausedReplayGoesOnWhereItWas) {
  ASSERT_TRUE(grows());
  ASSERT_EQ(system_.control({"replay", "pause"}).exit_code, 0);
  std::size_t before = 0;
  // Until what was on its way has come.
  ASSERT_TRUE(eventually([&] {
    const bool still = before == rates_.size();
    before = rates_.size();
    std::this_thread::sleep_for(300ms);
    return still;
  }));
  ASSERT_EQ(system_.control({"replay", "speed max"}).exit_code, 0);
  EXPECT_EQ(rates_.size(), before) << "another speed doesn't end a pause";
  ASSERT_EQ(system_.control({"replay", "resume"}).exit_code, 0);
  ASSERT_TRUE(grows(1000));
  const auto all = rates_.all();
  for (std::size_t i = 1; i < all.size(); ++i)
    ASSERT_EQ(all[i].sequence_number(), all[i - 1].sequence_number() + 1);
}

TEST_F(SourceCommands, WhatCannotBeDoneIsRefusedInOneLine) {
  ASSERT_TRUE(grows());
  for (const auto& [command, argument] :
       {std::pair{"inject", "jump:x:1"}, std::pair{"inject", "gap:x:0"},
        std::pair{"replay", "stop"}, std::pair{"replay", "speed 0"},
        std::pair{"replay", "speed"}}) {
    const Finished finished = system_.control({command, argument});
    EXPECT_EQ(finished.exit_code, 1) << command << ' ' << argument;
    EXPECT_NE(finished.out.find("expected"), std::string::npos) << finished.out << finished.err;
    EXPECT_EQ(finished.out.find("--speed"), std::string::npos) << finished.out;
  }
  const Finished elsewhere = system_.control({"freeze", "--service", "gyro_publisher"});
  EXPECT_EQ(elsewhere.exit_code, 1);
  EXPECT_NE(elsewhere.out.find("known are inject, replay"), std::string::npos) << elsewhere.out;
}

}  // namespace
}  // namespace zerodrift::system_test
