// SPDX-License-Identifier: Apache-2.0
#include "tests/system/raw_datagrams.h"

#include <arpa/inet.h>
#include <linux/if_ether.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace zerodrift::system_test {
namespace {

// RTPS 2.3, 9.6.1: ports of a domain, and of the participants in it.
constexpr std::uint32_t kPortBase = 7400;
constexpr std::uint32_t kPortsOfDomain = 250;
constexpr std::uint16_t kFirstUnicast = 10;
constexpr std::uint16_t kParticipants = 6;

std::uint32_t first_port(std::uint32_t domain) {
  return kPortBase + kPortsOfDomain * domain;
}

int open_capture() {
  const int descriptor = ::socket(AF_PACKET, SOCK_DGRAM | SOCK_CLOEXEC, htons(ETH_P_IP));
  if (descriptor < 0) return -1;
  sockaddr_ll address{};
  address.sll_family = AF_PACKET;
  address.sll_protocol = htons(ETH_P_IP);
  address.sll_ifindex = static_cast<int>(::if_nametoindex("lo"));
  const timeval patience{0, 50000};
  const int room = 1 << 24;
  ::setsockopt(descriptor, SOL_SOCKET, SO_RCVBUFFORCE, &room, sizeof room);
  ::setsockopt(descriptor, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  // The socket interface takes every kind of address by this pointer.
  const auto* general = static_cast<const sockaddr*>(static_cast<const void*>(&address));
  if (::bind(descriptor, general, sizeof address) == 0) return descriptor;
  ::close(descriptor);
  return -1;
}

}  // namespace

LoopbackCapture::LoopbackCapture(std::uint32_t domain)
    : first_port_(first_port(domain)), socket_(open_capture()) {
  if (works()) thread_ = std::thread([this] { record(); });
}

LoopbackCapture::~LoopbackCapture() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  if (works()) ::close(socket_);
}

// IPv4 (RFC 791) and UDP (RFC 768) headers, read by hand.
void LoopbackCapture::record() {
  Bytes packet(1U << 16U);
  while (!stop_) {
    sockaddr_ll from{};
    socklen_t from_size = sizeof from;
    const auto size = ::recvfrom(socket_, packet.data(), packet.size(), 0,
                                 static_cast<sockaddr*>(static_cast<void*>(&from)), &from_size);
    // Loopback shows each packet twice: as it leaves, and as it arrives.
    if (size < 28 || from.sll_pkttype == PACKET_OUTGOING || packet[9] != IPPROTO_UDP) continue;
    const std::size_t udp = std::size_t{packet[0] & 0x0FU} * 4U;
    const auto port = static_cast<std::uint16_t>(packet[udp + 2] << 8U | packet[udp + 3]);
    if (port < first_port_ || port >= first_port_ + kPortsOfDomain) continue;
    const auto from_port = static_cast<std::uint16_t>(packet[udp] << 8U | packet[udp + 1]);
    const std::lock_guard lock(mutex_);
    datagrams_.push_back(
        {port, Bytes(packet.begin() + static_cast<std::ptrdiff_t>(udp) + 8, packet.begin() + size),
         from_port});
  }
}

std::vector<Datagram> LoopbackCapture::all() const {
  const std::lock_guard lock(mutex_);
  return datagrams_;
}

bool LoopbackCapture::contains(const std::string& text) const {
  const std::lock_guard lock(mutex_);
  return std::any_of(datagrams_.begin(), datagrams_.end(), [&](const Datagram& datagram) {
    return std::search(datagram.bytes.begin(), datagram.bytes.end(), text.begin(), text.end()) !=
           datagram.bytes.end();
  });
}

RawSender::RawSender() : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
  if (socket_ < 0) throw std::runtime_error("cannot open a UDP socket");
}

RawSender::~RawSender() {
  ::close(socket_);
}

void RawSender::send(std::uint16_t port, const Bytes& bytes) const {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(port);
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  // Nobody has to be there to hear it.
  (void)::sendto(socket_, bytes.data(), bytes.size(), 0,
                 static_cast<const sockaddr*>(static_cast<const void*>(&to)), sizeof to);
}

void RawSender::send_to_all(std::uint32_t domain, const Bytes& bytes) const {
  for (std::uint16_t k = 0; k < 2 * kParticipants; ++k) {
    send(static_cast<std::uint16_t>(first_port(domain) + kFirstUnicast + k), bytes);
  }
}

ForgedSender::ForgedSender(std::uint16_t from)
    : socket_(::socket(AF_INET, SOCK_RAW | SOCK_CLOEXEC, IPPROTO_UDP)), from_(from) {
  if (socket_ < 0) throw std::runtime_error("cannot open a raw socket");
}

ForgedSender::~ForgedSender() {
  ::close(socket_);
}

// The kernel adds the IPv4 header; a UDP checksum of 0 is none (RFC 768).
void ForgedSender::send_to_all(std::uint32_t domain, const Bytes& bytes) const {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const auto length = static_cast<std::uint16_t>(bytes.size() + 8);
  for (std::uint16_t k = 0; k < 2 * kParticipants; ++k) {
    const auto port = static_cast<std::uint16_t>(first_port(domain) + kFirstUnicast + k);
    Bytes packet;
    for (const std::uint16_t field : {from_, port, length, std::uint16_t{0}}) {
      packet.push_back(static_cast<std::uint8_t>(field >> 8U));
      packet.push_back(static_cast<std::uint8_t>(field & 0xFFU));
    }
    packet.insert(packet.end(), bytes.begin(), bytes.end());
    (void)::sendto(socket_, packet.data(), packet.size(), 0,
                   static_cast<const sockaddr*>(static_cast<const void*>(&to)), sizeof to);
  }
}

bool is_received(std::uint32_t domain, const Datagram& datagram) {
  const std::uint32_t first = first_port(domain) + kFirstUnicast;
  return datagram.port >= first && datagram.port < first + 2U * kParticipants;
}

Bytes malformed_message(std::mt19937_64& random) {
  const auto below = [&](std::uint64_t n) { return random() % n; };
  const auto octet = [&] { return static_cast<std::uint8_t>(random()); };
  Bytes message{'R', 'T', 'P', 'S', 2, 2, 1, 15};
  for (int k = 0; k < 12; ++k) message.push_back(octet());
  // Every id of RTPS 2.3 and DDS Security 1.1, and one that is nobody's.
  constexpr std::array<std::uint8_t, 19> kIds{0x01, 0x06, 0x07, 0x08, 0x09, 0x0c, 0x0d,
                                              0x0e, 0x0f, 0x12, 0x13, 0x15, 0x16, 0x30,
                                              0x31, 0x32, 0x33, 0x34, 0x80};
  // Writers and readers that every participant has, and some that it might have.
  constexpr std::array<std::uint32_t, 8> kEntities{0x000100c2, 0x000100c7, 0x000003c2, 0x000004c2,
                                                   0x000201c3, 0xff0202c3, 0x00000103, 0x00000104};
  const std::uint64_t submessages = 1 + below(4);
  for (std::uint64_t k = 0; k < submessages; ++k) {
    const std::size_t body = below(5) == 0 ? below(4) : below(200);
    const std::uint64_t told = below(4) == 0 ? below(65536) : body;
    message.push_back(kIds[below(kIds.size())]);
    message.push_back(octet());
    const bool little = (message.back() & 1U) != 0;
    const auto low = static_cast<std::uint8_t>(told & 0xFFU);
    const auto high = static_cast<std::uint8_t>(told >> 8U);
    message.push_back(little ? low : high);
    message.push_back(little ? high : low);
    const std::size_t start = message.size();
    const std::uint8_t extreme = below(2) == 0 ? 0x00 : 0xFF;
    const std::uint64_t wild = below(3);
    for (std::size_t i = 0; i < body; ++i) {
      message.push_back(wild == 0 || (wild == 1 && below(2) == 0) ? octet() : extreme);
    }
    // Where DATA names its reader and writer; a header that fits leads deeper in.
    for (const std::size_t at : {std::size_t{4}, std::size_t{8}}) {
      if (body < at + 4 || below(4) == 0) continue;
      const std::uint32_t id = kEntities[below(kEntities.size())];
      for (std::size_t i = 0; i < 4; ++i) {
        message[start + at + i] = static_cast<std::uint8_t>(id >> (24U - 8U * i));
      }
    }
    if (body >= 20 && below(2) == 0) {
      message[start + 2] = little ? 16 : 0;
      message[start + 3] = little ? 0 : 16;
    }
  }
  return message;
}

}  // namespace zerodrift::system_test
