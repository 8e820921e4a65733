// SPDX-License-Identifier: Apache-2.0
// The console's gateway: DDS on one side, HTTP and WebSockets on the other.
//
// Threads: the middleware's push what arrives into bounded queues; the server's does all the rest
// (drain, encode, send), 50 times a second while somebody looks at samples, else four times; the
// main one speaks of the service itself.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <variant>

#include "common/foxglove/hub.h"
#include "common/service/command_client.h"
#include "common/service/host.h"
#include "common/web/access.h"
#include "common/web/server.h"
#include "common/web/static_files.h"
#include "services/console/arrivals.h"
#include "services/console/console_options.h"
#include "services/console/gateway.h"

namespace zerodrift::services {

class ConsoleNode final : public web::Application {
 public:
  explicit ConsoleNode(const ConsoleOptions& options);
  ~ConsoleNode() override;
  ConsoleNode(const ConsoleNode&) = delete;
  ConsoleNode& operator=(const ConsoleNode&) = delete;

  // Until a stop signal.
  int run();  // exit code

 private:
  // web::Application, on the server's thread.
  web::Response respond(const web::Request& request) override;
  std::variant<std::string, web::Response> upgrade(const web::Request& request) override;
  void opened(web::Client& client) override;
  void received(web::Client& client, web::Frame::Kind kind, std::string_view message) override;
  void closed(web::Client& client, const std::string& why) override;

  void tick();
  void once_a_second(std::int64_t unix_ns);
  void call(const foxglove::CallOrigin& origin, const std::string& payload);
  void answer(const foxglove::CallOrigin& origin, const telemetry::Command& command,
              const service::CommandAnswer& answer);
  [[nodiscard]] web::Response health(const web::Request& request) const;
  [[nodiscard]] web::Response metrics();
  [[nodiscard]] service::Status status() const;

  ConsoleOptions options_;
  web::Access access_;
  web::StaticFiles page_;
  web::Server server_;  // before the host: a port that is taken is refused first
  service::Host host_;
  foxglove::Hub hub_;
  Gateway gateway_;
  std::uint32_t command_service_ = 0;
  std::map<foxglove::ClientId, int> open_calls_;
  std::map<foxglove::ClientId, std::uint64_t> reported_dropped_;
  std::int64_t second_began_ns_ = 0;
  std::atomic<std::int64_t> host_alive_ns_{0};

  // What the main thread says of the server's.
  std::atomic<std::uint64_t> clients_{0};
  std::atomic<std::uint64_t> gyros_{0};
  std::atomic<std::uint64_t> samples_{0};
  std::atomic<std::uint64_t> frames_dropped_{0};
  std::atomic<std::uint64_t> gateway_left_out_{0};
  std::atomic<std::uint64_t> commands_{0};

  Arrivals arrivals_;
  service::CommandClient commands_client_;
};

}  // namespace zerodrift::services
