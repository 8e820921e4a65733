// SPDX-License-Identifier: Apache-2.0
// A publisher's pacer and its consumers' reporters, each in a participant of its own, over the
// loopback interface. Progress is best effort and repeated, so the consumers here repeat it too.
#include "common/service/replay_pacer.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/dds/topics.h"
#include "tests/unit/dds/test_domain.h"

namespace zerodrift::service {
namespace {

using dds::eventually;
using dds::TestDomain;
using std::chrono_literals::operator""ms;
using std::chrono_literals::operator""s;

constexpr std::uint32_t kDomain = 106;
constexpr std::uint32_t kGyro = 7;
constexpr std::uint64_t kFirst = 1000;
constexpr std::uint64_t kWindow = ReplayCredit::kWindow;
constexpr auto kAtOnce = 0ms;
constexpr auto kAWhile = 50ms;

class Consumer {
 public:
  Consumer(const TestDomain& domain, const std::string& name)
      : participant_(name, domain.network()), reporter_(participant_, name) {}

  ReplayProgressReporter& reporter() { return reporter_; }

 private:
  dds::Participant participant_;
  ReplayProgressReporter reporter_;
};

class Pacing : public testing::Test {
 protected:
  explicit Pacing(std::vector<std::string> wait_for = {"one", "two"})
      : pacer_(publisher_, kGyro, std::move(wait_for)) {}

  // Says the same until the pacer has understood it.
  void announced(Consumer& consumer, const std::string& still_missing) {
    ASSERT_TRUE(eventually([&] {
      consumer.reporter().announce();
      return pacer_.missing_consumers() == still_missing;
    }));
  }
  // Sends as many samples as there is room for, `limit` at most; what was sent last.
  std::uint64_t send_all_there_is_room_for(std::uint64_t from, std::uint64_t limit = 10 * kWindow) {
    std::uint64_t sequence = from;
    while (sequence - from < limit && pacer_.wait_for_room(sequence, kFirst, kAWhile)) ++sequence;
    return sequence - 1;
  }
  // True once a sample has room, with this consumer repeating its progress.
  bool room_after(Consumer& consumer, std::uint64_t taken, std::uint64_t sequence) {
    return eventually([&] {
      consumer.reporter().report(kGyro, taken, core::SensorTime{0});
      return pacer_.wait_for_room(sequence, kFirst, kAtOnce);
    });
  }

  TestDomain domain_{kDomain};
  dds::Participant publisher_{"publisher", domain_.network()};
  ReplayPacer pacer_;
};

class PacingOne : public Pacing {
 protected:
  PacingOne() : Pacing({"one"}) {}
};

class PacingNobody : public Pacing {
 protected:
  PacingNobody() : Pacing(std::vector<std::string>{}) {}
};

TEST(ReplayPacerLaws, TheHistoryOfSampleTopicsHoldsManyWindows) {
  // A quarter of the history may be on its way: nothing can be overwritten before it is taken, even
  // with several times the window held up by the transport.
  for (const dds::TopicSpec& spec :
       {dds::kAngularRate, dds::kRateReference, dds::kCompensatedRate}) {
    EXPECT_GE(static_cast<std::uint64_t>(spec.depth), 4 * kWindow) << spec.name;
  }
}

TEST_F(Pacing, NamesTheConsumersThatAreMissing) {
  EXPECT_TRUE(pacer_.anybody_to_wait_for());
  EXPECT_EQ(pacer_.missing_consumers(), "one, two");
  EXPECT_FALSE(pacer_.wait_for_consumers(kAtOnce));
  Consumer two(domain_, "two");
  announced(two, "one");
  EXPECT_FALSE(pacer_.wait_for_consumers(kAtOnce));
  Consumer one(domain_, "one");
  announced(one, "");
  EXPECT_TRUE(pacer_.wait_for_consumers(kAtOnce));
}

// The monitor hears what the compensation answers: of what was answered before they were connected
// it never takes anything.
TEST_F(Pacing, OneThatTookNothingJoinsOnceAnotherTookAll) {
  Consumer one(domain_, "one");
  announced(one, "two");
  Consumer two(domain_, "two");
  announced(two, "");
  const std::uint64_t newest = send_all_there_is_room_for(kFirst);
  EXPECT_EQ(newest, kFirst + kWindow - 1);
  EXPECT_EQ(pacer_.let_unconnected_join(kFirst), "") << "nobody took anything";
  for (int k = 0; k < 20; ++k) {
    one.reporter().report(kGyro, newest - 1, core::SensorTime{0});
    std::this_thread::sleep_for(5ms);
    ASSERT_EQ(pacer_.let_unconnected_join(kFirst), "") << "some are still on their way";
  }
  EXPECT_FALSE(pacer_.wait_for_room(newest + 1, kFirst, kAtOnce));
  EXPECT_TRUE(eventually([&] {
    one.reporter().report(kGyro, newest, core::SensorTime{0});
    return pacer_.let_unconnected_join(kFirst) == "two";
  }));
  EXPECT_EQ(pacer_.let_unconnected_join(kFirst), "") << "once";
  EXPECT_TRUE(pacer_.wait_for_room(newest + 1, kFirst, kAtOnce));
}

TEST_F(PacingNobody, NobodyIsWaitedForWhereNobodyIsNamed) {
  EXPECT_FALSE(pacer_.anybody_to_wait_for());
  EXPECT_EQ(pacer_.missing_consumers(), "");
  EXPECT_TRUE(pacer_.wait_for_consumers(kAtOnce));
  EXPECT_EQ(send_all_there_is_room_for(kFirst), kFirst + 10 * kWindow - 1);
  EXPECT_TRUE(pacer_.wait_for_all(kFirst + 10 * kWindow, kFirst, kAtOnce));
}

TEST_F(PacingOne, ExactlyOneWindowIsSentBeforeTheFirstAnswer) {
  Consumer one(domain_, "one");
  announced(one, "");
  EXPECT_EQ(send_all_there_is_room_for(kFirst), kFirst + kWindow - 1);
}

TEST_F(PacingOne, EachAnswerMakesRoomForAsManyAsItTook) {
  Consumer one(domain_, "one");
  announced(one, "");
  const std::uint64_t sent = send_all_there_is_room_for(kFirst);
  ASSERT_TRUE(room_after(one, kFirst + 9, sent + 1));
  EXPECT_EQ(send_all_there_is_room_for(sent + 2), sent + 10);
}

TEST_F(Pacing, TheSlowestConsumerDecides) {
  Consumer one(domain_, "one");
  Consumer two(domain_, "two");
  announced(one, "two");
  announced(two, "");
  const std::uint64_t sent = send_all_there_is_room_for(kFirst);
  EXPECT_EQ(sent, kFirst + kWindow - 1);
  for (int i = 0; i < 10; ++i) one.reporter().report(kGyro, sent, core::SensorTime{0});
  EXPECT_FALSE(pacer_.wait_for_room(sent + 1, kFirst, kAWhile));
  EXPECT_TRUE(room_after(two, kFirst, sent + 1));
  EXPECT_FALSE(pacer_.wait_for_room(sent + 2, kFirst, kAWhile));
}

// Redundant instances: one that is slower must lose nothing, or it no longer answers the same; one
// that died must not hold up the replay for as long as it takes to be missed.
TEST_F(PacingOne, OfSeveralWithOneNameAllAreKeptPaceWithAndTheFurthestCannotBeLeftBehind) {
  Consumer quick(domain_, "one");
  Consumer slow(domain_, "one");
  announced(quick, "");
  std::uint64_t sent = send_all_there_is_room_for(kFirst);
  EXPECT_GE(sent, kFirst + kWindow - 1);
  // The slow one has taken nothing yet. It is known once the quick one alone makes no room.
  EXPECT_TRUE(eventually([&] {
    slow.reporter().announce();
    quick.reporter().report(kGyro, sent, core::SensorTime{0});
    sent = send_all_there_is_room_for(sent + 1, 1);
    return !pacer_.wait_for_room(sent + 1, kFirst, kAWhile);
  }));
  EXPECT_EQ(pacer_.leave_behind(kFirst), "one");
  EXPECT_TRUE(room_after(quick, sent, sent + 1));
  ++sent;
  const auto is_all_taken = [&](std::uint64_t by_quick, std::uint64_t by_slow) {
    for (int i = 0; i < 10; ++i) {
      quick.reporter().report(kGyro, by_quick, core::SensorTime{0});
      slow.reporter().report(kGyro, by_slow, core::SensorTime{0});
    }
    return pacer_.wait_for_all(sent, kFirst, kAWhile);
  };
  EXPECT_TRUE(eventually([&] { return is_all_taken(sent, sent); })) << "both are known";
  EXPECT_TRUE(eventually([&] { return !is_all_taken(sent, sent - 5); })) << "the slow one is";
  EXPECT_EQ(pacer_.leave_behind(kFirst), "one");
  EXPECT_TRUE(is_all_taken(sent, sent - 5));
  EXPECT_TRUE(eventually([&] { return !is_all_taken(sent, sent - 4); })) << "it gets on again";
  EXPECT_EQ(pacer_.leave_behind(kFirst), "one");
  EXPECT_TRUE(eventually([&] { return !is_all_taken(sent - 4, sent - 4); }));
  EXPECT_EQ(pacer_.leave_behind(kFirst), "") << "somebody of that name must take them";
}

// A recorder that comes in mid-replay must not lose what it says that it records.
TEST_F(PacingOne, OneThatIsNotNamedIsKeptPaceWithFromItsFirstReportOn) {
  Consumer one(domain_, "one");
  Consumer recorder(domain_, "recorder");
  announced(one, "");
  recorder.reporter().announce();
  const std::uint64_t sent = send_all_there_is_room_for(kFirst);
  // Both say where they are, until the pacer has heard both.
  const auto is_all_taken = [&](std::uint64_t by_one, std::uint64_t by_recorder) {
    for (int i = 0; i < 10; ++i) {
      one.reporter().report(kGyro, by_one, core::SensorTime{0});
      recorder.reporter().report(kGyro, by_recorder, core::SensorTime{0});
    }
    return pacer_.wait_for_all(sent, kFirst, kAWhile);
  };
  EXPECT_TRUE(eventually([&] { return is_all_taken(sent, sent); }));
  EXPECT_TRUE(eventually([&] { return !is_all_taken(sent, sent - 1); })) << "it is waited for";
  EXPECT_EQ(pacer_.leave_behind(kFirst), "recorder");
  EXPECT_TRUE(is_all_taken(sent, sent - 1)) << "until it gets on";
  EXPECT_EQ(pacer_.leave_behind(kFirst), "");
  EXPECT_TRUE(eventually([&] { return !is_all_taken(sent, sent - 2); })) << "it is heard again";
}

TEST_F(Pacing, AConsumerThatIsGoneIsNoLongerWaitedFor) {
  Consumer one(domain_, "one");
  auto two = std::make_unique<Consumer>(domain_, "two");
  announced(one, "two");
  announced(*two, "");
  const std::uint64_t sent = send_all_there_is_room_for(kFirst);
  for (int i = 0; i < 10; ++i) two->reporter().report(kGyro, kFirst, core::SensorTime{0});
  ASSERT_TRUE(room_after(one, sent, sent + 1)) << "one more, for the one that two took";
  EXPECT_FALSE(pacer_.wait_for_room(sent + 2, kFirst, kAWhile));
  two.reset();
  EXPECT_TRUE(room_after(one, sent, sent + 2));
  EXPECT_EQ(pacer_.missing_consumers(), "two");
  EXPECT_FALSE(pacer_.wait_for_consumers(kAtOnce));
}

TEST_F(PacingOne, AConsumerThatComesAgainStandsWhereTheReplayIs) {
  auto first_life = std::make_unique<Consumer>(domain_, "one");
  announced(*first_life, "");
  const std::uint64_t sent = send_all_there_is_room_for(kFirst);
  ASSERT_TRUE(room_after(*first_life, sent, sent + 1));
  first_life.reset();
  ASSERT_TRUE(eventually([&] { return pacer_.missing_consumers() == "one"; }));
  const std::uint64_t later = send_all_there_is_room_for(sent + 2);
  EXPECT_EQ(later, sent + 1 + 10 * kWindow) << "nobody is there to wait for";

  Consumer second_life(domain_, "one");
  announced(second_life, "");
  EXPECT_EQ(send_all_there_is_room_for(later + 1), later + kWindow);
}

// Who comes again says so before its reader of the rates is met, and a whole window may go out in
// between.
TEST_F(PacingOne, WhatWasSentBeforeAReaderWasMetIsNotWaitedFor) {
  std::atomic<bool> is_heard{false};
  eprosima::fastrtps::rtps::GUID_t reader_of_one;
  dds::Reader<msg::ReplayProgress> ear(
      publisher_, [&](const msg::ReplayProgress&, const dds::SampleOrigin& origin) {
        if (!is_heard) reader_of_one.guidPrefix = origin.writer.guidPrefix;
        is_heard = true;
      });
  ASSERT_TRUE(pacer_.wait_for_room(kFirst, kFirst, kAtOnce)) << "nobody is there to wait for";
  Consumer one(domain_, "one");
  announced(one, "");
  ASSERT_TRUE(eventually([&] { return is_heard.load(); }));
  const std::uint64_t sent = send_all_there_is_room_for(kFirst + 1);
  ASSERT_EQ(sent, kFirst + kWindow);
  pacer_.note_reader(eprosima::fastrtps::rtps::GUID_t{});
  EXPECT_FALSE(pacer_.wait_for_room(sent + 1, kFirst, kAtOnce)) << "a reader of somebody else";
  pacer_.note_reader(reader_of_one);
  EXPECT_EQ(send_all_there_is_room_for(sent + 1), sent + kWindow);
  ASSERT_TRUE(room_after(one, sent + 1, sent + kWindow + 1)) << "it takes what comes";
  pacer_.note_reader(reader_of_one);
  EXPECT_FALSE(pacer_.wait_for_room(sent + kWindow + 2, kFirst, kAtOnce)) << "it has taken some";
}

// Rule: what was sent while the compensation was not there never comes to the monitor behind it,
// whether or not that one had taken all that the compensation took.
class PacingBehind : public Pacing, public testing::WithParamInterface<std::uint64_t> {};
INSTANTIATE_TEST_SUITE_P(Samples, PacingBehind, testing::Values(0U, 1U, 100U));

TEST_P(PacingBehind, OneThatCameAgainNobodyIsWaitedForWithWhatThatOneMissed) {
  auto one = std::make_unique<Consumer>(domain_, "one");
  Consumer two(domain_, "two");
  announced(*one, "two");
  announced(two, "");
  const std::uint64_t taken = send_all_there_is_room_for(kFirst);
  std::uint64_t newest = taken;
  ASSERT_TRUE(eventually([&] {
    one->reporter().report(kGyro, taken, core::SensorTime{0});
    two.reporter().report(kGyro, taken - GetParam(), core::SensorTime{0});
    newest = send_all_there_is_room_for(newest + 1);
    return newest == taken - GetParam() + kWindow;
  }));
  one.reset();
  ASSERT_TRUE(eventually([&] { return pacer_.missing_consumers() == "one"; }));
  EXPECT_FALSE(pacer_.wait_for_room(newest + 1, kFirst, kAWhile)) << "nobody takes";

  Consumer again(domain_, "one");
  announced(again, "");
  EXPECT_EQ(send_all_there_is_room_for(newest + 1), newest + kWindow);
  EXPECT_TRUE(eventually([&] {
    again.reporter().report(kGyro, newest + kWindow, core::SensorTime{0});
    two.reporter().report(kGyro, newest + kWindow, core::SensorTime{0});
    return pacer_.wait_for_all(newest + kWindow, kFirst, kAtOnce);
  }));
}

// ... and where its first answers went out before the monitor met it, those neither.
TEST_F(Pacing, WhoTookNothingSinceAnotherCameAgainJoinsOnceThatOneTookAll) {
  auto one = std::make_unique<Consumer>(domain_, "one");
  Consumer two(domain_, "two");
  announced(*one, "two");
  announced(two, "");
  ASSERT_TRUE(pacer_.wait_for_room(kFirst, kFirst, kAtOnce));
  ASSERT_TRUE(eventually([&] {
    one->reporter().report(kGyro, kFirst, core::SensorTime{0});
    two.reporter().report(kGyro, kFirst, core::SensorTime{0});
    return pacer_.wait_for_all(kFirst, kFirst, kAtOnce);
  }));
  one.reset();
  ASSERT_TRUE(eventually([&] { return pacer_.missing_consumers() == "one"; }));
  Consumer again(domain_, "one");
  announced(again, "");
  const std::uint64_t newest = send_all_there_is_room_for(kFirst + 1);
  EXPECT_EQ(pacer_.let_unconnected_join(kFirst), "");
  EXPECT_TRUE(eventually([&] {
    again.reporter().report(kGyro, newest, core::SensorTime{0});
    return pacer_.let_unconnected_join(kFirst) == "two";
  }));
  EXPECT_TRUE(pacer_.wait_for_room(newest + 1, kFirst, kAtOnce));
}

// Rule: a consumer that stands still, here for one and a half times the topic's lease, would lose
// what was sent meanwhile: it is waited for until it has left.
TEST_F(PacingOne, AConsumerThatSaysNothingIsWaitedForUntilItLeaves) {
  dds::Participant consumer("one", domain_.network());
  std::optional<dds::Writer<msg::ReplayProgress>> writer(consumer);
  const auto say = [&](std::uint32_t gyro, std::uint64_t taken) {
    msg::ReplayProgress progress;
    progress.consumer("one");
    progress.gyro_id(gyro);
    progress.sequence_number(taken);
    writer->write(progress);
  };
  ASSERT_TRUE(eventually([&] {
    say(0, 0);
    return pacer_.missing_consumers().empty();
  }));
  const std::uint64_t sent = send_all_there_is_room_for(kFirst);
  EXPECT_EQ(sent, kFirst + kWindow - 1);
  EXPECT_FALSE(pacer_.wait_for_room(sent + 1, kFirst, dds::kReplayProgress.lease * 3 / 2));
  EXPECT_EQ(pacer_.missing_consumers(), "");
  ASSERT_TRUE(eventually([&] {
    say(kGyro, sent);
    return pacer_.wait_for_room(sent + 1, kFirst, kAtOnce);
  }));
  send_all_there_is_room_for(sent + 2);
  writer.reset();
  ASSERT_TRUE(pacer_.wait_for_room(sent + kWindow + 2, kFirst, 10s));
  EXPECT_EQ(pacer_.missing_consumers(), "one");
}

// Rule: a publisher of temperatures says on the same topic what it has, and is no consumer.
TEST_F(PacingOne, APublisherOfTemperaturesIsNoConsumer) {
  dds::Participant participant("thermal", domain_.network());
  ReplayProgressReporter thermal(participant, kGyro, {"coil", "case"});
  std::atomic<int> said{0};
  dds::Reader<msg::ReplayProgress> reader(
      publisher_, [&](const msg::ReplayProgress& progress, const dds::SampleOrigin&) {
        if (progress.gyro_id() == kGyro && std::string(progress.probes().c_str()) == "coil,case")
          ++said;
      });
  ASSERT_TRUE(eventually([&] { return said >= 2; }));
  EXPECT_EQ(pacer_.missing_consumers(), "one");
  EXPECT_THROW(
      ReplayProgressReporter(participant, kGyro, {std::string(200, 'a'), std::string(56, 'b')}),
      std::invalid_argument);
}

// Rule: a consumer that lives but is busy, here for one and a half times the lease, is waited for.
TEST_F(PacingOne, ABusyConsumerIsNeverTakenForGone) {
  Consumer one(domain_, "one");
  announced(one, "");
  const std::uint64_t sent = send_all_there_is_room_for(kFirst);
  EXPECT_FALSE(pacer_.wait_for_room(sent + 1, kFirst, dds::kReplayProgress.lease * 3 / 2));
  EXPECT_EQ(pacer_.missing_consumers(), "");
}

TEST_F(PacingOne, AJumpInTheSequenceNumbersIsNotWaitedFor) {
  Consumer one(domain_, "one");
  announced(one, "");
  ASSERT_TRUE(pacer_.wait_for_room(kFirst, kFirst, kAtOnce));
  ASSERT_TRUE(room_after(one, kFirst, kFirst + 1));
  const std::uint64_t after_a_gap = kFirst + 100 * kWindow;
  ASSERT_TRUE(room_after(one, kFirst + 1, after_a_gap));
  EXPECT_FALSE(pacer_.wait_for_room(after_a_gap + 1, kFirst, kAWhile)) << "until it was taken";
  EXPECT_TRUE(room_after(one, after_a_gap, after_a_gap + 1));
}

TEST_F(PacingOne, ASequenceNumberThatGoesBackIsNotWaitedFor) {
  Consumer one(domain_, "one");
  announced(one, "");
  ASSERT_TRUE(pacer_.wait_for_room(kFirst, kFirst, kAtOnce));
  EXPECT_TRUE(pacer_.wait_for_room(kFirst - 1, kFirst, kAtOnce));
  EXPECT_TRUE(pacer_.wait_for_room(0, kFirst, kAtOnce));
}

TEST_F(PacingOne, WhatAConsumerTookOfAnEarlierReplayDoesNotCount) {
  Consumer one(domain_, "one");
  announced(one, "");
  ASSERT_TRUE(pacer_.wait_for_room(kFirst, kFirst, kAtOnce));
  for (int i = 0; i < 10; ++i) one.reporter().report(kGyro, kFirst - 1, core::SensorTime{0});
  EXPECT_EQ(send_all_there_is_room_for(kFirst + 1), kFirst + kWindow - 1);
}

TEST_F(PacingOne, ProgressOfAnotherGyroDoesNotCount) {
  Consumer one(domain_, "one");
  announced(one, "");
  const std::uint64_t sent = send_all_there_is_room_for(kFirst);
  for (int i = 0; i < 10; ++i) one.reporter().report(kGyro + 1, sent, core::SensorTime{0});
  EXPECT_FALSE(pacer_.wait_for_room(sent + 1, kFirst, kAWhile));
}

TEST_F(PacingOne, TheEndIsReachedWhenEverySampleIsTakenEvenOfOne) {
  Consumer one(domain_, "one");
  announced(one, "");
  ASSERT_TRUE(pacer_.wait_for_room(kFirst, kFirst, kAtOnce));
  EXPECT_FALSE(pacer_.wait_for_all(kFirst, kFirst, kAWhile));
  EXPECT_TRUE(eventually([&] {
    one.reporter().report(kGyro, kFirst, core::SensorTime{0});
    return pacer_.wait_for_all(kFirst, kFirst, kAtOnce);
  }));
}

TEST_F(PacingOne, TemperaturesAreHeldUntilSomebodyNeedsThem) {
  Consumer one(domain_, "one");
  announced(one, "");
  EXPECT_FALSE(pacer_.wait_until_needed(5s, kAWhile));
  EXPECT_TRUE(eventually([&] {
    one.reporter().report(kGyro, kFirst, 5s);
    return pacer_.wait_until_needed(5s, kAtOnce);
  }));
  EXPECT_FALSE(pacer_.wait_until_needed(6s, kAWhile));
}

}  // namespace
}  // namespace zerodrift::service
