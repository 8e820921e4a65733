// SPDX-License-Identifier: Apache-2.0
// A small blocking HTTP and WebSocket client on a plain socket, for benches and tests: it can also
// say what no well-behaved client says.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/web/address.h"

namespace zerodrift::web {

using HeaderLines = std::vector<std::pair<std::string, std::string>>;

class BlockingClient {
 public:
  // Throws WebError where nobody listens. `receive_buffer_bytes`, if not 0, is the kernel's.
  explicit BlockingClient(const Address& address, int receive_buffer_bytes = 0);
  ~BlockingClient();
  BlockingClient(const BlockingClient&) = delete;
  BlockingClient& operator=(const BlockingClient&) = delete;

  // As it is. False: the other side has closed.
  bool send_raw(std::string_view bytes);
  // Whatever comes next; empty: closed, or nothing within the time.
  std::string receive_raw(std::chrono::milliseconds at_most);

  struct Reply {
    unsigned status = 0;  // 0: none came
    std::string head;
    std::string body;
  };
  // GET with Host; other lines are added.
  Reply get(const std::string& target, const HeaderLines& headers = {});
  // What comes back to raw bytes: its head, and its body by Content-Length.
  Reply receive_reply(std::chrono::milliseconds at_most, bool has_body = true);
  // The reply is 101 where it worked.
  Reply upgrade(const std::string& target, const std::string& subprotocols,
                const HeaderLines& headers = {});

  enum class Opcode : std::uint8_t {
    kContinuation = 0,
    kText = 1,
    kBinary = 2,
    kClose = 8,
    kPing = 9,
    kPong = 10
  };
  // Masked, as a client has to.
  bool send(Opcode opcode, std::string_view payload);
  struct Message {
    Opcode opcode = Opcode::kText;
    std::string payload;
    // Of a close frame: its code; 0 without one.
    [[nodiscard]] std::uint16_t close_code() const;
  };
  // The next whole frame; pings are answered and passed over. Nothing: closed, or not within the
  // time.
  std::optional<Message> receive(std::chrono::milliseconds at_most);

 private:
  bool fill(std::chrono::steady_clock::time_point until);

  Address address_;
  int socket_ = -1;
  std::string received_;
  std::size_t taken_ = 0;  // of received_
};

}  // namespace zerodrift::web
