// SPDX-License-Identifier: Apache-2.0
// Which of several instances of a service writes the answers of one gyro.
//
// Every instance answers every raw sample; one is active and writes, the others hold their answers
// back and listen. Where the active one stays silent for longer than it may (late answers that go
// on coming, as after an interruption of the network, are no silence), a standby writes what
// it holds, from the first sample that it has not heard the active one write, and is the active one
// from then on. The topic's exclusive ownership makes that safe: a standby's writer is stronger
// than the active one's (stronger_than), so that the first sample it writes is heard at once, and
// whatever the one before still writes (it was stopped, not dead; it was late, not silent) is
// ignored by every reader. The one before hears the stronger one, and is a standby. No reader has
// to notice a silence first, so the topic needs no deadline.
//
// What may not have arrived, or not everywhere, when the active one fell silent is written again:
// the last kRepeated. A reader that takes a (sequence number, sensor time) once, as dds::Reader
// does, sees every sample exactly once.
//
// Time is an argument: nanoseconds of the host's monotonic clock. One thread at a time.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "common/core/ring_buffer.h"
#include "common/service/instance_sync.h"
#include "idl/dds/compensated_rate.h"

namespace zerodrift::service {

// The strength of a writer that nobody was heard before: the later it starts, the stronger, so that
// it is heard although readers still listen to one that died (for the participants' lease). Counts
// 16 a second from 2026 on, and from 0 again after 8 years; `rank` 0..15 decides between those that
// start within the same second.
[[nodiscard]] std::uint32_t first_strength(std::int64_t unix_time_ns, std::uint32_t rank) noexcept;

// A strength above the given one; of two instances that find one at the same time, each its own.
constexpr std::uint32_t stronger_than(std::uint32_t strength, std::uint32_t instance) noexcept {
  return (strength / kMostInstances + 1) * kMostInstances + instance % kMostInstances;
}

class HotStandby {
 public:
  enum class Role : std::uint8_t { kActive, kStandby };
  // What a standby's answers are worth.
  enum class Health : std::uint8_t {
    kInSync,  // its state is the active one's
    kBehind,  // it has not caught up yet: better than nothing
    kUnwell,  // its learner hangs
  };

  using Duration = std::chrono::nanoseconds;
  // An answer that a standby holds has to be heard from the active one within this. Shorter than a
  // reader's deadline; longer than a busy machine delays one process beside another. Being wrong
  // costs a change of roles and nothing else.
  static constexpr Duration kSilence = std::chrono::milliseconds(5);
  static constexpr Duration kSilenceBehind = std::chrono::milliseconds(20);
  // Later than whoever is well, on whatever network: the last resort.
  static constexpr Duration kSilenceUnwell = std::chrono::milliseconds(250);
  // On a network the active one's answers come later: a standby waits kLagFactor times as long as
  // the latest came in the last seconds, where that is longer than the above, up to
  // kSilenceLongest, the deadline of the topic. Twice: the longest of a few hundred was not the
  // longest there will be.
  static constexpr std::int64_t kLagFactor = 2;
  static constexpr Duration kSilenceLongest = std::chrono::milliseconds(100);
  // Of records and simulations, which wait for their consumers: these may be apart by the window
  // they are given, and nobody counts on the time.
  static constexpr Duration kSilencePaced = std::chrono::seconds(1);
  // After an interruption of the network everybody is on the way through what comes at once, and
  // not from the same sample on: for so long after a sample, or another's answer, that came late by
  // kSilenceLongest.
  static constexpr Duration kSilenceLate = std::chrono::seconds(1);
  // For an instance that never heard another: discovery takes that long at most, but for rare
  // outliers, in which two are active for a moment.
  static constexpr Duration kDiscovery = std::chrono::seconds(2);
  // Longer than the middleware takes to repair a loss: kRepairs times as long as the latest answer
  // came in the last seconds, where that is longer.
  static constexpr Duration kRepeated = std::chrono::milliseconds(20);
  static constexpr std::int64_t kRepairs = 4;
  // Samples held: kDiscovery at 2 kHz, and more.
  static constexpr std::size_t kHeld = 8192;

  // Of a service that is alone: active, whatever comes.
  explicit HotStandby(std::uint32_t strength) : strength_(strength) {}
  // One of several: a standby at first.
  HotStandby(std::uint32_t instance, std::uint32_t strength, std::int64_t now_ns);

  [[nodiscard]] Role role() const noexcept { return role_; }
  [[nodiscard]] bool is_alone() const noexcept { return !instance_; }
  [[nodiscard]] Health health() const noexcept {
    if (unwell_) return Health::kUnwell;
    return in_sync_ ? Health::kInSync : Health::kBehind;
  }
  // Of the writer that is written with, and of the one that should be: a standby's is stronger than
  // any that was heard.
  [[nodiscard]] std::uint32_t strength() const noexcept { return strength_; }
  [[nodiscard]] std::uint32_t wanted_strength() const noexcept;
  void set_strength(std::uint32_t strength) noexcept { strength_ = strength; }

  // An answer, in the order of answering. True: to be written now; else it is held.
  [[nodiscard]] bool take(const msg::CompensatedRate& answer, std::int64_t now_ns) noexcept;
  // Another instance's sample, as its reader heard it.
  void hear(const msg::CompensatedRate& other, std::int64_t now_ns) noexcept;
  // This process stood still until now: what others wrote meanwhile is on its way in, and is waited
  // for.
  void woke(std::int64_t now_ns) noexcept { listening_since_ns_ = now_ns; }
  // True where the active one has been silent for too long: write_held(), and be the active one.
  [[nodiscard]] bool must_take_over(std::int64_t now_ns) const noexcept;
  // Gives every answer to be written to `write(msg::CompensatedRate&)`, oldest first.
  template <typename Write>
  void take_over(std::int64_t now_ns, Write&& write) {
    role_ = Role::kActive;
    ++takeovers_;
    if (const std::size_t first = first_unheard(); first < held_.size())
      doubted_ = {held_[first].answer.sequence_number(), held_[first].since_ns};
    for (std::size_t i = first_to_write(now_ns); i < held_.size(); ++i) write(held_[i].answer);
  }
  // The learner hangs, or hangs no longer. An active instance steps back once for each time it
  // begins.
  void set_unwell(bool unwell, std::int64_t now_ns) noexcept;

  // A standby that hears another, and whose answers are not the other's: it needs the other's
  // state.
  [[nodiscard]] bool needs_state() const noexcept;
  // The active instance's state is in place: what was held is void, and answers from there on are
  // taken.
  void caught_up(std::int64_t now_ns) noexcept;

  struct Counts {
    std::uint64_t takeovers = 0;
    std::uint64_t step_backs = 0;
    std::uint64_t compared = 0;   // answers of another instance with the same sequence number
    std::uint64_t differing = 0;  // of these: not equal to the bit
    std::uint64_t unheard = 0;    // held answers that had to be dropped, written by nobody
  };
  [[nodiscard]] Counts counts() const noexcept {
    return {takeovers_, step_backs_, compared_, differing_, unheard_};
  }

 private:
  struct Held {
    msg::CompensatedRate answer;
    std::int64_t since_ns = 0;
  };
  void step_back(std::int64_t now_ns) noexcept;
  void compare(const msg::CompensatedRate& mine, const msg::CompensatedRate& other) noexcept;
  [[nodiscard]] bool begins_anew(const msg::CompensatedRate& other) const noexcept;
  void drop_run_before(const msg::CompensatedRate& other) noexcept;
  [[nodiscard]] bool was_heard(const msg::CompensatedRate& answer) const noexcept;
  [[nodiscard]] Duration patience(std::int64_t now_ns) const noexcept;
  [[nodiscard]] Duration usual_patience() const noexcept;  // of one that is in sync and in time
  void note_arrival(const msg::CompensatedRate& answer, std::int64_t now_ns) noexcept;
  // Index of the oldest held answer that was not heard: these are the newest, and few.
  [[nodiscard]] std::size_t first_unheard() const noexcept;
  void hear_weaker(std::uint64_t sequence, std::int64_t now_ns) noexcept;
  void note_lag(std::uint64_t sequence, std::int64_t lag_ns, std::int64_t now_ns) noexcept;
  [[nodiscard]] std::size_t first_to_write(std::int64_t now_ns) const noexcept;
  [[nodiscard]] bool is_silent(std::int64_t now_ns) const noexcept;

  // Differing answers in a row after which a standby asks for the state: a model that came late to
  // one of two instances is in force in both well before.
  static constexpr std::uint64_t kDifferingRun = 200;
  static constexpr std::size_t kEarly = 64;
  // The latest one is forgotten by half in 0.69 times so many answers.
  static constexpr std::int64_t kLagMemory = 1024;
  // Samples; many times a burst, which is at most what the topic keeps.
  static constexpr std::int64_t kAgeMemory = 16384;

  std::optional<std::uint32_t> instance_{};
  std::uint32_t strength_ = 0;
  Role role_ = Role::kActive;
  bool in_sync_ = false;
  bool unwell_ = false;
  bool paced_ = false;  // as the newest answer's clock says
  std::int64_t standby_since_ns_ = 0;
  std::uint32_t heard_strength_ = 0;
  std::optional<std::uint64_t> heard_to_{};  // newest sequence of another's, in this standby's time
  std::int64_t heard_publish_ns_ = 0;        // newest of its publish_time_ns; 0: not known
  std::int64_t heard_ns_ = 0;                // when another's was last heard
  std::int64_t listening_since_ns_ = 0;
  // What was answered last. An active one's too: another that relieves it, and is relieved in turn
  // before it came as far, leaves it to write again what readers did not take from it.
  core::RingBuffer<Held> held_{1};
  core::RingBuffer<msg::CompensatedRate> early_{1};  // heard before they were answered here
  std::int64_t lag_ns_ = 0;  // how much later than its own answers a standby heard the active one's
  // Since publishing, of the samples that come soonest. Between clocks of two computers, so that
  // only differences say anything.
  std::optional<std::int64_t> least_age_ns_{};
  std::int64_t late_until_ns_ = 0;
  // What an active one took over for want of; the other's answer to it, heard after all, says how
  // long it should have waited.
  struct Doubt {
    std::uint64_t sequence = 0;
    std::int64_t since_ns = 0;
  };
  std::optional<Doubt> doubted_{};
  // Answers up to this come from one that waited before it took over: their lag is not the
  // network's.
  std::uint64_t lag_from_ = 0;
  std::uint64_t newest_ = 0;  // answered
  std::uint64_t differing_run_ = 0;
  std::uint64_t takeovers_ = 0;
  std::uint64_t step_backs_ = 0;
  std::uint64_t compared_ = 0;
  std::uint64_t differing_ = 0;
  std::uint64_t unheard_ = 0;
};

}  // namespace zerodrift::service
