// SPDX-License-Identifier: Apache-2.0
// What the guard lets through: by form, by sender, by how far it moves a number, by repetition.
// Whole participants are the system tests' (tests/system/packet_test.cpp).
#include "common/dds/packet_guard.h"

#include <fastrtps/utils/IPLocator.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <span>
#include <sstream>
#include <string>

#include "tests/unit/dds/rtps_bytes.h"

namespace zerodrift::dds {
namespace {

using namespace rtps_bytes;
using namespace std::chrono_literals;
using eprosima::fastrtps::rtps::Locator_t;
using Time = PacketGuard::Time;

constexpr std::uint32_t kSampleWriter = 0x00000103;
constexpr std::uint32_t kSampleReader = 0x00000204;
constexpr std::uint32_t kDiscoveryWriter = 0x000100c2;
constexpr std::uint32_t kAuthenticationWriter = 0x000201c3;
constexpr std::uint8_t kHasData = 4;
constexpr std::size_t kStatisticsSize = 56;
constexpr Time kStart{std::chrono::hours(24)};

Locator_t address(const std::string& ip, std::uint32_t port) {
  Locator_t locator;
  locator.kind = LOCATOR_KIND_UDPv4;
  eprosima::fastrtps::rtps::IPLocator::setIPv4(locator, ip);
  locator.port = port;
  return locator;
}
const Locator_t kHere = address("127.0.0.1", 7411);
const Locator_t kPeerAt = address("127.0.0.1", 40000);
const Locator_t kOtherAt = address("127.0.0.1", 40001);
const Prefix kPeer = prefix_of(7);
const Prefix kOther = prefix_of(9);
const Prefix kOurs = prefix_of(1);

Message from(const Prefix& prefix = kPeer) {
  return Message(prefix);
}
Body data_of(std::uint32_t writer) {
  return data({.writer = writer}, 1);
}
Body timestamp() {
  return Body().zeros(8);
}
Message announcement(const Prefix& prefix = kPeer) {
  return from(prefix).add(0x09, timestamp()).add(0x15, data_of(kDiscoveryWriter), kHasData);
}
Message encrypted(std::uint8_t filling = 0) {
  Body crypto;
  for (int k = 0; k < 20; ++k) crypto.u8(filling);
  return from().add(0x33, crypto).add(0x30, Body().zeros(64)).add(0x34, crypto);
}
Message with_statistics(Message message) {
  return message.add(0x80, Body().zeros(kStatisticsSize));
}

// ---------------------------------------- form

TEST(DatagramForm, OfSecuredParticipantsIsTold) {
  EXPECT_EQ(classify(encrypted().bytes()), DatagramKind::kProtected);
  EXPECT_EQ(classify(with_statistics(encrypted()).bytes()), DatagramKind::kProtected);
  EXPECT_EQ(classify(with_statistics(announcement()).bytes()), DatagramKind::kDiscovery);
  EXPECT_EQ(classify(from().add(0x15, data_of(kAuthenticationWriter), kHasData).bytes()),
            DatagramKind::kHandshake);
}

TEST(DatagramForm, OfAnythingElseIsForeign) {
  const Ends ends{kSampleReader, kSampleWriter};
  const Body beat = heartbeat(ends, 1, 1, 1);
  for (const Message& message :
       {from(), from().add(0x09, timestamp()), from().add(0x15, data_of(kSampleWriter), kHasData),
        from().add(0x08, gap(ends, 1, 2)), from().add(0x07, beat), announcement().add(0x07, beat),
        announcement().add(0x15, data_of(kAuthenticationWriter), kHasData),
        encrypted().add(0x07, beat), announcement().add(0x30, Body().zeros(20)),
        from().add(0x31, Body().zeros(20))}) {
    EXPECT_EQ(classify(message.bytes()), DatagramKind::kForeign)
        << message.bytes().size() << " bytes";
  }
  EXPECT_EQ(classify({}), DatagramKind::kForeign);
}

// Law: a datagram that is cut anywhere is no whole message.
TEST(DatagramForm, CutAnywhereIsForeign) {
  const Bytes whole = with_statistics(encrypted()).bytes();
  // Cut right before the statistics it is whole again.
  const std::size_t without_statistics = whole.size() - kStatisticsSize - 4;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    if (size == without_statistics) continue;
    EXPECT_EQ(classify(std::span(whole).first(size)), DatagramKind::kForeign) << size;
  }
}

// This datagram ends a process of Fast DDS 2.9.1.
TEST(DatagramForm, WithStatisticsThatAreNotTheLastIsMalformed) {
  EXPECT_TRUE(is_well_formed(with_statistics(announcement()).bytes()));
  const Message first = with_statistics(from()).add(0x15, data_of(kDiscoveryWriter), kHasData);
  EXPECT_FALSE(is_well_formed(first.bytes()));
  EXPECT_EQ(classify(first.bytes()), DatagramKind::kForeign);
  EXPECT_FALSE(is_well_formed(from().add(0x80, Body().zeros(20)).bytes()));
  // To another vendor the same number means something else.
  Bytes foreign =
      from().add(0x80, Body().zeros(20)).add(0x15, data_of(kSampleWriter), kHasData).bytes();
  foreign[7] = 16;
  EXPECT_TRUE(is_well_formed(foreign));
}

TEST(DatagramForm, OfRandomBytesIsJudgedWithoutHarm) {
  std::mt19937_64 random(20260723);
  for (int k = 0; k < 200000; ++k) {
    Bytes bytes = from().bytes();
    const std::size_t more = random() % 120;
    for (std::size_t i = 0; i < more; ++i) bytes.push_back(static_cast<std::uint8_t>(random()));
    // 20 random lengths that fit by chance and known ids: next to never.
    EXPECT_NE(classify(bytes), DatagramKind::kProtected);
    (void)is_well_formed(bytes);
  }
}

bool is_taken(std::uint8_t id, const Body& body, std::uint8_t flags = 0) {
  return is_well_formed(from().add(id, body, flags).bytes());
}

// As Fast DDS and Cyclone DDS send them.
TEST(DatagramForm, OfHonestSubmessagesIsTaken) {
  const Ends ends{kSampleReader, kSampleWriter};
  EXPECT_TRUE(is_taken(0x07, heartbeat(ends, 1, 0, 1))) << "of an empty history";
  EXPECT_TRUE(is_taken(0x07, heartbeat(ends, 2001, 2000, 7))) << "of a history that was emptied";
  EXPECT_TRUE(is_taken(0x08, gap(ends, 1, 7)));
  EXPECT_TRUE(is_taken(0x08, gap(ends, 1, 7, 256, 8)));
  EXPECT_TRUE(is_taken(0x06, ack_nack(ends, 0, 0, 0, 1))) << "a reader's first";
  EXPECT_TRUE(is_taken(0x06, ack_nack(ends, 9, 33, 2, 1)));
  EXPECT_TRUE(is_taken(0x12, nack_frag(ends, 9, 1, 2, 1, 1)));
  EXPECT_TRUE(is_taken(0x13, heartbeat_frag(ends, 9, 3, 1)));
  EXPECT_TRUE(is_taken(0x16, data_frag(ends, 9, {})));
  EXPECT_TRUE(is_taken(0x16, data_frag(ends, 9, {.first = 2, .sample_size = 100, .payload = 36})))
      << "the last fragment is as long as is left";
  EXPECT_TRUE(is_taken(0x09, Body(), 2)) << "no time stamp";
  // Status information and the end mark; then the key.
  EXPECT_TRUE(is_taken(0x15, data(ends, 1, 16, 0).u16(0x71).u16(4).u32(3).u16(1).u16(0).u32(1), 6));
  EXPECT_FALSE(is_taken(0x15, data(ends, 1, 16, 0).u16(0x71).u16(4).u32(3), 6)) << "no end mark";
  EXPECT_FALSE(is_taken(0x15, data(ends, 1, 16, 0).u16(0x71).u16(40).u32(3), 6));
}

// Fast DDS 2.9.1 copies what a last fragment says that it has, not what it has.
TEST(DatagramForm, OfAFragmentThatHoldsLessThanItSaysIsMalformed) {
  const Ends ends{kSampleReader, kSampleWriter};
  EXPECT_FALSE(is_taken(0x16, data_frag(ends, 1, {.count = 2})));
  EXPECT_FALSE(
      is_taken(0x16, data_frag(ends, 1, {.count = 1000, .size = 64000, .sample_size = 16000000})));
  EXPECT_FALSE(is_taken(0x16, data_frag(ends, 1, {.first = 0xFFFFFFFF, .count = 2})));
  EXPECT_FALSE(is_taken(0x16, data_frag(ends, 1, {.size = 0})));
  EXPECT_FALSE(is_taken(0x16, data_frag(ends, 1, {.size = 1, .sample_size = 8})));
  EXPECT_FALSE(is_taken(0x16, data_frag(ends, 1, {.sample_size = 0xFFFFFFFF})));
  EXPECT_FALSE(is_taken(0x16, data_frag(ends, 1, {}), 4)) << "a key in fragments";
}

// ---------------------------------------- sender

class Guarded {
 public:
  explicit Guarded(PacketGuard::Rule rule = PacketGuard::Rule::kPlain) : guard(rule, notices) {}
  bool hears(const Bytes& bytes, const Locator_t& source = kPeerAt, Time now = kStart) {
    return guard.lets_in(bytes, kHere, source, now);
  }
  bool hears(const Message& message, const Locator_t& source = kPeerAt, Time now = kStart) {
    return hears(message.bytes(), source, now);
  }
  std::shared_ptr<SecurityNotices> notices = std::make_shared<SecurityNotices>();
  PacketGuard guard;
};

Prefix numbered(std::uint32_t number) {
  Prefix prefix = prefix_of(200);
  for (std::size_t k = 0; k < 4; ++k) prefix[k] = static_cast<std::uint8_t>(number >> (8 * k));
  return prefix;
}

TEST(PacketGuard, LetsTheSameEncryptedBytesInOnce) {
  Guarded with(PacketGuard::Rule::kSecured);
  EXPECT_TRUE(with.hears(encrypted(1)));
  EXPECT_TRUE(with.hears(encrypted(2)));
  EXPECT_FALSE(with.hears(encrypted(1), kOtherAt));
  EXPECT_FALSE(with.hears(encrypted(1)));
  const auto told = with.notices->take();
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].code, "packet_replayed");
  EXPECT_EQ(told[0].count, 2U);
  EXPECT_TRUE(with.notices->take().empty()) << "each notice once";
}

class SenderRule : public testing::TestWithParam<PacketGuard::Rule> {
 protected:
  Guarded with{GetParam()};
};
INSTANTIATE_TEST_SUITE_P(PlainAndSecured, SenderRule,
                         testing::Values(PacketGuard::Rule::kPlain, PacketGuard::Rule::kSecured),
                         [](const auto& of) {
                           return of.param == PacketGuard::Rule::kPlain ? "plain" : "secured";
                         });

TEST_P(SenderRule, TakesANameOnlyFromWhoUsedItFirst) {
  EXPECT_TRUE(with.hears(announcement()));
  EXPECT_TRUE(with.hears(announcement())) << "it repeats itself";
  EXPECT_FALSE(with.hears(announcement(), kOtherAt));
  EXPECT_TRUE(with.hears(announcement(), address("10.0.0.1", 40000))) << "its other interface";
  EXPECT_TRUE(with.hears(announcement(kOther), kOtherAt)) << "another's own";
  with.guard.forget(kPeer);
  EXPECT_TRUE(with.hears(announcement(), kOtherAt)) << "free again";
  const auto told = with.notices->take();
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].code, "packet_refused");
  EXPECT_NE(told[0].text.find("127.0.0.1:40001"), std::string::npos) << told[0].text;
}

TEST_P(SenderRule, NamesMadeUpBySomeoneElseBarNoNewcomer) {
  for (std::uint32_t k = 0; k < 1100; ++k) with.hears(announcement(numbered(k)), kOtherAt);
  EXPECT_TRUE(with.hears(announcement()));
}

// Each from a port of its own, as somebody with many sockets, or with the right to forge sources.
TEST_P(SenderRule, NamesMadeUpFromEverywhereBarNewcomersForFiveSecondsAndNobodyKnown) {
  EXPECT_TRUE(with.hears(announcement(kOther), kOtherAt));
  with.guard.know(kOther);
  std::uint32_t taken = 0;
  for (std::uint32_t k = 0; k < 5000; ++k)
    taken += with.hears(announcement(numbered(k)), address("127.0.0.1", 2000 + k)) ? 1U : 0U;
  EXPECT_EQ(taken, SenderTable::kMostNewcomers) << "memory is bounded";
  EXPECT_TRUE(with.hears(announcement(kOther), kOtherAt)) << "who is known keeps its place";
  EXPECT_FALSE(with.hears(announcement()));
  EXPECT_TRUE(with.hears(announcement(), kPeerAt, kStart + SenderTable::kNewFor));
}

TEST_P(SenderRule, WhoIsKnownKeepsItsNameHoweverMuchIsMadeUp) {
  EXPECT_TRUE(with.hears(announcement()));
  with.guard.know(kPeer);
  Time now = kStart;
  for (std::uint32_t k = 0; k < 5000; ++k) {
    now += 10ms;
    with.hears(announcement(numbered(k)), address("127.0.0.1", 2000 + k), now);
    if (k % 100 == 0) {
      EXPECT_TRUE(with.hears(announcement(), kPeerAt, now));
      EXPECT_FALSE(with.hears(announcement(), kOtherAt, now));
    }
  }
}

// A discovery server has the same name whenever it is started.
TEST(PacketGuard, LeavesASilentNameToAnotherPortWithoutSecurityOnly) {
  for (const auto rule : {PacketGuard::Rule::kPlain, PacketGuard::Rule::kSecured}) {
    Guarded with(rule);
    EXPECT_TRUE(with.hears(announcement()));
    with.guard.know(kPeer);
    EXPECT_FALSE(with.hears(announcement(), kOtherAt, kStart + 9s));
    EXPECT_EQ(with.hears(announcement(), kOtherAt, kStart + 10s),
              rule == PacketGuard::Rule::kPlain);
  }
}

TEST(PacketGuard, KnowsParticipantsThatADiscoveryServerSpokeOf) {
  Guarded with;
  with.guard.know(kPeer);
  EXPECT_TRUE(with.hears(announcement()));
  EXPECT_FALSE(with.hears(announcement(), kOtherAt, kStart + SenderTable::kNewFor));
}

// ---------------------------------------- numbers

// A writer and a reader of a peer that both have said something.
class Matched : public testing::Test {
 protected:
  static constexpr std::uint64_t kNewest = 1000;
  static constexpr std::uint32_t kCount = 500;
  Matched() {
    with.guard.know(kPeer);
    with.guard.expect_endpoint(kPeer, kSampleWriter);
    with.guard.expect_endpoint(kPeer, kSampleReader);
    EXPECT_TRUE(with.hears(beat(kNewest, kCount)));
    EXPECT_TRUE(
        with.hears(from().add(0x06, ack_nack({kSampleReader, kSampleWriter}, 5, 0, 0, kCount))));
    EXPECT_TRUE(with.hears(
        from().add(0x12, nack_frag({kSampleReader, kSampleWriter}, 5, 1, 0, 0, kCount))));
  }
  static Message beat(std::uint64_t last, std::uint32_t count) {
    return from().add(0x07, heartbeat({kSampleReader, kSampleWriter}, 1, last, count));
  }
  static Message sample(std::uint64_t sequence) {
    return from().add(0x15, data({kSampleReader, kSampleWriter}, sequence), kHasData);
  }
  // From kStart on; its last number.
  std::uint64_t stream(int samples, std::chrono::nanoseconds interval) {
    std::uint64_t sequence = kNewest;
    for (int k = 0; k < samples; ++k)
      EXPECT_TRUE(with.hears(sample(++sequence), kPeerAt, kStart + k * interval));
    return sequence;
  }
  static std::vector<Named> hostile(const Prefix& speaker) {
    const Ends ends{kSampleReader, kSampleWriter, kNewest, kCount};
    return hostile_messages(speaker, kOurs, ends, ends);
  }
  Guarded with;
};

// Law: whatever a datagram says, what is let in moves no number beyond its bound, so that the
// middleware's work on it is bounded; and the honest go on.
TEST_F(Matched, WhateverFieldsSayNumbersMoveWithinTheirBounds) {
  const auto all = hostile(kPeer);
  EXPECT_GT(all.size(), 700U);
  std::size_t let_in = 0;
  for (const Named& hostile : all) {
    if (!with.hears(hostile.bytes)) continue;
    ++let_in;
    rtps_message::Submessages parts(std::span(hostile.bytes).subspan(rtps_message::kHeaderSize));
    while (!parts.done()) {
      const auto statement = rtps_message::statement_of(*parts.next());
      ASSERT_TRUE(statement) << hostile.name;
      EXPECT_LE(statement->newest, kNewest + NumberCourse::kMostSkipped + 1) << hostile.name;
      EXPECT_LE(statement->span, NumberCourse::kMostSkipped) << hostile.name;
      EXPECT_LE(statement->count, kCount + NumberCourse::kMostSkipped + 1) << hostile.name;
    }
  }
  EXPECT_GT(let_in, 0U) << "the small ends are numbers as any other";
  const Time later = kStart + 1s;
  EXPECT_TRUE(with.hears(sample(kNewest + 1), kPeerAt, later));
  EXPECT_TRUE(with.hears(beat(kNewest + 1, kCount + 1), kPeerAt, later));
  EXPECT_TRUE(
      with.hears(from().add(0x06, ack_nack({kSampleReader, kSampleWriter}, 6, 0, 0, kCount + 1)),
                 kPeerAt, later));
}

TEST_F(Matched, NobodyElseOnTheHostSaysAnythingInItsName) {
  for (const Named& hostile : hostile(kPeer))
    EXPECT_FALSE(with.hears(hostile.bytes, kOtherAt)) << hostile.name;
  // From within a message of its own.
  EXPECT_TRUE(with.hears(announcement(kOther), kOtherAt));
  EXPECT_FALSE(with.hears(from(kOther)
                              .add(0x0c, info_source(kPeer))
                              .add(0x07, heartbeat({kSampleReader, kSampleWriter}, 1, 1001, 501)),
                          kOtherAt));
}

TEST_F(Matched, AWriterThatWasCutOffForTenHoursIsHeardAtOnce) {
  constexpr std::uint64_t kAt2kHz = 10ULL * 3600 * 2000;
  const std::uint64_t newest = stream(2000, 500us);
  EXPECT_FALSE(with.hears(beat(newest + kAt2kHz, kCount + 1), kPeerAt, kStart + 1s));
  const Time later = kStart + 10h;
  EXPECT_TRUE(with.hears(beat(newest + kAt2kHz, kCount + 1), kPeerAt, later));
  EXPECT_TRUE(with.hears(sample(newest + kAt2kHz + 1), kPeerAt, later));
}

// What was buffered before a standstill comes first, then the leap over what was lost.
TEST_F(Matched, AfterAStandstillTheLeapMayComeBehindWhatWasBuffered) {
  std::uint64_t sequence = stream(32000, 31us);
  const Time later = kStart + 60s;
  for (int k = 0; k < 5000; ++k)
    EXPECT_TRUE(with.hears(sample(++sequence), kPeerAt, later + k * 10us));
  EXPECT_TRUE(with.hears(sample(sequence + 32000ULL * 60), kPeerAt, later + 60ms));
}

// One that says little is not believed much after a silence.
TEST_F(Matched, AnIdleWritersSilenceEarnsAForgerLittle) {
  EXPECT_TRUE(with.hears(beat(kNewest + 1, kCount + 1), kPeerAt, kStart + 1s));
  EXPECT_TRUE(with.hears(beat(kNewest + 2, kCount + 2), kPeerAt, kStart + 3s));
  EXPECT_FALSE(with.hears(beat(kNewest + 1000000, kCount + 3), kPeerAt, kStart + 10h));
}

TEST_F(Matched, TheFastestStreamIsNeverRefused) {
  std::uint64_t sequence = kNewest;
  for (int k = 0; k < 400000; ++k)  // 200 000 a second
    ASSERT_TRUE(with.hears(sample(++sequence), kPeerAt, kStart + k * 5us)) << k;
}

// Work is bounded by the second, not only by the datagram.
TEST_F(Matched, ManySmallLeapsTogetherMoveNoFurtherThanOne) {
  std::uint64_t newest = kNewest;
  for (std::uint64_t last = kNewest; last < kNewest + (1U << 24U); last += 5000) {
    if (with.hears(beat(last, kCount + 1), kPeerAt, kStart + 500ms)) newest = last;
  }
  EXPECT_LE(newest, kNewest + NumberCourse::kMostSkipped + (NumberCourse::kMostSkipped / 5000) + 2);
}

// A writer tells a new reader in one GAP of all that was before it.
TEST_F(Matched, ALongGapIsTakenOnceForEachReader) {
  with.guard.forget_endpoint(kPeer, kSampleWriter);
  with.guard.expect_endpoint(kPeer, kSampleWriter);
  const auto long_gap = [&](std::uint32_t reader) {
    return from().add(0x08, gap({reader, kSampleWriter}, 1, 100000000));
  };
  EXPECT_TRUE(with.hears(long_gap(kSampleReader)));
  EXPECT_TRUE(with.hears(long_gap(kSampleReader + 0x100)));
  EXPECT_FALSE(with.hears(long_gap(kSampleReader), kPeerAt, kStart + 10h));
  EXPECT_FALSE(with.hears(long_gap(0))) << "to anybody";
}

TEST_F(Matched, AnEndpointThatCameAgainBeginsAnew) {
  EXPECT_FALSE(with.hears(beat(1ULL << 35U, kCount)));
  with.guard.forget_endpoint(kPeer, kSampleWriter);
  with.guard.expect_endpoint(kPeer, kSampleWriter);
  EXPECT_TRUE(with.hears(beat(1ULL << 35U, kCount)));
  with.guard.forget(kPeer);
  with.guard.know(kPeer);
  with.guard.expect_endpoint(kPeer, kSampleWriter);
  EXPECT_TRUE(with.hears(beat(3, 1)));
}

// Whoever makes endpoints up finds that places are kept.
TEST_F(Matched, EndpointsMadeUpDriveNobodyOut) {
  for (std::uint32_t k = 0; k < 20000; ++k) with.guard.expect_endpoint(numbered(k), kSampleWriter);
  EXPECT_FALSE(with.hears(beat(1ULL << 35U, kCount)));
}

// ---------------------------------------- honest peers

struct Recorded {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  Bytes bytes{};
};

std::vector<Recorded> honest_datagrams() {
  std::ifstream file(std::string(ZERODRIFT_SOURCE_DIR) + "/tests/golden/rtps/honest_datagrams.txt");
  std::vector<Recorded> all;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with('#')) continue;
    std::istringstream fields(line);
    Recorded recorded;
    std::string digits;
    fields >> recorded.from >> recorded.to >> digits;
    for (std::size_t k = 0; k + 1 < digits.size(); k += 2)
      recorded.bytes.push_back(
          static_cast<std::uint8_t>(std::stoul(digits.substr(k, 2), nullptr, 16)));
    all.push_back(std::move(recorded));
  }
  return all;
}

// Golden: what our services and Cyclone DDS say to each other. Each port hears its own share, and
// knows everybody and every endpoint from their first word on: the strictest that there is.
TEST(PacketGuard, RefusesNothingThatOurServicesOrAnotherVendorsSay) {
  const auto all = honest_datagrams();
  ASSERT_GT(all.size(), 40U);
  std::map<std::uint32_t, Guarded> guards;
  std::set<std::uint8_t> vendors;
  Time now = kStart;
  for (const Recorded& recorded : all) {
    now += 10ms;
    Guarded& with = guards[recorded.to];
    EXPECT_TRUE(with.hears(recorded.bytes, address("127.0.0.1", recorded.from), now))
        << recorded.from << " to " << recorded.to << ", " << recorded.bytes.size() << " bytes";
    Prefix prefix{};
    std::copy_n(recorded.bytes.begin() + rtps_message::kPrefixAt, prefix.size(), prefix.begin());
    vendors.insert(recorded.bytes[rtps_message::kVendorAt + 1]);
    with.guard.know(prefix);
    rtps_message::Submessages parts(std::span(recorded.bytes).subspan(rtps_message::kHeaderSize));
    while (!parts.done()) {
      const auto statement = rtps_message::statement_of(*parts.next());
      ASSERT_TRUE(statement);
      with.guard.expect_endpoint(prefix, statement->writer);
      with.guard.expect_endpoint(prefix, statement->reader);
    }
  }
  EXPECT_EQ(vendors, (std::set<std::uint8_t>{15, 16})) << "Fast DDS and Cyclone DDS";
}

}  // namespace
}  // namespace zerodrift::dds
