// SPDX-License-Identifier: Apache-2.0
// Whoever can send a datagram to a service's ports can send it anything: what was on the wire
// before, what was on the wire with bits changed, and what never was.
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <random>
#include <string>

#include "tests/system/raw_datagrams.h"
#include "tests/system/secured_system.h"

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

constexpr std::size_t kReplayed = 1500;
constexpr std::size_t kTampered = 40;
constexpr int kMalformed = 3000;

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
  run.expect_one_answer_each();
  run.expect_event("packet_refused");

  if (!capture.works()) {
    run.expect_alive_then_stop();
    GTEST_SKIP() << "this user may not capture: nothing was replayed or changed";
  }
  // What was sent to nobody is of no use.
  std::erase_if(recorded, [&](const Datagram& datagram) { return !is_heard(domain, datagram); });
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

}  // namespace
}  // namespace zerodrift::system_test
