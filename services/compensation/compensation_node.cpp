// SPDX-License-Identifier: Apache-2.0
#include "services/compensation/compensation_node.h"

#include <algorithm>
#include <utility>

#include "common/core/time.h"
#include "common/dds/conversions.h"
#include "common/service/instance_name.h"
#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
#include "services/compensation/instances.h"

namespace zerodrift::services {

using service::Severity;

namespace {

// Of a gyro that has no rate yet: more than a replay sends ahead, 10 s of 4 probes at 200 Hz.
constexpr std::size_t kMostEarlyInputs = 8192;

}  // namespace

CompensationNode::CompensationNode(const CompensationNodeOptions& options)
    : options_(options),
      host_(service::instance_name(options.instance), options.network, options.supervision),
      gyros_(options.max_gyros),
      early_(options.max_gyros, kMostEarlyInputs),
      save_schedule_(core::from_seconds(options.checkpoint_period_s)),
      saved_gyros_(options.checkpoint_dir),
      learner_(kMostGyros, data_mutex_, [this] { drain_all(); }),
      commands_(
          host_, [this](const msg::Command& m) { return on_command(m); },
          [this](const msg::Command& m) { overhear(m); }),
      progress_(host_.participant(), service::kCompensation),
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
          host_.observer(), [this](const auto& writer, auto how) { note_departure(writer, how); }),
      coverage_(host_, options.max_gyros),
      rivals_(host_, options.redundant) {
  // A configuration that cannot work is found here, not with the first sample.
  compensation::Compensator check(options_.compensation);
  report_prior();
  request_thread_ = std::thread([this] { serve_requests_until_stopped(); });
  if (!options_.ros2_imu.empty()) ros2_diagnostics_.emplace(host_);
  if (!options_.redundant) return;
  checkpoint_writer_.emplace(host_.participant(), host_.observer());
  checkpoint_reader_.emplace(
      host_.participant(),
      [this](const msg::CheckpointPart& m, const dds::SampleOrigin&) { on_checkpoint(m); },
      host_.observer());
  peer_reader_.emplace(
      host_.participant(),
      [this](const msg::CompensatedRate& m, const dds::SampleOrigin&) { on_peer(m); },
      host_.observer(), PeerReader::OnGone{}, partitions_of_others(options_.instance));
}

CompensationNode::~CompensationNode() {
  {
    const std::lock_guard lock(requests_mutex_);
    requests_closed_ = true;
  }
  requests_changed_.notify_all();
  request_thread_.join();  // while the learner still answers
  learner_.stop();
}

int CompensationNode::run() {
  return host_.run([this] { return status(); }, [this] { tick(); },
                   [this] { service::end_within(service::kStopWithin, host_.exit_code()); });
}

// ---------------------------------------- data path

Gyro* CompensationNode::gyro(std::uint32_t gyro_id, double interval_s, std::int64_t now_ns) {
  if (Gyro* source = gyros_.find(gyro_id)) return source;
  const Gyro::Surroundings surroundings{.instance = options_.instance,
                                        .is_redundant = options_.redundant,
                                        .await_subscribers = options_.await_subscribers,
                                        .host = host_,
                                        .learner = learner_,
                                        .progress = progress_,
                                        .compute_latency = compute_latency_};
  const bool is_frozen = is_commanded_to_freeze();
  Gyro* made = gyros_.find_or_make(gyro_id, gyro_id, options_.compensation, interval_s,
                                   options_.ros2_imu.contains(gyro_id), surroundings);
  if (made == nullptr) {
    newest_stranger_ = gyro_id;
    return nullptr;
  }
  if (is_frozen) made->compensator().freeze();
  for (const Gyro::Arrived& early : early_.take(gyro_id)) made->take(early, now_ns);
  return made;
}

void CompensationNode::take_in(std::uint32_t gyro_id, Gyro::Arrived arrived) {
  const std::int64_t now = service::monotonic_ns();
  const std::lock_guard lock(data_mutex_);
  take_departures(now);
  Gyro* source = gyros_.find(gyro_id);
  if (source == nullptr) return early_.keep(gyro_id, std::move(arrived));
  source->take(arrived, now);
}

// A writer that only fell silent may be standing still. Discovery's thread: nothing is waited for.
void CompensationNode::note_departure(const eprosima::fastrtps::rtps::GUID_t& writer,
                                      dds::Departure departure) {
  if (departure != dds::Departure::kLeft) return;
  const std::lock_guard lock(departures_mutex_);
  departures_.push_back(writer);
  any_departed_ = true;
}

// data_mutex_ is held.
void CompensationNode::take_departures(std::int64_t now_ns) {
  if (!any_departed_) return;
  std::vector<Gyro::Guid> departures;
  {
    const std::lock_guard lock(departures_mutex_);
    departures.swap(departures_);
    any_departed_ = false;
  }
  for (auto& [id, source] : gyros_.entries()) source.end_inputs_of(departures, now_ns);
}

void CompensationNode::on_rate(const msg::AngularRate& message, const dds::SampleOrigin& origin) {
  const std::int64_t ingress_ns = service::monotonic_ns();
  const std::lock_guard lock(data_mutex_);
  take_departures(ingress_ns);
  Gyro* const source = gyro(message.gyro_id(), message.interval_s(), ingress_ns);
  const std::uint64_t run = dds::run_of(origin.writer);
  if (source == nullptr) return;
  if (source->pipeline().follows(run)) note_arrival(message, ingress_ns);
  source->take(message, run, ingress_ns);
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
  take_in(message.gyro_id(), {dds::from_message(message), origin.writer});
}

void CompensationNode::on_reference(const msg::RateReference& message,
                                    const dds::SampleOrigin& origin) {
  take_in(message.gyro_id(), {dds::from_message(message), origin.writer});
}

// A publisher of temperatures says four times a second which probes it has.
void CompensationNode::on_replay(const msg::ReplayProgress& message) {
  if (message.consumer().size() != 0) return;
  const std::lock_guard lock(data_mutex_);
  if (Gyro* source = gyros_.find(message.gyro_id()))
    source->limit_probes(message.probes().c_str(), service::monotonic_ns());
}

void CompensationNode::drain_all() {
  const std::int64_t now = service::monotonic_ns();
  for (auto& [id, source] : gyros_.entries()) source.pipeline().drain(now);
}

// ---------------------------------------- the tick

void CompensationNode::tick() {
  progress_.announce();
  make_writers();
  report_to_ros2();
  report_coverage();
  const std::int64_t now = service::monotonic_ns();
  const std::lock_guard lock(data_mutex_);
  take_departures(now);
  report_strangers();
  for (auto& [id, source] : gyros_.entries()) {
    source.note_subscribers(now);
    source.pipeline().drain(now);
    source.tick(now);
    source.events.report(source, now);
    ask_for_state(source, now);
  }
  save_from_time_to_time();
}

// Creating an endpoint from a listener can deadlock the middleware, so a new gyro's writer is made
// here, and what came meanwhile is answered.
void CompensationNode::make_writers() {
  std::vector<Gyro*> without;
  {
    const std::lock_guard lock(data_mutex_);
    for (auto& [id, source] : gyros_.entries()) {
      if (!source.has_writer()) without.push_back(&source);
    }
  }
  for (Gyro* source : without) {
    resume(*source);
    auto writer = std::make_unique<dds::Writer<msg::CompensatedRate>>(
        host_.participant(), host_.observer(),
        options_.redundant ? partitions_to_write(options_.instance) : dds::Partitions{});
    auto ros2_writer = make_ros2_writer(source->id);
    const std::lock_guard lock(data_mutex_);
    source->set_writers(std::move(writer), std::move(ros2_writer));
  }
}

std::unique_ptr<dds::RosImuWriter> CompensationNode::make_ros2_writer(std::uint32_t gyro_id) {
  const auto wanted = options_.ros2_imu.find(gyro_id);
  if (wanted == options_.ros2_imu.end()) return nullptr;
  return std::make_unique<dds::RosImuWriter>(host_.participant(), wanted->second, gyro_id,
                                             host_.observer());
}

void CompensationNode::report_to_ros2() {
  const std::int64_t now = service::monotonic_ns();
  if (!ros2_diagnostics_ || !ros2_diagnostics_->is_due(now)) return;
  {
    const std::lock_guard lock(data_mutex_);
    for (const auto& [id, source] : gyros_.entries()) ros2_diagnostics_->look_at(source, now);
  }
  ros2_diagnostics_->publish(now);
}

void CompensationNode::report_coverage() {
  {
    const std::lock_guard lock(data_mutex_);
    for (const auto& [id, source] : gyros_.entries()) coverage_.look_at(source);
  }
  coverage_.publish();
}

void CompensationNode::report_strangers() {
  const std::uint64_t strangers = gyros_.refused();
  if (strangers == reported_strangers_) return;
  host_.raise_counted(
      {.code = "too_many_gyros",
       .severity = Severity::kWarning,
       .text = "gyro " + std::to_string(newest_stranger_) +
               " is one too many: " + std::to_string(options_.max_gyros) +
               " gyros are compensated (--max-gyros), samples of others are not answered",
       .gyro_id = newest_stranger_},
      strangers - reported_strangers_);
  reported_strangers_ = strangers;
}

}  // namespace zerodrift::services
