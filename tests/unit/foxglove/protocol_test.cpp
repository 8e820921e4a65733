// SPDX-License-Identifier: Apache-2.0
// The protocol's bytes, from its specification (github.com/foxglove/ws-protocol, docs/spec.md).
#include "common/foxglove/protocol.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/foxglove/schema.h"
#include "idl/proto/telemetry.pb.h"

namespace zerodrift::foxglove {
namespace {

using Kind = web::Frame::Kind;

std::string bytes_of(const web::Frame& frame) {
  std::string bytes;
  for (std::size_t i = 0; i < frame.head_size; ++i) bytes += static_cast<char>(frame.head[i]);
  return bytes + *frame.body;
}

TEST(ProtocolGolden, MessageDataIsOpcodeSubscriptionTimePayload) {
  const auto frame = message_data(0x01020304, 0x1112131415161718, web::body_of("payload"));
  EXPECT_EQ(bytes_of(frame),
            std::string("\x01\x04\x03\x02\x01\x18\x17\x16\x15\x14\x13\x12\x11", 13) + "payload");
  EXPECT_EQ(frame.kind, Kind::kBinary);
}

TEST(ProtocolGolden, AServiceResponseIsOpcodeServiceCallEncodingPayload) {
  EXPECT_EQ(service_call_response(1, 0x0201, "json", "{}"),
            std::string("\x03\x01\0\0\0\x01\x02\0\0\x04\0\0\0json{}", 19));
}

TEST(ProtocolGolden, AServiceRequestIsReadAsItIsWritten) {
  const auto message = parse(
      Kind::kBinary, std::string_view("\x02\x07\0\0\0\xff\xff\xff\xff\x08\0\0\0protobufabc", 24));
  const auto* call = std::get_if<ServiceCall>(&message);
  ASSERT_NE(call, nullptr);
  EXPECT_EQ(call->service, 7U);
  EXPECT_EQ(call->call, 0xffffffffU);
  EXPECT_EQ(call->encoding, "protobuf");
  EXPECT_EQ(call->payload, "abc");
}

TEST(ProtocolGolden, TextMessagesAreTheseJsonObjects) {
  EXPECT_EQ(server_info({.name = "n",
                         .capabilities = {"services"},
                         .supported_encodings = {"json"},
                         .metadata = {{"k", "v"}},
                         .session_id = "1"}),
            R"({"op":"serverInfo","name":"n","capabilities":["services"],)"
            R"("supportedEncodings":["json"],"metadata":{"k":"v"},"sessionId":"1"})");
  EXPECT_EQ(advertise({{1, "/t", {"p.M", "c2No"}}}),
            R"({"op":"advertise","channels":[{"id":1,"topic":"/t","encoding":"protobuf",)"
            R"("schemaName":"p.M","schema":"c2No","schemaEncoding":"protobuf"}]})");
  EXPECT_EQ(advertise_services({{1, "/s", "T", {"p.A", "YQ=="}, {"p.B", "Yg=="}}}),
            R"({"op":"advertiseServices","services":[{"id":1,"name":"/s","type":"T","request":)"
            R"({"encoding":"protobuf","schemaName":"p.A","schemaEncoding":"protobuf",)"
            R"("schema":"YQ=="},"response":{"encoding":"protobuf","schemaName":"p.B",)"
            R"("schemaEncoding":"protobuf","schema":"Yg=="}}]})");
  EXPECT_EQ(status(StatusLevel::kWarning, "w"), R"({"op":"status","level":1,"message":"w"})");
  EXPECT_EQ(service_call_failure(1, 2, "why"),
            R"({"op":"serviceCallFailure","serviceId":1,"callId":2,"message":"why"})");
}

TEST(Protocol, ClientsSubscribeAndUnsubscribe) {
  const auto subscribed = parse(
      Kind::kText,
      R"({"op":"subscribe","subscriptions":[{"id":0,"channelId":3},{"id":1,"channelId":5}]})");
  const auto* subscribe = std::get_if<Subscribe>(&subscribed);
  ASSERT_NE(subscribe, nullptr);
  ASSERT_EQ(subscribe->subscriptions.size(), 2U);
  EXPECT_EQ(subscribe->subscriptions[1].id, 1U);
  EXPECT_EQ(subscribe->subscriptions[1].channel, 5U);
  const auto left = parse(Kind::kText, R"({"op":"unsubscribe","subscriptionIds":[0,4294967295]})");
  ASSERT_TRUE(std::holds_alternative<Unsubscribe>(left));
  EXPECT_EQ(std::get<Unsubscribe>(left).subscriptions[1], 4294967295U);
}

TEST(ProtocolAbuse, WhatIsNotServedHasOneLineThatSaysSo) {
  for (const char* text :
       {"", "{", "[]", "1", "null", "{}", R"({"op":1})", R"({"op":"getParameters"})",
        R"({"op":"subscribe"})", R"({"op":"subscribe","subscriptions":1})",
        R"({"op":"subscribe","subscriptions":[1]})",
        R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":3}]})",
        R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":3}]})",
        R"({"op":"subscribe","subscriptions":[{"id":1.5,"channelId":3}]})",
        R"({"op":"unsubscribe","subscriptionIds":["1"]})", R"({"op":"a\nb"})"}) {
    const auto message = parse(Kind::kText, text);
    ASSERT_TRUE(std::holds_alternative<NotServed>(message)) << text;
    const std::string& why = std::get<NotServed>(message).why;
    EXPECT_FALSE(why.empty());
    EXPECT_EQ(why.find('\n'), std::string::npos);
  }
  const std::string whole("\x02\x07\0\0\0\x01\0\0\0\x04\0\0\0json", 17);
  for (std::size_t length = 0; length < whole.size(); ++length)
    EXPECT_TRUE(std::holds_alternative<NotServed>(parse(Kind::kBinary, whole.substr(0, length))))
        << length;
  EXPECT_TRUE(std::holds_alternative<ServiceCall>(parse(Kind::kBinary, whole)));
  for (const char* opcode : {"\x01", "\x03", "\xff"})
    EXPECT_TRUE(std::holds_alternative<NotServed>(parse(Kind::kBinary, opcode)));
  // Nesting as deep as a message may be long.
  EXPECT_TRUE(std::holds_alternative<NotServed>(parse(Kind::kText, std::string(65536, '['))));
}

TEST(Protocol, TheFirstSubprotocolThatIsOursIsSpoken) {
  EXPECT_EQ(choose_subprotocol({"x", "foxglove.websocket.v1", "foxglove.sdk.v1"}),
            "foxglove.websocket.v1");
  EXPECT_EQ(choose_subprotocol({"foxglove.sdk.v1"}), "foxglove.sdk.v1");
  EXPECT_FALSE(choose_subprotocol({"x"}));
  EXPECT_FALSE(choose_subprotocol({}));
}

// RFC 4648, section 10.
TEST(SchemaGolden, Base64IsThatOfTheStandard) {
  const char* plain = "foobar";
  const char* expected[] = {"", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"};
  for (std::size_t n = 0; n <= 6; ++n)
    EXPECT_EQ(base64(std::string_view(plain).substr(0, n)), expected[n]);
  EXPECT_EQ(base64("\xff\xfe\xfd"), "//79");
}

TEST(Schema, HoldsTheFileAndItsImportsImportsFirst) {
  const Schema schema = schema_of(*telemetry::CompensatedRate::descriptor());
  EXPECT_EQ(schema.name, "zerodrift.telemetry.CompensatedRate");
  // FileDescriptorSet { file = 1 { name = 1 ... } }: the first file's name follows its tag.
  EXPECT_NE(schema.text.find(base64("google/protobuf/timestamp").substr(0, 12)), std::string::npos);
  EXPECT_EQ(schema.text.size() % 4, 0U);
}

}  // namespace
}  // namespace zerodrift::foxglove
