// SPDX-License-Identifier: Apache-2.0
// The server's side of the protocol: channels, services, and who subscribed to what. One thread.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/foxglove/protocol.h"
#include "common/web/server.h"

namespace zerodrift::foxglove {

using ChannelId = std::uint32_t;
using ClientId = std::uint64_t;

// How a payload goes out.
struct Delivery {
  std::uint64_t log_time_ns = 0;  // Unix time at which it was received here
  web::Frame::Importance importance = web::Frame::Importance::kState;
  // Not 0: of several payloads of the channel with this key that still wait, the newest is enough.
  std::uint32_t latest_of = 0;
};

// Where a call came from, so that it can be answered later, though its client may be gone.
struct CallOrigin {
  ClientId client = 0;
  std::string remote;
  std::uint32_t service = 0;
  std::uint32_t call = 0;
  std::string encoding;
};

class Hub {
 public:
  struct Callbacks {
    // A subscription that is new: what is kept can be sent to this client now.
    std::function<void(ClientId, ChannelId)> subscribed{};
    std::function<void(const CallOrigin&, const std::string& payload)> called{};
  };
  Hub(ServerInfo info, Callbacks callbacks);

  ChannelId add_channel(const std::string& topic, const Schema& schema);  // advertised to all
  std::uint32_t add_service(const std::string& name, const std::string& type, const Schema& request,
                            const Schema& response);

  [[nodiscard]] bool has_subscriber(ChannelId channel) const;
  [[nodiscard]] bool is_subscribed(ClientId client, ChannelId channel) const;
  // To all who subscribed, or to one.
  void publish(ChannelId channel, const Delivery& delivery, const web::Body& payload);
  void publish_to(ClientId client, ChannelId channel, const Delivery& delivery,
                  const web::Body& payload);

  void answer(const CallOrigin& call, std::string_view payload);
  void fail(const CallOrigin& call, const std::string& why);

  void opened(web::Client& client);
  void received(web::Client& client, web::Frame::Kind kind, std::string_view message);
  void closed(const web::Client& client);

  [[nodiscard]] std::size_t clients() const { return clients_.size(); }
  void for_each_client(const std::function<void(web::Client&)>& visit);
  [[nodiscard]] const web::Client* client(ClientId id) const;

 private:
  struct Connected {
    web::Client* link = nullptr;
    std::map<std::uint32_t, ChannelId> channels;       // by subscription
    std::map<ChannelId, std::uint32_t> subscriptions;  // and back
  };
  void subscribe(Connected& client, const Subscribe& message);
  void unsubscribe(Connected& client, const Unsubscribe& message);
  void call(Connected& client, ServiceCall&& message);
  void warn(const Connected& client, const std::string& why) const;
  void send(Connected& client, std::uint32_t subscription, ChannelId channel,
            const Delivery& delivery, const web::Body& payload);

  ServerInfo info_;
  Callbacks callbacks_;
  std::map<ChannelId, Channel> channels_;
  std::map<std::uint32_t, Service> services_;
  std::map<ClientId, Connected> clients_;
  std::map<ChannelId, std::size_t> subscribers_;  // how many; none: no entry
  std::uint32_t next_channel_ = 1;
  std::uint32_t next_service_ = 1;
};

}  // namespace zerodrift::foxglove
