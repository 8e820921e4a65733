// SPDX-License-Identifier: Apache-2.0
// How far one datagram may move what an endpoint knows of another's numbers.
//
// Fast DDS 2.9.1 counts one by one from the last number that it knows to the one it is given: 0.2
// us each, with the reader locked (Debian's has assertions that ask the kernel for the thread's
// id). One forged HEARTBEAT of 2^40 stops the data path for days, and one count of 2^32 - 1 makes a
// reader deaf to all genuine ones. So a stream may skip as many numbers within a second as it can
// lose, and as many more as it writes in the time that it was silent for before: a writer that was
// cut off for ten hours is received at once.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>

#include "common/dds/rtps_message.h"

namespace zerodrift::dds {

// One number that grows.
class NumberCourse {
 public:
  using Time = std::chrono::steady_clock::time_point;
  // All that 16 gyros at 2 kHz write by one writer: 8 ms of the middleware's work.
  static constexpr std::uint64_t kMostSkipped = 1U << 15U;
  static constexpr std::chrono::seconds kSecond{1};

  // False: a leap; nothing is noted then. The first number is taken as it is.
  bool takes(std::uint64_t number, Time now) noexcept;

 private:
  void begin_second(Time now) noexcept;

  std::uint64_t newest_ = 0;
  std::uint64_t may_skip_ = kMostSkipped;  // in what is left of the second that began then
  std::uint64_t steps_ = 0;                // in it
  std::uint64_t most_steps_ = 0;           // in any second so far
  Time began_{};
  Time received_at_{};
  bool has_begun_ = false;
};

// The endpoints that discovery knows: of others no reader and no writer takes anything. Bounded; a
// place is kept until its endpoint is gone, so that nobody can drive it out.
class SequenceWatch {
 public:
  using Time = NumberCourse::Time;
  using Prefix = rtps_message::Prefix;

  void expect_participant(const Prefix& prefix);  // and its endpoints of discovery
  void expect(const Prefix& prefix, std::uint32_t entity);
  void forget(const Prefix& prefix, std::uint32_t entity) { endpoints_.erase({prefix, entity}); }
  void forget_participant(const Prefix& prefix);

  // False: what `prefix` states is a leap. O(log endpoints).
  bool takes(const Prefix& prefix, const rtps_message::Statement& statement, Time now) noexcept;

 private:
  static constexpr std::size_t kMostEndpoints = 8192;
  static constexpr std::size_t kMostPeers = 8;  // of an endpoint, among ours
  struct Key {
    Prefix prefix{};
    std::uint32_t entity = 0;
    auto operator<=>(const Key&) const = default;
  };
  struct Peer {
    std::uint32_t entity = 0;  // ours; 0: free, or anybody's
    NumberCourse acknowledgements{};
    NumberCourse missing_fragments{};
    bool had_long_gap = false;
  };
  struct Endpoint {
    NumberCourse samples{};
    NumberCourse heartbeats{};
    std::array<Peer, kMostPeers> peers{};
    std::size_t met = 0;
  };
  static Peer* peer_of(Endpoint& endpoint, std::uint32_t entity) noexcept;
  static bool may_be_long(Endpoint& endpoint, const rtps_message::Statement& gap) noexcept;

  std::map<Key, Endpoint> endpoints_;
};

}  // namespace zerodrift::dds
