// SPDX-License-Identifier: Apache-2.0
// Longer than other files for one reason: whatever includes Boost.Beast takes half a minute to
// compile, so the loop, a connection and a WebSocket, which only know each other, stand in one
// source.
#include "common/web/server.h"

#include <pthread.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <map>
#include <optional>
#include <thread>

namespace zerodrift::web {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using std::chrono_literals::operator""ms;

namespace {

constexpr auto kRetryAccept = 100ms;    // no file descriptor is free
constexpr auto kGoodbyeWithin = 300ms;  // of clients, at a stop
constexpr auto kLookForGoodbyes = 10ms;
constexpr auto kSayWithin = 2000ms;          // a last response, before the connection ends
constexpr std::size_t kLongestReason = 120;  // 123 bytes fit into a close frame (RFC 6455, 5.5)

std::string text_of(const tcp::endpoint& endpoint) {
  return Address{endpoint.address().to_string(), endpoint.port()}.text();
}

std::string string_of(beast::string_view text) {
  return {text.data(), text.size()};
}

std::vector<std::string> list_of(beast::string_view header) {
  std::vector<std::string> names;
  for (const auto& name : http::token_list(header)) names.push_back(string_of(name));
  return names;
}

using HttpRequest = http::request<http::string_body>;

}  // namespace

class Server::Loop {
 public:
  Loop(const ServerOptions& options, Application& application);
  ~Loop() { stop(); }
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;

  void start();
  void stop();
  void post(std::function<void()> task) { asio::post(context_, std::move(task)); }
  void post_after(std::chrono::milliseconds delay, std::function<void()> task);
  [[nodiscard]] Address address() const;
  [[nodiscard]] Server::Counts counts() const { return {connections_, refused_, gave_way_}; }

 private:
  class Connection;
  class WebSocket;
  void await_goodbyes(std::chrono::steady_clock::time_point until);
  void accept();
  void accepted(tcp::socket socket);

  ServerOptions options_;
  Application& application_;
  // Those that speak HTTP, in the order in which they give way. Longer there than the context,
  // which ends the last of them.
  struct Turn {
    bool is_answered = false;  // its response is on the way: after those that asked nothing yet
    std::uint64_t step = 0;
    auto operator<=>(const Turn&) const = default;
  };
  std::map<Turn, Connection*> plain_;
  asio::io_context context_{1};
  tcp::acceptor acceptor_{context_};
  std::atomic<std::uint64_t> connections_{0};
  std::atomic<std::uint64_t> refused_{0};
  std::atomic<std::uint64_t> gave_way_{0};
  std::uint64_t next_id_ = 1;
  std::uint64_t next_step_ = 1;
  std::uint64_t websockets_ = 0;  // being opened, open, or saying goodbye
  std::map<std::uint64_t, std::weak_ptr<WebSocket>> clients_;
  bool stopping_ = false;
  std::thread thread_;
};

// ---------------------------------------- one WebSocket

class Server::Loop::WebSocket final : public Client,
                                      public std::enable_shared_from_this<WebSocket> {
 public:
  WebSocket(Loop& loop, std::uint64_t id, beast::tcp_stream&& stream, std::string remote,
            std::string subprotocol)
      : Client(id),
        loop_(loop),
        stream_(std::move(stream)),
        deadline_(loop.context_),
        queue_(loop.options_.outgoing),
        remote_(std::move(remote)),
        subprotocol_(std::move(subprotocol)) {
    ++loop_.websockets_;
  }
  ~WebSocket() {
    --loop_.connections_;
    --loop_.websockets_;
  }

  void open(const HttpRequest& request) {
    beast::get_lowest_layer(stream_).expires_never();
    const auto silent = loop_.options_.client_silent_at_most;
    stream_.set_option(
        websocket::stream_base::timeout{loop_.options_.request_within, silent, true});
    stream_.set_option(
        websocket::stream_base::decorator([this](websocket::response_type& response) {
          response.set(http::field::server, "zerodrift");
          if (!subprotocol_.empty())
            response.set(http::field::sec_websocket_protocol, subprotocol_);
        }));
    stream_.read_message_max(loop_.options_.largest_message);
    stream_.auto_fragment(false);
    stream_.async_accept(request, [self = shared_from_this()](beast::error_code error) {
      if (error) return;
      self->opened_ = true;
      self->loop_.clients_[self->id()] = self;
      self->loop_.application_.opened(*self);
      if (!self->closing_) self->read();
      if (self->loop_.stopping_) self->close(CloseCode::kGoingAway, "the gateway stops");
    });
  }

  void send(Frame frame) override {
    if (closing_ || !opened_) return;
    if (queue_.push(std::move(frame)) == OutgoingQueue::Pushed::kTooMuchState) {
      close(CloseCode::kTryAgainLater,
            "too slow: more waits for this client than is kept; connect again, or subscribe less");
      return;
    }
    write_next();
  }

  void close(CloseCode code, const std::string& reason) override {
    if (closing_) return;
    closing_ = true;
    if (why_.empty()) why_ = reason;
    websocket::close_reason goodbye(static_cast<websocket::close_code>(code),
                                    reason.substr(0, kLongestReason).c_str());
    // Beast's time-outs end here: a read that waits for the end of the goodbye has an assertion
    // that none reaches it. deadline_ ends what takes too long.
    stream_.set_option(websocket::stream_base::timeout{websocket::stream_base::none(),
                                                       websocket::stream_base::none(), false});
    stream_.async_close(goodbye, [self = shared_from_this()](beast::error_code) { self->end(); });
    // It may read nothing any more: then the goodbye never ends.
    deadline_.expires_after(loop_.options_.closed_within);
    deadline_.async_wait([weak = weak_from_this()](beast::error_code error) {
      if (const auto self = weak.lock(); self && !error) self->end();
    });
  }

  // Without a goodbye.
  void end() {
    beast::error_code ignored;
    beast::get_lowest_layer(stream_).socket().close(ignored);
    deadline_.cancel();
    if (!opened_ || ended_) return;
    ended_ = closing_ = true;
    loop_.clients_.erase(id());
    loop_.application_.closed(*this, why_);
  }

  [[nodiscard]] Counts counts() const override {
    return {sent_, queue_.dropped(), queue_.bytes() + writing_.size(), queue_.fill()};
  }
  [[nodiscard]] const std::string& remote() const override { return remote_; }
  [[nodiscard]] const std::string& subprotocol() const override { return subprotocol_; }

 private:
  void read() {
    stream_.async_read(buffer_, [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (error) return self->failed(error);
      self->pass_on();
      if (!self->closing_) self->read();  // what comes after a goodbye, that itself reads
    });
  }

  void pass_on() {
    const auto data = buffer_.cdata();
    const std::string_view message(static_cast<const char*>(data.data()), data.size());
    if (!closing_) {
      try {
        loop_.application_.received(
            *this, stream_.got_text() ? Frame::Kind::kText : Frame::Kind::kBinary, message);
      } catch (const std::exception& error) {
        close(CloseCode::kPolicyError, error.what());
      }
    }
    buffer_.consume(buffer_.size());
  }

  // One write at a time.
  void write_next() {
    if (is_writing_ || closing_) return;
    auto next = queue_.pop();
    if (!next) return;
    writing_ = std::move(*next);
    is_writing_ = true;
    stream_.binary(writing_.kind == Frame::Kind::kBinary);
    const std::array<asio::const_buffer, 2> buffers{
        asio::buffer(writing_.head.data(), writing_.head_size),
        writing_.body ? asio::buffer(*writing_.body) : asio::const_buffer()};
    stream_.async_write(buffers, [self = shared_from_this()](beast::error_code error, std::size_t) {
      self->is_writing_ = false;
      self->writing_ = Frame();
      if (error) return self->failed(error);
      ++self->sent_;
      self->write_next();
    });
  }

  void failed(beast::error_code error) {
    const bool by_itself = error == websocket::error::closed || error == asio::error::eof ||
                           error == asio::error::connection_reset ||
                           error == asio::error::operation_aborted;
    if (why_.empty() && !by_itself) why_ = error.message();
    end();
  }

  Loop& loop_;
  websocket::stream<beast::tcp_stream> stream_;
  asio::steady_timer deadline_;
  beast::flat_buffer buffer_;
  OutgoingQueue queue_;
  std::string remote_;
  std::string subprotocol_;
  std::string why_;
  Frame writing_;
  std::uint64_t sent_ = 0;
  bool is_writing_ = false;
  bool opened_ = false;
  bool closing_ = false;
  bool ended_ = false;
};

// ---------------------------------------- one connection, as long as it speaks HTTP

class Server::Loop::Connection final : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Loop& loop, tcp::socket&& socket)
      : loop_(loop), stream_(std::move(socket)), buffer_(loop.options_.largest_header) {
    beast::error_code error;
    const auto endpoint = stream_.socket().remote_endpoint(error);
    if (!error) remote_ = text_of(endpoint);
    ++loop_.connections_;
  }
  ~Connection() {
    loop_.plain_.erase(turn_);
    if (!upgraded_) --loop_.connections_;
  }

  void read() {
    take_turn(false);
    parser_.emplace();
    parser_->header_limit(static_cast<std::uint32_t>(loop_.options_.largest_header));
    parser_->body_limit(loop_.options_.largest_body);
    stream_.expires_after(loop_.options_.request_within);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](beast::error_code error, std::size_t) {
                       error ? self->failed(error) : self->serve();
                     });
  }

  void give_way() {
    loop_.plain_.erase(turn_);
    stream_.close();
  }

 private:
  // From now on it waits for a request, or for its response to be read.
  void take_turn(bool is_answered) {
    loop_.plain_.erase(turn_);
    turn_ = {is_answered, loop_.next_step_++};
    loop_.plain_[turn_] = this;
  }

  // A request that can't be read to its end.
  void refuse(Response response) {
    stream_.expires_after(kSayWithin);
    respond(std::move(response), http::verb::get, 11, false);
  }

  void failed(beast::error_code error) {
    if (error == http::error::end_of_stream) return end();
    if (error == http::error::header_limit || error == http::error::buffer_overflow)
      return refuse(plain_response(431, "the header is longer than is taken"));
    if (error == http::error::body_limit)
      return refuse(plain_response(413, "the body is longer than is taken"));
    if (error.category() == http::make_error_code(http::error::bad_method).category() &&
        error != http::error::partial_message)
      return refuse(plain_response(400, "this is no HTTP request: " + error.message()));
    end();
  }

  void serve() {
    const HttpRequest& request = parser_->get();
    const bool keep = request.keep_alive();
    const auto verb = request.method();
    const unsigned version = request.version();
    auto target = parse_target(string_of(request.target()).c_str());
    if (request.target().size() > loop_.options_.largest_header) target.reset();
    if (!target || request.target().find('\0') != beast::string_view::npos)
      return respond(plain_response(400, "this is no path"), verb, version, keep);
    if (verb != http::verb::get && verb != http::verb::head) {
      Response response = plain_response(405, "only GET and HEAD are served");
      response.headers.emplace_back("Allow", "GET, HEAD");
      return respond(std::move(response), verb, version, keep);
    }
    const Request asked = request_of(request, std::move(*target));
    try {
      if (asked.is_upgrade) return upgrade(asked, request);
      respond(loop_.application_.respond(asked), verb, version, keep);
    } catch (const std::exception& error) {
      respond(plain_response(500, error.what()), verb, version, false);
    }
  }

  [[nodiscard]] Request request_of(const HttpRequest& request, Target target) const {
    const auto header = [&](http::field name) { return string_of(request[name]); };
    Request asked;
    asked.is_upgrade = websocket::is_upgrade(request);
    asked.target = std::move(target);
    asked.host = header(http::field::host);
    if (request.count(http::field::host) > 1) asked.host.clear();
    asked.origin = header(http::field::origin);
    asked.authorization = header(http::field::authorization);
    asked.if_none_match = header(http::field::if_none_match);
    asked.accept_encoding = header(http::field::accept_encoding);
    asked.remote = remote_;
    for (const auto& field : request) {
      if (field.name() != http::field::sec_websocket_protocol) continue;
      for (auto& name : list_of(field.value())) asked.subprotocols.push_back(std::move(name));
    }
    return asked;
  }

  void upgrade(const Request& asked, const HttpRequest& request) {
    const ServerOptions& options = loop_.options_;
    if (loop_.websockets_ + options.kept_for_requests >= options.most_connections) {
      ++loop_.refused_;
      return respond(plain_response(503, "too many clients; at most " +
                                             std::to_string(options.most_connections -
                                                            options.kept_for_requests)),
                     http::verb::get, request.version(), false);
    }
    auto verdict = loop_.application_.upgrade(asked);
    if (auto* refused = std::get_if<Response>(&verdict)) {
      return respond(std::move(*refused), http::verb::get, request.version(), false);
    }
    upgraded_ = true;  // its place is the WebSocket's now
    loop_.plain_.erase(turn_);
    std::make_shared<WebSocket>(loop_, loop_.next_id_++, std::move(stream_), remote_,
                                std::get<std::string>(std::move(verdict)))
        ->open(request);
  }

  void respond(Response response, http::verb verb, unsigned version, bool keep) {
    take_turn(true);
    keep_ = keep && !loop_.stopping_;
    body_ = response.body ? response.body : body_of("");
    message_.emplace();
    message_->result(response.status);
    message_->version(version);
    message_->keep_alive(keep_);
    message_->set(http::field::server, "zerodrift");
    for (const auto& [name, value] : loop_.options_.headers) message_->set(name, value);
    for (const auto& [name, value] : response.headers) message_->set(name, value);
    if (response.status != 304) {
      message_->set(http::field::content_type, response.content_type);
      message_->content_length(body_->size());
    }
    if (verb != http::verb::head && response.status != 304)
      message_->body() = {body_->data(), body_->size()};
    serializer_.emplace(*message_);
    const auto written = [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (error || !self->keep_) return self->end();
      self->read();
    };
    if (verb == http::verb::head) {
      http::async_write_header(stream_, *serializer_, written);
    } else {
      http::async_write(stream_, *serializer_, written);
    }
  }

  void end() {
    beast::error_code ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
  }

  Loop& loop_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  std::optional<http::response<http::span_body<const char>>> message_;
  std::optional<http::response_serializer<http::span_body<const char>>> serializer_;
  Body body_;
  std::string remote_;
  Turn turn_{};
  bool keep_ = false;
  bool upgraded_ = false;
};

// ---------------------------------------- the loop

Server::Loop::Loop(const ServerOptions& options, Application& application)
    : options_(options), application_(application) {
  const std::string where = options.listen.text();
  beast::error_code error;
  const tcp::endpoint endpoint(asio::ip::make_address(options.listen.host, error),
                               options.listen.port);
  if (error) throw WebError("'" + where + "' is not an address");
  acceptor_.open(endpoint.protocol(), error);
  if (!error) acceptor_.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor_.bind(endpoint, error);
  if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
  if (error == asio::error::address_in_use)
    throw WebError(where + " is taken by another process; stop it or name another with --listen");
  if (error) throw WebError("can't listen at " + where + ": " + error.message());
  options_.listen.port = acceptor_.local_endpoint().port();
}

Address Server::Loop::address() const {
  return options_.listen;
}

void Server::Loop::start() {
  accept();
  thread_ = std::thread([this] {
    pthread_setname_np(pthread_self(), "web");
    context_.run();
  });
}

void Server::Loop::stop() {
  if (!thread_.joinable()) return;
  post([this] {
    stopping_ = true;
    beast::error_code ignored;
    acceptor_.close(ignored);
    const auto clients = clients_;
    for (const auto& [id, weak] : clients) {
      if (const auto client = weak.lock())
        client->close(CloseCode::kGoingAway, "the gateway stops");
    }
    await_goodbyes(std::chrono::steady_clock::now() + kGoodbyeWithin);
  });
  thread_.join();
}

void Server::Loop::await_goodbyes(std::chrono::steady_clock::time_point until) {
  if (clients_.empty() || std::chrono::steady_clock::now() >= until) return context_.stop();
  post_after(kLookForGoodbyes, [this, until] { await_goodbyes(until); });
}

void Server::Loop::post_after(std::chrono::milliseconds delay, std::function<void()> task) {
  auto timer = std::make_shared<asio::steady_timer>(context_, delay);
  timer->async_wait([timer, task = std::move(task)](beast::error_code error) {
    if (!error) task();
  });
}

void Server::Loop::accept() {
  acceptor_.async_accept([this](beast::error_code error, tcp::socket socket) {
    if (stopping_ || error == asio::error::operation_aborted) return;
    if (error) return post_after(kRetryAccept, [this] { accept(); });
    accepted(std::move(socket));
    accept();
  });
}

void Server::Loop::accepted(tcp::socket socket) {
  beast::error_code ignored;
  socket.set_option(tcp::no_delay(true), ignored);
  socket.set_option(asio::socket_base::send_buffer_size(options_.send_buffer_bytes), ignored);
  if (connections_ >= options_.most_connections && !plain_.empty()) {
    ++gave_way_;
    plain_.begin()->second->give_way();
  }
  std::make_shared<Connection>(*this, std::move(socket))->read();
}

// ---------------------------------------- the server

Server::Server(const ServerOptions& options, Application& application)
    : loop_(std::make_unique<Loop>(options, application)) {}
Server::~Server() = default;

Address Server::address() const {
  return loop_->address();
}
void Server::start() {
  loop_->start();
}
void Server::stop() {
  loop_->stop();
}
void Server::post(std::function<void()> task) {
  loop_->post(std::move(task));
}
void Server::post_after(std::chrono::milliseconds delay, std::function<void()> task) {
  loop_->post_after(delay, std::move(task));
}
Server::Counts Server::counts() const {
  return loop_->counts();
}

}  // namespace zerodrift::web
