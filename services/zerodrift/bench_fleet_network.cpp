// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/bench_fleet_network.h"

#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>

namespace zerodrift::services {
namespace {

// "  lo: BYTES PACKETS ..." of what was received; on loopback that is what was sent.
void read_loopback(NetworkCounts& counts) {
  std::ifstream file("/proc/self/net/dev");
  for (std::string line; std::getline(file, line);) {
    const auto colon = line.find(':');
    if (colon == std::string::npos || line.substr(0, colon).find("lo") == std::string::npos)
      continue;
    std::istringstream fields(line.substr(colon + 1));
    if (fields >> counts.bytes >> counts.packets) return;
  }
  throw std::runtime_error("bench fleet: /proc/self/net/dev does not tell of the interface lo");
}

// Two lines that begin with "Udp:", the names and the values.
void read_udp(NetworkCounts& counts) {
  std::ifstream file("/proc/self/net/snmp");
  std::string names;
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("Udp:", 0) != 0) continue;
    if (names.empty()) {
      names = line;
      continue;
    }
    std::map<std::string, std::uint64_t> found;
    std::istringstream keys(names.substr(4));
    std::istringstream values(line.substr(4));
    std::uint64_t value = 0;
    for (std::string key; keys >> key && values >> value;) found[key] = value;
    counts.datagrams = found["OutDatagrams"];
    counts.unanswered = found["NoPorts"];
    counts.dropped = found["RcvbufErrors"];
    return;
  }
  throw std::runtime_error("bench fleet: /proc/self/net/snmp does not tell of UDP");
}

}  // namespace

NetworkCounts operator-(const NetworkCounts& later, const NetworkCounts& earlier) {
  return {.bytes = later.bytes - earlier.bytes,
          .packets = later.packets - earlier.packets,
          .datagrams = later.datagrams - earlier.datagrams,
          .unanswered = later.unanswered - earlier.unanswered,
          .dropped = later.dropped - earlier.dropped};
}

NetworkCounts network_counts() {
  NetworkCounts counts;
  read_loopback(counts);
  read_udp(counts);
  return counts;
}

double load_average() {
  double load = 0.0;
  std::ifstream("/proc/loadavg") >> load;
  return load;
}

double available_memory_gib() {
  std::ifstream file("/proc/meminfo");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("MemAvailable:", 0) == 0)
      return static_cast<double>(std::stoll(line.substr(13))) / (1024.0 * 1024.0);
  }
  return 0.0;
}

}  // namespace zerodrift::services
