// SPDX-License-Identifier: Apache-2.0
// The clock as adversary: stepped, frozen, skewed, read by a process that was held up.
#include "common/service/sensor_clock.h"

#include <gtest/gtest.h>
#include <sys/timex.h>

#include <cerrno>
#include <vector>

namespace zerodrift::service {
namespace {

using std::chrono::nanoseconds;
using namespace std::chrono_literals;
using Verdict = SensorClock::Verdict;

constexpr std::int64_t kBootedNs = 5'000'000'000'000;        // monotonic
constexpr std::int64_t kUnixNs = 1'790'000'000'000'000'000;  // in 2026
constexpr nanoseconds kLookEvery = 10ms;

// A host whose wall clock the test moves.
class Host {
 public:
  [[nodiscard]] ClockReading now() const { return {monotonic_.count(), unix_.count()}; }
  void pass(nanoseconds time, double wall_pace = 1.0) {
    monotonic_ += time;
    unix_ += nanoseconds(static_cast<std::int64_t>(static_cast<double>(time.count()) * wall_pace));
  }
  void step(nanoseconds by) { unix_ += by; }

 private:
  nanoseconds monotonic_{kBootedNs};
  nanoseconds unix_{kUnixNs};
};

// A process that looks all the time: what it was told, but for doubts.
struct Process {
  explicit Process(const Host& host) : clock(host.now()) {}
  void look_for(Host& host, nanoseconds time, double wall_pace = 1.0) {
    for (nanoseconds passed{0}; passed < time; passed += kLookEvery) {
      host.pass(kLookEvery, wall_pace);
      const auto look = clock.look(host.now());
      if (look.verdict == Verdict::kStepped) steps.push_back(look.step);
      if (look.verdict == Verdict::kUnsteady) ++unsteady;
    }
  }
  [[nodiscard]] core::SensorTime time(const Host& host) const {
    return clock.at(host.now().monotonic_ns);
  }
  SensorClock clock;
  std::vector<nanoseconds> steps{};
  int unsteady = 0;
};

class Stepped : public testing::TestWithParam<nanoseconds> {};

// Rule: after a step all processes of a host agree again within a few looks, whether they started
// before or after it, and each was told once, by how much.
TEST_P(Stepped, EveryProcessFollowsAndIsToldOnce) {
  Host host;
  Process before(host);
  before.look_for(host, 1s);
  EXPECT_EQ(before.time(host).count(), host.now().unix_ns);
  host.step(GetParam());
  Process after(host);
  before.look_for(host, 200ms);
  EXPECT_EQ(before.time(host), after.time(host));
  EXPECT_EQ(before.steps, std::vector{GetParam()});
  before.look_for(host, 10s);
  EXPECT_EQ(before.time(host).count(), host.now().unix_ns);
  EXPECT_EQ(before.steps.size(), 1U);
  EXPECT_EQ(before.unsteady, 0);
}

constexpr nanoseconds kTenYears = 24h * 3653;
INSTANTIATE_TEST_SUITE_P(Clock, Stepped,
                         testing::Values(1s, -1s, 1h, -1h, kTenYears, -kTenYears,
                                         nanoseconds(-kUnixNs)));

// Rule: what is smaller than half a leap second is nobody's concern.
TEST(SensorClock, ASmallStepIsLeftAlone) {
  Host host;
  Process process(host);
  for (const nanoseconds step : {400ms, -800ms, 800ms}) {
    host.step(step);
    process.look_for(host, 1s);
  }
  EXPECT_EQ(process.steps.size(), 0U);
  EXPECT_EQ(process.time(host).count(), host.now().unix_ns - 400'000'000);
}

// Rule: sensor time never depends on the wall clock's pace: one that stands still, runs at a tenth
// or at ten times the pace is told, once, and not followed.
TEST(SensorClock, AWallClockWithoutASteadyPaceIsToldAndNotFollowed) {
  for (const double pace : {0.0, 0.1, 10.0, -1.0}) {
    Host host;
    Process process(host);
    const core::SensorTime began = process.time(host);
    process.look_for(host, 60s, pace);
    EXPECT_EQ(process.time(host) - began, 60s) << pace;
    EXPECT_EQ(process.steps.size(), 0U) << pace;
    EXPECT_EQ(process.unsteady, 1) << pace;
  }
}

// Rule: a clock that is stepped there and back between two looks, or jumps about, decides nothing.
TEST(SensorClock, AStepThatDoesNotStayIsNotFollowed) {
  Host host;
  Process process(host);
  const core::SensorTime began = process.time(host);
  for (int k = 0; k < 100; ++k) {
    host.step(k % 2 == 0 ? nanoseconds(1h) : nanoseconds(-1h));
    process.look_for(host, 50ms);
  }
  EXPECT_EQ(process.time(host) - began, 5s);
  EXPECT_EQ(process.steps.size(), 0U);
}

// Rule: NTP's slewing moves both clocks; a skew of 500 ppm between them is followed in steps that
// are each told, and no process is ever further off than that.
TEST(SensorClock, ASlowSkewIsFollowedBySmallSteps) {
  Host host;
  Process process(host);
  for (int minute = 0; minute < 60; ++minute) {
    process.look_for(host, 60s, 1.0 + 500e-6);
    EXPECT_LE(std::abs(process.time(host).count() - host.now().unix_ns), 500'100'000);
  }
  EXPECT_EQ(process.steps.size(), 3U);  // 1.8 s in an hour
  EXPECT_EQ(process.unsteady, 0);
}

TEST(ClockDiscipline, IsWhatTheKernelKnows) {
  using Lock = ClockDiscipline::Lock;
  EXPECT_EQ(discipline_of(TIME_OK, STA_NANO | STA_PLL, -1500).lock, Lock::kLocked);
  EXPECT_EQ(discipline_of(TIME_OK, STA_NANO | STA_PLL, -1500).offset_ns, -1500);
  EXPECT_EQ(discipline_of(TIME_OK, STA_PLL, 7).offset_ns, 7000);
  EXPECT_EQ(discipline_of(TIME_INS, STA_NANO, 0).lock, Lock::kLocked);
  EXPECT_EQ(discipline_of(TIME_OK, STA_UNSYNC, 7).lock, Lock::kFree);
  EXPECT_EQ(discipline_of(TIME_ERROR, STA_NANO, 7).lock, Lock::kFree);
  EXPECT_EQ(discipline_of(TIME_ERROR, STA_NANO, 7).offset_ns, 0);
  EXPECT_EQ(discipline_of(-EPERM, 0, 7).lock, Lock::kUnknown);
}

TEST(SensorClock, ReadsBothClocksOfThisHostAtOneMoment) {
  const ClockReading first = await_clocks();
  const ClockReading second = await_clocks();
  EXPECT_GE(second.monotonic_ns, first.monotonic_ns);
  SensorClock clock(first);
  EXPECT_EQ(clock.look(second).verdict, Verdict::kSteady);
}

}  // namespace
}  // namespace zerodrift::service
