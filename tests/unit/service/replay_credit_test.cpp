// SPDX-License-Identifier: Apache-2.0
// A replay, compensations that are killed and started again, and a monitor behind them, in any
// order of what reaches whom: the replay never stands still for good, and no more is on its way
// than the topics' history holds.
#include "common/service/replay_credit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <deque>
#include <random>
#include <string>
#include <vector>

#include "common/dds/topics.h"

namespace zerodrift::service {
namespace {

constexpr std::uint64_t kFirst = 1000;
constexpr std::uint64_t kWindow = ReplayCredit::kWindow;
constexpr auto kHistory = static_cast<std::size_t>(dds::kAngularRate.depth);

// One life of a process.
class Process {
 public:
  Process(std::string name, std::uint8_t life) : name_(std::move(name)) {
    writer_.guidPrefix.value[11] = life;
    writer_.entityId.value[0] = 1;
    reader_ = writer_;
    reader_.entityId.value[0] = 2;
  }

  void announce(ReplayCredit& credit) const {
    if (is_alive) credit.note(name_, writer_, {});
  }
  void report(ReplayCredit& credit) const {
    if (is_alive && taken_ != 0) credit.note(name_, writer_, {{taken_, core::kNever}});
  }
  // Once in a life. Its word is heard by then, or soon after.
  void connect(ReplayCredit& credit) {
    if (!is_alive || is_connected) return;
    is_connected = true;
    credit.note_reader(reader_);
    announce(credit);
  }
  void leave(ReplayCredit& credit) {
    if (!is_alive) credit.forget(writer_);
  }
  void deliver(std::uint64_t sequence) {
    if (is_alive && is_connected) waiting_.push_back(sequence);
    EXPECT_LE(waiting_.size(), kHistory) << name_;
  }
  std::vector<std::uint64_t> take(std::size_t at_most) {
    std::vector<std::uint64_t> taken;
    while (is_alive && !waiting_.empty() && taken.size() < at_most) {
      taken.push_back(waiting_.front());
      taken_ = std::max(taken_, waiting_.front());
      waiting_.pop_front();
    }
    return taken;
  }
  [[nodiscard]] std::uint64_t taken() const { return taken_; }

  bool is_alive = true;
  bool is_connected = false;  // for a compensation to the rates, for the monitor see World
  bool monitor_hears = false;

 private:
  std::string name_;
  ReplayCredit::Guid writer_;
  ReplayCredit::Guid reader_;
  std::deque<std::uint64_t> waiting_;
  std::uint64_t taken_ = 0;
};

class World {
 public:
  explicit World(std::uint64_t seed) : random_(seed) {
    monitor_.is_connected = true;  // what it hears of is each compensation's answer
    monitor_.announce(credit_);
    start();
  }

  void happen() {
    Process& one = compensations_[draw(compensations_.size())];
    switch (draw(12)) {
      case 0: one.announce(credit_); break;
      case 1: one.report(credit_); break;
      case 2: one.connect(credit_); break;
      case 3: one.leave(credit_); break;
      case 4: one.monitor_hears = true; break;
      case 5: monitor_.report(credit_); break;
      case 6: monitor_.take(draw(2 * kWindow)); break;
      case 7:
        if (draw(4) == 0) one.is_alive = false;
        break;
      case 8:
        if (alive() < 2 && compensations_.size() < 200) start();
        break;
      case 9:
      case 10: send(draw(2 * kWindow)); break;
      default: answer(one, draw(2 * kWindow)); break;
    }
  }

  // Everybody is there and does what there is to do; what does not help is waited for, twice.
  std::uint64_t sent_when_all_goes_well() {
    if (alive() == 0) start();
    const std::uint64_t before = next_;
    for (int patience = 0; patience < 3 && next_ < before + 4 * kWindow;) {
      for (Process& one : compensations_) {
        one.announce(credit_);
        one.connect(credit_);
        answer(one, 10 * kWindow);
        one.monitor_hears = true;
        one.report(credit_);
      }
      monitor_.take(10 * kWindow);
      monitor_.report(credit_);
      if (send(kWindow / 2) > 0) continue;
      ++patience;
      static_cast<void>(credit_.leave_behind(kFirst));
      static_cast<void>(credit_.let_unconnected_join(kFirst));
    }
    return next_ - before;
  }

  [[nodiscard]] bool all_comes_to_the_monitor() {
    sent_when_all_goes_well();
    return monitor_.taken() + kWindow >= next_;
  }

 private:
  std::size_t draw(std::size_t below) { return random_() % below; }
  [[nodiscard]] std::ptrdiff_t alive() const {
    return std::count_if(compensations_.begin(), compensations_.end(),
                         [](const Process& one) { return one.is_alive; });
  }
  void start() {
    compensations_.emplace_back("compensation", static_cast<std::uint8_t>(compensations_.size()));
  }
  std::uint64_t send(std::uint64_t at_most) {
    std::uint64_t sent = 0;
    for (; sent < at_most && credit_.missing_consumers().empty() && credit_.has_room(kFirst);
         ++sent) {
      credit_.note_sent(next_);
      for (Process& one : compensations_) one.deliver(next_);
      ++next_;
    }
    return sent;
  }
  void answer(Process& one, std::size_t at_most) {
    for (const std::uint64_t sequence : one.take(at_most)) {
      if (one.monitor_hears) monitor_.deliver(sequence);
    }
  }

  std::mt19937_64 random_;
  ReplayCredit credit_{{"compensation", "allan_monitor"}};
  std::uint64_t next_ = kFirst;
  Process monitor_{"allan_monitor", 255};
  std::deque<Process> compensations_;
};

TEST(ReplayCredit, NeverStandsStillForGoodAndNeverRunsAway) {
  for (std::uint64_t seed = 1; seed <= 1000 && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE(seed);
    World world(seed);
    for (int step = 0; step < 400; ++step) world.happen();
    EXPECT_GE(world.sent_when_all_goes_well(), 4 * kWindow) << "stands still";
    EXPECT_TRUE(world.all_comes_to_the_monitor());
  }
}

}  // namespace
}  // namespace zerodrift::service
