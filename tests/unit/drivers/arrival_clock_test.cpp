// SPDX-License-Identifier: Apache-2.0
#include "common/drivers/arrival_clock.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <random>
#include <vector>

namespace zerodrift::drivers {
namespace {

using core::SensorTime;
using std::chrono::milliseconds;
using std::chrono::seconds;
using namespace std::chrono_literals;

constexpr unsigned kLap = 128;

// A frame that is read alone.
SensorTime stamped(ArrivalClock& clock, SensorTime host_time, std::uint64_t step) {
  clock.begin_read(host_time, 1, false);
  return clock.next(step).time;
}

// Frames every ms arrive in bursts, each up to 8 ms late: the stamps must not show it.
TEST(ArrivalClocks, TakesTheHostsJitterOff) {
  constexpr std::uint64_t kSeed = 43;
  std::mt19937_64 random{kSeed};
  ArrivalClock clock{1000.0, kLap};
  SensorTime previous{0};
  SensorTime burst{0};
  for (int k = 1; k <= 20000; ++k) {
    const SensorTime sent = milliseconds{k};
    if (sent > burst) burst = sent + SensorTime{static_cast<std::int64_t>(random() % 8'000'000)};
    const SensorTime stamp = stamped(clock, std::max(burst, sent), 1);
    ASSERT_GT(stamp, previous) << "seed " << kSeed << " frame " << k;
    previous = stamp;
    // Settled, it lies above the true time by the creep since the last early arrival: 2e-4 ms a
    // frame. One burst in 8 arrives less than 1 ms late; 100 bursts (about 500 frames, 0.1 ms)
    // without one have a chance of 2e-6.
    if (k > 2000) {
      ASSERT_GE(stamp, sent) << "seed " << kSeed << " frame " << k;
      ASSERT_LE(stamp, sent + SensorTime{1'100'000}) << "seed " << kSeed << " frame " << k;
    }
  }
}

TEST(ArrivalClocks, FollowsACrystalThatIsSlowOrFast) {
  for (const double error : {-1e-4, 1e-4}) {
    ArrivalClock clock{1000.0, kLap};
    SensorTime stamp{0};
    SensorTime sent{0};
    for (int k = 1; k <= 100000; ++k) {
      sent = SensorTime{std::llround(k * 1e6 * (1.0 + error))};
      stamp = stamped(clock, sent, 1);
    }
    EXPECT_EQ(stamp, sent) << error;  // each arrival is on time, so each is its own stamp
  }
}

TEST(ArrivalClocks, MissingFramesKeepTheirPlaceInTime) {
  ArrivalClock clock{1000.0, kLap};
  (void)stamped(clock, milliseconds{0}, 1);
  EXPECT_EQ(stamped(clock, milliseconds{4}, 3),
            milliseconds{3} + SensorTime{600});  // 3 periods and their creep
}

// Set back by an hour, all later frames were 1 ns apart.
TEST(ArrivalClocks, FollowHostTimeThatIsSetAnew) {
  using namespace std::chrono_literals;
  for (const SensorTime step : {SensorTime{-1h}, SensorTime{1h}, SensorTime{700ms}}) {
    ArrivalClock clock{1000.0, kLap};
    SensorTime host{10h};
    for (int k = 0; k < 1000; ++k) (void)stamped(clock, host += 1ms, 1);
    host += step;
    clock.restart();
    for (int k = 0; k < 1000; ++k) {
      host += 1ms;
      ASSERT_EQ(stamped(clock, host, 1), host);
    }
  }
}

// A silence of the gyro, or of the line, is one in its stamps too: they crept behind for an hour.
TEST(ArrivalClocks, ASilenceStartsAfresh) {
  for (const SensorTime silence : {200ms, 900ms, 5000ms}) {
    ArrivalClock clock{1000.0, kLap};
    SensorTime host{0};
    for (int k = 0; k < 1000; ++k) stamped(clock, host += 1ms, 1);
    EXPECT_EQ(stamped(clock, host + silence, 1), host + silence);
  }
}

// A gyro whose numbers go from 0 to 127, a line that may lose frames, a host that reads what is
// there and drops what comes to a full buffer.
class Line {
 public:
  explicit Line(double rate_hz, std::size_t buffer) : rate_hz_(rate_hz), buffer_(buffer) {}

  void send_until(SensorTime time) {
    for (; sent_at(next_) <= time; ++next_) {
      if (next_ >= lost_from_ && next_ < lost_to_) continue;
      if (frames_.size() < buffer_) frames_.push_back(next_);
    }
  }
  void lose(std::uint64_t count) {
    lost_from_ = next_;
    lost_to_ = next_ + count;
  }
  [[nodiscard]] SensorTime sent_at(std::uint64_t frame) const {
    return SensorTime{std::llround(1e9 * static_cast<double>(frame + 1) / rate_hz_)};
  }
  std::deque<std::uint64_t>& frames() { return frames_; }

 private:
  double rate_hz_;
  std::size_t buffer_;
  std::uint64_t next_ = 0;
  std::uint64_t lost_from_ = 0;
  std::uint64_t lost_to_ = 0;
  std::deque<std::uint64_t> frames_;
};

struct Given {
  std::uint64_t frame = 0;     // the truth
  std::uint64_t sequence = 0;  // as counted
  SensorTime time{0};
};

// The program reads at most 113 frames at once.
class Reader {
 public:
  Reader(Line& line, double rate_hz) : line_(line), clock_(rate_hz, kLap) {}

  void read(SensorTime host_time) {
    constexpr std::size_t kAtOnce = 113;
    line_.send_until(host_time);
    while (!line_.frames().empty()) {
      const std::size_t count = std::min(kAtOnce, line_.frames().size());
      clock_.begin_read(host_time, count, count == kAtOnce);
      for (std::size_t i = 0; i < count; ++i) {
        const std::uint64_t frame = line_.frames().front();
        line_.frames().pop_front();
        const std::uint64_t apart = given.empty() ? 1 : (frame - given.back().frame - 1) % kLap + 1;
        const ArrivalClock::Stamp stamp = clock_.next(apart);
        const std::uint64_t sequence =
            given.empty() ? frame : given.back().sequence + apart + stamp.lost;
        given.push_back({frame, sequence, stamp.time});
      }
    }
  }

  std::vector<Given> given;

 private:
  Line& line_;
  ArrivalClock clock_;
};

// Whatever is lost, is late or sleeps: in order, never later than the host can know, and within a
// lap's doubt of the truth at once, which is of what a buffer lost; numbers are those of the frames
// again as soon as what was read at once is through.
TEST(ArrivalClocks, LossesStopsAndBurstsLeaveTimesAndNumbersRight) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random{seed};
    const double rates_hz[] = {100.0, 500.0, 1000.0, 2000.0};
    const double rate_hz = rates_hz[random() % 4];
    Line line{rate_hz, 510};
    Reader reader{line, rate_hz};
    SensorTime host{0};
    const auto run = [&](SensorTime duration) {
      for (const SensorTime end = host + duration; host < end;) {
        host += milliseconds{1 + static_cast<long>(random() % 16)};  // as USB adapters give them
        reader.read(host);
      }
    };
    for (int k = 0; k < 12; ++k) {
      run(3s);
      const std::size_t first = reader.given.size();
      switch (random() % 3) {
        case 0: line.lose(1 + random() % static_cast<std::uint64_t>(1.5 * rate_hz)); break;
        case 1: host += milliseconds{20 + static_cast<long>(random() % 3000)}; break;
        case 2: break;
      }
      run(2s);
      // Long enough after it: what follows is as before.
      for (std::size_t i = first; i < reader.given.size(); ++i) {
        const Given& one = reader.given[i];
        ASSERT_TRUE(i == 0 || one.time > reader.given[i - 1].time) << i;
        ASSERT_GE(one.time, line.sent_at(one.frame) - 110ms) << i << " frame " << one.frame;
      }
      const Given& last = reader.given.back();
      EXPECT_LE(last.time, line.sent_at(last.frame) + 20ms);
      EXPECT_GE(last.time, line.sent_at(last.frame) - 110ms);
      const double apart = static_cast<double>(last.sequence) - static_cast<double>(last.frame);
      EXPECT_EQ(std::fmod(apart, kLap), 0.0);
      if (rate_hz >= 1000.0) {
        EXPECT_EQ(apart, 0.0) << last.frame;
      }
    }
  }
}

// --- the rate that it was said to send at

// What a watch of `said_hz` finds of a gyro that sends `sent_hz`, as soon as it finds it.
struct Found {
  std::optional<double> other_rate_hz;
  double after_s = 0.0;
};
Found watch(double said_hz, double sent_hz, double duration_s, std::uint64_t seed) {
  std::mt19937_64 random{seed};
  FrameRateWatch watch{said_hz};
  SensorTime busy_until{0};
  for (std::uint64_t k = 0;; ++k) {
    const double sent_s = static_cast<double>(k) / sent_hz;
    const SensorTime sent = 1h + SensorTime{std::llround(1e9 * sent_s)};
    // The host is late by up to 16 ms, and every now and then by half a second.
    if (sent > busy_until) {
      busy_until = sent + SensorTime{static_cast<std::int64_t>(random() % 16'000'000)};
      if (random() % 500 == 0) busy_until += milliseconds{random() % 500};
    }
    watch.note(std::max(sent, busy_until), true);
    if (watch.other_rate_hz() || sent_s > duration_s) return {watch.other_rate_hz(), sent_s};
  }
}

TEST(FrameRateWatches, SaysNothingOfAGyroThatSendsAsWasSaid) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    for (const double crystal : {-2e-4, 0.0, 2e-4}) {
      const Found found = watch(1000.0, 1000.0 * (1.0 + crystal), 600.0, seed);
      EXPECT_FALSE(found.other_rate_hz) << "seed " << seed << ", after " << found.after_s << " s";
    }
  }
}

TEST(FrameRateWatches, FindsAnotherRate) {
  struct Case {
    double said_hz;
    double sent_hz;
    double within_s;
  };
  for (const Case& one :
       {Case{1000.0, 500.0, 3.0}, Case{1000.0, 900.0, 3.0}, Case{1000.0, 1100.0, 3.0},
        Case{100.0, 1000.0, 3.0}, Case{1000.0, 990.0, 10.0}, Case{1000.0, 1001.5, 100.0}}) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      const Found found = watch(one.said_hz, one.sent_hz, one.within_s, seed);
      ASSERT_TRUE(found.other_rate_hz) << one.sent_hz << ", seed " << seed;
      EXPECT_NEAR(*found.other_rate_hz / one.sent_hz, 1.0, 0.03) << "seed " << seed;
    }
  }
}

// Set up anew while it runs: told, and taken back.
TEST(FrameRateWatches, TakesBackWhatIsOver) {
  FrameRateWatch watch{1000.0};
  SensorTime now{0};
  const auto run = [&](double sent_hz, double duration_s) {
    for (double t = 0.0; t < duration_s; t += 1.0 / sent_hz)
      watch.note(now += SensorTime{std::llround(1e9 / sent_hz)}, true);
  };
  run(1000.0, 20.0);
  EXPECT_FALSE(watch.other_rate_hz());
  run(500.0, 2.0);
  ASSERT_TRUE(watch.other_rate_hz());
  EXPECT_NEAR(*watch.other_rate_hz(), 500.0, 1.0);
  run(1000.0, 2.0);
  EXPECT_FALSE(watch.other_rate_hz());
}

// Losses are no lower rate.
TEST(FrameRateWatches, LeavesLossesOut) {
  std::mt19937_64 random{7};
  FrameRateWatch watch{1000.0};
  bool follows = true;
  for (int k = 0; k < 200'000; ++k) {
    if (random() % 10 == 0) {
      follows = false;
      continue;
    }
    watch.note(milliseconds{k}, follows);
    follows = true;
    ASSERT_FALSE(watch.other_rate_hz()) << k;
  }
}

}  // namespace
}  // namespace zerodrift::drivers
