// SPDX-License-Identifier: Apache-2.0
// A client of the console: a Foxglove client on a socket, as small as it can be.
#pragma once

#include <google/protobuf/message.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/web/web_error.h"
#include "tests/support/web_client.h"

namespace zerodrift::system_test {

class ConsoleClient {
 public:
  using Opcode = web::BlockingClient::Opcode;
  struct Data {
    std::string topic;
    std::uint64_t log_time_ns = 0;
    std::string payload;
  };
  struct Called {
    bool failed = false;
    std::string text;  // the failure, or the reply's payload
  };

  explicit ConsoleClient(const web::Address& address, const web::HeaderLines& headers = {},
                         int receive_buffer_bytes = 0)
      : socket_(address, receive_buffer_bytes) {
    status_ = socket_.upgrade("/", "foxglove.sdk.v1", headers).status;
  }
  [[nodiscard]] unsigned status() const { return status_; }
  [[nodiscard]] web::BlockingClient& socket() { return socket_; }

  // Waits until the channel is there.
  void subscribe(const std::string& topic, std::chrono::milliseconds at_most = kAtMost) {
    const auto until = Clock::now() + at_most;
    while (!channels_.contains(topic) && Clock::now() < until) read(until);
    ASSERT_TRUE(channels_.contains(topic)) << topic;
    const std::uint32_t id = next_id_++;
    topics_[id] = topic;
    socket_.send(Opcode::kText,
                 nlohmann::json{{"op", "subscribe"},
                                {"subscriptions", {{{"id", id}, {"channelId", channels_[topic]}}}}}
                     .dump());
  }
  // The next of a topic; what comes of others meanwhile is kept.
  std::optional<Data> next(const std::string& topic, std::chrono::milliseconds at_most = kAtMost) {
    const auto until = Clock::now() + at_most;
    for (;;) {
      for (auto one = data_.begin(); one != data_.end(); ++one) {
        if (one->topic != topic) continue;
        Data found = std::move(*one);
        data_.erase(one);
        return found;
      }
      if (!read(until)) return std::nullopt;
    }
  }
  template <typename Message>
  std::optional<Message> next_as(const std::string& topic,
                                 std::chrono::milliseconds at_most = kAtMost) {
    const auto data = next(topic, at_most);
    Message message;
    if (!data || !message.ParseFromString(data->payload)) return std::nullopt;
    return message;
  }
  // Through the service /command; payload in this encoding.
  std::optional<Called> call(const std::string& encoding, const std::string& payload,
                             std::chrono::milliseconds at_most = 2 * kAtMost) {
    const auto until = Clock::now() + at_most;
    while (!command_service_ && read(until)) {
    }
    if (!command_service_) return std::nullopt;
    const std::uint32_t id = next_id_++;
    socket_.send(Opcode::kBinary, "\x02" + little_endian(*command_service_) + little_endian(id) +
                                      little_endian(static_cast<std::uint32_t>(encoding.size())) +
                                      encoding + payload);
    while (!calls_.contains(id) && read(until)) {
    }
    const auto found = calls_.find(id);
    return found == calls_.end() ? std::nullopt : std::optional(found->second);
  }
  [[nodiscard]] std::uint16_t close_code() const { return close_code_; }

  static constexpr std::chrono::milliseconds kAtMost{15000};

 private:
  using Clock = std::chrono::steady_clock;

  static std::string little_endian(std::uint32_t value) {
    std::string bytes;
    for (unsigned i = 0; i < 4; ++i) bytes += static_cast<char>(value >> 8U * i & 0xFFU);
    return bytes;
  }
  static std::uint64_t number(const std::string& bytes, std::size_t at, std::size_t size) {
    std::uint64_t value = 0;
    for (std::size_t i = size; i-- > 0;)
      value = value << 8U | static_cast<unsigned char>(bytes.at(at + i));
    return value;
  }
  bool read(Clock::time_point until) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now());
    const auto message = socket_.receive(std::max(left, std::chrono::milliseconds(0)));
    if (!message) return false;
    if (message->opcode == Opcode::kClose) {
      close_code_ = message->close_code();
      return false;
    }
    if (message->opcode == Opcode::kText) {
      read_text(nlohmann::json::parse(message->payload));
    } else if (message->payload.at(0) == 1) {
      data_.push_back({topics_[static_cast<std::uint32_t>(number(message->payload, 1, 4))],
                       number(message->payload, 5, 8), message->payload.substr(13)});
    } else {
      const std::size_t encoding = number(message->payload, 9, 4);
      calls_[static_cast<std::uint32_t>(number(message->payload, 5, 4))] = {
          false, message->payload.substr(13 + encoding)};
    }
    return true;
  }
  void read_text(const nlohmann::json& json) {
    const std::string op = json.at("op");
    if (op == "advertise") {
      for (const auto& channel : json.at("channels"))
        channels_[channel.at("topic")] = channel.at("id");
    } else if (op == "advertiseServices") {
      command_service_ = json.at("services").at(0).at("id").get<std::uint32_t>();
    } else if (op == "serviceCallFailure") {
      calls_[json.at("callId").get<std::uint32_t>()] = {true, json.at("message")};
    }
  }

  web::BlockingClient socket_;
  unsigned status_ = 0;
  std::uint32_t next_id_ = 1;
  std::map<std::string, std::uint32_t> channels_;
  std::map<std::uint32_t, std::string> topics_;  // by subscription
  std::optional<std::uint32_t> command_service_;
  std::deque<Data> data_;
  std::map<std::uint32_t, Called> calls_;
  std::uint16_t close_code_ = 0;
};

}  // namespace zerodrift::system_test
