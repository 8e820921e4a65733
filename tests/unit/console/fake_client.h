// SPDX-License-Identifier: Apache-2.0
// A client of the gateway without a socket.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "services/console/gateway.h"

namespace zerodrift::services {

using Kind = web::Frame::Kind;

class FakeClient final : public web::Client {
 public:
  explicit FakeClient(std::uint64_t id) : web::Client(id) {}
  void send(web::Frame frame) override {
    if (frame.kind == Kind::kBinary) {
      data.push_back(std::move(frame));
      return;
    }
    const auto json = nlohmann::json::parse(*frame.body);
    if (json.at("op") != "advertise") return;
    for (const auto& channel : json.at("channels")) {
      channels[channel.at("topic")] = channel.at("id");
      schemas[channel.at("topic")] = channel.at("schemaName");
    }
  }
  void close(web::CloseCode, const std::string&) override {}
  [[nodiscard]] Counts counts() const override { return {1, 2, waiting, 0.5}; }
  [[nodiscard]] const std::string& remote() const override { return remote_; }
  [[nodiscard]] const std::string& subprotocol() const override { return remote_; }

  template <typename Message>
  [[nodiscard]] std::vector<Message> take() {
    std::vector<Message> messages;
    for (const auto& frame : data)
      EXPECT_TRUE(messages.emplace_back().ParseFromString(*frame.body));
    data.clear();
    return messages;
  }
  std::map<std::string, unsigned> channels;
  std::map<std::string, std::string> schemas;  // full names, by topic
  std::vector<web::Frame> data;
  std::size_t waiting = 0;

 private:
  std::string remote_;
};

}  // namespace zerodrift::services
