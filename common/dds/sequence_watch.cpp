// SPDX-License-Identifier: Apache-2.0
#include "common/dds/sequence_watch.h"

#include <algorithm>
#include <utility>

namespace zerodrift::dds {
namespace {

using rtps_message::Statement;

// Writers and readers of discovery, liveliness and types (RTPS 2.3, 9.3.1.3; DDS-XTypes 1.3,
// 7.6.3.3.3), which every participant may have.
constexpr std::array<std::uint32_t, 12> kBuiltin{0x000100c2, 0x000100c7, 0x000003c2, 0x000003c7,
                                                 0x000004c2, 0x000004c7, 0x000200c2, 0x000200c7,
                                                 0x000300c3, 0x000300c4, 0x000301c3, 0x000301c4};

// What a stream loses of each four numbers while it is received: three.
constexpr std::uint64_t kNumbersAStep = 4;

}  // namespace

bool NumberCourse::takes(std::uint64_t number, Time now) noexcept {
  if (!has_begun_) {
    has_begun_ = true;
    newest_ = number;
    received_at_ = now;
    return true;
  }
  if (now - began_ >= kSecond) begin_second(now);
  if (number > newest_) {
    const std::uint64_t skipped = number - newest_ - 1;
    if (skipped > may_skip_) return false;
    may_skip_ -= skipped;
    newest_ = number;
    ++steps_;
  }
  received_at_ = now;
  return true;
}

void NumberCourse::begin_second(Time now) noexcept {
  most_steps_ = std::max(most_steps_, steps_);
  steps_ = 0;
  const auto silent_s =
      std::chrono::duration_cast<std::chrono::seconds>(now - received_at_).count();
  may_skip_ = kMostSkipped + kNumbersAStep * most_steps_ * static_cast<std::uint64_t>(silent_s);
  began_ = now;
}

void SequenceWatch::expect_participant(const Prefix& prefix) {
  for (const std::uint32_t entity : kBuiltin) expect(prefix, entity);
}

void SequenceWatch::expect(const Prefix& prefix, std::uint32_t entity) {
  if (endpoints_.size() < kMostEndpoints) endpoints_.try_emplace({prefix, entity});
}

void SequenceWatch::forget_participant(const Prefix& prefix) {
  const auto first = endpoints_.lower_bound({prefix, 0});
  auto last = first;
  while (last != endpoints_.end() && last->first.prefix == prefix) ++last;
  endpoints_.erase(first, last);
}

SequenceWatch::Peer* SequenceWatch::peer_of(Endpoint& endpoint, std::uint32_t entity) noexcept {
  const auto end = endpoint.peers.begin() + static_cast<std::ptrdiff_t>(endpoint.met);
  const auto known = std::find_if(endpoint.peers.begin(), end,
                                  [&](const Peer& peer) { return peer.entity == entity; });
  if (known != end) return &*known;
  if (endpoint.met == kMostPeers) return nullptr;
  Peer& peer = endpoint.peers[endpoint.met++];
  peer.entity = entity;
  return &peer;
}

// A writer announces to each new reader once, in one GAP, all that was before it.
bool SequenceWatch::may_be_long(Endpoint& endpoint, const Statement& gap) noexcept {
  if (gap.span <= NumberCourse::kMostSkipped) return true;
  Peer* const peer = gap.reader == 0 ? nullptr : peer_of(endpoint, gap.reader);
  return peer != nullptr && !std::exchange(peer->had_long_gap, true);
}

bool SequenceWatch::takes(const Prefix& prefix, const Statement& statement, Time now) noexcept {
  if (statement.of == Statement::Of::kNothing) return true;
  const bool of_reader = statement.of == Statement::Of::kAcknowledgement ||
                         statement.of == Statement::Of::kMissingFragments;
  const auto found = endpoints_.find({prefix, of_reader ? statement.reader : statement.writer});
  if (found == endpoints_.end()) return true;
  Endpoint& endpoint = found->second;
  switch (statement.of) {
    case Statement::Of::kSamples: return endpoint.samples.takes(statement.newest, now);
    case Statement::Of::kHeartbeat:
      return endpoint.samples.takes(statement.newest, now) &&
             endpoint.heartbeats.takes(statement.count, now);
    case Statement::Of::kGap:
      return endpoint.samples.takes(statement.newest, now) && may_be_long(endpoint, statement);
    case Statement::Of::kAcknowledgement:
    case Statement::Of::kMissingFragments: break;
    case Statement::Of::kNothing: return true;
  }
  // Beyond kMostPeers our endpoints go unwatched rather than unread.
  Peer* const peer = peer_of(endpoint, statement.writer);
  if (peer == nullptr) return true;
  return statement.of == Statement::Of::kAcknowledgement
             ? peer->acknowledgements.takes(statement.count, now)
             : peer->missing_fragments.takes(statement.count, now);
}

}  // namespace zerodrift::dds
