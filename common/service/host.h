// SPDX-License-Identifier: Apache-2.0
// What every service process has: a participant, signals, a status once a second, events, a log.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <compare>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/dds/participant.h"
#include "common/dds/receiving_watch.h"
#include "common/service/event_tally.h"
#include "common/service/stop_signals.h"
#include "common/service/supervision.h"

namespace zerodrift::service {

enum class Severity : std::uint32_t { kInformation = 0, kWarning = 1, kError = 2 };
enum class State : std::uint32_t {
  kStarting = 0,
  kWaiting = 1,
  kRunning = 2,
  kDegraded = 3,
  kStopping = 4
};
// "waiting"; "unknown" for what is none.
const char* state_name(State state) noexcept;

struct Metric {
  std::string name;
  std::string unit;
  double value;
};

// What belongs to one of several things a service looks after, e.g. a gyro; published beside the
// status as "<service>:<name>".
struct StatusPart {
  std::string name;
  std::vector<Metric> metrics{};
  std::string summary{};
  bool is_whole_process = false;  // what the middleware noticed is told with it, too
};

// A status "name:part" is of service "name" with the part "latency", a gyro's number or another
// one.
bool is_part(std::string_view service);
// "gyro_publisher:7" tells of gyro 7; none: of no gyro.
std::optional<std::uint32_t> gyro_told_of(std::string_view service);

struct Status {
  State state = State::kRunning;
  std::string summary;
  std::vector<Metric> metrics{};
  std::vector<StatusPart> parts{};
  std::optional<Flow> flow{};
};

// What an event and a total of the middleware are called.
struct EndpointCode {
  dds::EndpointEvent::Kind kind;
  const char* code;
};
inline constexpr std::array kEndpointCodes{
    EndpointCode{dds::EndpointEvent::Kind::kIncompatibleQos, "incompatible_qos"},
    EndpointCode{dds::EndpointEvent::Kind::kTypeMismatch, "type_mismatch"},
    EndpointCode{dds::EndpointEvent::Kind::kSampleLost, "sample_lost"},
    EndpointCode{dds::EndpointEvent::Kind::kSampleRejected, "sample_rejected"},
    EndpointCode{dds::EndpointEvent::Kind::kDeadlineMissed, "deadline_missed"},
    EndpointCode{dds::EndpointEvent::Kind::kLivelinessLost, "liveliness_lost"},
    EndpointCode{dds::EndpointEvent::Kind::kLivelinessRegained, "liveliness_regained"},
    EndpointCode{dds::EndpointEvent::Kind::kPeerLost, "peer_lost"},
    EndpointCode{dds::EndpointEvent::Kind::kSharedMemoryNotShared, "shared_memory_not_shared"}};

struct Occurrence {
  std::string code{};  // stable, machine-readable
  Severity severity = Severity::kWarning;
  std::string text{};  // one clear line
  std::uint32_t gyro_id = 0;
  std::int64_t sensor_time_ns = 0;
  std::string subject{};  // of several that share a code, tallied apart: e.g. a topic and a peer
};

class Host {
 public:
  // `name` is the service's; also the name of its log, which standard_error() writes.
  Host(const std::string& name, const dds::NetworkOptions& network,
       const Supervision& supervision = {});
  ~Host();

  [[nodiscard]] dds::Participant& participant() noexcept { return participant_; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }

  // Any thread, though not once a sample: takes memory and a lock, held by others for as long as it
  // takes to copy what is due. Published by run(), once for each new code, gyro and subject, then
  // at most once a second with its count; logged where it is news (EventTally). Its texts become
  // one clean line each.
  void raise(const Occurrence& occurrence);
  // Each logged and published by itself, in this order: what somebody asked for, and will look for
  // in the log, or a state that changes, whose last line has to be true. Where kMostTold wait
  // already, counted as by raise().
  void raise_each(const Occurrence& occurrence);
  // Adds `times` at once; nothing happens for 0. For counters that a data path kept.
  void raise_counted(Occurrence occurrence, std::uint64_t times);
  // For readers and writers: turns what the middleware noticed into events and into totals,
  // published as metrics `<topic>_<code>` of the status once they are not 0. Endpoints without an
  // observer have this one.
  [[nodiscard]] dds::EndpointObserver observer();

  // Publishes status() about four times a second until a stop signal, then calls on_stop, and
  // publishes once more: with State::kStopping, or with State::kDegraded where it gave up, since
  // who gave up has not ended in order and is missed. `tick`, if given, runs before each. Notifies
  // the supervisor too: sd_notify(3), and the health file. What the supervision forbids is raised
  // and ends it as a signal would, and so does that the process stood still for so long that others
  // have forgotten it. Gives exit_code().
  int run(const std::function<Status()>& status, const std::function<void()>& tick = {},
          const std::function<void()>& on_stop = {});
  void publish(const Status& status);
  // kExitDone, or why run() ended by itself. Any thread.
  [[nodiscard]] int exit_code() const noexcept { return exit_code_; }
  // Ends run() with this; the first reason counts. Any thread.
  void give_up(int exit_code);

 private:
  void publish(const std::string& name, State state, const std::string& summary,
               const std::vector<Metric>& metrics);
  void judge_standstill(std::chrono::nanoseconds waited);
  void add_endpoint_totals(std::vector<Metric>& metrics);

  struct TallyKey {
    std::string code;
    std::uint32_t gyro_id = 0;
    std::string subject;
    auto operator<=>(const TallyKey&) const = default;
  };
  struct Tally {
    EventTally events;
    Occurrence latest;
  };
  struct DueEvent {
    Occurrence occurrence;
    std::uint64_t count = 0;
    bool is_logged = false;
  };
  void note(const dds::EndpointEvent& event);
  Tally& tally_of(Occurrence& occurrence);  // under the lock
  // At most a round's worth; what is left is due in the next.
  std::vector<DueEvent> due_events();
  void raise_security_notices();
  void publish_events();
  void log(const DueEvent& event) const;
  void judge_flow(Status& status);
  void judge_receiving(Status& status);
  void notify_supervisor(const Status& status);
  void write_health(const Status& status);

  std::string name_;
  std::string host_name_;
  std::int64_t started_ns_;
  Supervision supervision_;
  FlowWatch flow_watch_;
  bool reported_stale_ = false;  // of the silence that lasts
  dds::StuckCount stuck_count_;
  bool is_stuck_ = false;
  bool reported_ready_ = false;
  std::int64_t health_written_ns_ = 0;
  std::atomic<int> exit_code_{0};
  dds::Participant participant_;
  std::mutex events_mutex_;
  std::map<TallyKey, Tally> tallies_;
  std::deque<DueEvent> queued_;
  TallyKey last_published_;  // the next round begins behind it
  std::map<std::string, std::uint64_t> endpoint_totals_;
  dds::Writer<msg::ServiceStatus> status_writer_;
  dds::Writer<msg::Event> event_writer_;
};

}  // namespace zerodrift::service
