// SPDX-License-Identifier: Apache-2.0
// The messages of the Foxglove WebSocket protocol, to and from bytes. Text messages are JSON with a
// field `op`, binary ones begin with an opcode; integers are little-endian.
// https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md
//
// `foxglove.websocket.v1` and its successor `foxglove.sdk.v1` (foxglove-sdk) agree in all that is
// used here.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/web/frame.h"

namespace zerodrift::foxglove {

inline constexpr std::array<std::string_view, 2> kSubprotocols{"foxglove.sdk.v1",
                                                               "foxglove.websocket.v1"};
// The first of ours that the client names; nothing where it names none of them.
std::optional<std::string> choose_subprotocol(const std::vector<std::string>& offered);

// ---------------------------------------- to a client

struct ServerInfo {
  std::string name{};
  std::vector<std::string> capabilities{};
  std::vector<std::string> supported_encodings{};
  std::map<std::string, std::string> metadata{};
  std::string
      session_id{};  // of this server's run: a client that comes back sees whether it is new
};

// `schema` of encoding "protobuf": a FileDescriptorSet in base64, see schema.h.
struct Schema {
  std::string name;  // "package.Message"
  std::string text;
};
struct Channel {
  std::uint32_t id = 0;
  std::string topic;
  Schema schema;
};
struct Service {
  std::uint32_t id = 0;
  std::string name;
  std::string type;
  Schema request;
  Schema response;
};
enum class StatusLevel : std::uint8_t { kInformation = 0, kWarning = 1, kError = 2 };

std::string server_info(const ServerInfo& info);
std::string advertise(const std::vector<Channel>& channels);
std::string advertise_services(const std::vector<Service>& services);
std::string status(StatusLevel level, const std::string& message);
std::string service_call_failure(std::uint32_t service, std::uint32_t call,
                                 const std::string& message);
// Opcode 1. The payload is shared, the subscription is the client's own.
web::Frame message_data(std::uint32_t subscription, std::uint64_t log_time_ns, web::Body payload);
// Opcode 3.
std::string service_call_response(std::uint32_t service, std::uint32_t call,
                                  std::string_view encoding, std::string_view payload);

// ---------------------------------------- from a client

struct Subscription {
  std::uint32_t id = 0;
  std::uint32_t channel = 0;
};
struct Subscribe {
  std::vector<Subscription> subscriptions;
};
struct Unsubscribe {
  std::vector<std::uint32_t> subscriptions;
};
struct ServiceCall {
  std::uint32_t service = 0;
  std::uint32_t call = 0;
  std::string encoding;
  std::string payload;
};
// What is well-formed and not served, or not well-formed: one line that says so.
struct NotServed {
  std::string why;
};
using ClientMessage = std::variant<Subscribe, Unsubscribe, ServiceCall, NotServed>;

// Any bytes. O(length).
ClientMessage parse(web::Frame::Kind kind, std::string_view message);

}  // namespace zerodrift::foxglove
