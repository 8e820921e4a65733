// SPDX-License-Identifier: Apache-2.0
#include "services/compensation/compensation_node.h"

#include <pthread.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/core/integer_time.h"
#include "common/core/units.h"
#include "common/dds/conversions.h"
#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
#include "common/service/realtime.h"
#include "services/compensation/instances.h"

namespace zerodrift::services {

using compensation::Readiness;
using compensation::Reason;
using service::Severity;

namespace {

constexpr std::uint64_t kReportEvery = 32;  // samples between two progress reports
constexpr std::int64_t kSilentPublisherNs =
    1000000000;                                      // a publisher silent this long may be replaced
constexpr std::int64_t kTellWaitingNs = 2000000000;  // after so long it is told
// Of a gyro that has no rate yet: more than a replay sends ahead, 10 s of 4 probes at 200 Hz.
constexpr std::size_t kMostEarlyInputs = 8192;
// Ticks of a quarter of a second until a subscriber that was matched hears all.
constexpr int kOurTicks = 2;
constexpr int kForeignTicks = 8;
constexpr std::chrono::microseconds kLockCheck{50};
constexpr core::SensorTime kClocksAgreeWithin{2'000'000'000};  // of one host, or of PTP or NTP
constexpr const char* kConsumer = "compensation";
constexpr const char* kLearnerThread = "learner";

std::size_t place_of(core::ReferenceKind kind) noexcept {
  if (kind == core::ReferenceKind::kNavigationResidual) return 2;
  return kind == core::ReferenceKind::kRest ? 1 : 0;
}
constexpr std::array kReferencePlaces{core::ReferenceKind::kRecord, core::ReferenceKind::kRest,
                                      core::ReferenceKind::kNavigationResidual};

std::string instance_name(std::uint32_t instance) {
  return instance == 0 ? kConsumer : std::string(kConsumer) + "/" + std::to_string(instance);
}

constexpr bool is_temperature_fault(Reason reason) {
  return reason == Reason::kTemperatureMissing || reason == Reason::kTemperatureStale ||
         reason == Reason::kProbeStuck;
}

constexpr std::string_view temperature_fault_text(Reason reason) {
  switch (reason) {
    case Reason::kTemperatureMissing:
      return "no temperature of a probe that a feature or the prior needs";
    case Reason::kTemperatureStale:
      return "a temperature stream stopped, longer than temperature_stale_s ago";
    default:
      return "a probe has not moved for probe_stuck_s while others do";
  }
}

using compensation::ReferenceVerdict;
// Refusals that somebody ought to know of; the others are as configured, or in the order of things.
constexpr std::array kReferenceFaults{
    ReferenceVerdict::kUnknownKind,   ReferenceVerdict::kUncertain,
    ReferenceVerdict::kMoreThanEarth, ReferenceVerdict::kEarthRateIncluded,
    ReferenceVerdict::kWrongEpoch,    ReferenceVerdict::kImplausible,
    ReferenceVerdict::kDistrusted};

constexpr std::string_view reference_fault_text(ReferenceVerdict verdict) {
  switch (verdict) {
    case ReferenceVerdict::kUnknownKind:
      return "a rate reference of an unknown kind; not heard";
    case ReferenceVerdict::kUncertain:
      return "a rate reference whose variance is above the limit or no number; not heard";
    case ReferenceVerdict::kMoreThanEarth:
      return "a rest reference that turns faster than the Earth; not heard";
    case ReferenceVerdict::kEarthRateIncluded:
      return "a rest reference, while earth_rate.mode says that Earth rate counts as drift; not "
             "heard, or it would be taken off twice";
    case ReferenceVerdict::kWrongEpoch:
      return "a residual of another model than was in force at its time; not heard";
    case ReferenceVerdict::kImplausible:
      return "a residual further off than forecast and residual explain; not heard";
    default:
      return "a residual after several implausible ones; not heard until the next label";
  }
}

}  // namespace

CompensationNode::CompensationNode(const CompensationNodeOptions& options)
    : options_(options),
      strength_(service::first_strength(service::unix_time_ns(), options.ownership_strength)),
      host_(instance_name(options.instance), options.network, options.supervision),
      early_(options.max_gyros, kMostEarlyInputs),
      save_schedule_(options.checkpoint_period),
      commands_(host_, [this](const msg::Command& m) { return on_command(m); }),
      progress_(host_.participant(), kConsumer),
      replay_reader_(host_.participant(), [this](const msg::ReplayProgress& m,
                                                 const dds::SampleOrigin&) { on_replay(m); }),
      reference_reader_(
          host_.participant(),
          [this](const msg::RateReference& m, const dds::SampleOrigin& o) { on_reference(m, o); },
          host_.observer(), [this](const auto& writer, auto how) { note_departure(writer, how); }),
      temperature_reader_(
          host_.participant(),
          [this](const msg::Temperature& m, const dds::SampleOrigin& o) { on_temperature(m, o); },
          host_.observer(), [this](const auto& writer, auto how) { note_departure(writer, how); }),
      rate_reader_(
          host_.participant(),
          [this](const msg::AngularRate& m, const dds::SampleOrigin& o) { on_rate(m, o); },
          host_.observer(), [this](const auto& writer, auto how) { note_departure(writer, how); }) {
  // A configuration that cannot work is found here, not with the first sample.
  compensation::Compensator check(options_.compensation);
  tell_of_prior();
  learner_thread_ = std::thread([this] { learn_until_stopped(); });
  request_thread_ = std::thread([this] { serve_requests_until_stopped(); });
  if (!is_one_of_several()) return;
  checkpoint_writer_.emplace(host_.participant(), host_.observer());
  checkpoint_reader_.emplace(
      host_.participant(),
      [this](const msg::CheckpointPart& m, const dds::SampleOrigin&) { on_checkpoint(m); },
      host_.observer());
  peer_reader_.emplace(
      host_.participant(),
      [this](const msg::CompensatedRate& m, const dds::SampleOrigin&) { on_peer(m); },
      host_.observer(), dds::Reader<msg::CompensatedRate>::OnGone{},
      partitions_of_others(options_.instance));
  takeover_thread_ = std::thread([this] { take_over_until_stopped(); });
}

CompensationNode::~CompensationNode() {
  stopping_takeovers_ = true;
  if (takeover_thread_.joinable()) takeover_thread_.join();
  {
    const std::lock_guard lock(requests_mutex_);
    requests_closed_ = true;
  }
  requests_changed_.notify_all();
  request_thread_.join();  // while the learner still answers
  stopping_ = true;
  wake_learner();
  learner_thread_.join();
}

int CompensationNode::run() {
  return host_.run([this] { return status(); }, [this] { tick(); },
                   [this] { service::end_within(service::kStopWithin, host_.exit_code()); });
}

// ---------------------------------------- data path

CompensationNode::Gyro* CompensationNode::known(std::uint32_t gyro_id) noexcept {
  for (auto& source : gyros_) {
    if (source->id == gyro_id) return source.get();
  }
  return nullptr;
}

CompensationNode::Gyro* CompensationNode::gyro(std::uint32_t gyro_id) {
  if (Gyro* source = known(gyro_id)) return source;
  if (gyros_.size() >= options_.max_gyros) {
    ++strangers_;
    newest_stranger_ = gyro_id;
    return nullptr;
  }
  const service::HotStandby role =
      is_one_of_several()
          ? service::HotStandby(options_.instance, strength_, service::monotonic_ns())
          : service::HotStandby(strength_);
  gyros_.push_back(std::make_unique<Gyro>(gyro_id, options_.compensation, role));
  Gyro& made = *gyros_.back();
  newcomers_.push(made.compensator.get());
  for (const Arrived& early : early_.take(gyro_id)) take_in(made, early);
  return &made;
}

void CompensationNode::take_in(std::uint32_t gyro_id, Arrived arrived) {
  take_departures();
  Gyro* source = known(gyro_id);
  if (source == nullptr) return early_.keep(gyro_id, std::move(arrived));
  take_in(*source, arrived);
  drain(*source);
}

void CompensationNode::take_in(Gyro& gyro, const Arrived& arrived) {
  if (gyro.catch_up.logging) gyro.catch_up.log.push_back(arrived.input);
  if (const auto* temperature = std::get_if<core::TemperatureSample>(&arrived.input)) {
    const auto& probes = gyro.compensator->probes();
    const auto probe = std::find(probes.begin(), probes.end(), temperature->probe);
    if (probe == probes.end()) return;
    gyro.temperature_writers[static_cast<std::size_t>(probe - probes.begin())] = {
        .writer = arrived.writer, .in_mid_run = temperature->measured};
    gyro.compensator->push(*temperature);
    if (temperature->measured && !core::is_paced_by_consumers(temperature->clock))
      gyro.newest_temperature = temperature->time;
  } else if (const auto* reference = std::get_if<core::RateReferenceSample>(&arrived.input)) {
    gyro.reference_writers[place_of(reference->kind)] = {arrived.writer};
    gyro.compensator->push(*reference);
  }
}

// A writer that only fell silent may be standing still. Discovery's thread: nothing is waited for.
void CompensationNode::note_departure(const eprosima::fastrtps::rtps::GUID_t& writer,
                                      dds::Departure departure) {
  if (departure != dds::Departure::kLeft) return;
  const std::lock_guard lock(departures_mutex_);
  departures_.push_back(writer);
  any_departed_ = true;
}

// data_mutex_ is held. Nothing more comes of a writer that left: a rate that waits for it goes on.
void CompensationNode::take_departures() {
  if (!any_departed_) return;
  std::vector<eprosima::fastrtps::rtps::GUID_t> departures;
  {
    const std::lock_guard lock(departures_mutex_);
    departures.swap(departures_);
    any_departed_ = false;
  }
  for (auto& source : gyros_) {
    const Readiness before = source->compensator->readiness();
    bool ended = false;
    for (const auto& writer : departures) ended = end_inputs(*source, writer) || ended;
    if (!ended) continue;
    const bool waited =
        before == Readiness::kAwaitsTemperature || before == Readiness::kAwaitsReference;
    const bool goes_on = waited && source->compensator->readiness() != before;
    const bool in_mid_run =
        std::any_of(source->temperature_writers.begin(), source->temperature_writers.end(),
                    [](const InputWriter& input) { return input.left && input.in_mid_run; });
    if ((goes_on || in_mid_run) && core::is_paced_by_consumers(source->newest.raw.clock))
      source->input_ended = true;
    drain(*source);
  }
}

bool CompensationNode::end_inputs(Gyro& gyro, const eprosima::fastrtps::rtps::GUID_t& writer) {
  if (gyro.publisher == writer) gyro.publisher_left = true;
  bool ended = false;
  const auto note = [&](InputWriter& input) {
    if (input.left || input.writer != writer) return;
    input.left = ended = true;
  };
  for (InputWriter& input : gyro.temperature_writers) note(input);
  for (InputWriter& input : gyro.reference_writers) note(input);
  if (ended) end_what_left(gyro);
  return ended;
}

void CompensationNode::end_what_left(Gyro& gyro) {
  for (std::size_t p = 0; p < gyro.temperature_writers.size(); ++p) {
    if (gyro.temperature_writers[p].left) gyro.compensator->end_temperature(p);
  }
  for (std::size_t r = 0; r < gyro.reference_writers.size(); ++r) {
    if (gyro.reference_writers[r].left) gyro.compensator->end_references(kReferencePlaces[r]);
  }
}

// One publisher an id: the first is heard until it is gone or silent, so that two streams are never
// mixed.
bool CompensationNode::accepts(Gyro& gyro, const dds::SampleOrigin& origin, std::int64_t now_ns) {
  const bool is_silent = gyro.publisher_left || now_ns - gyro.heard_ns >= kSilentPublisherNs;
  if (gyro.has_publisher && gyro.publisher == origin.writer) {
    gyro.heard_ns = now_ns;
    return true;
  }
  if (gyro.has_publisher && !is_silent) {
    ++gyro.rejected;
    return false;
  }
  if (gyro.has_publisher) {
    while (gyro.writer != nullptr && gyro.compensator->readiness() != Readiness::kNothing)
      answer(gyro);
    gyro.compensator->restart_stream();
    gyro.newest_sequence = 0;
    gyro.catch_up = {};         // the log is of the publisher before
    gyro.heard_by_all = false;  // nor may those who heard it be there any more
    gyro.ticks_with_subscribers = 0;
  }
  gyro.publisher = origin.writer;
  gyro.has_publisher = true;
  gyro.publisher_left = false;
  gyro.heard_ns = now_ns;
  return true;
}

void CompensationNode::on_rate(const msg::AngularRate& message, const dds::SampleOrigin& origin) {
  const std::int64_t ingress_ns = service::monotonic_ns();
  const std::lock_guard lock(data_mutex_);
  take_departures();
  Gyro* const found = gyro(message.gyro_id());
  if (found == nullptr) return;
  Gyro& source = *found;
  if (!accepts(source, origin, ingress_ns)) return;
  note_arrival(message, ingress_ns);
  source.clock_locked = message.clock_locked();
  source.clock_offset_ns = message.clock_offset_ns();
  const auto sample = dds::from_message(message);
  if (source.catch_up.logging) source.catch_up.log.emplace_back(sample);
  if (source.compensator->push(sample, message.publish_time_ns(), ingress_ns) ==
          compensation::Admission::kQueueFull &&
      source.writer != nullptr) {
    answer(source);  // never lose a raw sample: the oldest goes out with what is there
    source.compensator->push(sample, message.publish_time_ns(), ingress_ns);
  }
  drain(source);
}

// A gyro whose samples are stamped with the host's Unix time says how old they were when published.
void CompensationNode::note_arrival(const msg::AngularRate& message,
                                    std::int64_t ingress_ns) noexcept {
  arrival_latency_.record_between(message.publish_time_ns(), ingress_ns);
  if (message.clock_source() != static_cast<std::uint32_t>(core::ClockSource::kHost)) return;
  const std::int64_t published_ns = service::unix_time_of(
      message.publish_time_ns(), {.unix_ns = service::unix_time_ns(), .monotonic_ns = ingress_ns});
  sensor_latency_.record_between(message.sensor_time_ns(), published_ns);
}

void CompensationNode::on_temperature(const msg::Temperature& message,
                                      const dds::SampleOrigin& origin) {
  Arrived arrived{dds::from_message(message), origin.writer};
  const std::lock_guard lock(data_mutex_);
  take_in(message.gyro_id(), std::move(arrived));
}

void CompensationNode::on_reference(const msg::RateReference& message,
                                    const dds::SampleOrigin& origin) {
  const std::lock_guard lock(data_mutex_);
  take_in(message.gyro_id(), {dds::from_message(message), origin.writer});
}

// A publisher of temperatures says four times a second which probes it has.
void CompensationNode::on_replay(const msg::ReplayProgress& message) {
  if (message.consumer().size() != 0) return;
  const std::lock_guard lock(data_mutex_);
  Gyro* const source = known(message.gyro_id());
  if (source == nullptr) return;
  source->compensator->limit_probes(message.probes().c_str());
  drain(*source);
}

// A record or simulation also waits for the subscribers that were asked for.
bool CompensationNode::may_write(Gyro& source) const {
  if (source.writer == nullptr) return false;
  if (source.heard_by_all || source.compensator->readiness() == Readiness::kNothing) return true;
  source.heard_by_all = options_.await_subscribers == 0 ||
                        !core::is_paced_by_consumers(source.compensator->waiting_clock());
  return source.heard_by_all;
}

// Real sensors are answered at once, with what is there. A record or simulation waits for its
// consumers, so its samples wait here for what belongs to them, and the result does not depend on
// who came first.
void CompensationNode::drain(Gyro& source) {
  if (!may_write(source)) return;
  compensation::Compensator& compensator = *source.compensator;
  for (;;) {
    const Readiness readiness = compensator.readiness();
    if (readiness == Readiness::kNothing) break;
    if (readiness != Readiness::kReady &&
        core::is_paced_by_consumers(compensator.waiting_clock())) {
      if (readiness == Readiness::kAwaitsModel) {
        model_awaited_ = true;  // the learner's thread goes on here, unless it is there already
        if (compensator.readiness() == Readiness::kAwaitsModel) return;
        continue;
      }
      if (source.waiting_since_ns == 0) source.waiting_since_ns = service::monotonic_ns();
      if (source.reported_needed != compensator.needed_time()) report_progress(source);
      return;
    }
    answer(source);
  }
}

void CompensationNode::answer(Gyro& source) {
  const std::uint64_t labels = source.compensator->counts().labels;
  source.waiting_since_ns = 0;
  source.told_waiting = false;
  source.newest = source.compensator->answer_next();
  dds::to_message(source.newest, source.id, options_.instance, message_);
  message_.run_id(dds::run_of(source.publisher));
  message_.clock_locked(source.clock_locked);
  message_.clock_offset_ns(source.clock_offset_ns);
  if (source.standby.take(message_, service::monotonic_ns())) write(source, message_);
  source.newest_sequence = std::max(source.newest_sequence, source.newest.raw.sequence);
  if (source.compensator->counts().labels != labels) wake_learner();
  if (core::is_paced_by_consumers(source.newest.raw.clock) &&
      ++source.answered_since_report >= kReportEvery) {
    report_progress(source);
  }
}

void CompensationNode::write(Gyro& source, msg::CompensatedRate& message) {
  message.ownership_strength(source.standby.strength());
  const std::int64_t egress_ns = service::monotonic_ns();
  message.egress_time_ns(egress_ns);
  if (!source.writer->write(message)) ++source.unwritten;
  if (source.ros2_writer && !source.ros2_writer->write(message)) ++source.unwritten;
  compute_latency_.record(egress_ns - message.ingress_time_ns());
}

void CompensationNode::report_progress(Gyro& source) {
  source.answered_since_report = 0;
  source.reported_needed = source.compensator->needed_time();
  progress_.report(source.id, source.newest_sequence, source.reported_needed);
}

// ---------------------------------------- learner

void CompensationNode::wake_learner() {
  ++learner_wakeups_;
  learner_wakeups_.notify_one();
}

void CompensationNode::learn_until_stopped() {
  pthread_setname_np(pthread_self(), kLearnerThread);  // for those who look at a running service
  service::leave_realtime();
  while (!stopping_) {
    const std::uint32_t seen = learner_wakeups_.load();
    for (auto** newcomer = newcomers_.front(); newcomer != nullptr; newcomer = newcomers_.front()) {
      roster_.push_back(*newcomer);
      newcomers_.pop();
    }
    for (auto* question = questions_.front(); question != nullptr; question = questions_.front()) {
      (*question)();
      questions_.pop();
    }
    bool learned = false;
    for (compensation::Compensator* compensator : roster_) {
      while (compensator->learner().run_one()) {
        learned = true;
        resume_after_model();
      }
    }
    if (!learned && !stopping_) learner_wakeups_.wait(seen);
  }
}

// Samples of a record or simulation that waited for the model. Whoever holds the lock may be
// waiting for an answer of this thread: then the tick goes on with them.
void CompensationNode::resume_after_model() {
  if (!model_awaited_.exchange(false)) return;
  std::unique_lock lock(data_mutex_, std::try_to_lock);
  while (!lock.owns_lock()) {
    if (stopping_ || questions_.front() != nullptr) return;
    std::this_thread::sleep_for(kLockCheck);
    static_cast<void>(lock.try_lock());
  }
  for (auto& source : gyros_) drain(*source);
}

// ---------------------------------------- commands

CompensationNode::Verdict CompensationNode::on_command(const msg::Command& command) {
  const std::lock_guard lock(data_mutex_);
  const std::string_view name = command.name().c_str();
  const bool needs_files =
      name == "checkpoint" || name == "restore" || name == "adopt" || name == "revert";
  return needs_files ? hand_over(command) : obey(command);
}

CompensationNode::Verdict CompensationNode::obey(const msg::Command& command) {
  Verdict verdict{.text = "no gyro has been heard yet"};
  bool accepted = false;
  const std::vector<Gyro*> active = active_gyros();
  if (active.empty() && !gyros_.empty()) return {.text = kStandbyText};
  for (Gyro* source : active) {
    verdict.text = obey(*source, command.name().c_str(), accepted);
    verdict.model_epoch = source->newest.model_epoch;
    if (!accepted) break;
  }
  if (accepted) verdict.outcome = Outcome::kAccepted;
  return verdict;
}

std::string CompensationNode::obey(Gyro& source, std::string_view command, bool& accepted) {
  accepted = true;
  if (command == "freeze") {
    source.compensator->freeze();
    return "learning is frozen";
  }
  if (command == "learn") {
    source.compensator->learn();
    return "learning goes on when at rest";
  }
  if (command == "reset") {
    accepted = source.compensator->reset_models();
    wake_learner();
    return accepted ? "all that was learned is forgotten" : "the learner is busy; try again";
  }
  accepted = false;
  return "unknown command '" + std::string(command) +
         "'; known are freeze, learn, reset, checkpoint, restore, adopt, revert";
}

// ---------------------------------------- status

void CompensationNode::tick() {
  progress_.announce();
  make_writers();
  const std::int64_t now = service::monotonic_ns();
  const std::lock_guard lock(data_mutex_);
  take_departures();
  tell_of_strangers();
  for (auto& source : gyros_) {
    tell_of_waiting(*source, now);
    tell_of_clocks(*source);
    if (source->heard_by_all && core::is_paced_by_consumers(source->newest.raw.clock))
      report_progress(*source);
    tell_of_faults(*source);
    look_after_standby(*source);
  }
  save_from_time_to_time();
}

// Creating an endpoint from a listener can deadlock the middleware, so a new gyro's writer is made
// here, and what came meanwhile is answered.
void CompensationNode::make_writers() {
  std::vector<Gyro*> without;
  std::vector<Gyro*> weak;
  {
    const std::lock_guard lock(data_mutex_);
    for (auto& source : gyros_) {
      const bool is_weak = source->standby.wanted_strength() != source->standby.strength();
      if (source->writer == nullptr) without.push_back(source.get());
      if (source->writer != nullptr && is_weak) weak.push_back(source.get());
    }
  }
  for (Gyro* source : weak) renew_writer(*source);
  for (Gyro* source : without) {
    resume(*source);
    auto writer = make_writer(strength_);
    auto ros2_writer = make_ros2_writer(source->id);
    const std::lock_guard lock(data_mutex_);
    source->writer = std::move(writer);
    source->ros2_writer = std::move(ros2_writer);
  }
  const std::lock_guard lock(data_mutex_);
  for (auto& source : gyros_) {
    note_subscribers(*source);
    drain(*source);
  }
}

std::unique_ptr<dds::RosImuWriter> CompensationNode::make_ros2_writer(std::uint32_t gyro_id) {
  const auto wanted = options_.ros2_imu.find(gyro_id);
  if (wanted == options_.ros2_imu.end()) return nullptr;
  return std::make_unique<dds::RosImuWriter>(host_.participant(), wanted->second, gyro_id,
                                             host_.observer());
}

// A match is known here before it is known there. Ours begin within 12 ms, so that the second tick
// will do. A reader of another vendor begins with the first heartbeat it hears once it has matched,
// up to a second later on a busy machine, and what was written before is lost to it.
void CompensationNode::note_subscribers(Gyro& source) {
  if (source.writer == nullptr) return;
  const bool has_nodes = source.ros2_writer != nullptr;
  const int nodes = has_nodes ? source.ros2_writer->matched() : 0;
  const bool is_foreign =
      source.writer->met_foreign() || (has_nodes && source.ros2_writer->met_foreign());
  const bool are_here = source.writer->matched() + nodes >= options_.await_subscribers;
  source.ticks_with_subscribers = are_here ? source.ticks_with_subscribers + 1 : 0;
  source.heard_by_all = source.heard_by_all ||
                        source.ticks_with_subscribers >= (is_foreign ? kForeignTicks : kOurTicks);
}

// Silence decides nothing: who is silent may be standing still.
void CompensationNode::tell_of_waiting(Gyro& source, std::int64_t now_ns) {
  const auto tell = [&](const char* code, const char* text) {
    host_.raise({.code = code,
                 .severity = Severity::kWarning,
                 .text = "gyro " + std::to_string(source.id) + ": " + text,
                 .gyro_id = source.id,
                 .sensor_time_ns = source.compensator->needed_time().count()});
  };
  if (source.input_ended)
    tell("stream_ended", "the publisher of a temperature or reference left; going on without");
  source.input_ended = false;
  const bool is_long =
      source.waiting_since_ns != 0 && now_ns - source.waiting_since_ns > kTellWaitingNs;
  if (!is_long || source.told_waiting) return;
  source.told_waiting = true;
  tell("stream_silent", source.compensator->readiness() == Readiness::kAwaitsReference
                            ? "rates wait for a reference whose publisher says nothing"
                            : "rates wait for temperatures; is thermal_publisher running?");
}

// A temperature from the future is not used until its time comes. (One from the past is told as
// stale.)
void CompensationNode::tell_of_clocks(Gyro& source) {
  const core::SensorTime rate = source.newest.raw.time;
  const bool is_known = source.compensator->counts().samples_out > 0 &&
                        source.newest_temperature != core::kNever &&
                        !core::is_paced_by_consumers(source.newest.raw.clock);
  const bool disagrees =
      is_known && core::saturating_difference(source.newest_temperature, rate) > kClocksAgreeWithin;
  if (disagrees && !source.told_clocks) {
    host_.raise({.code = "clocks_disagree",
                 .severity = Severity::kWarning,
                 .text = "gyro " + std::to_string(source.id) + ": a temperature is stamped " +
                         std::to_string(core::seconds(
                             core::saturating_difference(source.newest_temperature, rate))) +
                         " s ahead of the rates; do their publishers' clocks agree?",
                 .gyro_id = source.id,
                 .sensor_time_ns = rate.count()});
  }
  source.told_clocks = disagrees;
}

void CompensationNode::tell_of_strangers() {
  if (strangers_ == told_strangers_) return;
  host_.raise_counted(
      {.code = "too_many_gyros",
       .severity = Severity::kWarning,
       .text = "gyro " + std::to_string(newest_stranger_) +
               " is one too many: " + std::to_string(options_.max_gyros) +
               " gyros are compensated (--max-gyros), samples of others are not answered",
       .gyro_id = newest_stranger_},
      strangers_ - told_strangers_);
  told_strangers_ = strangers_;
}

void CompensationNode::tell_of_faults(Gyro& source) {
  const compensation::CompensatorCounts now = source.compensator->counts();
  const auto tell = [&](const char* code, std::string text, std::uint64_t before,
                        std::uint64_t after) {
    if (after <= before) return;
    host_.raise_counted({.code = code,
                         .severity = Severity::kWarning,
                         .text = "gyro " + std::to_string(source.id) + ": " + std::move(text),
                         .gyro_id = source.id,
                         .sensor_time_ns = source.newest.raw.time.count()},
                        after - before);
  };
  const compensation::CompensatorCounts& told = source.told;
  tell("invalid_sample",
       "a rate is not finite or marked invalid; passed on marked invalid, not learned",
       told.invalid, now.invalid);
  tell("duplicate_sample", "a sequence number came twice; answered once", told.duplicates,
       now.duplicates);
  tell("late_sample", "a sequence number came after a later one; answered, not learned", told.late,
       now.late);
  tell("too_old_sample", "a sequence number more than 4096 behind the newest; not answered",
       told.too_old, now.too_old);
  tell("missing_sample", "sequence numbers are missing from the stream", told.missing, now.missing);
  tell("time_fault", "a time stamp does not increase; answered, not learned", told.time_faults,
       now.time_faults);
  tell("refused_temperature", "a temperature is not finite, implausible or out of order; not used",
       told.temperatures_refused, now.temperatures_refused);
  tell("late_model", "the learner was late; samples went out with the model before",
       told.late_models, now.late_models);
  tell("skipped_label", "the learner's queue was full; a label was skipped", told.labels_skipped,
       now.labels_skipped);
  for (const auto verdict : kReferenceFaults) {
    const auto v = static_cast<std::size_t>(verdict);
    const std::string code = "reference_" + std::string(compensation::name(verdict));
    tell(code.c_str(), std::string(reference_fault_text(verdict)), told.references[v],
         now.references[v]);
  }
  tell("duplicate_publisher", "a second publisher uses this id; only the first is heard",
       source.told_rejected, source.rejected);
  source.told = now;
  source.told_rejected = source.rejected;
  tell_of_modes(source);
  tell_of_temperature(source);
}

void CompensationNode::tell_of_modes(Gyro& source) {
  for (const auto axis : core::kAxes) {
    const std::size_t i = core::index(axis);
    const auto mode = source.newest.mode[i];
    const auto reason = source.newest.reason[i];
    if (mode == source.told_mode[i] && reason == source.told_reason[i]) continue;
    source.told_mode[i] = mode;
    source.told_reason[i] = reason;
    host_.raise({.code = "mode_" + std::string(core::name(axis)),
                 .severity = Severity::kInformation,
                 .text = "axis " + std::string(core::name(axis)) + ": " +
                         std::string(compensation::name(mode)) + " (" +
                         std::string(compensation::name(reason)) + ")",
                 .gyro_id = source.id,
                 .sensor_time_ns = source.newest.raw.time.count()});
  }
}

// The axes share their thermometers: told once for all of them, each time it begins.
void CompensationNode::tell_of_temperature(Gyro& source) {
  const auto fault =
      std::find_if(source.newest.reason.begin(), source.newest.reason.end(), is_temperature_fault);
  const Reason now = fault == source.newest.reason.end() ? Reason::kNone : *fault;
  if (now == source.told_temperature_fault) return;
  source.told_temperature_fault = now;
  if (now == Reason::kNone) return;
  host_.raise({.code = std::string(compensation::name(now)),
               .severity = Severity::kWarning,
               .text = "gyro " + std::to_string(source.id) + ": " +
                       std::string(temperature_fault_text(now)) + "; the model is not used",
               .gyro_id = source.id,
               .sensor_time_ns = source.newest.raw.time.count()});
}

}  // namespace zerodrift::services
