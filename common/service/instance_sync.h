// SPDX-License-Identifier: Apache-2.0
// Several instances of a service answer every raw sample of a gyro, equal inputs to the same bits.
// Which of them write what they answer.
//
// Every instance that is in sync writes every answer at once, and readers take each answer once,
// whoever wrote it first (core/first_come.h). So a death costs nothing, and nobody has to notice
// it. One that is not in sync holds its answers back: it has just started, or 200 of its answers in
// a row differed from a senior's (one, after a command that changes the leader's model), or follow
// another publisher of the same gyro. It asks an instance that is in sync, which is any that it
// receives from, for its state, and is in sync from there on.
//
// Of two that differ, the one whose line of answers is longer by far (of another power of two, and
// 20 s at 200 Hz at least) is the senior, since it has learned from more; else the one with the
// lower number. A line goes on from instance to instance with the state.
//
// One that is not in sync and receives from nobody for 2 s is the only one, and so in sync; for
// 100 ms, where it was in sync and differed: its line is the best there is.
//
// What readers don't tell apart needs one writer: the leader, which is the lowest instance received
// within 100 ms. It writes ROS 2's topic and takes the commands that change a model; being wrong
// about it costs repeated messages on ROS 2's topic.
//
// Silence is counted in time in which this instance itself answers, a step between two answers as
// 25 ms at most: a stream that pauses and a process that stood still say nothing about others.
// Time is an argument, nanoseconds of the host's monotonic clock. One thread at a time. Nothing
// allocates after construction.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace zerodrift::service {

inline constexpr std::uint32_t kMostInstances = 16;  // numbered 0..15

// An answer, as far as instances compare theirs.
struct AnswerMark {
  std::uint32_t instance = 0;
  std::uint32_t answered = 0;  // by this line of answers; the largest number stands for more
  std::uint64_t run = 0;       // of the raw samples' publisher
  std::uint64_t sequence = 0;
  std::uint64_t digest = 0;  // of all that was computed

  friend bool operator==(const AnswerMark&, const AnswerMark&) = default;
};

class InstanceSync {
 public:
  enum class Health : std::uint8_t {
    kInSync,
    kBehind,  // it has not caught up yet
    kHangs,   // its learner hangs
  };

  static constexpr std::chrono::nanoseconds kNobodyElse = std::chrono::seconds(2);
  static constexpr std::chrono::nanoseconds kSilentLeader = std::chrono::milliseconds(100);
  static constexpr std::chrono::nanoseconds kLongestStep = kSilentLeader / 4;
  static constexpr std::chrono::nanoseconds kLongestTick = std::chrono::milliseconds(250);
  // A model that came late to one of two instances is in force in both well before.
  static constexpr std::uint64_t kDifferingRun = 200;
  static constexpr std::uint32_t kShortLine = 4096;  // answers; not distinguished below

  // Of a service that is alone: it writes, whatever comes.
  InstanceSync() = default;
  // One of several: behind, at first.
  explicit InstanceSync(std::uint32_t instance);

  [[nodiscard]] bool is_alone() const noexcept { return !instance_; }
  [[nodiscard]] Health health() const noexcept {
    if (hangs_) return Health::kHangs;
    return in_sync_ ? Health::kInSync : Health::kBehind;
  }
  // Whether it is the one that writes what only one may write.
  [[nodiscard]] bool leads() const noexcept { return is_alone() || leads_; }
  // What an answer of this instance says of its line; 0 while its learner hangs.
  [[nodiscard]] std::uint32_t stated_answered(std::uint64_t answered) const noexcept;

  // An answer of this instance's. True: it is written now; else it is held back.
  [[nodiscard]] bool note(const AnswerMark& mine, std::int64_t now_ns) noexcept;
  // From time to time: it counts the time in which nobody repeats an answer of this instance
  // although no more come.
  void tick(std::int64_t now_ns) noexcept;
  // Whether what it answers is written.
  [[nodiscard]] bool may_write() const noexcept;
  // The leader was given a command that changes its model: who differs now won't agree again.
  void expect_change() noexcept { expects_change_ = true; }
  // Another instance's answer, as its reader received it.
  void receive(const AnswerMark& other) noexcept;
  void set_hangs(bool hangs) noexcept;

  // Whom it needs the state of: it is behind, and receives from somebody.
  [[nodiscard]] std::optional<std::uint32_t> giver() const noexcept;
  // The publisher that one which is behind has to follow: that of the instances in sync.
  [[nodiscard]] std::optional<std::uint64_t> wanted_run() const noexcept;
  // A giver's state is in place.
  void caught_up() noexcept;
  // Whether it was received from anybody, or a line that is received answered it before: what is
  // held back needs not be written. A line of n answers has the last n of its run at most; one that
  // hangs doesn't say how many it has, and is believed to have all.
  [[nodiscard]] bool was_received(std::uint64_t run, std::uint64_t sequence) const noexcept;

  struct Counts {
    std::uint64_t takeovers = 0;   // it became the leader
    std::uint64_t step_backs = 0;  // it was in sync, and is behind
    std::uint64_t compared = 0;    // in sync: answers of another instance with the same number
    std::uint64_t differing = 0;   // of these: not equal to the bit
  };
  [[nodiscard]] Counts counts() const noexcept { return counts_; }

 private:
  struct Peer {
    bool received = false;
    std::int64_t received_ns = 0;  // on this instance's answering time
    AnswerMark newest{};
    std::uint64_t differing = 0;  // in a row
    std::uint64_t elsewhere = 0;  // in a row, of a publisher that this instance doesn't follow
  };
  [[nodiscard]] static bool is_senior(const AnswerMark& a, const AnswerMark& b) noexcept;
  [[nodiscard]] bool is_silent(const Peer& peer, std::chrono::nanoseconds since) const noexcept {
    return !peer.received || answering_ns_ - peer.received_ns >= since.count();
  }
  [[nodiscard]] bool receives_nobody() const noexcept;
  [[nodiscard]] bool would_lead() const noexcept;
  void judge() noexcept;
  void compare(const AnswerMark& mine, const AnswerMark& other) noexcept;
  void fall_behind(bool keeps_line) noexcept;

  static constexpr std::size_t kRemembered = 4096;
  static constexpr std::size_t kEarly = 256;

  std::optional<std::uint32_t> instance_{};
  bool in_sync_ = false;
  bool keeps_line_ = false;  // it was in sync, and its line goes on while it is behind
  bool hangs_ = false;
  bool leads_ = false;
  bool expects_change_ = false;    // until it falls behind
  std::int64_t noted_ns_ = 0;      // when it answered last
  std::int64_t answering_ns_ = 0;  // how long it has been answering
  std::optional<AnswerMark> newest_{};
  AnswerMark before_{};  // the newest of the run before
  std::array<Peer, kMostInstances> peers_{};
  std::vector<AnswerMark> own_{};    // by sequence number
  std::vector<AnswerMark> early_{};  // received before they were answered here, by sequence number
  Counts counts_{};
};

}  // namespace zerodrift::service
