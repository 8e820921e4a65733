// SPDX-License-Identifier: Apache-2.0
#include "services/console/console_node.h"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/core/counted.h"
#include "common/core/one_line.h"
#include "common/core/time.h"
#include "common/foxglove/schema.h"
#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
#include "services/console/metrics_text.h"
#include "services/console/telemetry.h"

namespace zerodrift::services {
namespace {

using std::chrono_literals::operator""ms;
using Outcome = service::CommandAnswer::Outcome;
namespace json_util = google::protobuf::util;

constexpr auto kTickWatched = 20ms;
constexpr auto kTickConnected = 100ms;
constexpr auto kTickAlone = 250ms;
constexpr std::size_t kMostEndpoints = 512;  // reported by /gateway
constexpr int kMostOpenCalls = 8;            // of a client
constexpr auto kAnswerWithin = 5000ms;
using core::kNsPerS;
constexpr std::int64_t kHostAliveNs = 2 * kNsPerS;  // eight of its rounds
constexpr const char* kContentSecurity =
    "default-src 'self'; connect-src 'self' ws: wss:; img-src 'self' data:; object-src 'none'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
constexpr const char* kNoPage =
    "zerodrift console: the page is not built; build it with -DZERODRIFT_BUILD_PAGE=ON (needs "
    "nodejs and npm) or name its folder with --page. Foxglove and Lichtblick connect to this "
    "address, /health and /metrics answer.";

web::ServerOptions server_options(const web::Address& listen) {
  web::ServerOptions options;
  options.listen = listen;
  options.headers = {{"Content-Security-Policy", kContentSecurity},
                     {"X-Content-Type-Options", "nosniff"},
                     {"Referrer-Policy", "no-referrer"},
                     {"X-Frame-Options", "DENY"},
                     {"Cross-Origin-Opener-Policy", "same-origin"}};
  return options;
}

web::StaticFiles load_page(const std::filesystem::path& folder) {
  return std::filesystem::is_directory(folder) ? web::StaticFiles(folder) : web::StaticFiles();
}

foxglove::ServerInfo server_info(std::uint32_t domain) {
  return {.name = fmt::format("zerodrift console, domain {}", domain),
          .capabilities = {"services"},
          .supported_encodings = {"protobuf", "json"},
          .metadata = {{"version", ZERODRIFT_VERSION}},
          .session_id = std::to_string(service::unix_time_ns())};
}

template <typename Number>
std::optional<Number> number_of(const std::string& text) {
  Number number{};
  const char* end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, number);
  return read.ec == std::errc{} && read.ptr == end ? std::optional(number) : std::nullopt;
}

// Nothing, or why it is none.
std::string read_command(const std::string& encoding, const std::string& payload,
                         telemetry::Command& command) {
  if (encoding == "json") {
    const auto read = json_util::JsonStringToMessage(payload, &command);
    if (!read.ok()) return "the command is not understood: " + std::string(read.message());
  } else if (!command.ParseFromString(payload)) {
    return "the command is no Protobuf message zerodrift.telemetry.Command";
  }
  if (command.service().empty() || command.name().empty())
    return "a command needs 'service' and 'name', e.g. compensation and freeze";
  return "";
}

std::string written_reply(const std::string& encoding, const telemetry::CommandReply& reply) {
  if (encoding != "json") return reply.SerializeAsString();
  json_util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  std::string text;
  const auto written = json_util::MessageToJsonString(reply, &text, options);
  return written.ok() ? text : "{}";
}

const char* outcome_name(Outcome outcome) {
  switch (outcome) {
    case Outcome::kDone: return "done";
    case Outcome::kRefused: return "refused";
    case Outcome::kNobody: return "no answer";
    case Outcome::kNotSent: return "not sent";
  }
  return "";
}

}  // namespace

ConsoleNode::ConsoleNode(const ConsoleOptions& options)
    : options_(options),
      access_(access_options(options)),
      page_(load_page(page_folder(options))),
      server_(server_options(web::parse_address(options.listen)), *this),
      host_("console", options.network, options.supervision),
      hub_(server_info(options.network.domain),
           {.subscribed = [this](auto client,
                                 auto channel) { gateway_.subscribed(client, channel); },
            .called = [this](const auto& origin, const auto& payload) { call(origin, payload); }}),
      gateway_({.version = ZERODRIFT_VERSION, .domain = options.network.domain}, hub_),
      arrivals_(host_),
      commands_client_(host_.participant(), host_.observer()) {
  command_service_ = hub_.add_service("/command", "zerodrift.telemetry.Command",
                                      foxglove::schema_of(*telemetry::Command::descriptor()),
                                      foxglove::schema_of(*telemetry::CommandReply::descriptor()));
}

ConsoleNode::~ConsoleNode() {
  server_.stop();
}

int ConsoleNode::run() {
  host_alive_ns_ = service::monotonic_ns();
  server_.start();
  server_.post([this] { tick(); });
  spdlog::info("listening at http://{}{}", server_.address().text(),
               page_.empty() ? ", without the page" : "");
  return host_.run([this] { return status(); },
                   [this] { host_alive_ns_ = service::monotonic_ns(); },
                   [this] {
                     service::end_within(service::kStopWithin, host_.exit_code());
                     server_.stop();
                   });
}

// ---------------------------------------- the server's thread

void ConsoleNode::tick() {
  const std::int64_t unix_ns = service::unix_time_ns();
  arrivals_.drain_into(gateway_);
  gateway_.flush(unix_ns);
  if (service::monotonic_ns() - second_began_ns_ >= kNsPerS) {
    second_began_ns_ = service::monotonic_ns();
    once_a_second(unix_ns);
  }
  const auto next = gateway_.is_watched() ? kTickWatched
                    : hub_.clients() > 0  ? kTickConnected
                                          : kTickAlone;
  server_.post_after(next, [this] { tick(); });
}

void ConsoleNode::once_a_second(std::int64_t unix_ns) {
  gateway_.report_gateway(host_.participant().remote_endpoints(kMostEndpoints), unix_ns);
  gateway_.report_fleet({unix_ns, service::monotonic_ns()});
  hub_.for_each_client([&](web::Client& client) {
    const std::uint64_t dropped = client.counts().frames_dropped;
    std::uint64_t& reported = reported_dropped_[client.id()];
    host_.raise_counted({.code = "slow_client",
                         .severity = service::Severity::kWarning,
                         .text = fmt::format("client {} is too slow: whole frames of samples are "
                                             "left out for it, {} so far",
                                             client.remote(), dropped)},
                        dropped - reported);
    reported = dropped;
  });
  clients_ = hub_.clients();
  const auto figures = gateway_.gyro_figures();
  std::uint64_t samples = 0;
  std::size_t gyros = 0;
  for (const auto& [id, gyro] : figures) {
    samples += gyro.samples;
    if (gyro.samples > 0) ++gyros;
  }
  gyros_ = gyros;
  samples_ = samples;
  frames_dropped_ = gateway_.dropped_of_all();
  gateway_left_out_ = gateway_.left_out();
}

service::Status ConsoleNode::status() const {
  const auto count = [](std::uint64_t value) { return static_cast<double>(value); };
  return {
      .state = gyros_ > 0 ? service::State::kRunning : service::State::kWaiting,
      .summary =
          core::counted(clients_.load(), "client") + ", " + core::counted(gyros_.load(), "gyro"),
      .metrics = {{"clients", "1", count(clients_)},
                  {"connections", "1", count(server_.counts().connections)},
                  {"connections_refused", "1", count(server_.counts().refused)},
                  {"gyros", "1", count(gyros_)},
                  {"samples", "1", count(samples_)},
                  {"frames_dropped", "1", count(frames_dropped_)},
                  {"commands", "1", count(commands_)},
                  {"arrivals_left_out", "1", count(arrivals_.overflow() + gateway_left_out_)}},
      .flow = service::Flow{
          .topic = dds::kCompensatedRate.name, .samples = samples_, .paced = arrivals_.paced()}};
}

// ---------------------------------------- HTTP

web::Response ConsoleNode::respond(const web::Request& request) {
  const std::string& path = request.target.path;
  const auto wants = path == "/metrics" ? web::Wants::kData : web::Wants::kPage;
  if (auto refused = access_.refusal(request, wants)) return *refused;
  if (path == "/health") return health(request);
  if (path == "/metrics") return metrics();
  if (auto file = page_.respond(request)) return *file;
  if (path == "/" && page_.empty()) return web::plain_response(200, kNoPage);
  return web::plain_response(404, "there is nothing here");
}

std::variant<std::string, web::Response> ConsoleNode::upgrade(const web::Request& request) {
  if (auto refused = access_.refusal(request, web::Wants::kData)) return *refused;
  if (request.target.path != "/" && request.target.path != "/ws")
    return web::plain_response(404, "WebSockets are at / and /ws");
  if (auto protocol = foxglove::choose_subprotocol(request.subprotocols)) return *protocol;
  return web::plain_response(400, "expected subprotocol foxglove.sdk.v1 or foxglove.websocket.v1");
}

// "?max_age=S": also 503 where no sample came within the last S seconds; "&gyro=N": of that gyro.
web::Response ConsoleNode::health(const web::Request& request) const {
  const bool is_alive = service::monotonic_ns() - host_alive_ns_ < kHostAliveNs;
  std::int64_t newest_ns = gateway_.newest_sample().monotonic_ns;
  const auto of = request.target.query.find("gyro");
  if (of != request.target.query.end()) {
    const auto id = number_of<std::uint32_t>(of->second);
    if (!id) return web::plain_response(400, "gyro: expected the number of a gyro");
    newest_ns = gateway_.newest_sample_of(*id).monotonic_ns;
  }
  const double age_s = static_cast<double>(service::monotonic_ns() - newest_ns) / 1e9;
  const auto asked = request.target.query.find("max_age");
  bool is_fresh = true;
  if (asked != request.target.query.end()) {
    const auto limit_s = number_of<double>(asked->second);
    if (!limit_s || !(*limit_s > 0.0))
      return web::plain_response(400, "max_age: expected seconds above 0");
    is_fresh = newest_ns != 0 && age_s <= *limit_s;
  }
  nlohmann::ordered_json json{{"status", !is_alive   ? "dds_stalled"
                                         : !is_fresh ? "no_recent_sample"
                                                     : "ok"},
                              {"dds_alive", is_alive},
                              {"newest_sample_age_s", nullptr},
                              {"clients", hub_.clients()},
                              {"gyros", gyros_.load()}};
  if (newest_ns != 0) json["newest_sample_age_s"] = std::max(0.0, age_s);
  return {.status = is_alive && is_fresh ? 200U : 503U,
          .content_type = "application/json",
          .body = web::body_of(json.dump() + '\n'),
          .headers = {{"Cache-Control", "no-store"}}};
}

web::Response ConsoleNode::metrics() {
  const MetricsInput input{.services = gateway_.services(),
                           .gyros = gateway_.gyro_figures(),
                           .allan = gateway_.allan_reports(),
                           .monotonic_ns = service::monotonic_ns(),
                           .version = ZERODRIFT_VERSION,
                           .commit = options_.commit,
                           .clients = hub_.clients(),
                           .frames_dropped = gateway_.dropped_of_all(),
                           .arrivals_left_out = arrivals_.overflow() + gateway_.left_out()};
  return {.content_type = "text/plain; version=0.0.4; charset=utf-8",
          .body = web::body_of(metrics_text(input)),
          .headers = {{"Cache-Control", "no-store"}}};
}

// ---------------------------------------- WebSockets

void ConsoleNode::opened(web::Client& client) {
  hub_.opened(client);
}

void ConsoleNode::received(web::Client& client, web::Frame::Kind kind, std::string_view message) {
  hub_.received(client, kind, message);
}

void ConsoleNode::closed(web::Client& client, const std::string& why) {
  gateway_.note_dropped_by_gone(client.counts().frames_dropped);
  hub_.closed(client);
  open_calls_.erase(client.id());
  reported_dropped_.erase(client.id());
  // A line for each would let clients fill the log.
  if (why.empty()) return;
  host_.raise({.code = "client_closed",
               .severity = service::Severity::kInformation,
               .text = core::one_line(fmt::format("client {}: {}", client.remote(), why))});
}

void ConsoleNode::call(const foxglove::CallOrigin& origin, const std::string& payload) {
  telemetry::Command command;
  const std::string refusal = read_command(origin.encoding, payload, command);
  if (!refusal.empty()) return hub_.fail(origin, refusal);
  if (open_calls_[origin.client] >= kMostOpenCalls)
    return hub_.fail(origin, "too many commands of this client wait for their answers");
  ++open_calls_[origin.client];
  ++commands_;
  commands_client_.send(
      {.service = command.service(),
       .name = command.name(),
       .argument = command.argument(),
       .issuer = "console " + origin.remote},
      kAnswerWithin, [this, origin, command](const service::CommandAnswer& answered) {
        server_.post([this, origin, command, answered] { answer(origin, command, answered); });
      });
}

void ConsoleNode::answer(const foxglove::CallOrigin& origin, const telemetry::Command& command,
                         const service::CommandAnswer& answered) {
  const auto open = open_calls_.find(origin.client);
  if (open != open_calls_.end() && --open->second <= 0) open_calls_.erase(open);
  const bool is_done = answered.outcome == Outcome::kDone;
  const std::string text = core::one_line(answered.text);
  host_.raise_each(
      {.code = "command",
       .severity = is_done ? service::Severity::kInformation : service::Severity::kWarning,
       .text = core::one_line(fmt::format("console {}: {} {}{}{}: {}: {}", origin.remote,
                                          command.service(), command.name(),
                                          command.argument().empty() ? "" : " ", command.argument(),
                                          outcome_name(answered.outcome), text))});
  if (!is_done && answered.outcome != Outcome::kRefused) return hub_.fail(origin, text);
  telemetry::CommandReply reply;
  reply.set_accepted(is_done);
  reply.set_text(text);
  reply.set_model_epoch(answered.model_epoch);
  reply.set_request_id(answered.request_id);
  hub_.answer(origin, written_reply(origin.encoding, reply));
}

}  // namespace zerodrift::services
