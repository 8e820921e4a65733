// SPDX-License-Identifier: Apache-2.0
// zerodrift ctl: commands are acknowledged, and seen in what the service publishes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "common/core/mode.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

using core::Mode;
using core::Reason;
using namespace std::chrono_literals;

TEST(Control, WithoutAServiceTheAnswerIsNo) {
  SystemUnderTest system(Domain::kControlNobody);
  const Finished status = system.control({"status", "--wait", "1"});
  EXPECT_EQ(status.exit_code, 1);
  EXPECT_NE(status.err.find("no compensation service"), std::string::npos) << status.err;
  const Finished freeze = system.control({"freeze", "--wait", "1"});
  EXPECT_EQ(freeze.exit_code, 1);
  EXPECT_NE(freeze.err.find("no answer"), std::string::npos) << freeze.err;
  EXPECT_EQ(system.control({"explode"}).exit_code, 2);
}

class ControlledRun {
 public:
  explicit ControlledRun(Domain domain)
      : system(domain),
        participant_("test", system.network()),
        answers(participant_),
        events(participant_) {
    Arguments source{"--source", "simulation", "--speed", "20"};
    for (const auto& argument :
         Simulation{.profile = write_ramp_profile(system, 100000)}.arguments()) {
      source.push_back(argument);
    }
    system.start("compensation", {});
    system.start("thermal_publisher", source);
    source.insert(source.end(), {"--rate", "50"});
    system.start("gyro_publisher", source);
  }

  // True once a sample after the `from`-th has this mode and reason on every axis.
  [[nodiscard]] bool reaches(Mode mode, Reason reason, std::size_t from) const {
    const auto is_so = [&](const msg::CompensatedRate& answer) {
      for (std::size_t i = 0; i < 3; ++i) {
        if (answer.mode()[i] != static_cast<std::uint8_t>(mode)) return false;
        if (answer.reason()[i] != static_cast<std::uint8_t>(reason)) return false;
      }
      return true;
    };
    return eventually([&] { return answers.any(is_so, from); });
  }
  [[nodiscard]] std::uint64_t epoch() const { return answers.newest().model_epoch(); }

  SystemUnderTest system;

 private:
  dds::Participant participant_;

 public:
  Collector<msg::CompensatedRate> answers;
  Collector<msg::Event> events;
};

TEST(Control, FreezeLearnAndResetAreAcknowledgedAndDoWhatTheySay) {
  ControlledRun run(Domain::kControl);
  ASSERT_TRUE(run.reaches(Mode::kLearning, Reason::kNone, 0));
  const Finished status = run.system.control({"status"});
  EXPECT_EQ(status.exit_code, 0) << status.err;
  EXPECT_NE(status.out.find("learning"), std::string::npos) << status.out;
  // Who makes the forecast, of every axis; a status is a second old at most.
  const auto all_shares_are_told = [&] {
    const auto told = nlohmann::json::parse(run.system.control({"status", "--json"}).out);
    const auto& axes = told.at("gyros").at(0).at("axes");
    return axes.size() == 3 && std::all_of(axes.begin(), axes.end(), [](const auto& axis) {
             double sum = 0.0;
             for (const auto& share : axis.at("shares")) sum += share.template get<double>();
             return axis.at("shares").contains("online_svr") && std::abs(sum - 1.0) < 1e-6;
           });
  };
  EXPECT_TRUE(eventually(all_shares_are_told));

  std::size_t from = run.answers.size();
  const Finished freeze = run.system.control({"freeze"});
  EXPECT_EQ(freeze.exit_code, 0) << freeze.err;
  EXPECT_NE(freeze.out.find("frozen"), std::string::npos) << freeze.out;
  EXPECT_TRUE(run.reaches(Mode::kFrozen, Reason::kCommanded, from));
  // A label confirmed before the command may still come into force, one second (50 samples) later;
  // then nothing.
  from = run.answers.size() + 100;
  ASSERT_TRUE(eventually([&] { return run.answers.size() > from; }));
  const std::uint64_t frozen_epoch = run.epoch();
  ASSERT_TRUE(eventually([&] { return run.answers.size() > from + 1500; }));  // 30 s: six labels
  EXPECT_EQ(run.epoch(), frozen_epoch);

  from = run.answers.size();
  EXPECT_EQ(run.system.control({"learn"}).exit_code, 0);
  EXPECT_TRUE(run.reaches(Mode::kLearning, Reason::kNone, from));
  EXPECT_TRUE(eventually([&] { return run.epoch() > frozen_epoch; }));

  from = run.answers.size();
  EXPECT_EQ(run.system.control({"reset"}).exit_code, 0);
  EXPECT_TRUE(run.reaches(Mode::kPassthrough, Reason::kNoEstimateYet, from));
  from = run.answers.size();
  EXPECT_TRUE(run.reaches(Mode::kLearning, Reason::kNone, from));
  for (const char* command : {"freeze", "learn", "reset"}) {
    EXPECT_TRUE(eventually([&] {
      return told(run.events, std::string("command_") + command, command);
    })) << command;
  }
  EXPECT_EQ(run.system.control({"freeze", "--service", "nobody", "--wait", "1"}).exit_code, 1);
}

// Rule: freeze and learn are for all gyros, those included that come later.
TEST(Control, FreezeHoldsForAGyroThatComesLaterUntilLearn) {
  SystemUnderTest system(Domain::kControlLaterGyro);
  dds::Participant participant("test", system.network());
  const Collector<msg::CompensatedRate> answers(participant);
  const auto start_gyro = [&](const char* id) {
    const Arguments source = Arguments{"--source", "simulation", "--speed", "20", "--gyro-id", id} +
                             Simulation{.profile = write_ramp_profile(system, 100000)}.arguments();
    system.start("thermal_publisher", source);
    system.start("gyro_publisher", source + Arguments{"--rate", "50"});
  };
  const auto comes = [&](std::uint32_t gyro, const auto& is_so) {
    return eventually([&] {
      return answers.any([&](const auto& a) { return a.gyro_id() == gyro && is_so(a); });
    });
  };
  const auto learns = [](const auto& a) {
    return a.mode()[0] == static_cast<std::uint8_t>(Mode::kLearning) && a.model_epoch() > 0;
  };
  // 60 s of sensor time, in which a gyro at rest learns.
  const auto stays_frozen = [&](std::uint32_t gyro) {
    return comes(gyro, [](const auto& a) { return a.sequence_number() >= 3000; }) &&
           !answers.any([&](const auto& a) {
             return a.gyro_id() == gyro && a.sequence_number() < 3000 &&
                    (a.model_epoch() > 0 ||
                     a.reason()[0] != static_cast<std::uint8_t>(Reason::kCommanded));
           });
  };
  system.start("compensation", {});
  const Finished freeze = system.control({"freeze"});
  ASSERT_EQ(freeze.exit_code, 0) << freeze.out << freeze.err;
  start_gyro("1");
  EXPECT_TRUE(stays_frozen(1)) << "frozen before its first sample";
  EXPECT_EQ(system.control({"learn"}).exit_code, 0);
  ASSERT_TRUE(comes(1, learns));
  EXPECT_EQ(system.control({"freeze"}).exit_code, 0);
  start_gyro("2");
  EXPECT_TRUE(stays_frozen(2)) << "frozen before this gyro was there";
  EXPECT_EQ(system.control({"learn"}).exit_code, 0);
  EXPECT_TRUE(comes(2, learns));
}

}  // namespace
}  // namespace zerodrift::system_test
