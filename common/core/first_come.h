// SPDX-License-Identifier: Apache-2.0
// One stream of numbered samples that several writers write, each in order and each to the bit the
// same: what a reader takes of it. The first of each sample is taken, whoever wrote it, and every
// other one is a repeat. A stream is one gyro's; a run is one life of the gyro's publisher, and its
// numbers say nothing about those of another run.
//
// Guaranteed: a sample of a run is taken at most once, within kSpan numbers of the run's newest and
// for the last kStretches stretches; a writer that lags further repeats nothing. A sample that no
// writer withheld is taken once. Samples come in the order in which any writer writes them, as long
// as each writer begins with a sample that this reader has been given already, or the next one.
// Time is not looked at: a run may be as short as it likes and may be repeated to the bit.
//
// A writer: anything that can be compared. No allocation, one thread.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>

namespace zerodrift::core {

template <typename Writer>
class FirstCome {
 public:
  static constexpr std::uint64_t kSpan = 4096;  // twice what a writer keeps for repairs
  static constexpr std::size_t kStretches = 8;
  static constexpr std::size_t kWriters = 16;

  // True: the sample is taken. `in_order` is false for one that its source sent after a later one.
  bool takes(std::uint64_t run, std::uint64_t sequence, const Writer& writer,
             bool in_order = true) noexcept {
    ++now_;
    Place& place = place_of(writer);
    const bool went_back = place.run == run && sequence < place.last &&
                           place.last - sequence >= kSpan;  // as its source's numbers did
    place.run = run;
    place.last = sequence;
    Stretch* into = nullptr;     // the newest that has room for the number
    Stretch* current = nullptr;  // of this run: the one that took a sample last
    for (Stretch& stretch : stretches_) {
      if (stretch.taken == 0 || stretch.run != run) continue;
      if (current == nullptr || stretch.taken > current->taken) current = &stretch;
      if (!stretch.covers(sequence)) continue;
      if (stretch.has(sequence)) return false;
      if (into == nullptr || stretch.taken > into->taken) into = &stretch;
    }
    if (into == nullptr) {
      // Far from all that was taken: numbers that jumped ahead, or back, or those of a writer that
      // is on its way through what was taken from others long ago.
      if (current != nullptr && sequence < current->newest && !went_back) return false;
      begin(run, sequence, writer, current != nullptr && went_back);
      return true;
    }
    // What others wrote before this reader began is not part of what it is owed.
    if (into->is_first && in_order && sequence < into->first && into->opener != writer)
      return false;
    into->mark(sequence);
    into->taken = now_;
    if (into->went_back) forget_before(*into);
    return true;
  }

 private:
  // Numbers that belong together; far from those of the other stretches of its run.
  struct Stretch {
    std::uint64_t run = 0;
    std::uint64_t newest = 0;
    std::uint64_t first = 0;
    std::uint64_t taken = 0;  // when it took a sample last; 0: free
    bool is_first = false;    // the very first that the reader took
    bool went_back = false;  // its numbers are below those taken before, until a second confirms it
    Writer opener{};
    std::bitset<kSpan> seen{};  // by number modulo kSpan, of (newest - kSpan, newest]

    [[nodiscard]] bool covers(std::uint64_t sequence) const noexcept {
      return sequence > newest ? sequence - newest <= kSpan : newest - sequence < kSpan;
    }
    [[nodiscard]] bool has(std::uint64_t sequence) const noexcept {
      return sequence <= newest && seen[sequence % kSpan];
    }
    void mark(std::uint64_t sequence) noexcept {
      for (; newest < sequence; seen[newest % kSpan] = false) ++newest;
      seen[sequence % kSpan] = true;
    }
  };
  struct Place {
    Writer writer{};
    std::uint64_t run = 0;
    std::uint64_t last = 0;
    std::uint64_t used = 0;
  };

  void begin(std::uint64_t run, std::uint64_t sequence, const Writer& writer,
             bool went_back) noexcept {
    Stretch* oldest = &stretches_[0];
    for (Stretch& stretch : stretches_) {
      if (stretch.taken < oldest->taken) oldest = &stretch;
    }
    *oldest = {.run = run,
               .newest = sequence,
               .first = sequence,
               .taken = now_,
               .is_first = now_ == 1,
               .went_back = went_back,
               .opener = writer,
               .seen = {}};
    oldest->mark(sequence);
  }
  void forget_before(Stretch& now) noexcept {
    now.went_back = false;
    for (Stretch& stretch : stretches_) {
      if (&stretch != &now && stretch.run == now.run) stretch.taken = 0;
    }
  }
  Place& place_of(const Writer& writer) noexcept {
    Place* oldest = &places_[0];
    for (Place& place : places_) {
      if (place.used != 0 && place.writer == writer) {
        place.used = now_;
        return place;
      }
      if (place.used < oldest->used) oldest = &place;
    }
    *oldest = {.writer = writer, .run = 0, .last = 0, .used = now_};
    return *oldest;
  }

  std::array<Stretch, kStretches> stretches_{};
  std::array<Place, kWriters> places_{};
  std::uint64_t now_ = 0;  // counts samples
};

}  // namespace zerodrift::core
