// SPDX-License-Identifier: Apache-2.0
// Input: a byte that says text (even) or binary (odd), then a WebSocket message of a client.
#include <cstdint>

#include "common/foxglove/hub.h"
#include "tests/fuzz/expectations.h"

namespace zerodrift::fuzz {
namespace {

using foxglove::ServiceCall;

class Listening final : public web::Client {
 public:
  Listening() : web::Client(1) {}
  void send(web::Frame frame) override {
    demand(frame.body != nullptr, "a frame has a body");
    ++frames;
  }
  void close(web::CloseCode, const std::string&) override {}
  [[nodiscard]] Counts counts() const override { return {}; }
  [[nodiscard]] const std::string& remote() const override { return remote_; }
  [[nodiscard]] const std::string& subprotocol() const override { return remote_; }
  std::size_t frames = 0;

 private:
  std::string remote_;
};

std::string little_endian(std::uint32_t value) {
  std::string bytes;
  for (unsigned i = 0; i < 4; ++i) bytes += static_cast<char>(value >> 8U * i & 0xFFU);
  return bytes;
}

std::string written(const ServiceCall& call) {
  return "\x02" + little_endian(call.service) + little_endian(call.call) +
         little_endian(static_cast<std::uint32_t>(call.encoding.size())) + call.encoding +
         call.payload;
}

}  // namespace

void foxglove_frame(Bytes input) {
  if (input.empty()) return;
  const auto kind = input[0] % 2 == 0 ? web::Frame::Kind::kText : web::Frame::Kind::kBinary;
  const std::string_view message = as_text(input.subspan(1));
  const foxglove::ClientMessage parsed = foxglove::parse(kind, message);
  if (const auto* refused = std::get_if<foxglove::NotServed>(&parsed))
    demand_one_line(refused->why);
  if (const auto* call = std::get_if<ServiceCall>(&parsed))
    demand(written(*call) == message, "a call that was read is the one that was written");

  Listening client;
  foxglove::Hub hub({.name = "fuzz", .supported_encodings = {"json"}}, {});
  hub.add_channel("/a", {"A", ""});
  hub.add_service("/s", "T", {"Q", ""}, {"R", ""});
  hub.opened(client);
  const std::size_t greeted = client.frames;
  hub.received(client, kind, message);
  demand(client.frames - greeted <= message.size() + 1, "a message has no more answers than bytes");
  hub.closed(client);
  demand(!hub.has_subscriber(1), "nobody has subscribed once all are gone");
}

}  // namespace zerodrift::fuzz
