// SPDX-License-Identifier: Apache-2.0
// Brings three streams that arrive in any order into the one order that sensor time dictates, so
// that live and offline runs compute the same bits.
#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/core/ring_buffer.h"
#include "common/core/samples.h"
#include "common/core/state_archive.h"

namespace zerodrift::compensation {

// How a raw sample is taken in. Every accepted sample is answered exactly once.
enum class Admission : std::uint8_t {
  kInOrder,
  kLate,  // an earlier sequence than the newest, not answered before; or one too far ahead to be
          // believed
  kDuplicate,  // answered already: not answered again
  kTooOld,     // so far behind that nobody knows whether it was answered
  kQueueFull,  // the caller must not let this happen: drain first
};

// Remembers which of the last 4096 sequence numbers were seen. A number farther off than that is
// doubted: one corrupt number must not make all that follow too old. It is believed when the next
// one follows it.
class SequenceWindow {
 public:
  Admission admit(std::uint64_t sequence) noexcept;
  void restart() noexcept { *this = {}; }
  [[nodiscard]] std::uint64_t missing() const noexcept { return missing_; }

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) {
    archive(doubted_, seen_, first_, newest_, missing_, started_);
  }

 private:
  static constexpr std::size_t kSpan = 4096;
  Admission jump_to(std::uint64_t sequence) noexcept;

  std::optional<std::uint64_t> doubted_;  // far from the newest, not yet confirmed
  std::bitset<kSpan> seen_;
  std::uint64_t first_ = 0;
  std::uint64_t newest_ = 0;
  // Sequence numbers since the first that were not seen so far; of counts that ended
  // (sequence_gap.h) those that were lost in each.
  std::uint64_t missing_ = 0;
  bool started_ = false;
};

// How far a stream has spoken. A stream that went back by more than core::kLargestStep is believed
// after two readings, so that one wild stamp neither ends the waiting for good nor starts it anew.
class StreamProgress {
 public:
  void advance(core::SensorTime time) noexcept;
  [[nodiscard]] core::SensorTime spoken_to() const noexcept { return spoken_to_; }

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) { archive(spoken_to_, previous_); }

 private:
  core::SensorTime spoken_to_{core::kNever};
  core::SensorTime previous_{core::kNever};
};

// A reading that waits for its time. `probe` indexes the probes the features need.
struct PendingTemperature {
  std::size_t probe = 0;
  core::SensorTime time{0};
  double temperature_degc = 0.0;
  bool measured = false;

  void carry(core::StateArchive& archive) {
    std::uint64_t index = probe;
    archive(index, time, temperature_degc, measured);
    probe = static_cast<std::size_t>(index);
  }
};

// Readings of the needed probes, handed on in time order once a rate sample's time has passed them.
// Temperatures up to t are known to be complete when every live probe has spoken beyond t.
class TemperatureQueue {
 public:
  TemperatureQueue(std::size_t probes, std::size_t capacity);

  // False when full: the oldest reading is dropped to make room (a temperature, never a rate
  // sample).
  bool push(const PendingTemperature& reading) noexcept;

  // True when no reading stamped <= time can still come from a probe that is not absent.
  [[nodiscard]] bool complete_to(core::SensorTime time) const noexcept;

  // The next reading stamped <= time, oldest first; ties in order of probe.
  std::optional<PendingTemperature> pop_until(core::SensorTime time) noexcept;

  // The owner gave up waiting for the probes that hold things up; one that speaks again is waited
  // for again.
  void give_up_waiting(core::SensorTime time) noexcept;
  // Whoever measured it left: what is there counts, nothing more is waited for. Who measures it
  // again begins anew.
  void end(std::size_t probe) noexcept;

  // How far a probe has spoken; kNever before.
  [[nodiscard]] core::SensorTime spoken_to(std::size_t probe) const noexcept {
    return probes_[probe].progress.spoken_to();
  }

  void restart() noexcept;
  // A rate came: what is measured from now on is of the same run or of the next one.
  void note_rate() noexcept {
    for (Probe& probe : probes_) probe.early = false;
  }
  // The rates began anew. Temperatures of the new run may have come before its first rate, all of
  // them where the run is short, so only those of probes that were ended before are dropped.
  void restart_ended() noexcept;

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) {
    for (std::size_t p = 0; p < probes_.size(); ++p) {
      archive(probes_[p].readings, probes_[p].progress, probes_[p].absent, probes_[p].ended,
              probes_[p].early);
      for (std::size_t i = 0; i < probes_[p].readings.size(); ++i)
        archive.require(probes_[p].readings[i].probe == p);
    }
  }

 private:
  struct Probe {
    core::RingBuffer<PendingTemperature> readings;
    StreamProgress progress;
    bool absent = false;
    bool ended = false;  // and not measured since; absent too
    bool early = false;  // began anew, and no rate came since
    void clear() noexcept {
      readings.clear();
      progress = {};
      absent = ended = false;
    }
  };
  std::vector<Probe> probes_;
};

// References by time: the newest at or before a sample.
class ReferenceQueue {
 public:
  explicit ReferenceQueue(std::size_t capacity) : queue_(capacity) {}

  void push(const core::RateReferenceSample& reference) noexcept;
  // A record's reference comes with every sample, a navigation filter's feedback at a steady pace:
  // they are waited for; a rate table's is not.
  [[nodiscard]] bool complete_to(core::SensorTime time) const noexcept;
  // The newest reference at or before `time`, if not older than `longest_age`.
  [[nodiscard]] const core::RateReferenceSample* at(core::SensorTime time,
                                                    core::SensorTime longest_age) noexcept;
  void give_up_waiting() noexcept { expected_ = false; }
  // As TemperatureQueue::end() and restart_ended().
  void end() noexcept {
    expected_ = false;
    ended_ = true;
  }
  void restart_ended() noexcept;
  // Waited for before the first has come.
  void expect() noexcept { expected_ = true; }
  [[nodiscard]] core::SensorTime spoken_to() const noexcept { return progress_.spoken_to(); }
  void restart() noexcept;

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) {
    archive(queue_, newest_due_, progress_, expected_, ended_);
  }

 private:
  core::RingBuffer<core::RateReferenceSample> queue_;
  std::optional<core::RateReferenceSample> newest_due_;
  StreamProgress progress_;
  bool expected_ = false;
  bool ended_ = false;  // and nothing has come since
};

}  // namespace zerodrift::compensation
