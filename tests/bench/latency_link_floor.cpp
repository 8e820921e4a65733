// SPDX-License-Identifier: Apache-2.0
// The floor: what any middleware on this machine has to pay at least. A futex on shared memory, and
// a UDP socket on loopback.
#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/futex.h>
#include <netinet/in.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstring>
#include <stdexcept>
#include <thread>

#include "tests/bench/latency_link.h"

namespace zerodrift::bench {
namespace {

constexpr std::size_t kSampleBytes = 112;  // of an AngularRate on the wire

// One direction: a ring that one process fills and another empties.
struct Ring {
  static constexpr std::size_t kSlots = 1024;
  struct Slot {
    Ping ping;
    std::array<char, kSampleBytes - sizeof(Ping)> rest;
  };
  std::atomic<std::uint32_t> written;  // the futex
  std::atomic<std::uint32_t> stopped;
  std::array<Slot, kSlots> slots;
};
static_assert(std::atomic<std::uint32_t>::is_always_lock_free);

void futex(std::atomic<std::uint32_t>& word, int operation, std::uint32_t value) {
  timespec at_most{0, 100000000};  // a stop is seen within this
  syscall(SYS_futex, &word, operation, value, operation == FUTEX_WAIT ? &at_most : nullptr, nullptr,
          0);
}

class SharedRings {
 public:
  explicit SharedRings(const std::string& name) : path_("/zerodrift_bench_" + name) {
    const int file = shm_open(path_.c_str(), O_RDWR | O_CREAT, 0600);
    if (file < 0 || ftruncate(file, sizeof(Rings)) != 0) {
      throw std::runtime_error("bench: no shared memory to be had: " + path_);
    }
    void* const memory = mmap(nullptr, sizeof(Rings), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    if (memory == MAP_FAILED) throw std::runtime_error("bench: cannot map " + path_);
    rings_ = static_cast<Rings*>(memory);  // all zero is a valid, empty state
  }
  ~SharedRings() {
    munmap(rings_, sizeof(Rings));
    shm_unlink(path_.c_str());
  }
  SharedRings(const SharedRings&) = delete;
  SharedRings& operator=(const SharedRings&) = delete;
  Ring& there() { return rings_->there; }
  Ring& back() { return rings_->back; }
  std::array<std::atomic<std::uint32_t>, 2>& present() { return rings_->present; }

 private:
  struct Rings {
    Ring there;
    Ring back;
    std::array<std::atomic<std::uint32_t>, 2> present;
  };
  std::string path_;
  Rings* rings_ = nullptr;
};

class FutexLink final : public LatencyLink {
 public:
  FutexLink(const LinkOptions& options, OnPing on_ping)
      : rings_(options.name),
        out_(options.end == LinkEnd::kFar ? rings_.back() : rings_.there()),
        in_(options.end == LinkEnd::kFar ? rings_.there() : rings_.back()),
        on_ping_(std::move(on_ping)) {
    rings_.present()[options.end == LinkEnd::kFar ? 1 : 0] = 1;
    receiver_ = std::thread([this] { receive(); });
  }
  ~FutexLink() override {
    stopping_ = true;
    receiver_.join();
  }
  bool connected() override { return rings_.present()[0] == 1 && rings_.present()[1] == 1; }
  void send(const Ping& ping) override {
    const std::uint32_t index = out_.written.load(std::memory_order_relaxed);
    out_.slots[index % Ring::kSlots].ping = ping;
    out_.written.store(index + 1, std::memory_order_release);
    futex(out_.written, FUTEX_WAKE, 1);
  }

 private:
  void receive() {
    std::uint32_t read = 0;
    while (!stopping_) {
      while (read != in_.written.load(std::memory_order_acquire)) {
        on_ping_(in_.slots[read++ % Ring::kSlots].ping);
      }
      futex(in_.written, FUTEX_WAIT, read);
    }
  }

  SharedRings rings_;
  Ring& out_;
  Ring& in_;
  OnPing on_ping_;
  std::atomic<bool> stopping_{false};
  std::thread receiver_;
};

// Ports of the two ends: in the range the middleware leaves free, apart by the link's name.
sockaddr_in loopback_port(const std::string& name, LinkEnd end) {
  constexpr std::size_t kFirstPort = 20000;
  constexpr std::size_t kPairs = 4000;
  const std::size_t pair = std::hash<std::string>{}(name) % kPairs;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port =
      htons(static_cast<std::uint16_t>(kFirstPort + 2 * pair + (end == LinkEnd::kFar ? 1 : 0)));
  return address;
}

class UdpLink final : public LatencyLink {
 public:
  UdpLink(const LinkOptions& options, OnPing on_ping)
      : socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)),
        peer_(loopback_port(options.name,
                            options.end == LinkEnd::kFar ? LinkEnd::kNear : LinkEnd::kFar)),
        on_ping_(std::move(on_ping)) {
    const sockaddr_in own = loopback_port(options.name, options.end);
    const timeval at_most{0, 100000};  // a stop is seen within this
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &at_most, sizeof at_most);
    if (socket_ < 0 || bind(socket_, reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0) {
      throw std::runtime_error("bench: UDP port " + std::to_string(ntohs(own.sin_port)) +
                               " on 127.0.0.1 is not to be had");
    }
    receiver_ = std::thread([this] { receive(); });
  }
  ~UdpLink() override {
    stopping_ = true;
    receiver_.join();
    close(socket_);
  }
  // A datagram of a sequence 0 says hello.
  bool connected() override {
    send({});
    return received_;
  }
  void send(const Ping& ping) override {
    std::array<char, kSampleBytes> datagram{};
    std::memcpy(datagram.data(), &ping, sizeof ping);
    sendto(socket_, datagram.data(), datagram.size(), 0, reinterpret_cast<const sockaddr*>(&peer_),
           sizeof peer_);
  }

 private:
  void receive() {
    std::array<char, kSampleBytes> datagram{};
    while (!stopping_) {
      if (recv(socket_, datagram.data(), datagram.size(), 0) !=
          static_cast<ssize_t>(datagram.size())) {
        continue;
      }
      received_ = true;
      Ping ping;
      std::memcpy(&ping, datagram.data(), sizeof ping);
      if (ping.sequence > 0) on_ping_(ping);
    }
  }

  int socket_;
  sockaddr_in peer_;
  OnPing on_ping_;
  std::atomic<bool> received_{false};
  std::atomic<bool> stopping_{false};
  std::thread receiver_;
};

}  // namespace

std::unique_ptr<LatencyLink> open_futex_link(const LinkOptions& options,
                                             LatencyLink::OnPing on_ping) {
  return std::make_unique<FutexLink>(options, std::move(on_ping));
}

std::unique_ptr<LatencyLink> open_udp_link(const LinkOptions& options,
                                           LatencyLink::OnPing on_ping) {
  return std::make_unique<UdpLink>(options, std::move(on_ping));
}

}  // namespace zerodrift::bench
