// SPDX-License-Identifier: Apache-2.0
#include "tests/hosts/host_network.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <poll.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/mount.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <exception>
#include <system_error>
#include <utility>

namespace zerodrift::hosts_test {
namespace {

using namespace std::chrono_literals;

constexpr const char* kInterface = "eth0";
constexpr const char* kTun = "/dev/net/tun";
constexpr std::size_t kLargestFrame = 2048;  // the taps' MTU is Ethernet's 1500
constexpr nanoseconds kLongestSleep = 20ms;  // until a stop is seen
constexpr std::size_t kTypeAt = 12;          // in an Ethernet header

[[noreturn]] void fail(const std::string& what) {
  throw std::system_error(errno, std::generic_category(), what);
}

int checked(int result, const std::string& what) {
  if (result < 0) fail(what);
  return result;
}

nanoseconds now() {
  return std::chrono::steady_clock::now().time_since_epoch();
}

// The work's exception is thrown here.
void on_a_thread_of_its_own(const std::function<void()>& work) {
  std::exception_ptr problem;
  std::thread([&] {
    try {
      work();
    } catch (...) {
      problem = std::current_exception();
    }
  }).join();
  if (problem) std::rethrow_exception(problem);
}

ifreq request_for(const char* interface) {
  ifreq request{};
  std::strncpy(request.ifr_name, interface, IFNAMSIZ - 1);
  return request;
}

void set_address(int socket, unsigned long what, const char* address) {
  ifreq request = request_for(kInterface);
  sockaddr_in value{};
  value.sin_family = AF_INET;
  inet_pton(AF_INET, address, &value.sin_addr);
  std::memcpy(&request.ifr_addr, &value, sizeof value);
  checked(::ioctl(socket, what, &request), std::string("address of ") + kInterface);
}

void bring_up(int socket, const char* interface) {
  ifreq request = request_for(interface);
  checked(::ioctl(socket, SIOCGIFFLAGS, &request), interface);
  request.ifr_flags = static_cast<short>(request.ifr_flags | IFF_UP | IFF_RUNNING);
  checked(::ioctl(socket, SIOCSIFFLAGS, &request), interface);
}

// Neighbour and router discovery of a protocol that nobody here speaks.
void switch_ipv6_off() {
  for (const char* which : {"all", "default"}) {
    const std::string path = std::string("/proc/sys/net/ipv6/conf/") + which + "/disable_ipv6";
    const int file = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (file < 0) continue;  // a kernel without it
    const bool written = ::write(file, "1", 1) == 1;
    ::close(file);
    if (!written) fail(path);
  }
}

int make_tap() {
  const int tap = checked(::open(kTun, O_RDWR | O_CLOEXEC | O_NONBLOCK), kTun);
  ifreq request = request_for(kInterface);
  request.ifr_flags = IFF_TAP | IFF_NO_PI;
  checked(::ioctl(tap, TUNSETIFF, &request), "TUNSETIFF");
  return tap;
}

// IPv4 and ARP.
bool is_ours(std::span<const std::uint8_t> frame) {
  if (frame.size() < kTypeAt + 2 || frame[kTypeAt] != 0x08) return false;
  return frame[kTypeAt + 1] == 0x00 || frame[kTypeAt + 1] == 0x06;
}

}  // namespace

std::optional<std::string> why_unavailable() {
  if (::geteuid() != 0) return "hosts are network namespaces, which need root";
  const int tun = ::open(kTun, O_RDWR | O_CLOEXEC);
  if (tun < 0)
    return std::string(kTun) + ": " + std::generic_category().message(errno) + "; hosts need taps";
  ::close(tun);
  std::optional<std::string> problem;
  std::thread([&] {
    if (::unshare(CLONE_NEWNET | CLONE_NEWNS) != 0)
      problem = "no namespaces can be made here: " + std::generic_category().message(errno);
  }).join();
  return problem;
}

HostNetwork::File::~File() {
  if (number_ >= 0) ::close(number_);
}

HostNetwork::File& HostNetwork::File::operator=(File&& other) noexcept {
  std::swap(number_, other.number_);
  return *this;
}

std::string HostNetwork::address(std::size_t host) {
  return "10.77.0." + std::to_string(host + 1);
}

// On a thread whose namespaces become the host's.
HostNetwork::Host HostNetwork::make_host(std::size_t number) {
  Host host;
  on_a_thread_of_its_own([&] {
    checked(::unshare(CLONE_NEWNET | CLONE_NEWNS), "unshare");
    switch_ipv6_off();
    checked(::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr), "private mounts");
    checked(::mount("tmpfs", "/dev/shm", "tmpfs", MS_NOSUID | MS_NODEV, "size=64m"), "/dev/shm");
    host.tap = File(make_tap());
    const File control(checked(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0), "socket"));
    bring_up(control.number(), "lo");
    set_address(control.number(), SIOCSIFADDR, address(number).c_str());
    set_address(control.number(), SIOCSIFNETMASK, "255.255.255.0");
    bring_up(control.number(), kInterface);
    const auto open_own = [](const char* path) {
      return File(checked(::open(path, O_RDONLY | O_CLOEXEC), path));
    };
    host.network = open_own("/proc/thread-self/ns/net");
    host.mounts = open_own("/proc/thread-self/ns/mnt");
  });
  return host;
}

HostNetwork::HostNetwork(std::size_t hosts, std::uint64_t seed) : hub_(hosts, seed) {
  for (std::size_t number = 0; number < hosts; ++number) hosts_.push_back(make_host(number));
  thread_ = std::thread([this] { switch_frames(); });
}

HostNetwork::~HostNetwork() {
  stopping_ = true;
  thread_.join();
}

std::vector<std::string> HostNetwork::entering(std::size_t host) const {
  const std::string files = "/proc/" + std::to_string(::getpid()) + "/fd/";
  return {"--net=" + files + std::to_string(hosts_[host].network.number()),
          "--mount=" + files + std::to_string(hosts_[host].mounts.number())};
}

void HostNetwork::run_on(std::size_t host, const std::function<void()>& work) const {
  on_a_thread_of_its_own([&] {
    checked(::setns(hosts_[host].network.number(), CLONE_NEWNET), "setns");
    work();
  });
}

void HostNetwork::set_conditions(const LinkConditions& conditions) {
  const std::lock_guard lock(mutex_);
  hub_.set_conditions(conditions);
}

void HostNetwork::cut(const std::vector<std::size_t>& a, const std::vector<std::size_t>& b) {
  const std::lock_guard lock(mutex_);
  hub_.cut(a, b);
}

void HostNetwork::heal() {
  const std::lock_guard lock(mutex_);
  hub_.heal();
}

void HostNetwork::unplug(std::size_t host) {
  const std::lock_guard lock(mutex_);
  hub_.unplug(host);
}

Hub::Counts HostNetwork::counts() const {
  const std::lock_guard lock(mutex_);
  return hub_.counts();
}

// ---------------------------------------- the hub's thread

void HostNetwork::switch_frames() {
  std::vector<pollfd> taps;
  for (const Host& host : hosts_) taps.push_back({host.tap.number(), POLLIN, 0});
  while (!stopping_) {
    nanoseconds sleep = kLongestSleep;
    {
      const std::lock_guard lock(mutex_);
      if (const auto due = hub_.next_due()) sleep = std::clamp(*due - now(), 0ns, kLongestSleep);
    }
    const timespec timeout{0, static_cast<long>(sleep.count())};
    if (::ppoll(taps.data(), taps.size(), &timeout, nullptr) < 0 && errno != EINTR) return;
    const std::lock_guard lock(mutex_);
    for (std::size_t host = 0; host < taps.size(); ++host) {
      if ((taps[host].revents & POLLIN) != 0) read_frames(host);
    }
    deliver_due();
  }
}

void HostNetwork::read_frames(std::size_t host) {
  std::array<std::uint8_t, kLargestFrame> buffer{};
  for (;;) {
    const ssize_t size = ::read(hosts_[host].tap.number(), buffer.data(), buffer.size());
    if (size <= 0) return;
    const std::span frame(buffer.data(), static_cast<std::size_t>(size));
    if (is_ours(frame)) hub_.accept(host, frame, now());
  }
}

void HostNetwork::deliver_due() {
  while (const auto delivery = hub_.take_due(now())) {
    const auto& frame = delivery->frame;
    // A host that takes nothing more loses it, as on any cable.
    static_cast<void>(::write(hosts_[delivery->port].tap.number(), frame.data(), frame.size()));
  }
}

}  // namespace zerodrift::hosts_test
