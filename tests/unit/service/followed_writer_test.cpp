// SPDX-License-Identifier: Apache-2.0
// Two publishers of one thermometer. Rule: they are never mixed, and a successor is taken over from
// the first reading on that its predecessor didn't give.
#include "common/service/followed_writer.h"

#include <gtest/gtest.h>

#include <functional>
#include <utility>
#include <vector>

namespace zerodrift::service {
namespace {

constexpr int kFirst = 1;
constexpr int kSecond = 2;
constexpr int kThird = 3;

class Publishers : public testing::Test {
 protected:
  // A reading whose degrees say who gave it, stamped and received at that time.
  void send(int writer, double at_s, bool measured = true) {
    const core::SensorTime at = core::from_seconds(at_s);
    writers_.push(
        {.probe = "coil", .time = at, .temperature_degc = 1.0 * writer, .measured = measured},
        writer, at.count(), take_);
  }
  bool leave(int writer, double at_s) {
    return writers_.leave(writer, core::from_seconds(at_s).count(), take_);
  }
  void tick(double at_s) { writers_.follow_who_waits(core::from_seconds(at_s).count(), take_); }
  // Who gave what was used since the last call.
  std::vector<int> used() { return std::exchange(used_, {}); }

  FollowedWriter<int> writers_{core::from_seconds(30.0)};
  std::vector<int> used_;
  std::function<void(const core::TemperatureSample&)> take_ =
      [this](const core::TemperatureSample& sample) {
        used_.push_back(static_cast<int>(sample.temperature_degc));
      };
};

TEST_F(Publishers, TheFirstIsFollowedAndTheOtherRefusedAndCounted) {
  for (int k = 0; k < 10; ++k) {
    send(kFirst, k);
    send(kSecond, k + 0.5);
  }
  EXPECT_EQ(used(), std::vector<int>(10, kFirst));
  EXPECT_EQ(writers_.rejected(), 9U) << "the last one waits";
}

TEST_F(Publishers, OneThatFollowsAnotherThatLeftIsTakenAtOnceWithWhatWaited) {
  send(kFirst, 0.0);
  send(kFirst, 1.0);
  send(kSecond, 1.1);
  send(kSecond, 1.2);
  EXPECT_EQ(used(), (std::vector{kFirst, kFirst}));
  EXPECT_FALSE(leave(kFirst, 1.3)) << "another goes on";
  EXPECT_FALSE(writers_.is_gone());
  EXPECT_EQ(used(), (std::vector{kSecond, kSecond}));
  send(kSecond, 1.4);
  EXPECT_EQ(used(), std::vector{kSecond});
  EXPECT_EQ(writers_.rejected(), 0U);
  EXPECT_TRUE(leave(kSecond, 1.5));
  EXPECT_TRUE(writers_.is_gone());
  EXPECT_FALSE(leave(kSecond, 1.6)) << "once";
  send(kThird, 2.0);
  EXPECT_EQ(used(), std::vector{kThird});
  EXPECT_FALSE(writers_.is_gone());
}

// The one before was killed: that it is gone is known after its lease only, 20 s.
TEST_F(Publishers, OneThatIsSilentForTwoOfItsSpacingsIsReplacedAndNothingIsMissing) {
  for (int k = 0; k <= 10; ++k) send(kFirst, k);
  used();
  send(kSecond, 11.5);
  EXPECT_EQ(used(), std::vector<int>{});
  send(kSecond, 12.0);
  EXPECT_EQ(used(), std::vector<int>{}) << "two spacings, not more";
  send(kSecond, 12.5);
  EXPECT_EQ(used(), std::vector<int>(3, kSecond));
  EXPECT_FALSE(leave(kFirst, 30.0)) << "it isn't followed any more";
  send(kSecond, 30.5);
  EXPECT_EQ(used(), std::vector{kSecond});
}

TEST_F(Publishers, AFastOneIsGivenASecond) {
  for (int k = 0; k <= 10; ++k) send(kFirst, 0.01 * k);
  used();
  send(kSecond, 1.0);
  tick(1.05);
  EXPECT_EQ(used(), std::vector<int>{});
  tick(1.15);
  EXPECT_EQ(used(), std::vector{kSecond}) << "though it waits for somebody itself";
}

TEST_F(Publishers, ASlowOneIsGivenUntilItIsStale) {
  send(kFirst, 0.0);
  send(kFirst, 20.0);
  used();
  send(kSecond, 49.0);
  EXPECT_EQ(used(), std::vector<int>{});
  send(kSecond, 51.0);
  EXPECT_EQ(used(), (std::vector{kSecond, kSecond}));
}

TEST_F(Publishers, OfSeveralThatWaitTheFirstIsFollowedAndOneThatLeftIsForgotten) {
  send(kFirst, 0.0);
  send(kFirst, 1.0);
  send(kSecond, 1.1);
  send(kThird, 1.2);
  EXPECT_FALSE(leave(kSecond, 1.3));
  EXPECT_FALSE(leave(kFirst, 1.4));
  EXPECT_EQ(used(), (std::vector{kFirst, kFirst, kThird}));
  EXPECT_EQ(writers_.rejected(), 1U);
}

TEST_F(Publishers, SaysWhetherTheFollowedOneEndedInMidRun) {
  send(kFirst, 0.0);
  EXPECT_TRUE(writers_.is_in_mid_run());
  send(kFirst, 1.0, false);
  send(kSecond, 1.1);
  EXPECT_FALSE(writers_.is_in_mid_run());
}

}  // namespace
}  // namespace zerodrift::service
