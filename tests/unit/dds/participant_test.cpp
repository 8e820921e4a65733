// SPDX-License-Identifier: Apache-2.0
// Participants of one process that stand for processes: delivery within a process is switched off,
// so every sample here crosses a socket on the loopback interface.
#include "common/dds/participant.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/unit/dds/numbered_rates.h"
#include "tests/unit/dds/socket_table.h"
#include "tests/unit/dds/test_domain.h"

namespace zerodrift::dds {
namespace {

using std::chrono_literals::operator""s;

msg::CompensatedRate compensated(std::uint32_t instance, std::uint64_t sequence) {
  msg::CompensatedRate message;
  message.gyro_id(1);
  message.instance(instance);
  message.sequence_number(sequence);
  return message;
}

std::string refusal(std::uint32_t domain, std::vector<std::string> interfaces = {},
                    std::vector<std::string> peers = {}) {
  NetworkOptions network;
  network.domain = domain;
  network.interfaces = std::move(interfaces);
  network.peers = std::move(peers);
  try {
    const Participant participant("refused", network);
  } catch (const DdsError& error) {
    return error.what();
  }
  return "no error";
}

TEST(ParticipantAbuse, ADomainOutOfRangeIsNamed) {
  EXPECT_EQ(refusal(233), "dds: domain 233 is not within 0..232");
  EXPECT_EQ(refusal(4294967295U), "dds: domain 4294967295 is not within 0..232");
}

TEST(ParticipantAbuse, WhatIsNotAnIPv4AddressIsNamed) {
  for (const char* address :
       {"eth0", "", "999.1.1.1", "1.2.3", "127.0.0.1x", "::1", "127.0.0.1 "}) {
    EXPECT_EQ(refusal(105, {address}), "dds: '" + std::string(address) +
                                           "' is not an IPv4 address; expected e.g. 192.168.0.10");
    EXPECT_EQ(
        refusal(105, {"127.0.0.1"}, {address}),
        "dds: '" + std::string(address) + "' is not an IPv4 address; expected e.g. 192.168.0.10");
  }
}

TEST(ParticipantAbuse, AnInterfaceThatThisMachineDoesNotHaveIsRefused) {
  // 192.0.2.0/24 is set aside for documentation (RFC 5737).
  EXPECT_EQ(refusal(105, {"192.0.2.1"}), "dds: no interface of this machine has address 192.0.2.1");
}

// The ports at which others look for participants of a computer are taken, but the last two.
class AFullDomain : public testing::Test {
 protected:
  static constexpr std::uint32_t kDomain = 108;
  static constexpr std::uint16_t kFirstPort = 7400 + 250 * kDomain + 10;
  static constexpr std::uint16_t kPlaces = 40;

  AFullDomain() {
    for (std::uint16_t place = 0; place < kPlaces - 2; ++place) take(place);
  }
  ~AFullDomain() override {
    for (const int socket : sockets_) ::close(socket);
  }
  void take(std::uint16_t place) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(static_cast<std::uint16_t>(kFirstPort + 2 * place));
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    sockets_.push_back(::socket(AF_INET, SOCK_DGRAM, 0));
    ASSERT_EQ(::bind(sockets_.back(), reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
  }
  const TestDomain domain_{kDomain, IfHeld::kWait};

 private:
  std::vector<int> sockets_;
};

// Before: it started, and was found by nobody that had come as late.
TEST_F(AFullDomain, RefusesOneThatNobodyWouldLookFor) {
  take(kPlaces - 2);
  take(kPlaces - 1);
  EXPECT_EQ(refusal(kDomain),
            "dds: domain 108 is full: 127.0.0.1 has 40 participants, and others look for no more; "
            "take another domain for some, or discovery servers");
}

TEST_F(AFullDomain, TakesTheLastTwoPlacesAndTheyMeet) {
  Participant one("one", domain_.network());
  Participant other("other", domain_.network());
  EXPECT_TRUE(eventually([&] { return one.acquaintance().peers == 1; }));
  EXPECT_TRUE(eventually([&] { return other.acquaintance().peers == 1; }));
}

TEST(Loopback, DeliversEverySampleOnceAndInOrder) {
  const TestDomain domain(101);
  expect_all_delivered(domain.network(), 10000);
}

TEST(Loopback, ReturnsAMessageToTheBit) {
  const TestDomain domain(102);
  Participant here("writer", domain.network());
  Participant there("reader", domain.network());
  std::mutex mutex;
  std::optional<msg::AllanReport> received;
  Reader<msg::AllanReport> reader(there, [&](const msg::AllanReport& message, const SampleOrigin&) {
    const std::lock_guard lock(mutex);
    received = message;
  });
  Writer<msg::AllanReport> writer(here);
  msg::AllanReport sent;
  sent.gyro_id(3);
  sent.axis(2);
  sent.samples(1ULL << 63U);
  sent.sensor_time_ns(-1);
  sent.bias_instability().value(0.1 + 0.2);
  // The longest lists that the type allows: more than one UDP datagram of a small network.
  for (int i = 0; i < 160; ++i) {
    msg::AllanPoint point;
    point.tau_s(i / 3.0);
    point.deviation_radps(1e-300 * i);
    sent.since_start().push_back(point);
    sent.rolling().push_back(point);
  }
  ASSERT_TRUE(writer.write(sent));
  ASSERT_TRUE(eventually([&] {
    const std::lock_guard lock(mutex);
    return received.has_value();
  }));
  EXPECT_EQ(*received, sent);
}

TEST(Loopback, ALateJoinerHearsThePresentStateOfEveryKey) {
  const TestDomain domain(103);
  Participant here("writer", domain.network());
  Writer<msg::ServiceStatus> writer(here);
  for (const char* service : {"one", "two"}) {
    for (std::uint32_t state = 0; state < 3; ++state) {
      msg::ServiceStatus status;
      status.service(service);
      status.state(state);
      ASSERT_TRUE(writer.write(status));
    }
  }
  Participant there("late", domain.network());
  std::mutex mutex;
  std::vector<std::string> heard;
  const Reader<msg::ServiceStatus> reader(
      there, [&](const msg::ServiceStatus& message, const SampleOrigin&) {
        const std::lock_guard lock(mutex);
        heard.push_back(message.service().to_string() + std::to_string(message.state()));
      });
  const auto both = [&] {
    const std::lock_guard lock(mutex);
    return heard.size() >= 2;
  };
  ASSERT_TRUE(eventually(both));
  const std::lock_guard lock(mutex);
  std::sort(heard.begin(), heard.end());
  EXPECT_EQ(heard, (std::vector<std::string>{"one2", "two2"}));
}

// Rule: of two that write the same samples each is heard once, whoever is first; a death loses
// none.
TEST(Loopback, OfTwoWritersEachSampleIsHeardOnce) {
  const TestDomain domain(104);
  Participant consumer("consumer", domain.network());
  std::mutex mutex;
  std::vector<std::uint64_t> heard;
  std::atomic<std::uint64_t> copies{0};
  Reader<msg::CompensatedRate> reader(
      consumer, [&](const msg::CompensatedRate& message, const SampleOrigin&) {
        const std::lock_guard lock(mutex);
        heard.push_back(message.sequence_number());
      });
  const Reader<msg::CompensatedRate, EveryCopy> everything(
      consumer, [&](const msg::CompensatedRate&, const SampleOrigin&) { ++copies; });
  Participant one("one", domain.network());
  Participant other("other", domain.network());
  auto first = std::make_unique<Writer<msg::CompensatedRate>>(one);
  Writer<msg::CompensatedRate> second(other);
  ASSERT_TRUE(eventually([&] {
    return reader.matched() == 2 && everything.matched() == 2 && first->matched() == 2 &&
           second.matched() == 2;
  }));
  const auto write = [](Writer<msg::CompensatedRate>& writer, std::uint64_t sequence) {
    auto message = compensated(1, sequence);
    message.run_id(7);
    ASSERT_TRUE(writer.write(message));
  };
  for (std::uint64_t sequence = 1; sequence <= 200; ++sequence) {
    if (sequence == 101) {
      ASSERT_TRUE(first->wait_until_received(5s));  // a writer that is deleted repairs nothing
      first.reset();
    }
    if (first != nullptr) write(*first, sequence);
    write(second, sequence);
  }
  ASSERT_TRUE(eventually([&] { return copies == 300; }));
  const std::lock_guard lock(mutex);
  ASSERT_EQ(heard.size(), 200U);
  for (std::size_t k = 0; k < heard.size(); ++k) EXPECT_EQ(heard[k], k + 1);
}

TEST(Loopback, AReaderLearnsWhichWriterIsGone) {
  const TestDomain domain(104);
  Participant consumer("consumer", domain.network());
  std::mutex mutex;
  std::vector<eprosima::fastrtps::rtps::GUID_t> heard;
  std::vector<eprosima::fastrtps::rtps::GUID_t> gone;
  const auto count = [&](const auto& guids) {
    const std::lock_guard lock(mutex);
    return guids.size();
  };
  Reader<msg::ReplayProgress> reader(
      consumer,
      [&](const msg::ReplayProgress&, const SampleOrigin& origin) {
        const std::lock_guard lock(mutex);
        heard.push_back(origin.writer);
      },
      {},
      [&](const eprosima::fastrtps::rtps::GUID_t& writer, Departure) {
        const std::lock_guard lock(mutex);
        gone.push_back(writer);
      });
  Participant lasting("lasting", domain.network());
  Writer<msg::ReplayProgress> lasting_writer(lasting);
  ASSERT_TRUE(eventually([&] { return reader.matched() == 1; }));
  {
    Participant short_lived("short-lived", domain.network());
    Writer<msg::ReplayProgress> writer(short_lived);
    msg::ReplayProgress progress;
    progress.consumer("x");
    // Best effort: repeated until heard.
    ASSERT_TRUE(eventually([&] {
      writer.write(progress);
      return count(heard) > 0;
    }));
    EXPECT_EQ(count(gone), 0U);
  }
  ASSERT_TRUE(eventually([&] { return count(gone) == 1; }));
  EXPECT_EQ(gone.front(), heard.front());
  EXPECT_EQ(reader.matched(), 1);
}

// Answers the first announcement that comes, at once and once, as another process.
class AnswersOnce {
 public:
  // As the first participant of the domain (RTPS 2.3, 9.6.1.1), to all others' ports.
  explicit AnswersOnce(std::uint32_t domain)
      : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    const auto port = static_cast<std::uint16_t>(7400 + 250 * domain + 10);
    const timeval at_most{.tv_sec = 30, .tv_usec = 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &at_most, sizeof at_most);
    const sockaddr_in own = loopback(port);
    if (::bind(socket_, reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0)
      throw std::runtime_error("the domain's first port is taken");
    answers_ = std::thread([this, port] {
      const std::vector<std::uint8_t> announcement = receive();
      for (int id = 1; id <= 40; ++id) {
        const sockaddr_in to = loopback(static_cast<std::uint16_t>(port + 2 * id));
        ::sendto(socket_, announcement.data(), announcement.size(), 0,
                 reinterpret_cast<const sockaddr*>(&to), sizeof to);
      }
    });
  }
  ~AnswersOnce() {
    answers_.join();
    ::close(socket_);
  }
  AnswersOnce(const AnswersOnce&) = delete;
  AnswersOnce& operator=(const AnswersOnce&) = delete;

 private:
  static sockaddr_in loopback(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return address;
  }
  // The announcement with another name wherever it holds its sender's: header and GUID.
  std::vector<std::uint8_t> receive() const {
    constexpr std::size_t kPrefixAt = 8;
    constexpr std::size_t kPrefix = 12;
    constexpr std::size_t kProcessAt = 4;  // as the middleware makes its names
    constexpr std::uint8_t kAnother = 0x80;
    std::vector<std::uint8_t> bytes(65536);
    const auto size = ::recv(socket_, bytes.data(), bytes.size(), 0);
    bytes.resize(static_cast<std::size_t>(std::max<ssize_t>(size, kPrefixAt + kPrefix)));
    const std::vector<std::uint8_t> sender(bytes.begin() + kPrefixAt,
                                           bytes.begin() + kPrefixAt + kPrefix);
    for (auto found = bytes.begin();; found += kPrefix) {
      found = std::search(found, bytes.end(), sender.begin(), sender.end());
      if (found == bytes.end()) return bytes;
      *(found + kProcessAt) ^= kAnother;
    }
  }

  int socket_;
  std::thread answers_;
};

// A peer answers a newcomer's announcement once. One that came before the newcomer listened was
// lost, and the two met only with the peer's next announcement, up to 2 s later.
TEST(Meeting, AParticipantHearsTheAnswerToItsFirstAnnouncement) {
  constexpr std::uint32_t kDomain = 107;
  const TestDomain domain(kDomain, IfHeld::kWait);
  for (int round = 0; round < 20; ++round) {
    const AnswersOnce peer(kDomain);
    Participant participant("newcomer", domain.network());
    ASSERT_TRUE(eventually([&] { return participant.acquaintance().peers == 1; }, 10s))
        << "round " << round;
  }
}

TEST(Confinement, EverySocketIsBoundToTheLoopbackAddress) {
  const TestDomain domain(105);
  const auto sockets_before = local_udp_addresses().size();
  Participant here("writer", domain.network());
  Participant there("reader", domain.network());
  std::atomic<int> received{0};
  const Reader<msg::Event> reader(there,
                                  [&](const msg::Event&, const SampleOrigin&) { ++received; });
  Writer<msg::Event> writer(here);
  msg::Event event;
  ASSERT_TRUE(writer.write(event));
  ASSERT_TRUE(eventually([&] { return received == 1; }));

  const auto addresses = local_udp_addresses();
  EXPECT_GT(addresses.size(), sockets_before) << "no socket seen: nothing was checked";
  for (const std::string& address : addresses) EXPECT_EQ(address, "127.0.0.1");
}

TEST(Confinement, NoMulticastGroupIsJoinedOutsideTheLoopbackInterface) {
  const TestDomain domain(105);
  const auto before = multicast_memberships();
  ASSERT_FALSE(before.empty()) << "/proc/net/igmp not understood";
  Participant here("writer", domain.network());
  const Writer<msg::Event> writer(here);
  for (const std::string& membership : multicast_memberships()) {
    EXPECT_TRUE(before.contains(membership) || membership.starts_with("lo ")) << membership;
  }
}

}  // namespace
}  // namespace zerodrift::dds
