// SPDX-License-Identifier: Apache-2.0
#include "tests/hosts/hub.h"

#include <algorithm>
#include <stdexcept>

namespace zerodrift::hosts_test {
namespace {

constexpr std::size_t kHeader = 14;       // destination, source, type
constexpr std::uint64_t kDraws = 3;       // random numbers a frame
constexpr std::uint8_t kGroupBit = 0x01;  // of a destination's first byte: multicast and broadcast

nanoseconds scaled(nanoseconds span, double factor) {
  return nanoseconds{static_cast<std::int64_t>(static_cast<double>(span.count()) * factor)};
}

bool is_probability(double p) {
  return p >= 0.0 && p <= 1.0;
}

}  // namespace

std::optional<std::string> LinkConditions::validate() const {
  if (!is_probability(loss)) return "loss: expected a probability, 0 to 1";
  if (!is_probability(reorder)) return "reorder: expected a probability, 0 to 1";
  if (delay < nanoseconds{0}) return "delay: expected 0 or more";
  if (jitter < nanoseconds{0} || jitter > delay) return "jitter: expected 0 to the delay";
  if (reorder_by < nanoseconds{0}) return "reorder_by: expected 0 or more";
  return std::nullopt;
}

Hub::Hub(std::size_t ports, std::uint64_t seed) : ports_(ports) {
  const twin::NoiseStream all(seed, "hub");
  for (std::uint64_t link = 0; link < ports * ports; ++link)
    links_.push_back({.fate = all.substream(link)});
}

void Hub::set_conditions(const LinkConditions& conditions) {
  if (const auto problem = conditions.validate()) throw std::invalid_argument(*problem);
  conditions_ = conditions;
}

void Hub::cut(const std::vector<Port>& a, const std::vector<Port>& b) {
  for (const Port one : a) {
    for (const Port other : b) {
      cuts_.insert({one, other});
      cuts_.insert({other, one});
    }
  }
}

void Hub::heal() {
  cuts_.clear();
}

void Hub::unplug(Port port) {
  unplugged_.insert(port);
}

bool Hub::connected(Port from, Port to) const {
  return !unplugged_.contains(from) && !unplugged_.contains(to) && !cuts_.contains({from, to});
}

void Hub::accept(Port from, std::span<const std::uint8_t> frame, nanoseconds now) {
  if (frame.size() < kHeader) {
    ++counts_.malformed;
    return;
  }
  Address destination{};
  Address source{};
  std::copy_n(frame.begin(), destination.size(), destination.begin());
  std::copy_n(frame.begin() + destination.size(), source.size(), source.begin());
  seen_[source] = from;
  const bool is_group = (destination[0] & kGroupBit) != 0;
  const auto known = is_group ? seen_.end() : seen_.find(destination);
  for (Port to = 0; to < ports_; ++to) {
    if (to != from && (known == seen_.end() || known->second == to)) send(from, to, frame, now);
  }
}

void Hub::send(Port from, Port to, std::span<const std::uint8_t> frame, nanoseconds now) {
  ++counts_.accepted;
  Link& link = links_[from * ports_ + to];
  const std::uint64_t draw = kDraws * link.frames++;
  if (!connected(from, to)) {
    ++counts_.cut;
    return;
  }
  if (link.fate.uniform(draw) < conditions_.loss) {
    ++counts_.lost;
    return;
  }
  nanoseconds due =
      now + conditions_.delay + scaled(conditions_.jitter, 2.0 * link.fate.uniform(draw + 1) - 1.0);
  if (link.fate.uniform(draw + 2) < conditions_.reorder) {
    due += conditions_.reorder_by;
    ++counts_.held_back;
  }
  queue_.push({due, order_++, from, to, Frame(frame.begin(), frame.end())});
}

std::optional<nanoseconds> Hub::next_due() const {
  if (queue_.empty()) return std::nullopt;
  return queue_.top().due;
}

std::optional<Hub::Delivery> Hub::take_due(nanoseconds now) {
  while (!queue_.empty() && queue_.top().due <= now) {
    UnderWay next = queue_.top();
    queue_.pop();
    if (connected(next.from, next.to)) {
      ++counts_.delivered;
      return Delivery{next.to, std::move(next.frame)};
    }
    ++counts_.cut;
  }
  return std::nullopt;
}

}  // namespace zerodrift::hosts_test
