// SPDX-License-Identifier: Apache-2.0
// What the kernel knows of UDP sockets and multicast memberships.
#pragma once

#include <set>
#include <string>
#include <vector>

namespace zerodrift::dds {

// Local IPv4 addresses, as "127.0.0.1", of this process's open UDP sockets, one for each socket.
// An IPv6 socket gives "ipv6".
std::vector<std::string> local_udp_addresses();

// Multicast groups joined on this machine, as "eth0 239.255.0.1".
std::set<std::string> multicast_memberships();

}  // namespace zerodrift::dds
