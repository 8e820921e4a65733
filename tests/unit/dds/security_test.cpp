// SPDX-License-Identifier: Apache-2.0
// What the guard lets through, by form, by sender and by repetition. Whole participants with keys
// are the system tests' (tests/system/security_test.cpp, packet_test.cpp).
#include "common/dds/security.h"

#include <fastrtps/utils/IPLocator.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <memory>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "common/dds/packet_guard.h"
#include "common/dds/topics.h"

namespace zerodrift::dds {
namespace {

using Bytes = std::vector<std::uint8_t>;
using eprosima::fastrtps::rtps::Locator_t;

constexpr std::uint8_t kSender = 7;
constexpr std::size_t kStatisticsSize = 56;

Bytes header(std::uint8_t sender = kSender) {
  constexpr std::array<std::uint8_t, 8> kStart{'R', 'T', 'P', 'S', 2, 2, 1, 15};
  Bytes bytes(20, sender);
  std::copy(kStart.begin(), kStart.end(), bytes.begin());
  return bytes;
}

// Little-endian lengths.
Bytes operator+(Bytes message, const std::pair<std::uint8_t, Bytes>& submessage) {
  const auto& [id, body] = submessage;
  message.push_back(id);
  message.push_back(1);
  message.push_back(static_cast<std::uint8_t>(body.size() & 0xFFU));
  message.push_back(static_cast<std::uint8_t>(body.size() >> 8U));
  for (const std::uint8_t octet : body) message.push_back(octet);
  return message;
}

std::pair<std::uint8_t, Bytes> data_of(std::uint32_t writer) {
  Bytes body(40, 0);
  for (std::size_t k = 0; k < 4; ++k) {
    body[8 + k] = static_cast<std::uint8_t>(writer >> (24U - 8U * k));
  }
  return {0x15, body};
}
const std::pair<std::uint8_t, Bytes> kTimestamp{0x09, Bytes(8)};
const std::pair<std::uint8_t, Bytes> kStatistics{0x80, Bytes(kStatisticsSize)};
const auto kAnnouncement = data_of(0x000100c2);
const auto kAuthentication = data_of(0x000201c3);
const auto kSample = data_of(0x00000103);

Bytes encrypted(std::uint8_t filling = 0) {
  return header() + std::pair{std::uint8_t{0x33}, Bytes(20, filling)} +
         std::pair{std::uint8_t{0x30}, Bytes(64, filling)} +
         std::pair{std::uint8_t{0x34}, Bytes(20, filling)};
}

Locator_t address(const std::string& ip, std::uint32_t port) {
  Locator_t locator;
  locator.kind = LOCATOR_KIND_UDPv4;
  eprosima::fastrtps::rtps::IPLocator::setIPv4(locator, ip);
  locator.port = port;
  return locator;
}
const Locator_t kHere = address("127.0.0.1", 7411);
const Locator_t kPeer = address("127.0.0.1", 40000);
const Locator_t kOther = address("127.0.0.1", 40001);

TEST(DatagramForm, OfSecuredParticipantsIsTold) {
  EXPECT_EQ(classify(encrypted()), DatagramKind::kProtected);
  EXPECT_EQ(classify(encrypted() + kStatistics), DatagramKind::kProtected);
  EXPECT_EQ(classify(header() + kTimestamp + kAnnouncement + kStatistics),
            DatagramKind::kDiscovery);
  EXPECT_EQ(classify(header() + kTimestamp + kAuthentication), DatagramKind::kHandshake);
}

TEST(DatagramForm, OfAnythingElseIsForeign) {
  const std::pair<std::uint8_t, Bytes> gap{0x08, Bytes(28)};
  const std::pair<std::uint8_t, Bytes> heartbeat{0x07, Bytes(28)};
  for (const Bytes& bytes :
       {Bytes{}, header(), header() + kTimestamp, header() + kSample, header() + gap,
        header() + heartbeat, header() + kTimestamp + kAnnouncement + gap,
        header() + kAnnouncement + kAuthentication, encrypted() + gap, encrypted() + kSample,
        header() + kAnnouncement + std::pair{std::uint8_t{0x30}, Bytes(20)},
        header() + std::pair{std::uint8_t{0x31}, Bytes(20)}}) {
    EXPECT_EQ(classify(bytes), DatagramKind::kForeign) << bytes.size() << " bytes";
  }
}

// Law: a datagram that is cut anywhere is no whole message.
TEST(DatagramForm, CutAnywhereIsForeign) {
  const Bytes whole = encrypted() + kStatistics;
  // Cut right before the statistics it is whole again.
  const std::size_t without_statistics = whole.size() - kStatisticsSize - 4;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    if (size == without_statistics) continue;
    EXPECT_EQ(classify(std::span(whole).first(size)), DatagramKind::kForeign) << size;
  }
}

// This datagram ends a process of Fast DDS 2.9.1.
TEST(DatagramForm, WithStatisticsThatAreNotTheLastIsMalformed) {
  EXPECT_TRUE(is_well_formed(header() + kTimestamp + kSample + kStatistics));
  EXPECT_FALSE(is_well_formed(header() + kTimestamp + kStatistics + kSample));
  EXPECT_FALSE(is_well_formed(header() + std::pair{std::uint8_t{0x80}, Bytes(20)}));
  EXPECT_EQ(classify(header() + kStatistics + kAnnouncement), DatagramKind::kForeign);
  // To another vendor the same number means something else.
  Bytes foreign = header() + std::pair{std::uint8_t{0x80}, Bytes(20)} + kSample;
  foreign[7] = 16;
  EXPECT_TRUE(is_well_formed(foreign));
}

TEST(DatagramForm, OfRandomBytesIsJudgedWithoutHarm) {
  std::mt19937_64 random(20260723);
  for (int k = 0; k < 200000; ++k) {
    Bytes bytes = header();
    const std::size_t more = random() % 120;
    for (std::size_t i = 0; i < more; ++i) bytes.push_back(static_cast<std::uint8_t>(random()));
    // 20 random lengths that fit by chance and known ids: next to never.
    EXPECT_NE(classify(bytes), DatagramKind::kProtected);
    (void)is_well_formed(bytes);
  }
}

struct Guarded {
  std::shared_ptr<SecurityNotices> notices = std::make_shared<SecurityNotices>();
  PacketGuard guard{PacketGuard::Rule::kSecured, notices};
};

TEST(PacketGuard, LetsTheSameEncryptedBytesInOnce) {
  Guarded with;
  EXPECT_TRUE(with.guard.lets_in(encrypted(1), kHere, kPeer));
  EXPECT_TRUE(with.guard.lets_in(encrypted(2), kHere, kPeer));
  EXPECT_FALSE(with.guard.lets_in(encrypted(1), kHere, kOther));
  EXPECT_FALSE(with.guard.lets_in(encrypted(1), kHere, kPeer));
  const auto told = with.notices->take();
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].code, "packet_replayed");
  EXPECT_EQ(told[0].count, 2U);
  EXPECT_TRUE(with.notices->take().empty()) << "each notice once";
}

TEST(PacketGuard, TakesAnAnnouncementOnlyFromWhoUsedTheNameFirst) {
  Guarded with;
  const Bytes announcement = header() + kTimestamp + kAnnouncement;
  EXPECT_TRUE(with.guard.lets_in(announcement, kHere, kPeer));
  EXPECT_TRUE(with.guard.lets_in(announcement, kHere, kPeer)) << "it repeats itself";
  EXPECT_FALSE(with.guard.lets_in(announcement, kHere, kOther));
  EXPECT_TRUE(with.guard.lets_in(announcement, kHere, address("10.0.0.1", 40000)))
      << "its other interface";
  EXPECT_TRUE(with.guard.lets_in(header(9) + kAnnouncement, kHere, kOther)) << "another's own";
  with.guard.forget({kSender, kSender, kSender, kSender, kSender, kSender, kSender, kSender,
                     kSender, kSender, kSender, kSender});
  EXPECT_TRUE(with.guard.lets_in(announcement, kHere, kOther)) << "free again";
  const auto told = with.notices->take();
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].code, "packet_refused");
  EXPECT_NE(told[0].text.find("127.0.0.1:40001"), std::string::npos) << told[0].text;
}

TEST(SecurityIdentity, IsTheServiceOrTheCommandLine) {
  EXPECT_EQ(security_identity("compensation"), "compensation");
  EXPECT_EQ(security_identity("compensation/2"), "compensation");
  for (const char* name : {"recorder", "diagnose", "zerodrift_ctl", "zerodrift_bench"}) {
    EXPECT_EQ(security_identity(name), "zerodrift") << name;
  }
}

// The words of a function of the script, `<name>() { ... }`.
std::set<std::string> words_of(const std::string& script, const std::string& name) {
  std::set<std::string> words;
  const auto begin = script.find('\n' + name + "() {");
  if (begin == std::string::npos) return words;
  std::istringstream text(script.substr(begin, script.find("\n}", begin) - begin));
  for (std::string word; text >> word;) words.insert(word);
  return words;
}

// Rule: a new topic gets its permissions, or security shuts it without a word here.
TEST(SecurityPermissions, NameAWriterAndAReaderForEveryTopic) {
  std::ifstream file(std::string(ZERODRIFT_SOURCE_DIR) + "/deploy/security/make_certificates.sh");
  std::ostringstream whole;
  whole << file.rdbuf();
  const std::string script = whole.str();
  for (const TopicSpec& topic : kAllTopics) {
    const std::string name(topic.name);
    if (script.find("of_all=\"service_status event\"") != std::string::npos &&
        (name == kServiceStatus.name || name == kEvent.name)) {
      continue;
    }
    for (const char* table : {"writes", "reads"}) {
      EXPECT_TRUE(words_of(script, table).contains(name)) << table << ' ' << name;
    }
  }
}

}  // namespace
}  // namespace zerodrift::dds
