// SPDX-License-Identifier: Apache-2.0
// Whoever can send a datagram to a service's ports can send it anything: what was on the wire
// before, what was on the wire with bits changed, and what never was.
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <random>
#include <set>
#include <span>
#include <string>

#include "common/dds/packet_guard.h"
#include "common/dds/rtps_message.h"
#include "tests/system/raw_datagrams.h"
#include "tests/system/secured_system.h"
#include "tests/unit/dds/rtps_bytes.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

// A sample of the gyro for every so many datagrams of the attacker, so that the genuine stream is
// in the midst of it.
constexpr int kDatagramsPerSample = 40;

class Attack {
 public:
  Attack(SecuredSystem& run, std::uint32_t domain) : run_(run), domain_(domain) {}

  void to(std::uint16_t port, const Bytes& bytes) {
    sender_.send(port, bytes);
    go_on();
  }
  void to_all(const Bytes& bytes) {
    sender_.send_to_all(domain_, bytes);
    go_on();
  }
  void forged_to_all(const ForgedSender& sender, const Bytes& bytes) {
    sender.send_to_all(domain_, bytes);
    go_on();
  }
  [[nodiscard]] int sent() const { return sent_; }

 private:
  // Slow enough for the services' sockets to take all in: nothing is lost on the way to be tried.
  void go_on() {
    if (++sent_ % kDatagramsPerSample != 0) return;
    run_.send();
    std::this_thread::sleep_for(2ms);
  }

  SecuredSystem& run_;
  std::uint32_t domain_;
  RawSender sender_;
  int sent_ = 0;
};

void replay(Attack& attack, const std::vector<Datagram>& recorded) {
  for (int round = 0; round < 2; ++round) {
    for (const Datagram& datagram : recorded) attack.to(datagram.port, datagram.bytes);
  }
}

// In order, drawn at random.
std::vector<Datagram> some_of(const std::vector<Datagram>& all, std::size_t count,
                              std::mt19937_64& random) {
  std::vector<Datagram> some;
  std::sample(all.begin(), all.end(), std::back_inserter(some), count, random);
  return some;
}

// One of each length and destination: announcements, handshakes, keys, samples, heartbeats.
std::vector<Datagram> one_of_each(const std::vector<Datagram>& recorded) {
  std::map<std::pair<std::size_t, std::uint16_t>, Datagram> kinds;
  for (const Datagram& datagram : recorded) {
    kinds.try_emplace({datagram.bytes.size(), datagram.port}, datagram);
  }
  std::vector<Datagram> result;
  for (auto& [kind, datagram] : kinds) result.push_back(std::move(datagram));
  return result;
}

// A bit at every offset of a datagram, but of long ones at a tenth, drawn at random; and the
// datagram cut at these offsets.
void tamper(Attack& attack, const std::vector<Datagram>& kinds, std::mt19937_64& random) {
  for (const Datagram& datagram : kinds) {
    const std::size_t step = datagram.bytes.size() > 600 ? 10 : 1;
    for (std::size_t at = random() % step; at < datagram.bytes.size(); at += step) {
      Bytes changed = datagram.bytes;
      changed[at] = static_cast<std::uint8_t>(changed[at] ^ (1U << (random() % 8)));
      attack.to(datagram.port, changed);
      attack.to(datagram.port, Bytes(datagram.bytes.begin(),
                                     datagram.bytes.begin() + static_cast<std::ptrdiff_t>(at)));
    }
  }
}

// Recorded from before the services start, so that their handshakes are in it.
std::vector<Datagram> record_a_while(SecuredSystem& run, const LoopbackCapture& capture) {
  run.connect();
  for (int k = 0; k < 100; ++k) {
    run.send();
    std::this_thread::sleep_for(10ms);
  }
  return capture.all();
}

// What an attacker who listens knows of a stream: who writes it, and where it is.
struct Stream {
  rtps_bytes::Prefix writes{};
  rtps_bytes::Ends of_writer;
  rtps_bytes::Ends of_reader{.count = 0};  // of whoever reads the answers
  rtps_bytes::Prefix acknowledges{};
  std::uint16_t from = 0;  // the writer's port
};

rtps_bytes::Prefix header_prefix(const Bytes& bytes) {
  rtps_bytes::Prefix prefix{};
  std::copy_n(bytes.begin() + dds::rtps_message::kPrefixAt, prefix.size(), prefix.begin());
  return prefix;
}

std::set<rtps_bytes::Prefix> speakers_in(const std::vector<Datagram>& recorded) {
  std::set<rtps_bytes::Prefix> speakers;
  for (const Datagram& datagram : recorded) {
    if (datagram.bytes.size() > dds::rtps_message::kHeaderSize)
      speakers.insert(header_prefix(datagram.bytes));
  }
  return speakers;
}

// Calls seen(datagram, submessages' statement) for all that is no endpoint of discovery.
template <typename Seen>
void for_each_statement(const std::vector<Datagram>& recorded, const Seen& seen) {
  for (const Datagram& datagram : recorded) {
    if (!dds::is_well_formed(datagram.bytes)) continue;
    dds::rtps_message::Submessages parts(
        std::span(datagram.bytes).subspan(dds::rtps_message::kHeaderSize));
    while (!parts.done()) {
      const auto statement = dds::rtps_message::statement_of(*parts.next());
      const bool of_discovery = (statement->writer & 0xC0U) != 0;
      if (!of_discovery) seen(datagram, *statement);
    }
  }
}

// The gyro is who writes on one topic only; who acknowledges most writes on none.
Stream stream_in(const std::vector<Datagram>& recorded) {
  using Of = dds::rtps_message::Statement::Of;
  std::map<rtps_bytes::Prefix, std::set<std::uint32_t>> writers;
  for_each_statement(recorded, [&](const Datagram& datagram, const auto& statement) {
    if (statement.of == Of::kHeartbeat)
      writers[header_prefix(datagram.bytes)].insert(statement.writer);
  });
  Stream stream;
  for_each_statement(recorded, [&](const Datagram& datagram, const auto& statement) {
    const auto speaker = header_prefix(datagram.bytes);
    if (statement.of == Of::kHeartbeat && writers[speaker].size() == 1) {
      stream.writes = speaker;
      stream.from = datagram.from;
      stream.of_writer = {0, statement.writer, statement.newest, statement.count};
    }
    if (statement.of == Of::kAcknowledgement && !writers.contains(speaker) &&
        statement.count > stream.of_reader.count) {
      stream.acknowledges = speaker;
      stream.of_reader = {statement.reader, statement.writer, 1, statement.count};
    }
  });
  return stream;
}

constexpr std::size_t kReplayed = 1500;
constexpr std::size_t kTampered = 40;
constexpr int kMalformed = 3000;

// Announcements in names that nobody has, 52 bytes each.
void make_names_up(Attack& attack) {
  for (std::uint32_t k = 0; k < 1100; ++k) {
    rtps_bytes::Prefix name = rtps_bytes::prefix_of(200);
    name[0] = static_cast<std::uint8_t>(k);
    name[1] = static_cast<std::uint8_t>(k >> 8U);
    attack.to_all(rtps_bytes::Message(name)
                      .add(0x15, rtps_bytes::data({.writer = 0x000100c2}, 1), 4)
                      .bytes());
  }
}

// Rule: 0 samples get in, none is lost, the service goes on and says what happened.
TEST(PacketAttack, OnASecuredServiceHarmsNothingAndIsTold) {
  SystemUnderTest system(Domain::kSecurityPackets);
  const std::uint32_t domain = system.network().domain;
  const LoopbackCapture capture(domain);
  const Finished made = make_certificates(system, {system.path("security")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  SecuredSystem run(system, system.path("security"));
  auto recorded = record_a_while(run, capture);
  Attack attack(run, domain);
  std::mt19937_64 random(20260721);
  for (int k = 0; k < kMalformed; ++k) attack.to_all(malformed_message(random));
  for (const auto& speaker : speakers_in(recorded)) {
    for (const auto& hostile :
         rtps_bytes::hostile_messages(speaker, {}, {0, 0x103, 100, 100}, {0x204, 0x103, 100, 100}))
      attack.to_all(hostile.bytes);
  }
  run.expect_one_answer_each();
  run.expect_event("packet_refused");
  make_names_up(attack);
  run.expect_newcomer_meets_the_service();

  if (!capture.works()) {
    run.expect_alive_then_stop();
    GTEST_SKIP() << "this user may not capture: nothing was replayed or changed";
  }
  // What was sent to nobody is of no use.
  std::erase_if(recorded, [&](const Datagram& datagram) { return !is_received(domain, datagram); });
  ASSERT_GT(recorded.size(), 200U);
  replay(attack, some_of(recorded, kReplayed, random));
  run.expect_one_answer_each();
  run.expect_event("packet_replayed");

  const std::uint64_t warnings = run.count_of("security_warning");
  tamper(attack, some_of(one_of_each(recorded), kTampered, random), random);
  run.expect_one_answer_each();
  EXPECT_TRUE(eventually([&] { return run.count_of("security_warning") > warnings; }));
  run.expect_alive_then_stop();
  RecordProperty("datagrams", attack.sent());
}

// Without security a changed sample is a sample: all that is promised is that nothing crashes and
// the stream goes on.
TEST(PacketAttack, OnAServiceWithoutSecurityCrashesNothing) {
  SystemUnderTest system(Domain::kPlainPackets);
  const std::uint32_t domain = system.network().domain;
  SecuredSystem run(system, {});
  run.connect();
  Attack attack(run, domain);
  std::mt19937_64 random(20260722);
  for (int k = 0; k < kMalformed; ++k) attack.to_all(malformed_message(random));
  run.expect_one_answer_each();
  run.expect_event("packet_refused", "is malformed");
  run.expect_alive_then_stop();
}

// Well-formed, and hostile in one field: a GAP up to 2^62, a HEARTBEAT far ahead, counts, sizes,
// sets. From another process of the host, in the name of whoever is matched, and of nobody.
TEST(PacketAttack, OfWellFormedMessagesLeavesAServiceWithoutSecurityEverySample) {
  SystemUnderTest system(Domain::kPlainHostile);
  const std::uint32_t domain = system.network().domain;
  const LoopbackCapture capture(domain);
  if (!capture.works()) GTEST_SKIP() << "this user may not capture: the writer's name is not known";
  SecuredSystem run(system, {});
  const auto recorded = record_a_while(run, capture);
  const Stream stream = stream_in(recorded);
  ASSERT_GT(stream.of_writer.newest, 50U);
  ASSERT_GT(stream.of_reader.count, 0U);
  Attack attack(run, domain);
  for (const auto& speaker : {stream.writes, stream.acknowledges, rtps_bytes::prefix_of(77)}) {
    for (const auto& hostile :
         rtps_bytes::hostile_messages(speaker, {}, stream.of_writer, stream.of_reader))
      attack.to_all(hostile.bytes);
  }
  run.expect_one_answer_each();
  // The newest refusal is what is told.
  attack.to_all(rtps_bytes::Message(stream.writes)
                    .add(0x07, rtps_bytes::heartbeat(stream.of_writer, 1, 2, 1))
                    .bytes());
  run.expect_event("packet_refused", "another participant's name");

  // With the right to forge the sender's port too: what is a leap is refused. What is none can be
  // meant, and is believed (deploy/security/README.md).
  constexpr std::uint64_t kLeaps = std::uint64_t{1} << 20U;
  const ForgedSender forged(stream.from);
  for (const auto& hostile :
       rtps_bytes::hostile_messages(stream.writes, {}, stream.of_writer, stream.of_reader, kLeaps))
    attack.forged_to_all(forged, hostile.bytes);
  run.expect_one_answer_each();
  attack.forged_to_all(
      forged, rtps_bytes::Message(stream.writes)
                  .add(0x07, rtps_bytes::heartbeat(stream.of_writer, 1, std::uint64_t{1} << 40U, 1))
                  .bytes());
  run.expect_event("packet_refused", "leaps ahead");
  run.expect_alive_then_stop();
  RecordProperty("datagrams", attack.sent());
}

}  // namespace
}  // namespace zerodrift::system_test
