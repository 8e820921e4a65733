// SPDX-License-Identifier: Apache-2.0
// What carries a sample from one process to another, for `zerodrift_bench latency`: every way to be
// compared behind one interface.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "common/dds/participant.h"

namespace zerodrift::bench {

struct Ping {
  std::uint64_t sequence = 0;  // from 1, without holes
  std::int64_t sent_ns = 0;    // host's monotonic clock
  double interval_s = 1e-3;    // since the one before
};

// kNear sends; kFar receives, and may answer. kLoop is both in one process, for the chain, whose
// answers are another topic.
enum class LinkEnd : std::uint8_t { kNear, kFar, kLoop };

class LatencyLink {
 public:
  using OnPing = std::function<void(const Ping&)>;  // on a thread of the link

  LatencyLink() = default;
  virtual ~LatencyLink() = default;
  LatencyLink(const LatencyLink&) = delete;
  LatencyLink& operator=(const LatencyLink&) = delete;
  [[nodiscard]] virtual bool connected() = 0;
  // One thread at a time.
  virtual void send(const Ping& ping) = 0;
};

struct LinkOptions {
  std::string kind;  // futex, udp, cyclone, chain, or a name of dds::hop_alternatives()
  LinkEnd end = LinkEnd::kNear;
  std::string name;  // keeps apart links of one kind on one machine
  dds::NetworkOptions network;
};

// Throws std::runtime_error.
std::unique_ptr<LatencyLink> open_link(const LinkOptions& options, LatencyLink::OnPing on_ping);

std::unique_ptr<LatencyLink> open_futex_link(const LinkOptions& options,
                                             LatencyLink::OnPing on_ping);
std::unique_ptr<LatencyLink> open_udp_link(const LinkOptions& options, LatencyLink::OnPing on_ping);
// True where the build has another vendor's middleware.
bool has_cyclone_link();
std::unique_ptr<LatencyLink> open_cyclone_link(const LinkOptions& options,
                                               LatencyLink::OnPing on_ping);
std::unique_ptr<LatencyLink> open_hop_link(const LinkOptions& options, LatencyLink::OnPing on_ping);
std::unique_ptr<LatencyLink> open_chain_link(const LinkOptions& options,
                                             LatencyLink::OnPing on_ping);

}  // namespace zerodrift::bench
