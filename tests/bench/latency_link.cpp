// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/latency_link.h"

namespace zerodrift::bench {

std::unique_ptr<LatencyLink> open_link(const LinkOptions& options, LatencyLink::OnPing on_ping) {
  if (options.kind == "futex") return open_futex_link(options, std::move(on_ping));
  if (options.kind == "udp") return open_udp_link(options, std::move(on_ping));
  if (options.kind == "chain") return open_chain_link(options, std::move(on_ping));
  if (options.kind == "cyclone") return open_cyclone_link(options, std::move(on_ping));
  return open_hop_link(options, std::move(on_ping));
}

}  // namespace zerodrift::bench
