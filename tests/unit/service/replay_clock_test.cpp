// SPDX-License-Identifier: Apache-2.0
// Only lower bounds of time are checked: a sample never comes before it is due. How late a busy
// machine wakes up is not the clock's.
#include "common/service/replay_clock.h"

#include <gtest/gtest.h>

#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>

namespace zerodrift::service {
namespace {

using std::chrono_literals::operator""h;
using std::chrono_literals::operator""ms;
using std::chrono_literals::operator""s;
using std::chrono_literals::operator""us;

// The clock does not sleep for less.
constexpr auto kShortestSleep = 200us;

std::string refusal(const std::string& text) {
  try {
    (void)parse_speed(text);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no error";
}

TEST(ParseSpeed, TakesNumbersAboveZeroAndMax) {
  EXPECT_EQ(parse_speed("1"), 1.0);
  EXPECT_EQ(parse_speed("60"), 60.0);
  EXPECT_EQ(parse_speed("60x"), 60.0);
  EXPECT_EQ(parse_speed("0.5"), 0.5);
  EXPECT_EQ(parse_speed("1e6"), 1e6);
  EXPECT_EQ(parse_speed("max"), std::nullopt);
}

TEST(ParseSpeed, RefusesTheRestInOneLine) {
  for (const char* text : {"", "0", "-1", "-0.0", "fast", "Max", "60xx", "x", "60 x", "1 2", "nan",
                           "inf", "1e7", "1e400"}) {
    EXPECT_EQ(refusal(text),
              "--speed: found '" + std::string(text) +
                  "', expected times real time above 0, at most 1e6 (60 or 60x), or max");
  }
}

TEST(ParseSpeed, RefusesInTheNameOfWhatWasGiven) {
  try {
    (void)parse_speed("0", "speed");
    ADD_FAILURE();
  } catch (const std::invalid_argument& error) {
    EXPECT_TRUE(std::string(error.what()).starts_with("speed: found '0', expected "))
        << error.what();
  }
}

TEST(ReplayClock, HoldsASampleUntilItIsDue) {
  ReplayClock clock(100.0);
  const auto start = std::chrono::steady_clock::now();
  clock.wait_until(core::SensorTime{5s});
  clock.wait_until(core::SensorTime{7s});
  EXPECT_GE(std::chrono::steady_clock::now() - start, 20ms - kShortestSleep);
}

TEST(ReplayClock, CountsFromTheFirstSampleWhereverItStands) {
  ReplayClock clock(1.0);
  clock.wait_until(core::SensorTime{1000000h});  // would never return if waited for
  clock.wait_until(core::SensorTime{1000000h} + 1ms);
}

TEST(ReplayClock, NeverSleepsAtFullSpeedNorForATimeThatGoesBack) {
  ReplayClock full_speed(std::nullopt);
  full_speed.wait_until(core::SensorTime{0});
  full_speed.wait_until(core::SensorTime{1000000h});
  ReplayClock clock(1.0);
  clock.wait_until(core::SensorTime{1000000h});
  clock.wait_until(core::SensorTime{0});
}

TEST(ReplayClock, GoesOnFromWhereItIsAfterAStallInsteadOfRushing) {
  ReplayClock clock(1.0);
  clock.wait_until(core::SensorTime{0});
  std::this_thread::sleep_for(300ms);
  clock.wait_until(core::SensorTime{10ms});  // 290 ms late: the clock starts anew here
  const auto resumed = std::chrono::steady_clock::now();
  clock.wait_until(core::SensorTime{60ms});
  // wait_until() read its clock before `resumed` was taken, by microseconds.
  EXPECT_GE(std::chrono::steady_clock::now() - resumed, 50ms - kShortestSleep - 5ms);
}

TEST(ReplayClock, APauseHoldsEvenAtFullSpeedUntilItIsResumed) {
  ReplayClock clock(std::nullopt);
  clock.wait_until(core::SensorTime{0});
  clock.pause();
  std::atomic<bool> resumed{false};
  std::thread other([&] {
    std::this_thread::sleep_for(50ms);
    resumed = true;
    clock.resume();
  });
  clock.wait_until(core::SensorTime{1});
  EXPECT_TRUE(resumed);
  other.join();
}

TEST(ReplayClock, TimeThatPassedWhilePausedIsNotCaughtUp) {
  ReplayClock clock(1.0);
  clock.wait_until(core::SensorTime{0});
  clock.pause();
  std::this_thread::sleep_for(60ms);
  clock.resume();
  const auto start = std::chrono::steady_clock::now();
  clock.wait_until(core::SensorTime{10ms});  // the first after the pause: due at once
  clock.wait_until(core::SensorTime{40ms});
  EXPECT_GE(std::chrono::steady_clock::now() - start, 30ms - kShortestSleep);
}

TEST(ReplayClock, AnotherSpeedHoldsFromTheNextSampleOn) {
  ReplayClock clock(1.0);
  clock.wait_until(core::SensorTime{0});
  clock.set_speed(std::nullopt);
  clock.wait_until(core::SensorTime{1000000h});  // would never return at the speed before
  clock.set_speed(100.0);
  clock.wait_until(core::SensorTime{1000001h});
  const auto start = std::chrono::steady_clock::now();
  clock.wait_until(core::SensorTime{1000001h} + 2s);
  EXPECT_GE(std::chrono::steady_clock::now() - start, 20ms - kShortestSleep);
}

TEST(ReplayClock, AStopEndsAPause) {
  ReplayClock clock(1.0);
  clock.pause();
  const std::atomic<bool> stopping{true};
  clock.wait_until(core::SensorTime{0}, stopping);
}

}  // namespace
}  // namespace zerodrift::service
