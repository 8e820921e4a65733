// SPDX-License-Identifier: Apache-2.0
#include "common/foxglove/hub.h"

#include <algorithm>
#include <utility>

namespace zerodrift::foxglove {
namespace {

constexpr std::size_t kMostSubscriptions = 4096;  // of one client

web::Frame text_frame(std::string text) {
  web::Frame frame;
  frame.kind = web::Frame::Kind::kText;
  frame.body = web::body_of(std::move(text));
  return frame;
}

}  // namespace

Hub::Hub(ServerInfo info, Callbacks callbacks)
    : info_(std::move(info)), callbacks_(std::move(callbacks)) {}

ChannelId Hub::add_channel(const std::string& topic, const Schema& schema) {
  const Channel channel{next_channel_++, topic, schema};
  channels_[channel.id] = channel;
  const web::Frame frame = text_frame(advertise({channel}));
  for (auto& [id, client] : clients_) client.link->send(frame);
  return channel.id;
}

std::uint32_t Hub::add_service(const std::string& name, const std::string& type,
                               const Schema& request, const Schema& response) {
  const Service service{next_service_++, name, type, request, response};
  services_[service.id] = service;
  const web::Frame frame = text_frame(advertise_services({service}));
  for (auto& [id, client] : clients_) client.link->send(frame);
  return service.id;
}

bool Hub::has_subscriber(ChannelId channel) const {
  return subscribers_.contains(channel);
}

bool Hub::is_subscribed(ClientId client, ChannelId channel) const {
  const auto known = clients_.find(client);
  return known != clients_.end() && known->second.subscriptions.contains(channel);
}

const web::Client* Hub::client(ClientId id) const {
  const auto known = clients_.find(id);
  return known == clients_.end() ? nullptr : known->second.link;
}

void Hub::for_each_client(const std::function<void(web::Client&)>& visit) {
  for (auto& [id, client] : clients_) visit(*client.link);
}

void Hub::send(Connected& client, std::uint32_t subscription, ChannelId channel,
               const Delivery& delivery, const web::Body& payload) {
  web::Frame frame = message_data(subscription, delivery.log_time_ns, payload);
  frame.importance = delivery.importance;
  if (delivery.latest_of != 0) frame.replaces = std::uint64_t{channel} << 32U | delivery.latest_of;
  client.link->send(std::move(frame));
}

void Hub::publish(ChannelId channel, const Delivery& delivery, const web::Body& payload) {
  for (auto& [id, client] : clients_) {
    const auto subscription = client.subscriptions.find(channel);
    if (subscription != client.subscriptions.end())
      send(client, subscription->second, channel, delivery, payload);
  }
}

void Hub::publish_to(ClientId client, ChannelId channel, const Delivery& delivery,
                     const web::Body& payload) {
  const auto known = clients_.find(client);
  if (known == clients_.end()) return;
  const auto subscription = known->second.subscriptions.find(channel);
  if (subscription != known->second.subscriptions.end())
    send(known->second, subscription->second, channel, delivery, payload);
}

void Hub::answer(const CallOrigin& call, std::string_view payload) {
  const auto known = clients_.find(call.client);
  if (known == clients_.end()) return;
  web::Frame frame;
  frame.body = web::body_of(service_call_response(call.service, call.call, call.encoding, payload));
  known->second.link->send(std::move(frame));
}

void Hub::fail(const CallOrigin& call, const std::string& why) {
  const auto known = clients_.find(call.client);
  if (known == clients_.end()) return;
  known->second.link->send(text_frame(service_call_failure(call.service, call.call, why)));
}

// ---------------------------------------- clients

void Hub::opened(web::Client& client) {
  clients_[client.id()].link = &client;
  client.send(text_frame(server_info(info_)));
  std::vector<Channel> channels;
  for (const auto& [id, channel] : channels_) channels.push_back(channel);
  client.send(text_frame(advertise(channels)));
  std::vector<Service> services;
  for (const auto& [id, service] : services_) services.push_back(service);
  if (!services.empty()) client.send(text_frame(advertise_services(services)));
}

void Hub::closed(const web::Client& client) {
  const auto known = clients_.find(client.id());
  if (known == clients_.end()) return;
  for (const auto& [channel, subscription] : known->second.subscriptions) {
    if (--subscribers_[channel] == 0) subscribers_.erase(channel);
  }
  clients_.erase(known);
}

void Hub::received(web::Client& client, web::Frame::Kind kind, std::string_view message) {
  const auto known = clients_.find(client.id());
  if (known == clients_.end()) return;
  Connected& from = known->second;
  ClientMessage parsed = parse(kind, message);
  if (const auto* subscribed = std::get_if<Subscribe>(&parsed)) {
    subscribe(from, *subscribed);
  } else if (const auto* unsubscribed = std::get_if<Unsubscribe>(&parsed)) {
    unsubscribe(from, *unsubscribed);
  } else if (auto* called = std::get_if<ServiceCall>(&parsed)) {
    call(from, std::move(*called));
  } else {
    warn(from, std::get<NotServed>(parsed).why);
  }
}

void Hub::warn(const Connected& client, const std::string& why) const {
  client.link->send(text_frame(status(StatusLevel::kWarning, why)));
}

void Hub::subscribe(Connected& client, const Subscribe& message) {
  for (const auto& [id, channel] : message.subscriptions) {
    const std::string which = "subscription " + std::to_string(id) + ": ";
    if (!channels_.contains(channel)) {
      warn(client, which + "there is no channel " + std::to_string(channel));
    } else if (client.channels.contains(id)) {
      warn(client, which + "this id is taken; unsubscribe it first");
    } else if (client.subscriptions.contains(channel)) {
      warn(client, which + "channel " + std::to_string(channel) + " is subscribed already");
    } else if (client.channels.size() >= kMostSubscriptions) {
      warn(client, which + "at most " + std::to_string(kMostSubscriptions) + " at a time");
    } else {
      client.channels[id] = channel;
      client.subscriptions[channel] = id;
      ++subscribers_[channel];
      if (callbacks_.subscribed) callbacks_.subscribed(client.link->id(), channel);
    }
  }
}

void Hub::unsubscribe(Connected& client, const Unsubscribe& message) {
  for (const std::uint32_t id : message.subscriptions) {
    const auto known = client.channels.find(id);
    if (known == client.channels.end()) {
      warn(client, "there is no subscription " + std::to_string(id));
      continue;
    }
    const ChannelId channel = known->second;
    client.subscriptions.erase(channel);
    client.channels.erase(known);
    if (--subscribers_[channel] == 0) subscribers_.erase(channel);
  }
}

void Hub::call(Connected& client, ServiceCall&& message) {
  const CallOrigin origin{client.link->id(), client.link->remote(), message.service, message.call,
                          std::move(message.encoding)};
  const auto& encodings = info_.supported_encodings;
  if (!services_.contains(message.service)) {
    fail(origin, "there is no service " + std::to_string(message.service));
  } else if (std::find(encodings.begin(), encodings.end(), origin.encoding) == encodings.end()) {
    fail(origin, "this encoding is not known here; see supportedEncodings");
  } else if (callbacks_.called) {
    callbacks_.called(origin, message.payload);
  }
}

}  // namespace zerodrift::foxglove
