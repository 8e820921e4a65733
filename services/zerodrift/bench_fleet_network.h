// SPDX-License-Identifier: Apache-2.0
// What the kernel has counted: traffic of the loopback interface and of UDP in this network
// namespace, the machine's load. All from /proc.
#pragma once

#include <cstdint>

namespace zerodrift::services {

struct NetworkCounts {
  std::uint64_t bytes = 0;       // over the loopback interface, with the heads of IP and UDP
  std::uint64_t packets = 0;     // there, with the kernel's "nobody is at this port"
  std::uint64_t datagrams = 0;   // of UDP that were sent
  std::uint64_t unanswered = 0;  // and found nobody at their port
  std::uint64_t dropped = 0;     // and found no room in the receiver's buffer
};
NetworkCounts operator-(const NetworkCounts& later, const NetworkCounts& earlier);

// Since the namespace was made. Throws std::runtime_error where /proc does not tell.
NetworkCounts network_counts();

double load_average();  // of the last minute
double available_memory_gib();

}  // namespace zerodrift::services
