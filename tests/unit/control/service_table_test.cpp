// SPDX-License-Identifier: Apache-2.0
// Which services are there, and which instance of the compensation speaks for a gyro.
#include "services/control/service_table.h"

#include <gtest/gtest.h>

#include "common/service/host.h"

namespace zerodrift::services {
namespace {

using Names = std::vector<std::string>;

class Services : public testing::Test {
 protected:
  static ServiceTable::Guid writer(std::uint8_t number) {
    ServiceTable::Guid guid;
    guid.guidPrefix.value[0] = number;
    return guid;
  }

  void say(std::uint8_t from, const std::string& service,
           const std::vector<std::pair<std::string, double>>& figures,
           service::State state = service::State::kRunning) {
    msg::ServiceStatus said;
    said.service() = service;
    said.state() = static_cast<std::uint32_t>(state);
    for (const auto& [name, value] : figures) {
      msg::Metric metric;
      metric.name() = name;
      metric.value() = value;
      said.metrics().push_back(metric);
    }
    table_.note(said, writer(from), ++now_ns_);
  }

  ServiceTable table_;
  std::int64_t now_ns_ = 0;
};

TEST_F(Services, ACompensationThatIsAloneIsAddressed) {
  EXPECT_FALSE(table_.has_compensation());
  EXPECT_EQ(table_.addressees(0), Names{});
  say(1, "compensation", {{"gyros", 0}});
  EXPECT_TRUE(table_.has_compensation());
  EXPECT_FALSE(table_.all_are_led()) << "it may have gyros yet to say";
  EXPECT_EQ(table_.addressees(0), Names{"compensation"});
  say(1, "compensation", {{"gyros", 1}});
  say(1, "compensation:latency", {});
  say(1, "compensation:7", {{"active", 1}});
  EXPECT_TRUE(table_.all_are_led());
  EXPECT_EQ(table_.gyros(), std::vector<std::uint32_t>{7});
}

TEST_F(Services, WhoLeadsIsAddressedAndSpeaksForTheGyro) {
  say(1, "compensation", {{"gyros", 1}});
  say(1, "compensation:1", {{"active", 0}});
  EXPECT_FALSE(table_.all_are_led());
  EXPECT_EQ(table_.addressees(0), Names{"compensation"});
  say(2, "compensation/10", {{"gyros", 1}});
  say(2, "compensation/10:1", {{"active", 1}});
  EXPECT_TRUE(table_.all_are_led());
  EXPECT_EQ(table_.addressees(0), Names{"compensation/10"});
  EXPECT_EQ(table_.compensation_of(1), "compensation/10");
  EXPECT_EQ(table_.compensation(), "compensation/10");
  say(3, "compensation/9:1", {{"active", 1}});
  EXPECT_EQ(table_.compensation_of(1), "compensation/9") << "the lowest number, not the first text";
  table_.note_gone(writer(3));
  EXPECT_EQ(table_.compensation_of(1), "compensation/10");
}

TEST_F(Services, EachLeaderTakesTheCommandWhereTheGyrosHaveSeveral) {
  say(1, "compensation", {{"gyros", 2}});
  say(1, "compensation:1", {{"active", 1}});
  EXPECT_FALSE(table_.all_are_led()) << "the second gyro is yet to come";
  say(1, "compensation:2", {{"active", 0}});
  EXPECT_FALSE(table_.all_are_led());
  say(2, "compensation/1:2", {{"active", 1}});
  EXPECT_TRUE(table_.all_are_led());
  EXPECT_EQ(table_.addressees(0), (Names{"compensation", "compensation/1"}));
  EXPECT_EQ(table_.addressees(2), Names{"compensation/1"});
}

TEST_F(Services, WhoIsGoneLeadsNothingAndKeepsItsLastFigures) {
  say(1, "compensation", {{"gyros", 1}, {"samples_out", 5}});
  say(1, "compensation:1", {{"active", 1}});
  say(2, "compensation/1", {{"gyros", 1}, {"samples_out", 9}});
  say(2, "compensation/1:1", {{"active", 0}});
  table_.note_gone(writer(1));
  EXPECT_FALSE(table_.find("compensation")->is_alive);
  EXPECT_FALSE(table_.find("compensation")->ended_in_order);
  EXPECT_EQ(table_.addressees(0), Names{"compensation/1"});
  table_.note_gone(writer(2));
  EXPECT_FALSE(table_.has_compensation());
  EXPECT_EQ(table_.addressees(0), Names{});
  EXPECT_EQ(table_.compensation(), "compensation/1") << "who was there last";
  EXPECT_EQ(table_.metric(table_.compensation(), "samples_out", 0.0), 9.0);
}

TEST_F(Services, ASuccessorOfTheSameNameIsThere) {
  say(1, "compensation", {{"gyros", 1}, {"health", 0}});
  say(2, "compensation", {{"gyros", 1}});
  EXPECT_EQ(table_.metric("compensation", "health", -1.0), -1.0) << "its own figures only";
  table_.note_gone(writer(1));
  EXPECT_TRUE(table_.has_compensation());
  table_.note_gone(writer(2));
  EXPECT_FALSE(table_.has_compensation());
  say(2, "compensation", {{"gyros", 1}});
  EXPECT_TRUE(table_.has_compensation()) << "it had only fallen silent";
}

TEST_F(Services, WhoSaysThatItStopsHasEndedInOrder) {
  say(1, "compensation", {{"gyros", 1}}, service::State::kStopping);
  EXPECT_FALSE(table_.has_compensation());
  EXPECT_TRUE(table_.find("compensation")->ended_in_order);
}

// Before: 512, and 128 gyros have 640 names.
TEST_F(Services, AsManyAreKeptAsTheTopicHasKeys) {
  for (std::uint32_t gyro = 1; gyro < 1024; ++gyro)
    say(1, "compensation:" + std::to_string(gyro), {{"active", 1}});
  say(1, "compensation", {{"gyros", 1023}});
  EXPECT_EQ(table_.gyros().size(), 1023U);
  EXPECT_TRUE(table_.all_are_led());
}

}  // namespace
}  // namespace zerodrift::services
