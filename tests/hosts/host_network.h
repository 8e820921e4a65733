// SPDX-License-Identifier: Apache-2.0
// Several hosts on one machine: each is a network namespace with one Ethernet interface and a
// /dev/shm of its own, and all interfaces end in one Hub. Nothing leaves the machine: the
// interfaces are taps inside namespaces made here, without a route to anywhere. The namespaces live
// as long as this object or, however the test ends, its process.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/hosts/hub.h"

namespace zerodrift::hosts_test {

// Why hosts can't be made here (no root, no /dev/net/tun); none: they can.
[[nodiscard]] std::optional<std::string> why_unavailable();

class HostNetwork {
 public:
  // Hosts 0 to hosts - 1, plugged in and up. Throws std::system_error.
  HostNetwork(std::size_t hosts, std::uint64_t seed);
  ~HostNetwork();
  HostNetwork(const HostNetwork&) = delete;
  HostNetwork& operator=(const HostNetwork&) = delete;

  // 10.77.0.(host + 1)
  [[nodiscard]] static std::string address(std::size_t host);
  // A program is started on a host as `nsenter <these arguments> <program> ...`.
  [[nodiscard]] std::vector<std::string> entering(std::size_t host) const;
  // Runs `work` in the host's network, and waits for it. Sockets and threads that it makes stay
  // there. Passes its exception on.
  void run_on(std::size_t host, const std::function<void()>& work) const;

  void set_conditions(const LinkConditions& conditions);
  void cut(const std::vector<std::size_t>& a, const std::vector<std::size_t>& b);
  void heal();
  void unplug(std::size_t host);
  [[nodiscard]] Hub::Counts counts() const;

 private:
  // Closed with the object.
  class File {
   public:
    explicit File(int number = -1) : number_(number) {}
    ~File();
    File(File&& other) noexcept : number_(other.number_) { other.number_ = -1; }
    File& operator=(File&& other) noexcept;
    [[nodiscard]] int number() const { return number_; }

   private:
    int number_;
  };
  struct Host {
    File network{};  // its namespaces
    File mounts{};
    File tap{};
  };

  static Host make_host(std::size_t number);
  void switch_frames();
  void read_frames(std::size_t host);
  void deliver_due();

  std::vector<Host> hosts_;
  mutable std::mutex mutex_;  // the hub's
  Hub hub_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace zerodrift::hosts_test
