// SPDX-License-Identifier: Apache-2.0
// An HTTP and WebSocket server on one port and one thread of its own. What it serves is its
// application's to say. server.cpp is the only source that knows Boost.Beast.
//
// Bounds: connections, header, body, message, what waits for each client, and time for each step of
// a connection. A newcomer is always accepted: where all places are taken, the plain connection
// that has waited longest gives way, and WebSockets never have all of them. What is beyond the
// bounds, malformed or not UTF-8 where it has to be is refused with an HTTP status or a WebSocket
// close code; nothing of it ends the server or another connection.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "common/web/address.h"
#include "common/web/frame.h"
#include "common/web/message.h"
#include "common/web/outgoing_queue.h"
#include "common/web/web_error.h"

namespace zerodrift::web {

struct ServerOptions {
  Address listen;
  std::size_t most_connections = 64;
  std::size_t kept_for_requests = 16;  // of them: no WebSocket takes these
  std::size_t largest_header = 8192;
  std::size_t largest_body = 65536;
  std::size_t largest_message = 65536;              // of a WebSocket
  std::chrono::milliseconds request_within{10000};  // from a connection's begin or last response
  std::chrono::milliseconds closed_within{2000};    // a WebSocket, from the server's goodbye on
  std::chrono::milliseconds client_silent_at_most{60000};  // pings are sent at half of it
  int send_buffer_bytes = 256 * 1024;  // of the kernel: what waits beyond it waits in the queue
  OutgoingLimits outgoing;
  std::vector<std::pair<std::string, std::string>> headers{};  // of every response
};

enum class CloseCode : std::uint16_t {
  kNormal = 1000,
  kGoingAway = 1001,
  kPolicyError = 1008,
  kTryAgainLater = 1013
};

// One WebSocket. The server's thread only; gone after Application::closed().
class Client {
 public:
  struct Counts {
    std::uint64_t frames_sent = 0;
    std::uint64_t frames_dropped = 0;
    std::size_t bytes_waiting = 0;
    double queue_fill = 0.0;  // 0..1
  };
  // Never waits. A client that is too slow even for state is closed, with the reason.
  virtual void send(Frame frame) = 0;
  virtual void close(CloseCode code, const std::string& reason) = 0;
  [[nodiscard]] virtual Counts counts() const = 0;
  [[nodiscard]] virtual const std::string& remote() const = 0;  // "127.0.0.1:40000"
  [[nodiscard]] virtual const std::string& subprotocol() const = 0;
  [[nodiscard]] std::uint64_t id() const { return id_; }

 protected:
  explicit Client(std::uint64_t id) : id_(id) {}
  ~Client() = default;

 private:
  std::uint64_t id_;  // no other ever has it
};

// What a server serves; called on its thread, one call at a time. Exceptions end as status 500.
class Application {
 public:
  virtual ~Application() = default;
  virtual Response respond(const Request& request) = 0;
  // The subprotocol to speak with the client, or why not.
  virtual std::variant<std::string, Response> upgrade(const Request& request) = 0;
  virtual void opened(Client& client) = 0;
  virtual void received(Client& client, Frame::Kind kind, std::string_view message) = 0;
  // `why`: one line, empty where the client went by itself.
  virtual void closed(Client& client, const std::string& why) = 0;
};

class Server {
 public:
  // Listens from here on; throws WebError where the address is taken or is none of this machine's.
  // The application lives longer.
  Server(const ServerOptions& options, Application& application);
  ~Server();  // as stop()
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  [[nodiscard]] Address address() const;  // with the port that was free
  void start();
  // Clients get a closing frame; within half a second all is closed and the thread has ended.
  void stop();

  // Any thread: runs it on the server's thread, where all of the application runs. After stop() it
  // never runs.
  void post(std::function<void()> task);
  void post_after(std::chrono::milliseconds delay, std::function<void()> task);

  struct Counts {
    std::uint64_t connections = 0;  // now
    std::uint64_t refused = 0;      // WebSockets without a place, since the start
    std::uint64_t gave_way = 0;     // plain connections that were closed for newcomers
  };
  [[nodiscard]] Counts counts() const;  // any thread

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace zerodrift::web
