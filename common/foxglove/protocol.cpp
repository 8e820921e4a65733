// SPDX-License-Identifier: Apache-2.0
#include "common/foxglove/protocol.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/core/one_line.h"

namespace zerodrift::foxglove {

using Json = nlohmann::ordered_json;

namespace {

constexpr std::uint8_t kMessageData = 1;
constexpr std::uint8_t kServiceCallResponse = 3;
constexpr std::uint8_t kServiceCallRequest = 2;  // a client's
constexpr std::uint8_t kClientMessageData = 1;
constexpr std::size_t kLongestQuote = 64;
constexpr const char* kEncoding = "protobuf";

template <typename Integer>
std::array<std::uint8_t, sizeof(Integer)> little_endian(Integer value) {
  std::array<std::uint8_t, sizeof(Integer)> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = static_cast<std::uint8_t>(value >> (8U * i) & 0xFFU);
  return bytes;
}

void append(std::string& bytes, std::uint32_t value) {
  for (const std::uint8_t byte : little_endian(value)) bytes += static_cast<char>(byte);
}

std::optional<std::uint32_t> take_uint32(std::string_view& bytes) {
  if (bytes.size() < sizeof(std::uint32_t)) return std::nullopt;
  std::uint32_t value = 0;
  for (std::size_t i = sizeof value; i-- > 0;)
    value = value << 8U | static_cast<std::uint8_t>(bytes[i]);
  bytes.remove_prefix(sizeof value);
  return value;
}

Json definition(const Schema& schema) {
  return {{"encoding", kEncoding},
          {"schemaName", schema.name},
          {"schemaEncoding", kEncoding},
          {"schema", schema.text}};
}

// Text of any origin may be no UTF-8; what isn't is replaced.
std::string dumped(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string quoted(const std::string& text) {
  return '\'' + core::one_line(text.substr(0, kLongestQuote)) + '\'';
}

const Json* member(const Json& object, const char* name) {
  if (!object.is_object()) return nullptr;
  const auto found = object.find(name);
  return found == object.end() ? nullptr : &*found;
}

std::optional<std::uint32_t> number(const Json* json) {
  if (json == nullptr || !json->is_number_unsigned()) return std::nullopt;
  const auto value = json->get<std::uint64_t>();
  if (value > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(value);
}

ClientMessage parse_subscribe(const Json& json) {
  const Json* list = member(json, "subscriptions");
  if (list == nullptr || !list->is_array())
    return NotServed{"subscribe: expected an array 'subscriptions'"};
  Subscribe message;
  for (const Json& entry : *list) {
    const auto id = number(member(entry, "id"));
    const auto channel = number(member(entry, "channelId"));
    if (!id || !channel)
      return NotServed{"subscribe: each of 'subscriptions' needs numbers 'id' and 'channelId'"};
    message.subscriptions.push_back({*id, *channel});
  }
  return message;
}

ClientMessage parse_unsubscribe(const Json& json) {
  const Json* list = member(json, "subscriptionIds");
  if (list == nullptr || !list->is_array())
    return NotServed{"unsubscribe: expected an array 'subscriptionIds'"};
  Unsubscribe message;
  for (const Json& entry : *list) {
    const auto id = number(&entry);
    if (!id) return NotServed{"unsubscribe: 'subscriptionIds' are numbers"};
    message.subscriptions.push_back(*id);
  }
  return message;
}

ClientMessage parse_text(std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) return NotServed{"a text message that is no JSON"};
  const Json* op = member(json, "op");
  if (op == nullptr || !op->is_string()) return NotServed{"a message without a string 'op'"};
  const auto& name = op->get_ref<const std::string&>();
  if (name == "subscribe") return parse_subscribe(json);
  if (name == "unsubscribe") return parse_unsubscribe(json);
  return NotServed{"op " + quoted(name) +
                   " is not served here; subscribe, unsubscribe and service calls are"};
}

ClientMessage parse_binary(std::string_view bytes) {
  if (bytes.empty()) return NotServed{"an empty binary message"};
  const auto opcode = static_cast<std::uint8_t>(bytes.front());
  bytes.remove_prefix(1);
  if (opcode == kClientMessageData)
    return NotServed{"clients publish nothing here; commands go to the service /command"};
  if (opcode != kServiceCallRequest)
    return NotServed{"binary opcode " + std::to_string(opcode) + " is not served here"};
  const auto service = take_uint32(bytes);
  const auto call = take_uint32(bytes);
  const auto length = take_uint32(bytes);
  if (!service || !call || !length || *length > bytes.size())
    return NotServed{"a service call that ends before its encoding"};
  return ServiceCall{*service, *call, std::string(bytes.substr(0, *length)),
                     std::string(bytes.substr(*length))};
}

}  // namespace

std::optional<std::string> choose_subprotocol(const std::vector<std::string>& offered) {
  for (const auto& name : offered) {
    if (std::find(kSubprotocols.begin(), kSubprotocols.end(), name) != kSubprotocols.end())
      return name;
  }
  return std::nullopt;
}

std::string server_info(const ServerInfo& info) {
  return dumped({{"op", "serverInfo"},
                 {"name", info.name},
                 {"capabilities", info.capabilities},
                 {"supportedEncodings", info.supported_encodings},
                 {"metadata", info.metadata},
                 {"sessionId", info.session_id}});
}

std::string advertise(const std::vector<Channel>& channels) {
  Json list = Json::array();
  for (const Channel& channel : channels) {
    list.push_back({{"id", channel.id},
                    {"topic", channel.topic},
                    {"encoding", kEncoding},
                    {"schemaName", channel.schema.name},
                    {"schema", channel.schema.text},
                    {"schemaEncoding", kEncoding}});
  }
  return dumped({{"op", "advertise"}, {"channels", std::move(list)}});
}

std::string advertise_services(const std::vector<Service>& services) {
  Json list = Json::array();
  for (const Service& service : services) {
    list.push_back({{"id", service.id},
                    {"name", service.name},
                    {"type", service.type},
                    {"request", definition(service.request)},
                    {"response", definition(service.response)}});
  }
  return dumped({{"op", "advertiseServices"}, {"services", std::move(list)}});
}

std::string status(StatusLevel level, const std::string& message) {
  return dumped({{"op", "status"}, {"level", static_cast<unsigned>(level)}, {"message", message}});
}

std::string service_call_failure(std::uint32_t service, std::uint32_t call,
                                 const std::string& message) {
  return dumped({{"op", "serviceCallFailure"},
                 {"serviceId", service},
                 {"callId", call},
                 {"message", message}});
}

web::Frame message_data(std::uint32_t subscription, std::uint64_t log_time_ns, web::Body payload) {
  web::Frame frame;
  auto at = frame.head.begin();
  *at++ = kMessageData;
  at = std::ranges::copy(little_endian(subscription), at).out;
  at = std::ranges::copy(little_endian(log_time_ns), at).out;
  frame.head_size = static_cast<std::uint8_t>(at - frame.head.begin());
  frame.body = std::move(payload);
  return frame;
}

std::string service_call_response(std::uint32_t service, std::uint32_t call,
                                  std::string_view encoding, std::string_view payload) {
  std::string bytes(1, static_cast<char>(kServiceCallResponse));
  append(bytes, service);
  append(bytes, call);
  append(bytes, static_cast<std::uint32_t>(encoding.size()));
  bytes.append(encoding).append(payload);
  return bytes;
}

ClientMessage parse(web::Frame::Kind kind, std::string_view message) {
  return kind == web::Frame::Kind::kText ? parse_text(message) : parse_binary(message);
}

}  // namespace zerodrift::foxglove
