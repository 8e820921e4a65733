// SPDX-License-Identifier: Apache-2.0
#include "common/service/host.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <iterator>
#include <mutex>
#include <string>
#include <vector>

#include "tests/support/other_terms.h"
#include "tests/unit/dds/test_domain.h"

namespace zerodrift::service {
namespace {

using dds::eventually;
using dds::TestDomain;

constexpr std::uint32_t kDomain = 108;

// A commander who may lose commands, which nobody here puts up with.
using CarelessCommand = dds::OnOtherTerms<msg::Command, dds::with_best_effort>;

// Before any thread of this process, as a service does.
class StopSignals : public testing::Environment {
 public:
  void SetUp() override { take_signals(); }
};
const testing::Environment* const kStopSignals = testing::AddGlobalTestEnvironment(new StopSignals);

// A host and somebody in another participant who hears what it says.
class HostedService : public testing::Test {
 protected:
  [[nodiscard]] std::vector<msg::Event> events(const std::string& code) {
    const std::lock_guard lock(mutex_);
    std::vector<msg::Event> found;
    std::copy_if(events_.begin(), events_.end(), std::back_inserter(found),
                 [&](const msg::Event& event) { return event.code().to_string() == code; });
    return found;
  }
  [[nodiscard]] std::vector<msg::ServiceStatus> statuses() {
    const std::lock_guard lock(mutex_);
    return statuses_;
  }
  // Runs the host until a tick finds it enough; the run then ticks once more.
  void run_until(const std::function<bool()>& enough) {
    bool stopped = false;
    host_.run(
        [] {
          return Status{State::kRunning, "all is well", {{"samples_in", "1", 42.0}}};
        },
        [&] {
          if (stopped || !enough()) return;
          stopped = true;
          request_stop();
        });
  }

  TestDomain domain_{kDomain};
  dds::Participant listener_{"listener", domain_.network()};
  std::mutex mutex_;
  std::vector<msg::Event> events_;
  std::vector<msg::ServiceStatus> statuses_;
  Host host_{"service_test", domain_.network()};
  dds::Reader<msg::Event> event_reader_{listener_,
                                        [this](const msg::Event& m, const dds::SampleOrigin&) {
                                          const std::lock_guard lock(mutex_);
                                          events_.push_back(m);
                                        }};
  dds::Reader<msg::ServiceStatus> status_reader_{
      listener_, [this](const msg::ServiceStatus& m, const dds::SampleOrigin&) {
        const std::lock_guard lock(mutex_);
        statuses_.push_back(m);
      }};
};

Occurrence occurrence(const std::string& code, std::uint32_t gyro_id = 0) {
  return {.code = code,
          .severity = Severity::kWarning,
          .text = "text of " + code,
          .gyro_id = gyro_id,
          .sensor_time_ns = 77};
}

TEST_F(HostedService, PublishesAnOccurrenceOnceWithEveryField) {
  Occurrence raised = occurrence("probe_stuck", 3);
  raised.severity = Severity::kError;
  host_.raise(raised);
  int ticks = 0;
  run_until([&] { return ++ticks == 4; });
  const auto found = events("probe_stuck");
  ASSERT_EQ(found.size(), 1U);
  const msg::Event& event = found.front();
  EXPECT_EQ(event.service().to_string(), "service_test");
  EXPECT_EQ(event.text().to_string(), "text of probe_stuck");
  EXPECT_EQ(event.severity(), 2U);
  EXPECT_EQ(event.gyro_id(), 3U);
  EXPECT_EQ(event.count(), 1U);
  EXPECT_EQ(event.sensor_time_ns(), 77);
  EXPECT_GT(event.wall_time_ns(), 0);
}

TEST_F(HostedService, CountsWhatIsRaisedBeforeItIsPublished) {
  for (int i = 0; i < 3; ++i) host_.raise(occurrence("raised"));
  host_.raise_counted(occurrence("counted"), 1000);
  host_.raise_counted(occurrence("counted"), 1);
  host_.raise_counted(occurrence("never"), 0);
  run_until([] { return true; });
  ASSERT_TRUE(eventually([&] { return events("counted").size() == 1; }));
  ASSERT_EQ(events("raised").size(), 1U);
  EXPECT_EQ(events("raised").front().count(), 3U);
  EXPECT_EQ(events("counted").front().count(), 1001U);
  EXPECT_TRUE(events("never").empty());
}

TEST_F(HostedService, KeepsOneTallyForEachCodeAndGyro) {
  host_.raise(occurrence("a", 1));
  host_.raise(occurrence("a", 2));
  host_.raise(occurrence("a", 2));
  host_.raise(occurrence("b", 1));
  run_until([] { return true; });
  ASSERT_TRUE(eventually([&] { return events("a").size() == 2 && events("b").size() == 1; }));
  for (const msg::Event& event : events("a")) EXPECT_EQ(event.count(), event.gyro_id());
}

TEST_F(HostedService, RepeatsAnOccurrenceAtMostOnceASecondWithItsCount) {
  std::uint64_t raised = 0;
  run_until([&] {
    host_.raise(occurrence("again"));
    ++raised;
    return events("again").size() == 2;
  });
  const auto found = events("again");
  ASSERT_GE(found.size(), 2U);
  EXPECT_EQ(found[0].count(), 1U);
  for (std::size_t i = 1; i < found.size(); ++i) {
    EXPECT_GT(found[i].count(), found[i - 1].count() + 1)
        << "each tick of a quarter second raised one";
    EXPECT_LE(found[i].count(), raised);
    // A tenth of a second for the time between reading the monotonic clock and the wall clock.
    EXPECT_GE(found[i].wall_time_ns() - found[i - 1].wall_time_ns(), 900000000);
  }
}

// Two commands within a tick are two lines of the log.
TEST_F(HostedService, WhatIsToldIsPublishedEachByItselfAndInOrder) {
  const auto raise_each = [&](const std::string& text) {
    Occurrence told = occurrence("command");
    told.text = text;
    host_.raise_each(told);
  };
  for (const char* text : {"inject", "clear", "inject"}) raise_each(text);
  run_until([&] { return events("command").size() >= 3; });
  const auto found = events("command");
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(found[0].text().to_string(), "inject");
  EXPECT_EQ(found[1].text().to_string(), "clear");
  EXPECT_EQ(found[2].text().to_string(), "inject");
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i].count(), i + 1);
}

TEST_F(HostedService, BoundsHowManyThatAreToldWait) {
  for (int i = 0; i < 1000; ++i) host_.raise_each(occurrence("command"));
  run_until([&] { return events("command").size() >= 64U + 1U; });
  std::uint64_t told = 0;
  for (const msg::Event& event : events("command")) told = std::max(told, event.count());
  EXPECT_EQ(told, 1000U);
  EXPECT_EQ(events("command").size(), 64U + 1U);
}

TEST_F(HostedService, TurnsWhatTheMiddlewareNoticedIntoAnEventAndAMetric) {
  const dds::Reader<msg::Command> commands(host_.participant(),
                                           [](const msg::Command&, const dds::SampleOrigin&) {});
  dds::Participant stranger("stranger", domain_.network());
  const dds::Writer<CarelessCommand> writer(stranger);
  const auto total = [&] {
    double value = 0.0;
    for (const auto& status : statuses()) {
      for (const auto& metric : status.metrics())
        if (metric.name().to_string() == "command_incompatible_qos") value = metric.value();
    }
    return value;
  };
  run_until([&] { return total() > 0.0; });
  const auto found = events("incompatible_qos");
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(total(), 1.0);
  const std::string text = found.front().text().to_string();
  for (const char* part : {"topic command: ", "stranger", "reliability best_effort"})
    EXPECT_NE(text.find(part), std::string::npos) << text;
}

TEST_F(HostedService, TalliesSubjectsOfOneCodeApart) {
  for (const char* subject : {"one", "two", "two"}) {
    Occurrence raised = occurrence("deadline_missed");
    raised.subject = subject;
    raised.text = subject;
    host_.raise(raised);
  }
  run_until([] { return true; });
  ASSERT_TRUE(eventually([&] { return events("deadline_missed").size() == 2; }));
  for (const msg::Event& event : events("deadline_missed"))
    EXPECT_EQ(event.count(), event.text().to_string() == "one" ? 1U : 2U);
}

// Rule: many different faults at once cost a bounded part of each round, and none is passed over.
TEST_F(HostedService, PublishesAFloodOfDifferentEventsInRounds) {
  constexpr std::size_t kFlood = 100;
  constexpr std::size_t kARound = 32;
  for (std::size_t k = 0; k < kFlood; ++k)
    host_.raise(occurrence("flood", static_cast<std::uint32_t>(k)));
  std::size_t ticks = 0;
  run_until([&] {
    EXPECT_LE(events("flood").size(), ticks * kARound);
    ++ticks;
    return events("flood").size() == kFlood;
  });
  EXPECT_GE(ticks, 1 + kFlood / kARound);
}

TEST_F(HostedService, BoundsWhatItKeepsOfDifferentEvents) {
  constexpr std::size_t kKept = 1024;
  for (std::size_t k = 0; k < kKept + 500; ++k)
    host_.raise(occurrence("flood", static_cast<std::uint32_t>(k)));
  run_until([&] { return !events("other_events").empty(); });
  ASSERT_FALSE(events("other_events").empty());
  EXPECT_EQ(events("other_events").front().count(), 500U);
}

TEST_F(HostedService, CutsATextThatIsTooLong) {
  Occurrence raised = occurrence("long");
  raised.text = std::string(1000, 'x');
  host_.raise(raised);
  run_until([] { return true; });
  ASSERT_TRUE(eventually([&] { return events("long").size() == 1; }));
  EXPECT_EQ(events("long").front().text().to_string(), std::string(252, 'x') + "...");
}

TEST_F(HostedService, SaysItsStatusAndAtTheEndThatItStops) {
  int ticks = 0;
  run_until([&] { return ++ticks >= 2 && !statuses().empty(); });
  ASSERT_TRUE(eventually([&] {
    return !statuses().empty() &&
           statuses().back().state() == static_cast<std::uint32_t>(State::kStopping);
  }));
  const auto heard = statuses();
  EXPECT_EQ(heard.front().state(), static_cast<std::uint32_t>(State::kRunning));
  EXPECT_EQ(heard.front().service().to_string(), "service_test");
  EXPECT_EQ(heard.front().summary().to_string(), "all is well");
  ASSERT_EQ(heard.front().metrics().size(), 1U);
  EXPECT_EQ(heard.front().metrics().front().name().to_string(), "samples_in");
  EXPECT_EQ(heard.front().metrics().front().value(), 42.0);
}

TEST(StopSignals, AreSeenByTheWaitAndNobodyElse) {
  EXPECT_FALSE(wait_for_stop(std::chrono::milliseconds(0)));
  request_stop();
  EXPECT_TRUE(wait_for_stop(std::chrono::seconds(5)));
  EXPECT_FALSE(wait_for_stop(std::chrono::milliseconds(0)));
}

TEST(HostNumbers, OfSeverityAndStateArePinned) {
  EXPECT_EQ(static_cast<std::uint32_t>(Severity::kInformation), 0U);
  EXPECT_EQ(static_cast<std::uint32_t>(Severity::kWarning), 1U);
  EXPECT_EQ(static_cast<std::uint32_t>(Severity::kError), 2U);
  EXPECT_EQ(static_cast<std::uint32_t>(State::kStarting), 0U);
  EXPECT_EQ(static_cast<std::uint32_t>(State::kWaiting), 1U);
  EXPECT_EQ(static_cast<std::uint32_t>(State::kRunning), 2U);
  EXPECT_EQ(static_cast<std::uint32_t>(State::kDegraded), 3U);
  EXPECT_EQ(static_cast<std::uint32_t>(State::kStopping), 4U);
}

}  // namespace
}  // namespace zerodrift::service
