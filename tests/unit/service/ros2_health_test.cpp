// SPDX-License-Identifier: Apache-2.0
#include "common/service/ros2_health.h"

#include <gtest/gtest.h>

#include <string>

namespace zerodrift::service {
namespace {

using core::Mode;
using core::Reason;
using dds::RosLevel;
using namespace std::chrono_literals;

GyroFacts learning() {
  GyroFacts gyro{.gyro_id = 7, .measured = {true, true, true}};
  gyro.newest.raw.interval_s = 0.005;
  gyro.newest.mode = {Mode::kLearning, Mode::kLearning, Mode::kLearning};
  return gyro;
}

GyroFacts with_axis_z(Mode mode, Reason reason) {
  GyroFacts gyro = learning();
  gyro.newest.mode[2] = mode;
  gyro.newest.reason[2] = reason;
  return gyro;
}

RosLevel level_of(const GyroFacts& gyro) {
  return status_of(gyro, "compensation").level;
}

TEST(RosHealthOfAGyro, HasItsNameAndTheAxesThatSayTheSame) {
  const auto status =
      status_of(with_axis_z(Mode::kFallback, Reason::kTemperatureStale), "compensation/2");
  EXPECT_EQ(status.name, "zerodrift: compensation/2 gyro 7");
  EXPECT_EQ(status.hardware_id, "gyro_7");
  EXPECT_EQ(status.message, "z: fallback (temperature_stale); x, y: learning");
  EXPECT_EQ(status.level, RosLevel::kWarn);
}

// Rule: nobody is called for what passes by itself, or was commanded.
TEST(RosHealthOfAGyro, IsOkWhereNobodyHasToDoAnything) {
  EXPECT_EQ(level_of(learning()), RosLevel::kOk);
  EXPECT_EQ(level_of(with_axis_z(Mode::kFrozen, Reason::kMotion)), RosLevel::kOk);
  EXPECT_EQ(level_of(with_axis_z(Mode::kHolding, Reason::kModelWorseThanBias)), RosLevel::kOk);
  EXPECT_EQ(level_of(with_axis_z(Mode::kFrozen, Reason::kCommanded)), RosLevel::kOk);
  EXPECT_EQ(level_of(with_axis_z(Mode::kPassthrough, Reason::kSchemeNone)), RosLevel::kOk);
}

TEST(RosHealthOfAGyro, WarnsOfRatesThatAreNotWhatTheyCouldBe) {
  EXPECT_EQ(level_of(with_axis_z(Mode::kPassthrough, Reason::kNoEstimateYet)), RosLevel::kWarn);
  EXPECT_EQ(level_of(with_axis_z(Mode::kOutOfDomain, Reason::kOutsideLearned)), RosLevel::kWarn);
  EXPECT_EQ(level_of(with_axis_z(Mode::kFrozen, Reason::kEarthRateUnknown)), RosLevel::kWarn);
}

TEST(RosHealthOfAGyro, IsAnErrorWhereARateCannotBeReliedOn) {
  EXPECT_EQ(level_of(with_axis_z(Mode::kPassthrough, Reason::kInvalidInput)), RosLevel::kError);
  EXPECT_EQ(level_of(with_axis_z(Mode::kLearning, Reason::kPolarityReversed)), RosLevel::kError);
  EXPECT_EQ(level_of(with_axis_z(Mode::kPassthrough, Reason::kTemperatureMissing)),
            RosLevel::kError);
}

// Before: every 50th sample was invalid at 200 Hz, and a report a second never saw one.
TEST(RosHealthOfAGyro, IsAnErrorWhereAnySampleSinceTheReportBeforeWasInvalid) {
  GyroFacts gyro = learning();
  gyro.invalid = {4, 0, 0};
  const auto status = status_of(gyro, "compensation");
  EXPECT_EQ(status.level, RosLevel::kError);
  EXPECT_EQ(status.message,
            "y, z: learning; x: learning, 4 samples with invalid_input since the report before");
  gyro.invalid = {1, 1, 1};
  EXPECT_EQ(status_of(gyro, "compensation").message,
            "x, y, z: learning, 1 sample with invalid_input since the report before");
  gyro = with_axis_z(Mode::kPassthrough, Reason::kInvalidInput);
  gyro.invalid = {0, 0, 1};
  EXPECT_EQ(status_of(gyro, "compensation").message,
            "x, y: learning; z: passthrough (invalid_input)");
  gyro = learning();
  gyro.invalid[2] = 7;
  gyro.measured[2] = false;
  EXPECT_EQ(level_of(gyro), RosLevel::kOk) << "it was never there";
}

TEST(RosHealthOfAGyro, LeavesOutAnAxisThatWasNeverMeasured) {
  GyroFacts gyro = with_axis_z(Mode::kPassthrough, Reason::kInvalidInput);
  gyro.measured[2] = false;
  EXPECT_EQ(level_of(gyro), RosLevel::kOk);
  gyro.measured = {};
  EXPECT_EQ(level_of(gyro), RosLevel::kError);
}

TEST(RosHealthOfAGyro, IsStaleAfterTwoSecondsOrThreeSamples) {
  GyroFacts gyro = learning();
  gyro.silence = 1900ms;
  EXPECT_EQ(level_of(gyro), RosLevel::kOk);
  gyro.silence = 5s;
  const auto status = status_of(gyro, "compensation");
  EXPECT_EQ(status.level, RosLevel::kStale);
  EXPECT_EQ(status.message, "no sample for 5 s; before: x, y, z: learning");
  gyro.newest.raw.interval_s = 2.0;  // a slow gyro
  EXPECT_EQ(level_of(gyro), RosLevel::kOk);
}

TEST(RosHealthOfAGyro, TellsAnInstanceThatWritesNothing) {
  GyroFacts gyro = learning();
  gyro.health = InstanceSync::Health::kBehind;
  EXPECT_EQ(level_of(gyro), RosLevel::kWarn);
  gyro.health = InstanceSync::Health::kHangs;
  EXPECT_EQ(level_of(gyro), RosLevel::kError);
}

class RosHealthOfServices : public ::testing::Test {
 protected:
  static ServiceRoster::Guid guid(std::uint8_t number) {
    ServiceRoster::Guid made;
    made.guidPrefix.value[0] = number;
    return made;
  }
  void hear(const char* service, State state, std::uint8_t writer = 1) {
    msg::ServiceStatus status;
    status.service(service);
    status.host("bench");
    status.state(static_cast<std::uint32_t>(state));
    status.summary("1 gyro");
    roster_.receive(status, guid(writer));
  }
  RosLevel level() const { return roster_.statuses().at(0).level; }

  ServiceRoster roster_;
};

TEST_F(RosHealthOfServices, AreInOrderAndWithoutTheirParts) {
  hear("gyro_publisher", State::kRunning);
  hear("compensation", State::kWaiting, 2);
  hear("compensation:1", State::kRunning, 2);
  const auto all = roster_.statuses();
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].name, "zerodrift: compensation");
  EXPECT_EQ(all[0].level, RosLevel::kWarn);
  EXPECT_EQ(all[0].message, "waiting, 1 gyro");
  EXPECT_EQ(all[0].hardware_id, "bench");
  EXPECT_EQ(all[1].level, RosLevel::kOk);
}

TEST_F(RosHealthOfServices, ADeathIsAnErrorUntilItIsHeardAgain) {
  hear("gyro_publisher", State::kRunning);
  roster_.note_gone(guid(1), dds::Departure::kSilent);
  EXPECT_EQ(level(), RosLevel::kStale);
  roster_.note_gone(guid(1), dds::Departure::kLeft);
  EXPECT_EQ(level(), RosLevel::kError);
  hear("gyro_publisher", State::kRunning, 3);  // started again
  EXPECT_EQ(level(), RosLevel::kOk);
  roster_.note_gone(guid(1), dds::Departure::kLeft);  // of the life before
  EXPECT_EQ(level(), RosLevel::kOk);
}

TEST_F(RosHealthOfServices, OneThatStoppedInOrderIsForgotten) {
  hear("gyro_publisher", State::kStopping);
  roster_.note_gone(guid(1), dds::Departure::kLeft);
  EXPECT_TRUE(roster_.statuses().empty());
}

// The publishers of two gyros have one name.
TEST_F(RosHealthOfServices, OfOneNameTheWorstIsTold) {
  hear("gyro_publisher", State::kRunning, 1);
  hear("gyro_publisher", State::kRunning, 2);
  roster_.note_gone(guid(2), dds::Departure::kLeft);
  hear("gyro_publisher", State::kRunning, 1);
  ASSERT_EQ(roster_.statuses().size(), 1U);
  EXPECT_EQ(level(), RosLevel::kError);
  hear("gyro_publisher", State::kRunning, 3);
  EXPECT_EQ(level(), RosLevel::kOk);
}

TEST_F(RosHealthOfServices, NamesFromAnybodyFillNoMemory) {
  for (int i = 0; i < 255; ++i)
    hear(("s" + std::to_string(i)).c_str(), State::kRunning, static_cast<std::uint8_t>(i));
  EXPECT_EQ(roster_.statuses().size(), 100U);
}

}  // namespace
}  // namespace zerodrift::service
