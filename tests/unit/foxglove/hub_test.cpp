// SPDX-License-Identifier: Apache-2.0
// Who gets what, by what was subscribed.
#include "common/foxglove/hub.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <vector>

namespace zerodrift::foxglove {
namespace {

using Kind = web::Frame::Kind;

class FakeClient final : public web::Client {
 public:
  explicit FakeClient(std::uint64_t id) : web::Client(id) {}
  void send(web::Frame frame) override { frames.push_back(std::move(frame)); }
  void close(web::CloseCode, const std::string&) override {}
  [[nodiscard]] Counts counts() const override { return {}; }
  [[nodiscard]] const std::string& remote() const override { return remote_; }
  [[nodiscard]] const std::string& subprotocol() const override { return remote_; }

  [[nodiscard]] std::string op_of(std::size_t i) const {
    if (frames.at(i).kind == Kind::kBinary) return "binary";
    return nlohmann::json::parse(*frames[i].body).at("op").get<std::string>();
  }
  std::vector<web::Frame> frames;

 private:
  std::string remote_ = "127.0.0.1:1";
};

class HubOfTwo : public testing::Test {
 protected:
  HubOfTwo() {
    channel_ = hub_.add_channel("/a", {"A", ""});
    service_ = hub_.add_service("/command", "T", {"Q", ""}, {"R", ""});
    hub_.opened(first_);
    hub_.opened(second_);
  }
  void subscribe(FakeClient& client, unsigned id, unsigned channel) {
    hub_.received(client, Kind::kText,
                  R"({"op":"subscribe","subscriptions":[{"id":)" + std::to_string(id) +
                      R"(,"channelId":)" + std::to_string(channel) + "}]}");
  }

  std::vector<std::pair<ClientId, ChannelId>> subscribed_;
  std::vector<CallOrigin> calls_;
  Hub hub_{{.name = "test", .supported_encodings = {"json"}},
           {.subscribed = [this](auto client,
                                 auto channel) { subscribed_.emplace_back(client, channel); },
            .called = [this](const auto& call, const auto&) { calls_.push_back(call); }}};
  FakeClient first_{1};
  FakeClient second_{2};
  ChannelId channel_ = 0;
  std::uint32_t service_ = 0;
};

TEST_F(HubOfTwo, ANewClientIsToldWhoChannelsAndServices) {
  ASSERT_EQ(first_.frames.size(), 3U);
  EXPECT_EQ(first_.op_of(0), "serverInfo");
  EXPECT_EQ(first_.op_of(1), "advertise");
  EXPECT_EQ(first_.op_of(2), "advertiseServices");
  hub_.add_channel("/b", {"B", ""});
  EXPECT_EQ(first_.op_of(3), "advertise");
}

TEST_F(HubOfTwo, PayloadsGoToWhoSubscribedUnderTheirOwnIdAndAreShared) {
  EXPECT_FALSE(hub_.has_subscriber(channel_));
  subscribe(first_, 7, channel_);
  subscribe(second_, 9, channel_);
  EXPECT_TRUE(hub_.has_subscriber(channel_));
  EXPECT_EQ(subscribed_,
            (std::vector<std::pair<ClientId, ChannelId>>{{1, channel_}, {2, channel_}}));
  const web::Body body = web::body_of("x");
  hub_.publish(channel_, {.log_time_ns = 5}, body);
  ASSERT_EQ(first_.frames.size(), 4U);
  EXPECT_EQ(first_.frames[3].head[1], 7);
  EXPECT_EQ(second_.frames[3].head[1], 9);
  EXPECT_EQ(first_.frames[3].body.get(), second_.frames[3].body.get());
  hub_.received(first_, Kind::kText, R"({"op":"unsubscribe","subscriptionIds":[7]})");
  hub_.publish(channel_, {}, body);
  EXPECT_EQ(first_.frames.size(), 4U);
  EXPECT_EQ(second_.frames.size(), 5U);
  hub_.closed(second_);
  EXPECT_FALSE(hub_.has_subscriber(channel_));
}

TEST_F(HubOfTwo, ASecondSubscriptionOfAChannelOrIdIsRefusedByAWarning) {
  const ChannelId other = hub_.add_channel("/b", {"B", ""});
  subscribe(first_, 1, channel_);
  const std::size_t before = first_.frames.size();
  subscribe(first_, 2, channel_);
  subscribe(first_, 1, other);
  subscribe(first_, 3, 99);
  hub_.received(first_, Kind::kText, R"({"op":"unsubscribe","subscriptionIds":[42]})");
  hub_.received(first_, Kind::kBinary, "");
  ASSERT_EQ(first_.frames.size(), before + 5);
  for (std::size_t i = before; i < first_.frames.size(); ++i) EXPECT_EQ(first_.op_of(i), "status");
  EXPECT_EQ(subscribed_.size(), 1U);
}

TEST_F(HubOfTwo, CallsAreAnsweredToTheirCallerOnlyAndMayComeTooLate) {
  const auto call = [&](char service, const std::string& encoding) {
    hub_.received(first_, Kind::kBinary,
                  std::string("\x02") + service + std::string("\0\0\0\x05\0\0\0", 7) +
                      static_cast<char>(encoding.size()) + std::string(3, '\0') + encoding + "{}");
  };
  const auto id = static_cast<char>(service_);
  call(id, "json");
  ASSERT_EQ(calls_.size(), 1U);
  hub_.answer(calls_[0], "{}");
  EXPECT_EQ(first_.op_of(3), "binary");
  EXPECT_EQ(first_.frames[3].body->substr(0, 9),
            std::string("\x03") + id + std::string("\0\0\0\x05\0\0\0", 7));
  call(id, "cdr");
  call(static_cast<char>(id + 1), "json");
  EXPECT_EQ(first_.op_of(4), "serviceCallFailure");
  EXPECT_EQ(first_.op_of(5), "serviceCallFailure");
  EXPECT_EQ(second_.frames.size(), 3U);
  hub_.closed(first_);
  hub_.answer(calls_[0], "{}");
  hub_.fail(calls_[0], "gone");
  EXPECT_EQ(first_.frames.size(), 6U);
}

TEST_F(HubOfTwo, OnlyLatestStatesReplaceEachOtherAndOnlyOfOneChannel) {
  const ChannelId other = hub_.add_channel("/b", {"B", ""});
  subscribe(first_, 1, channel_);
  subscribe(first_, 2, other);
  hub_.publish(channel_, {.latest_of = 1}, web::body_of("x"));
  hub_.publish(other, {.latest_of = 1}, web::body_of("x"));
  hub_.publish(channel_, {}, web::body_of("x"));
  const std::size_t n = first_.frames.size();
  EXPECT_NE(first_.frames[n - 3].replaces, first_.frames[n - 2].replaces);
  EXPECT_EQ(first_.frames[n - 1].replaces, 0U);
}

}  // namespace
}  // namespace zerodrift::foxglove
