// SPDX-License-Identifier: Apache-2.0
#include "common/dds/topics.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "common/dds/participant.h"

namespace zerodrift::dds {
namespace {

namespace fdds = eprosima::fastdds::dds;

TEST(Topics, HaveNamesOfTheirOwn) {
  std::set<std::string_view> names;
  for (const TopicSpec& spec : kAllTopics) EXPECT_TRUE(names.insert(spec.name).second) << spec.name;
}

template <typename Message>
void expect_bound_to(const TopicSpec& listed) {
  typename TopicOf<Message>::TypeSupport type;
  EXPECT_EQ(TopicOf<Message>::kSpec.name, listed.name);
  EXPECT_EQ(std::string(type.getName()), listed.type);
}

TEST(Topics, CarryTheTypeTheyAreBoundTo) {
  [&]<std::size_t... I>(std::index_sequence<I...>) {
    (expect_bound_to<std::tuple_element_t<I, AllMessages>>(kAllTopics[I]), ...);
  }
  (std::make_index_sequence<kAllTopics.size()>{});
}

TEST(Topics, OfferAndAskForTheSame) {
  for (const TopicSpec& spec : kAllTopics) {
    SCOPED_TRACE(spec.name);
    const auto writer = writer_qos(spec);
    const auto reader = reader_qos(spec);
    EXPECT_EQ(writer.reliability().kind, reader.reliability().kind);
    EXPECT_EQ(writer.durability().kind, reader.durability().kind);
    EXPECT_EQ(writer.ownership().kind, reader.ownership().kind);
    EXPECT_EQ(writer.liveliness().kind, reader.liveliness().kind);
    EXPECT_EQ(writer.liveliness().lease_duration, reader.liveliness().lease_duration);
    EXPECT_TRUE(detail::unmet(detail::terms_of(spec), detail::terms_of(spec)).empty());
    EXPECT_EQ(writer.history().depth, spec.depth);
    EXPECT_EQ(reader.history().depth, spec.depth);
  }
}

// Progress may lose one: each says everything, and the newest is repeated.
TEST(Topics, AreReliableButForProgress) {
  for (const TopicSpec& spec : kAllTopics) {
    const bool reliable = writer_qos(spec).reliability().kind == fdds::RELIABLE_RELIABILITY_QOS;
    EXPECT_EQ(reliable, spec.name != kReplayProgress.name) << spec.name;
  }
}

TEST(Topics, HaveRoomForTheFullHistoryOfEveryKey) {
  for (const TopicSpec& spec : kAllTopics) {
    for (const auto& limits :
         {writer_qos(spec).resource_limits(), reader_qos(spec).resource_limits()}) {
      EXPECT_EQ(limits.max_instances, spec.keys) << spec.name;
      EXPECT_GE(limits.max_samples_per_instance, spec.depth) << spec.name;
      EXPECT_GE(limits.max_samples, spec.keys * limits.max_samples_per_instance) << spec.name;
    }
  }
}

// Data sharing loses samples silently, a slow heartbeat stalls for seconds, and liveliness by
// participant is asserted by any living process (DECISIONS.md).
TEST(Topics, AvoidWhatLosesSamplesSilently) {
  for (const TopicSpec& spec : kAllTopics) {
    SCOPED_TRACE(spec.name);
    const auto writer = writer_qos(spec);
    EXPECT_EQ(writer.data_sharing().kind(), fdds::OFF);
    EXPECT_EQ(reader_qos(spec).data_sharing().kind(), fdds::OFF);
    EXPECT_LE(spec.heartbeat.count(), 20);
    EXPECT_EQ(writer.reliable_writer_qos().times.heartbeatPeriod.to_ns(),
              std::chrono::nanoseconds(spec.heartbeat).count());
    EXPECT_EQ(writer.publish_mode().kind, fdds::SYNCHRONOUS_PUBLISH_MODE);
  }
}

// Any living process asserts the kinds by participant for all that are there (DECISIONS.md).
TEST(Topics, HaveALeaseByTopicOrNone) {
  for (const TopicSpec& spec : kAllTopics) {
    SCOPED_TRACE(spec.name);
    const auto liveliness = writer_qos(spec).liveliness();
    if (spec.lease.count() == 0) {
      EXPECT_EQ(liveliness.kind, fdds::AUTOMATIC_LIVELINESS_QOS);
      EXPECT_EQ(liveliness.lease_duration, eprosima::fastrtps::c_TimeInfinite);
    } else {
      EXPECT_EQ(liveliness.kind, fdds::MANUAL_BY_TOPIC_LIVELINESS_QOS);
      EXPECT_EQ(liveliness.lease_duration.to_ns(), std::chrono::nanoseconds(spec.lease).count());
    }
  }
}

// The middleware would restart a timer with every sample; our own endpoints watch instead.
TEST(Topics, HaveNoDeadlineOfTheMiddlewares) {
  for (const TopicSpec& spec : kAllTopics) {
    EXPECT_EQ(writer_qos(spec).deadline().period, eprosima::fastrtps::c_TimeInfinite);
    EXPECT_EQ(reader_qos(spec).deadline().period, eprosima::fastrtps::c_TimeInfinite);
  }
}

// Rule: several may write the same, and whoever is first is heard.
TEST(Topics, AreEverybodysWhoWrites) {
  for (const TopicSpec& spec : kAllTopics)
    EXPECT_EQ(spec.ownership, Ownership::kShared) << spec.name;
}

TEST(Topics, KeepThePresentStateForLateJoiners) {
  const std::set<std::string_view> state{
      kTemperature.name, kAllanReport.name, kServiceStatus.name,  kEvent.name,
      kTwinReport.name,  kEnvironment.name, kThermalCoverage.name};
  for (const TopicSpec& spec : kAllTopics) {
    EXPECT_EQ(spec.durability == Durability::kTransientLocal, state.contains(spec.name))
        << spec.name;
  }
}

// Rule: as many gyros as have compensated rates have a status each of what serves them: of two
// instances, their publishers of rates and temperatures and a navigation filter.
TEST(Topics, EveryGyroHasRoomForTheStatusOfWhatServesIt) {
  EXPECT_GE(kServiceStatus.keys, 5 * kCompensatedRate.keys + kCompensatedRate.keys);
}

}  // namespace
}  // namespace zerodrift::dds
