// SPDX-License-Identifier: Apache-2.0
#include "common/replay/rate_replay.h"

#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <thread>
#include <vector>

#include "common/replay/temperature_replay.h"
#include "tests/unit/dds/test_domain.h"

namespace zerodrift::replay {
namespace {

using dds::eventually;

constexpr std::uint32_t kGyro = 3;
constexpr std::uint64_t kSamples = 500;  // more than a window of the pacing

GyroSource counting(std::uint64_t samples) {
  return [samples, next = std::uint64_t{0}]() mutable -> std::optional<GyroReading> {
    if (next == samples) return std::nullopt;
    core::AngularRateSample sample;
    sample.sequence = next;
    sample.time = core::SensorTime{static_cast<std::int64_t>(++next) * 5'000'000};
    sample.interval_s = 5e-3;
    sample.valid = {true, true, true};
    sample.clock = core::ClockSource::kReplay;
    return GyroReading{.rate = sample};
  };
}

// A replay for nobody in particular, and one that listens.
class Replays : public ::testing::Test {
 protected:
  Replays() {
    // Both ends: what is written before the writer knows its reader goes out into the void.
    dds::eventually([&] { return reader_.matched() > 0 && replay_.matched() > 0; });
  }

  [[nodiscard]] std::vector<std::uint64_t> heard() {
    const std::lock_guard lock(mutex_);
    return heard_;
  }

  dds::TestDomain domain_{kDomain};
  service::Host host_{"replay_test", domain_.network()};
  RateReplay replay_{host_, kGyro, "max", {}};
  std::mutex mutex_;
  std::vector<std::uint64_t> heard_;
  dds::Participant listener_{"listener", domain_.network()};
  dds::Reader<msg::AngularRate> reader_{
      listener_, [this](const msg::AngularRate& message, const dds::SampleOrigin&) {
        const std::lock_guard lock(mutex_);
        heard_.push_back(message.sequence_number());
      }};
  std::atomic<bool> stopping_{false};

 private:
  static constexpr std::uint32_t kDomain = 118;
};

TEST_F(Replays, GiveOutEverySampleOnceAndInOrder) {
  replay_.publish(counting(kSamples), stopping_);
  EXPECT_TRUE(replay_.finished());
  EXPECT_EQ(replay_.published(), kSamples);
  ASSERT_TRUE(eventually([&] { return heard().size() == kSamples; }));
  const auto all = heard();
  for (std::uint64_t i = 0; i < kSamples; ++i) ASSERT_EQ(all[i], i);
}

// As a monitor that was not connected to the compensation yet when the first samples were answered.
TEST_F(Replays, OneThatMissedTheBeginningIsNotWaitedForForGood) {
  RateReplay replay(host_, kGyro, "max", {"one", "late"});
  dds::Participant one("one", domain_.network());
  dds::Participant late("late", domain_.network());
  service::ReplayProgressReporter announcing_only(late, "late");
  service::ReplayProgressReporter reporter(one, "one");
  std::atomic<std::uint64_t> taken{0};
  dds::Reader<msg::AngularRate> reader(
      one, [&](const msg::AngularRate& message, const dds::SampleOrigin&) {
        ++taken;
        reporter.report(kGyro, message.sequence_number(), core::kNever);
      });
  ASSERT_TRUE(eventually([&] { return replay.matched() == 2 && reader.matched() == 2; }));
  std::thread publisher([&] { replay.publish(counting(kSamples), stopping_); });
  EXPECT_TRUE(eventually([&] { return replay.finished(); }));
  EXPECT_EQ(taken, kSamples);
  stopping_ = true;
  publisher.join();
}

TEST_F(Replays, AFilterDropsWhatItSaysAndNothingElse) {
  replay_.publish(counting(kSamples), stopping_, [](core::AngularRateSample& sample) {
    return sample.sequence % 5 == 0 ? RateReplay::Delivery::kDrop : RateReplay::Delivery::kGive;
  });
  ASSERT_TRUE(eventually([&] { return heard().size() == kSamples * 4 / 5; }));
  for (const std::uint64_t sequence : heard()) EXPECT_NE(sequence % 5, 0U);
}

TEST_F(Replays, AStopEndsAPausedReplay) {
  replay_.clock().pause();
  std::thread stopper([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    stopping_ = true;
  });
  replay_.publish(counting(kSamples), stopping_);
  stopper.join();
  EXPECT_FALSE(replay_.finished());
}

TEST_F(Replays, WhatTheSourceThrowsIsThrownAfterWhatWentOutWasReceived) {
  auto source = [inner = counting(kSamples), left = 10]() mutable -> std::optional<GyroReading> {
    if (left-- == 0) throw std::runtime_error("row 11 is bad");
    return inner();
  };
  EXPECT_THROW(replay_.publish(source, stopping_), std::runtime_error);
  EXPECT_TRUE(eventually([&] { return heard().size() == 10; }));
}

TEST_F(Replays, TemperaturesSayForEachProbeThatNothingMoreComes) {
  TemperatureReplay temperatures(host_, kGyro, "max", {});
  std::mutex mutex;
  std::vector<msg::Temperature> heard;
  dds::Reader<msg::Temperature> reader(
      listener_, [&](const msg::Temperature& message, const dds::SampleOrigin&) {
        const std::lock_guard lock(mutex);
        heard.push_back(message);
      });
  int left = 6;
  const auto next = [&]() -> std::optional<core::TemperatureSample> {
    if (left-- == 0) return std::nullopt;
    return core::TemperatureSample{.probe = left % 2 == 0 ? "coil" : "case",
                                   .sequence = static_cast<std::uint64_t>((5 - left) / 2),
                                   .time = core::SensorTime{(6 - left) * 1'000'000'000LL},
                                   .temperature_degc = 20.0,
                                   .clock = core::ClockSource::kReplay};
  };
  temperatures.publish({.probes = {"coil", "case"}, .next = next}, stopping_);
  ASSERT_TRUE(eventually([&] {
    const std::lock_guard lock(mutex);
    return heard.size() == 8;
  }));
  int ends = 0;
  for (const auto& message : heard) ends += message.measured() == 0 ? 1 : 0;
  EXPECT_EQ(ends, 2);
}

}  // namespace
}  // namespace zerodrift::replay
