// SPDX-License-Identifier: Apache-2.0
// The wire as an attacker on this machine has it: every datagram to a domain's ports on the
// loopback interface, and a plain socket to send others there.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

namespace zerodrift::system_test {

using Bytes = std::vector<std::uint8_t>;

struct Datagram {
  std::uint16_t port = 0;  // destination
  Bytes bytes{};
  std::uint16_t from = 0;  // source port
};

// Records until it is destroyed. Needs the right to open packet sockets.
class LoopbackCapture {
 public:
  explicit LoopbackCapture(std::uint32_t domain);
  ~LoopbackCapture();
  LoopbackCapture(const LoopbackCapture&) = delete;
  LoopbackCapture& operator=(const LoopbackCapture&) = delete;

  // False: this user may not capture.
  [[nodiscard]] bool works() const { return socket_ >= 0; }
  [[nodiscard]] std::vector<Datagram> all() const;
  [[nodiscard]] bool contains(const std::string& text) const;

 private:
  void record();

  std::uint32_t first_port_;
  int socket_;
  std::atomic<bool> stop_{false};
  mutable std::mutex mutex_;
  std::vector<Datagram> datagrams_;
  std::thread thread_;
};

// Sends to 127.0.0.1 from a port of its own.
class RawSender {
 public:
  RawSender();
  ~RawSender();
  RawSender(const RawSender&) = delete;
  RawSender& operator=(const RawSender&) = delete;
  void send(std::uint16_t port, const Bytes& bytes) const;
  // To discovery and user ports of the first participants of a domain.
  void send_to_all(std::uint32_t domain, const Bytes& bytes) const;

 private:
  int socket_;
};

// Sends from a port of 127.0.0.1 that is somebody else's. Needs the right to open raw sockets.
class ForgedSender {
 public:
  explicit ForgedSender(std::uint16_t from);
  ~ForgedSender();
  ForgedSender(const ForgedSender&) = delete;
  ForgedSender& operator=(const ForgedSender&) = delete;
  // As RawSender.
  void send_to_all(std::uint32_t domain, const Bytes& bytes) const;

 private:
  int socket_;
  std::uint16_t from_;
};

// True if it goes to the ports of send_to_all().
bool is_received(std::uint32_t domain, const Datagram& datagram);

// An RTPS header and submessages whose ids, flags, lengths and counts are drawn at random, each now
// and then at its extreme.
Bytes malformed_message(std::mt19937_64& random);

}  // namespace zerodrift::system_test
