// SPDX-License-Identifier: Apache-2.0
// What waits for one client, bounded. A client that is too slow loses the oldest samples first;
// state is never lost, and where that doesn't fit either the client has to go.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <optional>

#include "common/web/frame.h"

namespace zerodrift::web {

struct OutgoingLimits {
  std::size_t sample_frames = 1024;
  std::size_t sample_bytes = std::size_t{4} << 20U;
  std::size_t state_frames = 8192;
  std::size_t state_bytes = std::size_t{32} << 20U;  // one frame may be longer
};

class OutgoingQueue {
 public:
  explicit OutgoingQueue(const OutgoingLimits& limits) : limits_(limits) {}

  enum class Pushed : std::uint8_t { kWaits, kTooMuchState };
  // In order, but that a frame takes the place of the one that it replaces. O(log waiting).
  Pushed push(Frame frame);
  std::optional<Frame> pop();

  [[nodiscard]] bool empty() const { return waiting_.empty(); }
  [[nodiscard]] std::size_t frames() const { return waiting_.size(); }
  [[nodiscard]] std::size_t bytes() const { return samples_.bytes + states_.bytes; }
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }
  // Of the bound that is nearest, 0..1.
  [[nodiscard]] double fill() const;

 private:
  using Waiting = std::list<Frame>;
  struct Held {
    std::size_t frames = 0;
    std::size_t bytes = 0;
  };
  [[nodiscard]] Held& held(const Frame& frame);
  void take_out(Waiting::iterator at);
  void drop_oldest_samples();

  OutgoingLimits limits_;
  Waiting waiting_;
  std::deque<Waiting::iterator> waiting_samples_;  // oldest first
  std::map<std::uint64_t, Waiting::iterator> replaceable_;
  Held samples_;
  Held states_;
  std::uint64_t dropped_ = 0;
};

}  // namespace zerodrift::web
