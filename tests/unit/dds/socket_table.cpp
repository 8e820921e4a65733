// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/dds/socket_table.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace zerodrift::dds {
namespace {

// The kernel prints the address's 32 bits as they lie in memory.
std::string dotted(const std::string& hex) {
  in_addr address{};
  address.s_addr = static_cast<in_addr_t>(std::stoul(hex, nullptr, 16));
  std::array<char, INET_ADDRSTRLEN> text{};
  inet_ntop(AF_INET, &address, text.data(), text.size());
  return text.data();
}

std::set<std::string> own_socket_inodes() {
  std::set<std::string> inodes;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code closed_meanwhile;
    const std::string target = std::filesystem::read_symlink(entry, closed_meanwhile).string();
    constexpr std::string_view kPrefix = "socket:[";
    if (!target.starts_with(kPrefix)) continue;
    inodes.insert(target.substr(kPrefix.size(), target.size() - kPrefix.size() - 1));
  }
  return inodes;
}

// Rows of /proc/net/udp and udp6: slot, local address:port, remote, state, queues, timer,
// retransmits, user, timeout, inode.
void read_table(const char* path, bool ipv6, const std::set<std::string>& inodes,
                std::vector<std::string>& addresses) {
  std::ifstream table(path);
  std::string row;
  std::getline(table, row);
  while (std::getline(table, row)) {
    std::istringstream cells(row);
    std::array<std::string, 10> cell;
    for (std::string& c : cell) cells >> c;
    if (!inodes.contains(cell[9])) continue;
    addresses.push_back(ipv6 ? "ipv6" : dotted(cell[1].substr(0, cell[1].find(':'))));
  }
}

}  // namespace

std::vector<std::string> local_udp_addresses() {
  const auto inodes = own_socket_inodes();
  std::vector<std::string> addresses;
  read_table("/proc/net/udp", false, inodes, addresses);
  read_table("/proc/net/udp6", true, inodes, addresses);
  return addresses;
}

std::set<std::string> multicast_memberships() {
  std::set<std::string> groups;
  std::ifstream table("/proc/net/igmp");
  std::string device;
  std::string row;
  std::getline(table, row);
  while (std::getline(table, row)) {
    std::istringstream cells(row);
    std::string first;
    std::string second;
    cells >> first >> second;
    if (row.front() == '\t') {
      groups.insert(device + ' ' + dotted(first));
    } else {
      device = second;
    }
  }
  return groups;
}

}  // namespace zerodrift::dds
