// SPDX-License-Identifier: Apache-2.0
#include "tests/support/web_client.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>

#include "common/web/web_error.h"

namespace zerodrift::web {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono_literals::operator""ms;

constexpr auto kReplyWithin = 5000ms;
constexpr std::size_t kForgetTaken = 1 << 16;

std::uint64_t big_endian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (const char byte : bytes) value = value << 8U | static_cast<unsigned char>(byte);
  return value;
}

std::string big_endian(std::uint64_t value, unsigned bytes) {
  std::string text;
  while (bytes-- > 0) text += static_cast<char>(value >> (8U * bytes) & 0xFFU);
  return text;
}

std::string joined(const HeaderLines& headers) {
  std::string text;
  for (const auto& [name, value] : headers) text += name + ": " + value + "\r\n";
  return text;
}

bool names_host(const HeaderLines& headers) {
  return std::any_of(headers.begin(), headers.end(),
                     [](const auto& header) { return header.first == "Host"; });
}

std::size_t content_length(std::string_view head) {
  constexpr std::string_view kName = "\r\nContent-Length: ";
  const std::size_t at = head.find(kName);
  std::size_t length = 0;
  if (at != std::string_view::npos)
    std::from_chars(head.data() + at + kName.size(), head.data() + head.size(), length);
  return length;
}

}  // namespace

BlockingClient::BlockingClient(const Address& address, int receive_buffer_bytes)
    : address_(address) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(address.port);
  if (inet_pton(AF_INET, address.host.c_str(), &to.sin_addr) != 1)
    throw WebError(address.text() + " is not an IPv4 address");
  socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (receive_buffer_bytes > 0)
    setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof receive_buffer_bytes);
  const int on = 1;
  setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  if (connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    close(socket_);
    throw WebError("nobody listens at " + address.text() + ": " + std::strerror(errno));
  }
}

BlockingClient::~BlockingClient() {
  close(socket_);
}

bool BlockingClient::send_raw(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

bool BlockingClient::fill(Clock::time_point until) {
  const auto left =
      std::max(0ms, std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now()));
  pollfd waiting{socket_, POLLIN, 0};
  if (poll(&waiting, 1, static_cast<int>(left.count())) <= 0) return false;
  std::array<char, 65536> buffer;
  const ssize_t got = recv(socket_, buffer.data(), buffer.size(), 0);
  if (got <= 0) return false;
  if (taken_ > kForgetTaken) {
    received_.erase(0, taken_);
    taken_ = 0;
  }
  received_.append(buffer.data(), static_cast<std::size_t>(got));
  return true;
}

std::string BlockingClient::receive_raw(std::chrono::milliseconds at_most) {
  if (taken_ == received_.size()) fill(Clock::now() + at_most);
  std::string bytes = received_.substr(taken_);
  received_.clear();
  taken_ = 0;
  return bytes;
}

BlockingClient::Reply BlockingClient::receive_reply(std::chrono::milliseconds at_most,
                                                    bool has_body) {
  const auto until = Clock::now() + at_most;
  Reply reply;
  std::size_t end = std::string::npos;
  while ((end = received_.find("\r\n\r\n", taken_)) == std::string::npos) {
    if (!fill(until)) return reply;
  }
  reply.head = received_.substr(taken_, end - taken_);
  taken_ = end + 4;
  const std::size_t space = std::min(reply.head.find(' '), reply.head.size() - 1);
  std::from_chars(reply.head.data() + space + 1, reply.head.data() + reply.head.size(),
                  reply.status);
  const std::size_t length = has_body ? content_length(reply.head) : 0;
  while (received_.size() - taken_ < length) {
    if (!fill(until)) break;
  }
  reply.body = received_.substr(taken_, length);
  taken_ += reply.body.size();
  return reply;
}

BlockingClient::Reply BlockingClient::get(const std::string& target, const HeaderLines& headers) {
  const std::string host = names_host(headers) ? "" : "Host: " + address_.text() + "\r\n";
  send_raw("GET " + target + " HTTP/1.1\r\n" + host + joined(headers) + "\r\n");
  return receive_reply(kReplyWithin);
}

BlockingClient::Reply BlockingClient::upgrade(const std::string& target,
                                              const std::string& subprotocols,
                                              const HeaderLines& headers) {
  HeaderLines lines{{"Connection", "Upgrade"},
                    {"Upgrade", "websocket"},
                    {"Sec-WebSocket-Version", "13"},
                    {"Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="}};
  if (!subprotocols.empty()) lines.emplace_back("Sec-WebSocket-Protocol", subprotocols);
  lines.insert(lines.end(), headers.begin(), headers.end());
  return get(target, lines);
}

bool BlockingClient::send(Opcode opcode, std::string_view payload) {
  constexpr std::array<char, 4> kMask{0x12, 0x34, 0x56, 0x78};
  std::string frame;
  frame += static_cast<char>(0x80U | static_cast<unsigned>(opcode));
  if (payload.size() < 126) {
    frame += static_cast<char>(0x80U | payload.size());
  } else if (payload.size() < 65536) {
    frame += static_cast<char>(0x80U | 126U) + big_endian(payload.size(), 2);
  } else {
    frame += static_cast<char>(0x80U | 127U) + big_endian(payload.size(), 8);
  }
  frame.append(kMask.data(), kMask.size());
  for (std::size_t i = 0; i < payload.size(); ++i)
    frame += static_cast<char>(payload[i] ^ kMask[i % kMask.size()]);
  return send_raw(frame);
}

std::uint16_t BlockingClient::Message::close_code() const {
  if (opcode != Opcode::kClose || payload.size() < 2) return 0;
  return static_cast<std::uint16_t>(big_endian(std::string_view(payload).substr(0, 2)));
}

std::optional<BlockingClient::Message> BlockingClient::receive(std::chrono::milliseconds at_most) {
  const auto until = Clock::now() + at_most;
  const auto have = [&](std::size_t bytes) {
    while (received_.size() - taken_ < bytes) {
      if (!fill(until)) return false;
    }
    return true;
  };
  for (;;) {
    if (!have(2)) return std::nullopt;
    const auto first = static_cast<unsigned char>(received_[taken_]);
    std::size_t length = static_cast<unsigned char>(received_[taken_ + 1]) & 0x7FU;
    std::size_t head = 2;
    if (length >= 126) {
      const std::size_t bytes = length == 126 ? 2 : 8;
      if (!have(head + bytes)) return std::nullopt;
      length = big_endian(std::string_view(received_).substr(taken_ + head, bytes));
      head += bytes;
    }
    if (!have(head + length)) return std::nullopt;
    Message message{static_cast<Opcode>(first & 0xFU), received_.substr(taken_ + head, length)};
    taken_ += head + length;
    if (message.opcode != Opcode::kPing) return message;
    send(Opcode::kPong, message.payload);
  }
}

}  // namespace zerodrift::web
