// SPDX-License-Identifier: Apache-2.0
// What the middleware notices becomes an event with the name of the peer, once for each time it
// begins. Participants here stand for processes, over the loopback interface.
#include <fastdds/rtps/builtin/data/ParticipantProxyData.h>
#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/dds/participant.h"
#include "tests/support/other_terms.h"
#include "tests/unit/dds/test_domain.h"

namespace zerodrift::dds {

// Endpoints of others, who use our topics' names in their own way.
constexpr TopicSpec with_other_ownership(TopicSpec spec) {
  return with_best_effort(with_exclusive_ownership(spec));
}
constexpr TopicSpec with_durability(TopicSpec spec) {
  spec.durability = Durability::kTransientLocal;
  return spec;
}
constexpr TopicSpec of_another_type(TopicSpec spec) {
  spec.type = "foreign::Rate";
  return spec;
}
// Registered under another name than its own.
class ForeignRateType : public msg::AngularRatePubSubType {
 public:
  ForeignRateType() { setName("foreign::Rate"); }
};
struct RateOfAnotherType : msg::AngularRate {};
template <>
struct TopicOf<RateOfAnotherType> {
  using TypeSupport = ForeignRateType;
  static constexpr TopicSpec kSpec = of_another_type(kAngularRate);
};

namespace {

using namespace std::chrono_literals;
using Kind = EndpointEvent::Kind;
using detail::WriterDeadlines;

constexpr std::uint32_t kDomain = 107;

// What a participant's endpoints reported, in all.
class Reported {
 public:
  explicit Reported(Participant& participant) : participant_(participant) {}

  // How often `kind` happened on `topic`; a peer given must be the event's.
  std::uint64_t count(Kind kind, std::string_view topic, const std::string& peer = "") {
    participant_.report_events([this](const EndpointEvent& event) { events_.push_back(event); });
    std::uint64_t sum = 0;
    for (const EndpointEvent& event : events_) {
      if (event.kind != kind || event.topic != topic) continue;
      if (!peer.empty()) {
        EXPECT_EQ(event.peer, peer);
      }
      sum += event.count;
    }
    return sum;
  }
  [[nodiscard]] EndpointEvent last() const { return events_.back(); }

 private:
  Participant& participant_;
  std::vector<EndpointEvent> events_;
};

msg::AngularRate rate(core::ClockSource clock, double interval_s = 0.005) {
  msg::AngularRate message;
  message.gyro_id(7);
  message.clock_source(static_cast<std::uint32_t>(clock));
  message.interval_s(interval_s);
  return message;
}

// ---------------------------------------- laws

TEST(TermsLaws, AnOfferMeetsARequestUnlessItIsWeaker) {
  const detail::Terms terms{.reliability = 2,
                            .durability = 1,
                            .liveliness = 1,
                            .ownership = 0,
                            .deadline_ns = 100,
                            .lease_ns = 200};
  EXPECT_TRUE(unmet(terms, terms).empty());
  const auto only = [&](auto change, detail::Policy policy) {
    detail::Terms more = terms;
    change(more, 1);
    detail::Terms less = terms;
    change(less, -1);
    const bool weaker_is_less = policy != detail::Policy::kDeadline;
    const std::vector<detail::Policy> expected{policy};
    EXPECT_EQ(unmet(weaker_is_less ? less : more, terms), expected);
    EXPECT_TRUE(unmet(weaker_is_less ? more : less, terms).empty());
  };
  only([](auto& t, int by) { t.reliability += by; }, detail::Policy::kReliability);
  only([](auto& t, int by) { t.durability += by; }, detail::Policy::kDurability);
  only([](auto& t, int by) { t.liveliness += by; }, detail::Policy::kLiveliness);
  only([](auto& t, int by) { t.deadline_ns += by; }, detail::Policy::kDeadline);
  detail::Terms longer_lease = terms;
  ++longer_lease.lease_ns;
  EXPECT_EQ(unmet(longer_lease, terms), std::vector{detail::Policy::kLiveliness});
  detail::Terms exclusive = terms;
  exclusive.ownership = 1;
  EXPECT_EQ(unmet(exclusive, terms), std::vector{detail::Policy::kOwnership});
  EXPECT_EQ(unmet(terms, exclusive), std::vector{detail::Policy::kOwnership});
}

// Rule: samples at their consumers' pace, and those of a gyro slower than the deadline, say nothing
// by being late. 100 ms of angular_rate are two periods of 50 ms.
TEST(DeadlineLaws, ApplyToGyrosThatKeepTimeAndAreFastEnough) {
  using core::ClockSource;
  EXPECT_TRUE(detail::deadline_applies(rate(ClockSource::kHardware)));
  EXPECT_TRUE(detail::deadline_applies(rate(ClockSource::kHost)));
  EXPECT_TRUE(detail::deadline_applies(rate(ClockSource::kUnknown, 0.05)));
  EXPECT_FALSE(detail::deadline_applies(rate(ClockSource::kHardware, 0.0501)));
  EXPECT_FALSE(detail::deadline_applies(rate(ClockSource::kReplay)));
  EXPECT_FALSE(detail::deadline_applies(rate(ClockSource::kSimulation)));
  EXPECT_FALSE(detail::deadline_applies(
      rate(ClockSource::kHardware, std::numeric_limits<double>::quiet_NaN())));
  EXPECT_TRUE(detail::deadline_applies(msg::ServiceStatus()));
  EXPECT_EQ(detail::gyro_of(rate(ClockSource::kHost)), 7U);
  EXPECT_EQ(detail::gyro_of(msg::ServiceStatus()), 0U);
}

SampleOrigin origin(unsigned char writer, unsigned char key) {
  SampleOrigin result;
  result.writer.guidPrefix.value[0] = 1;
  result.writer.entityId.value[0] = writer;
  result.instance.value[0] = key;
  return result;
}

constexpr std::chrono::nanoseconds kDeadline = 100ms;
constexpr std::int64_t kMs = 1'000'000;

std::vector<int> silent_writers(WriterDeadlines& deadlines, std::int64_t now_ns) {
  std::vector<int> writers;
  for (const auto& silent : deadlines.silent(kDeadline, now_ns))
    writers.push_back(silent.writer.entityId.value[0]);
  return writers;
}

TEST(WriterDeadlinesLaws, ASilenceIsToldOnceWhetherItLastsOrHasEnded) {
  WriterDeadlines deadlines;
  const SampleOrigin one = origin(1, 1);
  EXPECT_TRUE(deadlines.silent(kDeadline, 1).empty()) << "never heard of";
  std::int64_t now = kMs;
  for (int run = 0; run < 3; ++run) {
    deadlines.note(one, 9, true, kDeadline, now);
    EXPECT_TRUE(deadlines.silent(kDeadline, now + 100 * kMs).empty())
        << "not longer than the deadline";
    now += 101 * kMs;
    const auto silent = deadlines.silent(kDeadline, now);
    ASSERT_EQ(silent.size(), 1U);
    EXPECT_EQ(silent[0].writer, one.writer);
    EXPECT_EQ(silent[0].gyro_id, 9U);
    EXPECT_EQ(silent[0].times, 1U);
    for (int k = 0; k < 10; ++k) EXPECT_TRUE(deadlines.silent(kDeadline, now += 500 * kMs).empty());
  }
  // Nobody asked while it lasted.
  deadlines.note(one, 9, true, kDeadline, now);
  deadlines.note(one, 9, true, kDeadline, now + 300 * kMs);
  deadlines.note(one, 9, true, kDeadline, now + 600 * kMs);
  const auto silent = deadlines.silent(kDeadline, now + 601 * kMs);
  ASSERT_EQ(silent.size(), 1U);
  EXPECT_EQ(silent[0].times, 2U);
}

TEST(WriterDeadlinesLaws, EachWriterAndKeyIsSilentForItself) {
  WriterDeadlines deadlines;
  deadlines.note(origin(1, 1), 0, true, kDeadline, kMs);
  deadlines.note(origin(2, 1), 0, true, kDeadline, 90 * kMs);
  deadlines.note(origin(3, 2), 0, true, kDeadline, 95 * kMs);
  EXPECT_EQ(silent_writers(deadlines, 120 * kMs), (std::vector<int>{1}));
  EXPECT_EQ(silent_writers(deadlines, 300 * kMs), (std::vector<int>{2, 3}));
}

TEST(WriterDeadlinesLaws, ASilenceThatDoesNotApplyIsNotToldAndDecidedByTheSampleBeforeIt) {
  WriterDeadlines deadlines;
  deadlines.note(origin(1, 1), 0, false, kDeadline, kMs);
  EXPECT_TRUE(silent_writers(deadlines, 500 * kMs).empty());
  deadlines.note(origin(1, 1), 0, true, kDeadline, 500 * kMs);
  EXPECT_TRUE(silent_writers(deadlines, 501 * kMs).empty());
  EXPECT_EQ(silent_writers(deadlines, 900 * kMs), (std::vector<int>{1}));
}

TEST(WriterDeadlinesLaws, AWriterThatIsGoneIsNotSilentAndLeavesItsPlace) {
  WriterDeadlines deadlines;
  for (int life = 0; life < 1000; ++life) {
    const auto writer = static_cast<unsigned char>(life % 250 + 1);
    deadlines.note(origin(writer, 1), 0, true, kDeadline, kMs);
    ASSERT_EQ(silent_writers(deadlines, 200 * kMs), (std::vector<int>{writer})) << life;
    deadlines.note(origin(writer, 1), 0, true, kDeadline, 210 * kMs);
    deadlines.forget(origin(writer, 1).writer);
    ASSERT_TRUE(silent_writers(deadlines, 900 * kMs).empty()) << life;
  }
}

TEST(WriterDeadlinesAbuse, MoreWritersThanThereIsRoomForDoNoHarm) {
  WriterDeadlines deadlines;
  for (int key = 0; key < 255; ++key)
    deadlines.note(origin(1, static_cast<unsigned char>(key)), 0, true, kDeadline, kMs);
  EXPECT_EQ(deadlines.silent(kDeadline, 900 * kMs).size(), 128U);
}

// One thread hears while another asks and a third forgets: a sanitizer's case.
TEST(WriterDeadlinesLaws, OtherThreadsMayAskMeanwhile) {
  WriterDeadlines deadlines;
  std::atomic<bool> stop{false};
  std::thread asks([&] {
    while (!stop) {
      for (const auto& silent : deadlines.silent(0ns))
        EXPECT_NE(silent.writer.entityId.value[0], 0);
    }
  });
  std::thread forgets([&] {
    while (!stop) deadlines.forget(origin(2, 2).writer);
  });
  for (int k = 0; k < 100000; ++k) {
    deadlines.note(origin(1, 1), 1, true, 0ns);
    deadlines.note(origin(2, 2), 2, true, 0ns);
  }
  stop = true;
  asks.join();
  forgets.join();
}

// A reader's listener without a reader.
class BareListener final : public detail::ReaderListener {
 public:
  explicit BareListener(detail::Discovery& discovery, EndpointObserver observer = {},
                        const TopicSpec& spec = kAngularRate)
      : ReaderListener(discovery, spec, std::move(observer)) {}

 private:
  void on_writer_gone(const eprosima::fastrtps::rtps::GUID_t&, Departure) override {}
};

TEST(EndpointEventLaws, LostAndRejectedSamplesAreToldByHowManyAreNew) {
  detail::Discovery discovery;
  std::vector<EndpointEvent> reported;
  const auto collect = [&](const EndpointEvent& event) { reported.push_back(event); };
  {
    BareListener listener(discovery);
    eprosima::fastdds::dds::SampleLostStatus lost;
    lost.total_count = 5;
    listener.on_sample_lost(nullptr, lost);
    discovery.report(collect);
    discovery.report(collect);
    ASSERT_EQ(reported.size(), 1U);
    EXPECT_EQ(reported[0].kind, Kind::kSampleLost);
    EXPECT_EQ(reported[0].topic, "angular_rate");
    EXPECT_EQ(reported[0].count, 5U);
    lost.total_count = 7;
    listener.on_sample_lost(nullptr, lost);
    eprosima::fastrtps::SampleRejectedStatus rejected;
    rejected.total_count = 3;
    listener.on_sample_rejected(nullptr, rejected);
  }
  discovery.report(collect);  // also of an endpoint that is gone by then
  ASSERT_EQ(reported.size(), 3U);
  EXPECT_EQ(reported[1].count, 2U);
  EXPECT_EQ(reported[2].kind, Kind::kSampleRejected);
  EXPECT_EQ(reported[2].count, 3U);
}

// Rule: where a newer sample has replaced what was lost, nothing is told, since nothing is missing.
TEST(EndpointEventLaws, OfATopicThatKeepsTheNewestAloneNothingIsLost) {
  detail::Discovery discovery;
  int reported = 0;
  BareListener listener(discovery, {}, kServiceStatus);
  eprosima::fastdds::dds::SampleLostStatus lost;
  lost.total_count = 5;
  listener.on_sample_lost(nullptr, lost);
  discovery.report([&](const EndpointEvent&) { ++reported; });
  EXPECT_EQ(reported, 0);
}

TEST(EndpointEventLaws, AnEndpointsOwnObserverIsToldInPlaceOfTheParticipants) {
  detail::Discovery discovery;
  int own = 0;
  int otherwise = 0;
  BareListener with(discovery, [&](const EndpointEvent&) { ++own; });
  BareListener without(discovery);
  eprosima::fastdds::dds::SampleLostStatus lost;
  lost.total_count = 1;
  with.on_sample_lost(nullptr, lost);
  discovery.report([&](const EndpointEvent&) { ++otherwise; });
  EXPECT_EQ(own, 1);
  EXPECT_EQ(otherwise, 0);
  without.on_sample_lost(nullptr, lost);
  discovery.report([&](const EndpointEvent&) { ++otherwise; });
  discovery.report({});  // nobody: dropped without harm
  EXPECT_EQ(own, 1);
  EXPECT_EQ(otherwise, 1);
}

TEST(EndpointEventAbuse, AFloodOfDifferentEventsIsBoundedAndNoneIsUncounted) {
  constexpr std::uint32_t kFlood = 10000;
  detail::Discovery discovery;
  const detail::Endpoint endpoint(kAngularRate, Direction::kReader, {});
  for (std::uint32_t gyro = 0; gyro < kFlood; ++gyro)
    discovery.note(endpoint, Kind::kDeadlineMissed, eprosima::fastrtps::rtps::GUID_t::unknown(),
                   "silent", gyro);
  std::size_t reported = 0;
  std::uint64_t sum = 0;
  discovery.report([&](const EndpointEvent& event) {
    ++reported;
    sum += event.count;
  });
  EXPECT_LE(reported, 256U);
  EXPECT_EQ(sum, kFlood);
}

TEST(EndpointEventLaws, APeerThatIsNotHeardOfAnyMoreIsNamed) {
  using Info = eprosima::fastrtps::rtps::ParticipantDiscoveryInfo;
  eprosima::fastrtps::rtps::ParticipantProxyData data{{}};
  data.m_guid.guidPrefix.value[0] = 1;
  data.m_participantName = "gyro_publisher";
  detail::Discovery discovery;
  std::vector<EndpointEvent> reported;
  for (const auto status : {Info::DISCOVERED_PARTICIPANT, Info::REMOVED_PARTICIPANT,
                            Info::DISCOVERED_PARTICIPANT, Info::DROPPED_PARTICIPANT}) {
    Info info(data);
    info.status = status;
    discovery.on_participant_discovery(nullptr, std::move(info));
  }
  discovery.report([&](const EndpointEvent& event) { reported.push_back(event); });
  ASSERT_EQ(reported.size(), 1U) << "one that says that it ends is no event";
  EXPECT_EQ(reported[0].kind, Kind::kPeerLost);
  EXPECT_EQ(reported[0].peer, "gyro_publisher");
  EXPECT_EQ(reported[0].topic, "");
}

TEST(AcquaintanceLaws, APeerIsUnfinishedUntilAWriterOfItIsKnown) {
  using Info = eprosima::fastrtps::rtps::ParticipantDiscoveryInfo;
  using WriterInfo = eprosima::fastrtps::rtps::WriterDiscoveryInfo;
  eprosima::fastrtps::rtps::ParticipantProxyData data{{}};
  data.m_guid.guidPrefix.value[0] = 1;
  detail::Discovery discovery;
  EXPECT_EQ(discovery.acquaintance(), Acquaintance{});
  Info info(data);
  info.status = Info::DISCOVERED_PARTICIPANT;
  discovery.on_participant_discovery(nullptr, std::move(info));
  EXPECT_EQ(discovery.acquaintance(), (Acquaintance{.peers = 1, .unfinished = 1}));
  eprosima::fastrtps::rtps::WriterProxyData writer(1, 1);
  writer.guid({data.m_guid.guidPrefix, 0x103});
  WriterInfo found(writer);
  found.status = WriterInfo::DISCOVERED_WRITER;
  discovery.on_publisher_discovery(nullptr, std::move(found));
  EXPECT_EQ(discovery.acquaintance(), (Acquaintance{.peers = 1, .endpoints = 1}));
}

// ---------------------------------------- scenarios

// The deadline is 100 ms. A pause of 350 ms holds three periods: one run. A machine that holds this
// process up for a tenth of a second between two samples makes one more, so single samples are
// sent.
TEST(Deadlines, AreToldOnceForEachRunOnBothSidesWithThePeersName) {
  const TestDomain domain(kDomain);
  Participant publisher("gyro_publisher", domain.network());
  Participant subscriber("compensation", domain.network());
  Reported offered(publisher);
  Reported requested(subscriber);
  std::atomic<int> received{0};
  const Reader<msg::AngularRate> reader(
      subscriber, [&](const msg::AngularRate&, const SampleOrigin&) { ++received; });
  Writer<msg::AngularRate> writer(publisher);
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1 && reader.matched() == 1; }));
  auto sample = rate(core::ClockSource::kHardware);
  for (std::uint64_t run = 1; run <= 2; ++run) {
    ASSERT_TRUE(writer.write(sample));
    ASSERT_TRUE(eventually([&] { return received == static_cast<int>(run); }));
    std::this_thread::sleep_for(350ms);
    EXPECT_EQ(requested.count(Kind::kDeadlineMissed, "angular_rate", "gyro_publisher"), run);
    EXPECT_EQ(requested.last().gyro_id, 7U);
    EXPECT_NE(requested.last().detail.find("gyro_publisher (pid " + std::to_string(getpid()) + ")"),
              std::string::npos)
        << requested.last().detail;
    EXPECT_EQ(offered.count(Kind::kDeadlineMissed, "angular_rate"), run);
  }
  // A replay's samples come at the pace of its consumers.
  auto replayed = rate(core::ClockSource::kReplay);
  ASSERT_TRUE(writer.write(replayed));
  ASSERT_TRUE(eventually([&] { return received == 3; }));
  std::this_thread::sleep_for(350ms);
  EXPECT_EQ(requested.count(Kind::kDeadlineMissed, "angular_rate"), 2U);
  EXPECT_EQ(offered.count(Kind::kDeadlineMissed, "angular_rate"), 2U);
}

TEST(IncompatibleQos, IsToldWithTopicPolicyAndPeerWhoeverComesFirst) {
  const TestDomain domain(kDomain);
  Participant stranger("stranger", domain.network());
  Reported strangers(stranger);
  Participant ours("compensation", domain.network());
  Reported reported(ours);
  const auto nothing = [](const msg::AngularRate&, const SampleOrigin&) {};
  const auto first = std::make_unique<Reader<msg::AngularRate>>(ours, nothing);
  const Writer<OnOtherTerms<msg::AngularRate, with_best_effort>> weak(stranger);
  ASSERT_TRUE(eventually(
      [&] { return reported.count(Kind::kIncompatibleQos, "angular_rate", "stranger") == 1; }));
  EXPECT_NE(
      reported.last().detail.find("offers reliability best_effort, this reader asks for reliable"),
      std::string::npos)
      << reported.last().detail;
  // The stranger is told as well.
  ASSERT_TRUE(eventually([&] {
    return strangers.count(Kind::kIncompatibleQos, "angular_rate", "compensation") == 1;
  }));
  EXPECT_NE(strangers.last().detail.find("asks for reliability reliable, this writer offers"),
            std::string::npos)
      << strangers.last().detail;
  // A second reader, that comes later, is told of the same peer.
  const Reader<msg::AngularRate> second(ours, nothing);
  EXPECT_TRUE(eventually(
      [&] { return reported.count(Kind::kIncompatibleQos, "angular_rate", "stranger") == 2; }));
  EXPECT_EQ(second.matched(), 0);
}

TEST(IncompatibleQos, NamesEveryPolicyThatIsUnmet) {
  const TestDomain domain(kDomain);
  Participant ours("compensation", domain.network());
  Reported reported(ours);
  const Reader<msg::AngularRate> reader(ours, [](const msg::AngularRate&, const SampleOrigin&) {});
  Participant stranger("stranger", domain.network());
  const Writer<OnOtherTerms<msg::AngularRate, with_other_ownership>> weak(
      stranger);  // best effort, exclusive
  ASSERT_TRUE(eventually([&] {
    return reported.count(Kind::kIncompatibleQos, "angular_rate", "stranger") >= 2;
  })) << reported.count(Kind::kIncompatibleQos, "angular_rate");
}

TEST(IncompatibleQos, OfAReaderThatAsksForMoreNamesIt) {
  const TestDomain domain(kDomain);
  Participant ours("gyro_publisher", domain.network());
  Reported reported(ours);
  const Writer<msg::AngularRate> writer(ours);
  Participant stranger("autopilot", domain.network());
  const Reader<OnOtherTerms<msg::AngularRate, with_durability>> hasty(
      stranger, [](const OnOtherTerms<msg::AngularRate, with_durability>&, const SampleOrigin&) {});
  ASSERT_TRUE(eventually(
      [&] { return reported.count(Kind::kIncompatibleQos, "angular_rate", "autopilot") == 1; }));
  EXPECT_NE(reported.last().detail.find(
                "asks for durability transient_local, this writer offers volatile"),
            std::string::npos)
      << reported.last().detail;
}

TEST(TypeMismatch, IsToldWithBothTypesAndThePeer) {
  const TestDomain domain(kDomain);
  Participant ours("compensation", domain.network());
  Reported reported(ours);
  const Reader<msg::AngularRate> reader(ours, [](const msg::AngularRate&, const SampleOrigin&) {});
  Participant stranger("stranger", domain.network());
  const Writer<RateOfAnotherType> writer(stranger);
  ASSERT_TRUE(eventually(
      [&] { return reported.count(Kind::kTypeMismatch, "angular_rate", "stranger") == 1; }));
  EXPECT_NE(
      reported.last().detail.find("writes foreign::Rate, here it is zerodrift::msg::AngularRate"),
      std::string::npos)
      << reported.last().detail;
  EXPECT_EQ(reported.count(Kind::kIncompatibleQos, "angular_rate"), 0U);
}

// The lease is 2 s; 20 s is a participant's.
TEST(Liveliness, AWriterThatFallsSilentIsGoneOnceAndIsHeardAgain) {
  const TestDomain domain(kDomain);
  Participant consumer("compensation", domain.network());
  Participant publisher("gyro_publisher", domain.network());
  Reported reported(publisher);
  std::atomic<int> heard{0};
  std::atomic<int> gone{0};
  Reader<msg::ReplayProgress> reader(
      publisher, [&](const msg::ReplayProgress&, const SampleOrigin&) { ++heard; }, {},
      [&](const eprosima::fastrtps::rtps::GUID_t&, Departure) { ++gone; });
  auto writer = std::make_unique<Writer<msg::ReplayProgress>>(consumer);
  ASSERT_TRUE(eventually([&] { return writer->matched() == 1 && reader.matched() == 1; }));
  msg::ReplayProgress progress;
  const auto is_heard = [&] {
    const int before = heard;
    return eventually([&] {
      writer->write(progress);
      return heard > before;
    });
  };
  ASSERT_TRUE(is_heard());
  EXPECT_EQ(gone, 0);
  ASSERT_TRUE(eventually([&] { return gone == 1; }, 15s));
  EXPECT_EQ(reported.count(Kind::kLivelinessLost, "replay_progress", "compensation"), 1U);
  EXPECT_EQ(reader.matched(), 1);
  ASSERT_TRUE(is_heard());
  EXPECT_TRUE(eventually([&] {
    return reported.count(Kind::kLivelinessRegained, "replay_progress", "compensation") == 1;
  }));
  // Gone a second time, now for good.
  writer.reset();
  EXPECT_TRUE(eventually([&] { return gone == 2; }));
}

}  // namespace
}  // namespace zerodrift::dds
