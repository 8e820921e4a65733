// SPDX-License-Identifier: Apache-2.0
// An Ethernet switch that treats frames as badly as it is told to: it loses, delays, reorders them,
// and cuts links. What happens to the nth frame from one port to another is a function of the seed,
// the two ports and n alone: no frame of another link changes it.
//
// Time is an argument, on any clock that doesn't step. One thread at a time.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <queue>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/twin/random.h"

namespace zerodrift::hosts_test {

using std::chrono::nanoseconds;

// Of each link in each direction.
struct LinkConditions {
  double loss = 0.0;  // probability that a frame is dropped
  // A frame's delay is uniform within delay - jitter .. delay + jitter, so that frames overtake
  // each other where the jitter is above half their distance.
  nanoseconds delay{0};
  nanoseconds jitter{0};
  double reorder = 0.0;  // probability that a frame is held back, by so much more:
  nanoseconds reorder_by{0};
  // Nothing when usable, else one line that names the wrong field.
  [[nodiscard]] std::optional<std::string> validate() const;
};

class Hub {
 public:
  using Port = std::size_t;
  using Frame = std::vector<std::uint8_t>;
  struct Delivery {
    Port port = 0;
    Frame frame{};
  };
  // Each copy of a frame to each port it goes to is accepted once and then ends as one of the
  // others.
  struct Counts {
    std::uint64_t accepted = 0;
    std::uint64_t delivered = 0;
    std::uint64_t lost = 0;       // by chance
    std::uint64_t cut = 0;        // by a cut link or a pulled plug
    std::uint64_t held_back = 0;  // of the delivered and those under way: reordered on purpose
    std::uint64_t malformed = 0;  // shorter than an Ethernet header; not among the accepted
  };

  Hub(std::size_t ports, std::uint64_t seed);

  // Of all links, from the next frame on. Throws std::invalid_argument where they don't validate().
  void set_conditions(const LinkConditions& conditions);
  // No frame passes between a port of `a` and one of `b` any more, nor one that is under way.
  void cut(const std::vector<Port>& a, const std::vector<Port>& b);
  void heal();             // undoes every cut()
  void unplug(Port port);  // for good

  // A frame that came in. O(log n) of those under way, for each port it goes to: the one behind
  // which its destination was seen, else all others.
  void accept(Port from, std::span<const std::uint8_t> frame, nanoseconds now);
  // When the next frame is due; none: nothing is under way.
  [[nodiscard]] std::optional<nanoseconds> next_due() const;
  // A frame that is due, in the order of being due.
  [[nodiscard]] std::optional<Delivery> take_due(nanoseconds now);

  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }
  [[nodiscard]] std::size_t under_way() const noexcept { return queue_.size(); }

 private:
  using Address = std::array<std::uint8_t, 6>;
  struct Link {
    twin::NoiseStream fate;
    std::uint64_t frames = 0;
  };
  struct UnderWay {
    nanoseconds due{0};
    std::uint64_t order = 0;  // of acceptance: equal times keep their order
    Port from = 0;
    Port to = 0;
    Frame frame{};
  };
  struct Later {
    bool operator()(const UnderWay& a, const UnderWay& b) const {
      return a.due != b.due ? a.due > b.due : a.order > b.order;
    }
  };

  void send(Port from, Port to, std::span<const std::uint8_t> frame, nanoseconds now);
  [[nodiscard]] bool connected(Port from, Port to) const;

  std::size_t ports_;
  std::vector<Link> links_;  // from * ports + to
  LinkConditions conditions_;
  std::set<std::pair<Port, Port>> cuts_;
  std::set<Port> unplugged_;
  std::map<Address, Port> seen_;
  std::priority_queue<UnderWay, std::vector<UnderWay>, Later> queue_;
  std::uint64_t order_ = 0;
  Counts counts_;
};

}  // namespace zerodrift::hosts_test
