// SPDX-License-Identifier: Apache-2.0
#include "common/service/host.h"

#include <fmt/format.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "common/core/one_line.h"
#include "common/service/exit_code.h"
#include "common/service/line_writer.h"
#include "common/service/monotonic_clock.h"

namespace zerodrift::service {
namespace {

constexpr std::chrono::milliseconds kStatusPeriod(250);
constexpr std::size_t kLongestCode = 48;
constexpr std::size_t kLongestEvent = 255;
constexpr std::size_t kLongestSummary = 128;
constexpr std::size_t kMostMetrics = 160;  // bound of service_status
constexpr std::size_t kMostTallies = 1024;
constexpr std::size_t kMostQueued = 64;
// Four rounds a second: whatever goes wrong, events cost a millisecond or so of each round.
constexpr std::size_t kEventsARound = 32;

// Hands lines to standard_error(): nobody who logs waits for who reads.
class LineSink final : public spdlog::sinks::base_sink<std::mutex> {
 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    standard_error().write({line.data(), line.size()});
  }
  void flush_() override {}
};

void log_to_standard_error(const std::string& name) {
  auto log = std::make_shared<spdlog::logger>(name, std::make_shared<LineSink>());
  log->set_formatter(std::make_unique<spdlog::pattern_formatter>(
      "%Y-%m-%dT%H:%M:%S.%e %n %l: %v", spdlog::pattern_time_type::local, ""));
  spdlog::set_default_logger(std::move(log));
}

std::string host_name() {
  std::array<char, 64> buffer{};
  if (gethostname(buffer.data(), buffer.size() - 1) != 0) return "unknown";
  return buffer.data();
}

constexpr std::int64_t kWriteHealthEveryNs = 1000000000;

double seconds(std::int64_t ns) {
  return static_cast<double>(ns) * 1e-9;
}

Severity severity_of(dds::EndpointEvent::Kind kind) {
  switch (kind) {
    case dds::EndpointEvent::Kind::kLivelinessRegained: return Severity::kInformation;
    case dds::EndpointEvent::Kind::kSharedMemoryNotShared: return Severity::kError;
    default: return Severity::kWarning;
  }
}

const char* endpoint_code(dds::EndpointEvent::Kind kind) {
  const auto* known = std::find_if(kEndpointCodes.begin(), kEndpointCodes.end(),
                                   [&](const EndpointCode& one) { return one.kind == kind; });
  return known != kEndpointCodes.end() ? known->code : "endpoint";
}

}  // namespace

bool is_part(std::string_view service) {
  return service.find(':') != std::string_view::npos;
}

std::optional<std::uint32_t> gyro_told_of(std::string_view service) {
  if (!is_part(service)) return std::nullopt;
  const std::string_view part = service.substr(service.find(':') + 1);
  std::uint32_t id = 0;
  const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), id);
  const bool is_id = error == std::errc() && end == part.data() + part.size() && id > 0;
  return is_id ? std::optional(id) : std::nullopt;
}

const char* state_name(State state) noexcept {
  switch (state) {
    case State::kStarting: return "starting";
    case State::kWaiting: return "waiting";
    case State::kRunning: return "running";
    case State::kDegraded: return "degraded";
    case State::kStopping: return "stopping";
  }
  return "unknown";
}

Host::Host(const std::string& name, const dds::NetworkOptions& network,
           const Supervision& supervision)
    : name_(name),
      host_name_(host_name()),
      started_ns_(monotonic_ns()),
      supervision_(supervision),
      flow_watch_(supervision, seconds(started_ns_)),
      participant_(name, network),
      status_writer_(participant_),
      event_writer_(participant_) {
  if (!spdlog::get(name_)) log_to_standard_error(name_);
  write_health({.state = State::kStarting, .summary = "", .metrics = {}});  // or refuses at once
}

// What went wrong before run() is at least in the log.
Host::~Host() {
  for (const DueEvent& event : due_events()) log(event);
  spdlog::drop(name_);
}

namespace {

// Texts may quote anybody: a peer's name, a command's argument.
void clean(Occurrence& occurrence) {
  occurrence.code = core::one_line(occurrence.code, kLongestCode);
  occurrence.text = core::shortened(occurrence.text, kLongestEvent);
}

}  // namespace

void Host::raise(const Occurrence& occurrence) {
  raise_counted(occurrence, 1);
}

void Host::raise_counted(Occurrence occurrence, std::uint64_t times) {
  if (times == 0) return;
  clean(occurrence);
  const std::lock_guard lock(events_mutex_);
  Tally& tally = tally_of(occurrence);
  tally.events.raised(times, monotonic_ns());
  tally.latest = std::move(occurrence);
}

void Host::raise_each(const Occurrence& occurrence) {
  {
    DueEvent event{.occurrence = occurrence, .is_logged = true};
    clean(event.occurrence);
    const std::lock_guard lock(events_mutex_);
    if (queued_.size() < kMostQueued) {
      Tally& tally = tally_of(event.occurrence);
      event.count = tally.events.published_by_itself();
      queued_.push_back(std::move(event));
      return;
    }
  }
  raise(occurrence);
}

Host::Tally& Host::tally_of(Occurrence& occurrence) {
  TallyKey key{occurrence.code, occurrence.gyro_id, occurrence.subject};
  if (tallies_.size() >= kMostTallies && !tallies_.contains(key)) {
    key = {"other_events", 0, ""};
    occurrence.text = core::one_line(occurrence.code + ": " + occurrence.text, kLongestEvent);
    occurrence.code = key.code;
  }
  return tallies_[key];
}

dds::EndpointObserver Host::observer() {
  return [this](const dds::EndpointEvent& event) { note(event); };
}

void Host::note(const dds::EndpointEvent& event) {
  const std::string code = endpoint_code(event.kind);
  const std::string topic(event.topic);
  {
    const std::lock_guard lock(events_mutex_);
    endpoint_totals_[topic.empty() ? code : topic + "_" + code] += event.count;
  }
  raise_counted({.code = code,
                 .severity = severity_of(event.kind),
                 .text = (topic.empty() ? "" : "topic " + topic + ": ") + event.detail,
                 .gyro_id = event.gyro_id,
                 .sensor_time_ns = 0,
                 .subject = topic + "/" + event.peer},
                event.count);
  // Going on would be silence.
  if (event.kind == dds::EndpointEvent::Kind::kSharedMemoryNotShared) give_up(kExitBadInput);
}

void Host::give_up(int exit_code) {
  int none = kExitDone;
  if (exit_code_.compare_exchange_strong(none, exit_code)) request_stop();
}

std::vector<Host::DueEvent> Host::due_events() {
  std::vector<DueEvent> due;
  const std::lock_guard lock(events_mutex_);
  while (!queued_.empty() &&
         due.size() < kEventsARound / 2) {  // a flood leaves room for the others
    due.push_back(std::move(queued_.front()));
    queued_.pop_front();
  }
  const std::int64_t now = monotonic_ns();
  auto next = tallies_.upper_bound(last_published_);
  for (std::size_t seen = 0; seen < tallies_.size() && due.size() < kEventsARound; ++seen) {
    if (next == tallies_.end()) next = tallies_.begin();
    auto& [key, tally] = *next++;
    if (!tally.events.is_due(now)) continue;
    const auto [count, is_news] = tally.events.publish(tally.latest.text, now);
    due.push_back({tally.latest, count, is_news});
    last_published_ = key;
  }
  return due;
}

void Host::log(const DueEvent& event) const {
  if (!event.is_logged) return;
  const Severity severity = event.occurrence.severity;
  const auto level = severity == Severity::kError         ? spdlog::level::err
                     : severity == Severity::kInformation ? spdlog::level::info
                                                          : spdlog::level::warn;
  spdlog::log(level, "{}: {}", event.occurrence.code, event.occurrence.text);
}

void Host::raise_security_notices() {
  for (const dds::SecurityNotice& notice : participant_.take_security_notices()) {
    raise_counted({.code = notice.code,
                   .severity = Severity::kWarning,
                   .text = notice.text,
                   .gyro_id = 0,
                   .sensor_time_ns = 0},
                  notice.count);
  }
}

void Host::publish_events() {
  for (const DueEvent& event : due_events()) {
    log(event);
    const Occurrence& occurrence = event.occurrence;
    msg::Event message;
    message.service(name_.c_str());
    message.code(occurrence.code.c_str());
    message.text(occurrence.text.c_str());
    message.severity(static_cast<std::uint32_t>(occurrence.severity));
    message.gyro_id(occurrence.gyro_id);
    message.count(event.count);
    message.sensor_time_ns(occurrence.sensor_time_ns);
    message.wall_time_ns(unix_time_ns());
    event_writer_.write(message);
  }
}

void Host::add_endpoint_totals(std::vector<Metric>& metrics) {
  const std::lock_guard lock(events_mutex_);
  for (const auto& [name, total] : endpoint_totals_)
    if (metrics.size() < kMostMetrics) metrics.push_back({name, "1", static_cast<double>(total)});
}

void Host::publish(const Status& status) {
  std::vector<Metric> metrics = status.metrics;
  add_endpoint_totals(metrics);
  publish(name_, status.state, status.summary, metrics);
  for (const StatusPart& part : status.parts) {
    std::vector<Metric> of_part = part.metrics;
    if (part.is_whole_process) add_endpoint_totals(of_part);
    publish(name_ + ":" + part.name, status.state, part.summary, of_part);
  }
}

void Host::publish(const std::string& name, State state, const std::string& summary,
                   const std::vector<Metric>& metrics) {
  assert(metrics.size() <= kMostMetrics && "a status holds 160 metrics; make a part of the rest");
  msg::ServiceStatus message;
  message.service(name.c_str());
  message.host(host_name_.c_str());
  message.process_id(static_cast<std::uint32_t>(getpid()));
  message.state(static_cast<std::uint32_t>(state));
  message.uptime_ms(static_cast<std::uint64_t>((monotonic_ns() - started_ns_) / 1000000));
  message.summary(core::one_line(summary, kLongestSummary).c_str());
  for (const Metric& metric : metrics) {
    if (message.metrics().size() == kMostMetrics) break;
    msg::Metric out;
    out.name(metric.name.c_str());
    out.unit(metric.unit.c_str());
    out.value(metric.value);
    message.metrics().push_back(out);
  }
  status_writer_.write(message);
}

void Host::judge_flow(Status& status) {
  if (!status.flow) return;
  const Flow& flow = *status.flow;
  const double now_s = seconds(monotonic_ns());
  const auto report = [&](const char* code, std::string text) {
    raise({.code = code, .severity = Severity::kError, .text = std::move(text)});
  };
  const std::size_t peers = participant_.counterparts(flow.topic, flow.end);
  if (peers == 0 && participant_.lacks_certificate()) {
    status.state = State::kDegraded;
    status.summary = fmt::format(
        "{} {}: others take part with certificates only (--security)",
        flow.end == dds::Direction::kWriter ? "nobody hears its" : "hears no", flow.topic);
  }
  switch (flow_watch_.judge(flow, peers, now_s)) {
    case FlowWatch::Verdict::kFine: reported_stale_ = false; return;
    case FlowWatch::Verdict::kStale: {
      const std::string text = fmt::format("no {} for {:.1f} s, after {} samples", flow.topic,
                                           flow_watch_.silent_s(now_s), flow.samples);
      if (!reported_stale_) report("input_stale", text);
      reported_stale_ = true;
      status.state = State::kDegraded;
      status.summary = text + (status.summary.empty() ? "" : "; " + status.summary);
      if (supervision_.exit_when_stale) give_up(kExitNo);
      return;
    }
    case FlowWatch::Verdict::kNobody:
      report(
          "no_peer",
          fmt::format("nobody at the other end of {} within {:g} s; {} other participants are "
                      "known. Does its process run, with the same --domain, --transport, "
                      "--discovery-server, and with an --interface and --peer that reach here?",
                      flow.topic, supervision_.peer_within_s, participant_.acquaintance().peers));
      give_up(kExitNo);
      return;
  }
}

// A thread that never leaves a datagram stops samples while this loop goes on.
void Host::judge_receiving(Status& status) {
  const auto busy_since_ns = participant_.busy_since_ns();
  const bool was_stuck = std::exchange(is_stuck_, stuck_count_.look(busy_since_ns));
  if (!is_stuck_) return;
  const std::string text =
      fmt::format("a receiving thread has been busy with one datagram for {:.0f} s",
                  seconds(monotonic_ns() - *busy_since_ns));
  if (!was_stuck) raise({.code = "receiving_stuck", .severity = Severity::kError, .text = text});
  status.state = State::kDegraded;
  status.summary = text + (status.summary.empty() ? "" : "; " + status.summary);
}

void Host::write_health(const Status& status) {
  if (supervision_.health_file.empty()) return;
  health_written_ns_ = monotonic_ns();
  service::write_health(supervision_.health_file, {.monotonic_ns = health_written_ns_,
                                                   .process_id = getpid(),
                                                   .service = name_,
                                                   .state = state_name(status.state),
                                                   .summary = status.summary});
}

void Host::notify_supervisor(const Status& status) {
  // Without a supervisor that asked (NOTIFY_SOCKET) these do nothing.
  const char* what = status.state == State::kStopping ? "STOPPING=1\n"
                     : reported_ready_                ? ""
                                                      : "READY=1\n";
  reported_ready_ = true;
  sd_notify(0, fmt::format("{}{}STATUS={}: {}", what, is_stuck_ ? "" : "WATCHDOG=1\n",
                           state_name(status.state), core::one_line(status.summary))
                   .c_str());
  if (monotonic_ns() - health_written_ns_ < kWriteHealthEveryNs &&
      status.state != State::kStopping) {
    return;
  }
  try {
    write_health(status);
  } catch (const std::runtime_error& error) {
    raise({.code = "health_file", .severity = Severity::kWarning, .text = error.what()});
  }
}

// While this thread waits nothing but a standstill of the whole process, of the middleware's
// threads too, makes the wait longer. Going on would be silence: who was forgotten may never hear
// again.
void Host::judge_standstill(std::chrono::nanoseconds waited) {
  constexpr auto kForgottenAfter = dds::kParticipantLease - dds::kAnnouncementPeriod;
  if (waited < kForgottenAfter) return;
  raise(
      {.code = "stood_still",
       .severity = Severity::kError,
       .text = fmt::format("the process stood still for {:.0f} s; others forget it after {} s and "
                           "may never be heard again, so it ends, to be started anew",
                           seconds(waited.count()), kForgottenAfter.count())});
  give_up(kExitNo);
}

int Host::run(const std::function<Status()>& status, const std::function<void()>& tick,
              const std::function<void()>& on_stop) {
  bool stop = false;
  while (!stop) {
    const std::int64_t began_ns = monotonic_ns();
    stop = wait_for_stop(kStatusPeriod);
    judge_standstill(std::chrono::nanoseconds(monotonic_ns() - began_ns));
    if (stop && on_stop) on_stop();
    if (tick) tick();
    participant_.report_events(observer());
    Status now = status();
    judge_flow(now);
    judge_receiving(now);
    if (stop) now.state = exit_code_ == kExitDone ? State::kStopping : State::kDegraded;
    publish(now);
    if (stop) now.state = State::kStopping;
    notify_supervisor(now);
    raise_security_notices();
    publish_events();
  }
  status_writer_.wait_until_received(std::chrono::milliseconds(200));
  event_writer_.wait_until_received(std::chrono::milliseconds(200));
  return exit_code_;
}

}  // namespace zerodrift::service
