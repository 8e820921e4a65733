// SPDX-License-Identifier: Apache-2.0
// A real server on loopback and clients of every kind: well-behaved, slow, hostile.
#include "common/web/server.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <memory>
#include <mutex>
#include <set>
#include <thread>
#include <tuple>
#include <vector>

#include "tests/support/web_client.h"

namespace zerodrift::web {
namespace {

using namespace std::chrono_literals;
using Opcode = BlockingClient::Opcode;

constexpr auto kAtMost = 5000ms;  // until a test gives up; what it waits for takes milliseconds

// Says back what it hears; "flood N" sends N samples of 4 kB and then "done", "close" closes the
// one that says it, "close all" everybody.
class Echo final : public Application {
 public:
  Response respond(const Request& request) override {
    if (request.target.path == "/throw") throw std::runtime_error("this path throws");
    return plain_response(200, "you asked for " + request.target.path);
  }
  std::variant<std::string, Response> upgrade(const Request& request) override {
    if (request.target.path == "/refused") return plain_response(403, "not here");
    return request.subprotocols.empty() ? std::string() : request.subprotocols.front();
  }
  void opened(Client& client) override { clients_.insert(&client); }
  void received(Client& client, Frame::Kind kind, std::string_view message) override {
    if (message.starts_with("flood "))
      return flood(client, std::stoi(std::string(message.substr(6))));
    if (message == "close") return client.close(CloseCode::kPolicyError, "as you wish");
    if (message == "close all") {
      for (Client* each : std::set<Client*>(clients_))
        each->close(CloseCode::kPolicyError, "as you wish");
      return;
    }
    Frame frame;
    frame.kind = kind;
    frame.body = body_of(std::string(message));
    for (Client* each : message.starts_with("all:") ? clients_ : std::set<Client*>{&client})
      each->send(frame);
  }
  void closed(Client& client, const std::string& why) override {
    const std::lock_guard lock(mutex_);
    clients_.erase(&client);
    last_why_ = why;
    dropped_ += client.counts().frames_dropped;
    ++closed_;
  }
  std::string last_why() {
    const std::lock_guard lock(mutex_);
    return last_why_;
  }
  std::uint64_t dropped() {
    const std::lock_guard lock(mutex_);
    return dropped_;
  }
  std::atomic<int> closed_{0};

 private:
  static void flood(Client& client, int frames) {
    const Body body = body_of(std::string(4096, 's'));
    for (int i = 0; i < frames; ++i) {
      Frame frame;
      frame.importance = Frame::Importance::kSample;
      frame.head[0] = static_cast<std::uint8_t>(i);
      frame.head_size = 1;
      frame.body = body;
      client.send(frame);
    }
    Frame done;
    done.kind = Frame::Kind::kText;
    done.body = body_of("done " + std::to_string(client.counts().frames_dropped));
    client.send(done);
  }
  std::set<Client*> clients_;
  std::mutex mutex_;
  std::string last_why_;
  std::uint64_t dropped_ = 0;
};

ServerOptions small_options() {
  ServerOptions options;
  options.listen = {"127.0.0.1", 0};
  options.most_connections = 8;
  options.kept_for_requests = 2;
  options.request_within = 1000ms;
  options.closed_within = 200ms;
  options.send_buffer_bytes = 16 * 1024;
  options.headers = {{"X-Content-Type-Options", "nosniff"}};
  return options;
}

class WebServer : public testing::Test {
 protected:
  explicit WebServer(const ServerOptions& options = small_options()) : server_(options, echo_) {
    server_.start();
  }
  [[nodiscard]] std::unique_ptr<BlockingClient> connect(int receive_buffer = 0) const {
    return std::make_unique<BlockingClient>(server_.address(), receive_buffer);
  }
  [[nodiscard]] std::unique_ptr<BlockingClient> open(int receive_buffer = 0) const {
    auto client = connect(receive_buffer);
    EXPECT_EQ(client->upgrade("/", "a, b").status, 101U);
    return client;
  }
  // What a server does with bytes that come instead of a request.
  [[nodiscard]] unsigned status_of(const std::string& bytes) const {
    const auto client = connect();
    client->send_raw(bytes);
    return client->receive_reply(kAtMost).status;
  }
  void expect_alive() const { EXPECT_EQ(connect()->get("/alive").status, 200U); }
  static std::string echoed(BlockingClient& client, const std::string& text) {
    client.send(Opcode::kText, text);
    const auto message = client.receive(kAtMost);
    return message ? message->payload : "nothing";
  }

  Echo echo_;
  Server server_;
};

TEST_F(WebServer, AnswersRequestsOneAfterTheOtherOnOneConnection) {
  const auto client = connect();
  for (const char* path : {"/a", "/b?x=1", "/c"}) {
    const auto reply = client->get(path);
    EXPECT_EQ(reply.status, 200U);
    EXPECT_NE(reply.body.find("you asked for /"), std::string::npos);
    EXPECT_NE(reply.head.find("X-Content-Type-Options: nosniff"), std::string::npos);
  }
  client->send_raw("HEAD /d HTTP/1.1\r\nHost: h\r\n\r\n");
  const auto head = client->receive_reply(kAtMost, false);
  EXPECT_EQ(head.status, 200U);
  EXPECT_NE(head.head.find("Content-Length: 17"), std::string::npos) << head.head;
  EXPECT_EQ(client->get("/throw").status, 500U);
  expect_alive();
}

TEST_F(WebServer, EchoesTextAndBinaryAndNamesItsSubprotocol) {
  const auto client = connect();
  const auto reply = client->upgrade("/", "first, second");
  EXPECT_EQ(reply.status, 101U);
  EXPECT_NE(reply.head.find("Sec-WebSocket-Protocol: first"), std::string::npos) << reply.head;
  EXPECT_EQ(echoed(*client, "grüezi"), "grüezi");
  client->send(Opcode::kBinary, std::string("\0\xff", 2));
  const auto binary = client->receive(kAtMost);
  ASSERT_TRUE(binary);
  EXPECT_EQ(binary->opcode, Opcode::kBinary);
  EXPECT_EQ(binary->payload, std::string("\0\xff", 2));
  client->send(Opcode::kPing, "p");
  EXPECT_EQ(client->receive(kAtMost)->opcode, Opcode::kPong);
  EXPECT_EQ(connect()->upgrade("/refused", "a").status, 403U);
}

TEST_F(WebServer, MessagesMayComeInFragments) {
  const auto client = open();
  const std::string mask(4, '\0');
  client->send_raw("\x01\x82" + mask + "ab");  // text, not final, masked by zeros
  client->send(Opcode::kPing, "");             // control frames may come between
  client->send_raw("\x80\x82" + mask + "cd");
  EXPECT_EQ(client->receive(kAtMost)->opcode, Opcode::kPong);
  EXPECT_EQ(client->receive(kAtMost)->payload, "abcd");
}

TEST_F(WebServer, HostileRequestsGetOneStatusEachAndEndNothing) {
  EXPECT_EQ(status_of("GARBAGE\r\n\r\n"), 400U);
  EXPECT_EQ(status_of(std::string("\x16\x03\x01\x02\x00\x01\x00\x01", 8) + "\r\n\r\n"), 400U);
  EXPECT_EQ(status_of("GET / HTTP/9.9\r\nHost: h\r\n\r\n"), 400U);
  EXPECT_EQ(status_of("GET /../etc/passwd HTTP/1.1\r\nHost: h\r\n\r\n"), 400U);
  EXPECT_EQ(status_of("GET http://other/ HTTP/1.1\r\nHost: h\r\n\r\n"), 400U);
  EXPECT_EQ(status_of("POST / HTTP/1.1\r\nHost: h\r\nContent-Length: 0\r\n\r\n"), 405U);
  EXPECT_EQ(status_of("GET / HTTP/1.1\r\nHost: h\r\nX: " + std::string(9000, 'x') + "\r\n\r\n"),
            431U);
  EXPECT_EQ(status_of("GET /" + std::string(9000, 'x') + " HTTP/1.1\r\nHost: h\r\n\r\n"), 431U);
  EXPECT_EQ(status_of("POST / HTTP/1.1\r\nHost: h\r\nContent-Length: 99999999\r\n\r\n"), 413U);
  EXPECT_EQ(
      status_of("GET / HTTP/1.1\r\nHost: h\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n"),
      400U);
  EXPECT_EQ(status_of("GET / HTTP/1.1\r\nHost: h\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n"),
            400U);
  expect_alive();
}

TEST_F(WebServer, ARequestThatNeverEndsIsCutOff) {
  const auto client = connect();
  client->send_raw("GET / HTTP/1.1\r\nHost:");
  EXPECT_EQ(client->receive_raw(kAtMost), "");  // closed after request_within
  expect_alive();
}

struct Bad {
  const char* name;
  std::string bytes;
  std::uint16_t code;
};
class BadFrame : public WebServer, public testing::WithParamInterface<Bad> {};

TEST_P(BadFrame, ClosesItsOwnConnectionWithItsCodeAndNoOther) {
  const auto other = open();
  const auto client = open();
  client->send_raw(GetParam().bytes);
  const auto message = client->receive(kAtMost);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->opcode, Opcode::kClose);
  EXPECT_EQ(message->close_code(), GetParam().code);
  EXPECT_EQ(echoed(*other, "still here"), "still here");
}

std::string masked(const std::string& head, const std::string& payload) {
  return head + std::string(4, '\0') + payload;
}

// Codes of RFC 6455, 7.4.1: 1002 protocol error, 1007 no UTF-8, 1009 too big.
INSTANTIATE_TEST_SUITE_P(
    All, BadFrame,
    testing::Values(
        Bad{"unmasked", "\x81\x02hi", 1002}, Bad{"reserved_bits", masked("\xf1\x82", "hi"), 1002},
        Bad{"reserved_opcode", masked("\x83\x82", "hi"), 1002},
        Bad{"bad_utf8", masked("\x81\x82", "\xc3\x28"), 1007},
        Bad{"surrogate", masked("\x81\x83", "\xed\xa0\x80"), 1007},
        Bad{"continuation_of_nothing", masked("\x80\x82", "hi"), 1002},
        Bad{"text_within_fragments", masked("\x01\x81", "a") + masked("\x81\x81", "b"), 1002},
        Bad{"fragmented_ping", masked("\x09\x81", "a"), 1002},
        Bad{"long_ping", masked(std::string("\x89\xfe\x00\x7e", 4), std::string(126, 'x')), 1002},
        Bad{"oversized",
            std::string("\x82\xff\x00\x00\x00\x00\x00\x02\x00\x00", 10) + std::string(4, '\0') +
                "x",
            1009},
        Bad{"huge",
            std::string("\x82\xff\x7f\xff\xff\xff\xff\xff\xff\xff", 10) + std::string(4, '\0'),
            1009},
        Bad{"bad_close_code", masked(std::string("\x88\x82", 2), std::string("\x00\x01", 2)),
            1002}),
    [](const auto& of) { return std::string(of.param.name); });

TEST_F(WebServer, FragmentsTogetherAreBoundedToo) {
  const auto client = open();
  const std::string head = std::string("\x02\xfe\x7f\xff", 4) + std::string(4, '\0');
  for (int i = 0; i < 3; ++i)
    client->send_raw((i == 0 ? head : '\0' + head.substr(1)) + std::string(0x7fff, 'x'));
  const auto message = client->receive(kAtMost);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->close_code(), 1009);
  expect_alive();
}

TEST_F(WebServer, ASlowClientLosesSamplesOthersNothing) {
  const auto slow = open(4096);
  const auto other = open();
  // 16 MB for a queue of 4 MB, while the client reads nothing.
  slow->send(Opcode::kText, "flood 4000");
  EXPECT_EQ(echoed(*other, "quick"), "quick");
  int frames = 0;
  std::string done;
  while (done.empty()) {
    const auto message = slow->receive(kAtMost);
    ASSERT_TRUE(message);
    if (message->opcode == Opcode::kText) {
      done = message->payload;
    } else {
      EXPECT_EQ(message->payload.size(), 4097U);
      ++frames;
    }
  }
  EXPECT_GT(frames, 0);
  EXPECT_EQ(done, "done " + std::to_string(4000 - frames));  // what it lost is what is counted
}

TEST_F(WebServer, TooManyClientsAreToldSoAndRequestsAreServedAllTheSame) {
  const ServerOptions options = small_options();
  std::vector<std::unique_ptr<BlockingClient>> clients;
  for (std::size_t i = options.kept_for_requests; i < options.most_connections; ++i)
    clients.push_back(open());
  EXPECT_EQ(connect()->upgrade("/", "a").status, 503U);
  EXPECT_EQ(server_.counts().refused, 1U);
  expect_alive();
  EXPECT_EQ(echoed(*clients.front(), "served"), "served");
  clients.clear();
  for (int i = 0; i < 500 && server_.counts().connections > 0; ++i)
    std::this_thread::sleep_for(10ms);
  EXPECT_EQ(connect()->upgrade("/", "a").status, 101U);
}

// All are younger than request_within when the next one comes.
TEST_F(WebServer, ConnectionsThatAskNothingOrDripGiveWayToWhoAsks) {
  const auto client = open();
  std::vector<std::unique_ptr<BlockingClient>> idle;
  for (int round = 0; round < 5; ++round) {
    for (std::size_t i = 0; i < 2 * small_options().most_connections; ++i) {
      idle.push_back(connect());
      if (i % 2 == 0) idle.back()->send_raw("GET / HTTP/1.1\r\nHost:");
    }
    expect_alive();
    EXPECT_LE(server_.counts().connections, small_options().most_connections + 1);
  }
  EXPECT_GT(server_.counts().gave_way, 0U);
  EXPECT_EQ(echoed(*client, "still here"), "still here") << "a WebSocket keeps its place";
}

TEST_F(WebServer, WhoAsksIsServedWhileConnectionsAreMadeAllTheTime) {
  std::atomic<bool> done{false};
  std::thread flood([&] {
    std::vector<std::unique_ptr<BlockingClient>> idle;
    while (!done) {
      if (idle.size() > 100) idle.clear();
      idle.push_back(connect());
      std::this_thread::sleep_for(1ms);
    }
  });
  // The eighth newcomer behind a connection ends it if that has not asked by then; who is so slow
  // asks again.
  for (int i = 0; i < 20; ++i) {
    bool served = false;
    for (int attempt = 0; attempt < 100 && !served; ++attempt)
      served = connect()->get("/metrics").status == 200U;
    EXPECT_TRUE(served) << i;
  }
  done = true;
  flood.join();
}

TEST_F(WebServer, AClosedClientIsToldWhyAndSoIsTheApplication) {
  const auto client = open();
  client->send(Opcode::kText, "close");
  const auto message = client->receive(kAtMost);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->close_code(), 1008);
  EXPECT_EQ(message->payload.substr(2), "as you wish");
  client->send(Opcode::kClose, message->payload.substr(0, 2));
  for (int i = 0; i < 500 && echo_.closed_ == 0; ++i) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(echo_.last_why(), "as you wish");
}

// A client that is closed may answer or not, go or stay; its server may be reading from it or not.
// In a build with assertions this asks Beast's own ones, too.
enum class Parting : std::uint8_t {
  kAnswersAndGoes,
  kAnswersAndStays,
  kTalksOn,
  kStaysSilent,
  kGoes
};
enum class ClosedBy : std::uint8_t { kItself, kAnother };

class AClosedClient : public WebServer,
                      public testing::WithParamInterface<std::tuple<ClosedBy, Parting>> {};

TEST_P(AClosedClient, IsClosedOnceWithItsReasonHoweverItParts) {
  const auto [closed_by, parting] = GetParam();
  auto client = open();
  const auto another = closed_by == ClosedBy::kAnother ? open() : nullptr;
  (another ? *another : *client).send(Opcode::kText, another ? "close all" : "close");
  const auto goodbye = client->receive(kAtMost);
  ASSERT_TRUE(goodbye);
  ASSERT_EQ(goodbye->close_code(), 1008);
  const std::string code = goodbye->payload.substr(0, 2);
  if (parting == Parting::kTalksOn) {
    for (int i = 0; i < 10; ++i) client->send(Opcode::kText, "what?");
    client->send(Opcode::kPing, "still there?");
  }
  if (parting == Parting::kAnswersAndGoes || parting == Parting::kAnswersAndStays)
    client->send(Opcode::kClose, code);
  if (another) another->send(Opcode::kClose, code);
  if (parting == Parting::kAnswersAndGoes || parting == Parting::kGoes) client.reset();
  const int expected = another ? 2 : 1;
  for (int i = 0; i < 500 && echo_.closed_ < expected; ++i) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(echo_.closed_, expected);
  EXPECT_EQ(echo_.last_why(), "as you wish");
  expect_alive();
}

std::string name_of(const testing::TestParamInfo<AClosedClient::ParamType>& tested) {
  constexpr std::array<const char*, 5> kPartings{"AnswersAndGoes", "AnswersAndStays", "TalksOn",
                                                 "StaysSilent", "Goes"};
  const auto [closed_by, parting] = tested.param;
  return std::string(closed_by == ClosedBy::kItself ? "ByItselfAnd" : "ByAnotherAnd") +
         kPartings[static_cast<std::size_t>(parting)];
}

INSTANTIATE_TEST_SUITE_P(
    All, AClosedClient,
    testing::Combine(testing::Values(ClosedBy::kItself, ClosedBy::kAnother),
                     testing::Values(Parting::kAnswersAndGoes, Parting::kAnswersAndStays,
                                     Parting::kTalksOn, Parting::kStaysSilent, Parting::kGoes)),
    name_of);

TEST_F(WebServer, AClientThatVanishesEndsNothing) {
  for (int i = 0; i < 5; ++i) {
    const auto client = open();
    client->send(Opcode::kText, "flood 500");
  }
  for (int i = 0; i < 500 && echo_.closed_ < 5; ++i) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(echo_.closed_, 5);
  expect_alive();
}

TEST_F(WebServer, ATakenPortIsOneLine) {
  ServerOptions options = small_options();
  options.listen = server_.address();
  try {
    const Server second(options, echo_);
    FAIL() << "a second server got the port";
  } catch (const WebError& error) {
    EXPECT_NE(std::string(error.what()).find("is taken by another process"), std::string::npos);
  }
}

TEST_F(WebServer, AStopTellsItsClients) {
  const auto client = open();
  EXPECT_EQ(echoed(*client, "x"), "x");
  server_.stop();
  const auto message = client->receive(kAtMost);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->close_code(), 1001);
  EXPECT_THROW(static_cast<void>(connect()), WebError);
}

}  // namespace
}  // namespace zerodrift::web
