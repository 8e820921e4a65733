// SPDX-License-Identifier: Apache-2.0
#include "services/compensation/gyro.h"

#include <algorithm>
#include <utility>

#include "common/core/integer_time.h"
#include "common/dds/conversions.h"
#include "common/service/monotonic_clock.h"
#include "services/compensation/instances.h"

namespace zerodrift::services {

using compensation::Readiness;

namespace {

// Ticks of a quarter of a second until a subscriber that was matched receives all.
constexpr int kOurTicks = 2;
constexpr int kForeignTicks = 8;
// The learner hangs where a model is this late.
constexpr core::SensorTime kHangs{2'000'000'000};

std::size_t place_of(core::ReferenceKind kind) noexcept {
  if (kind == core::ReferenceKind::kNavigationResidual) return 2;
  return kind == core::ReferenceKind::kRest ? 1 : 0;
}

// A replay's come as fast as its rates, of which the pipeline keeps as many.
constexpr std::size_t kReplayed = 2048;

}  // namespace

Gyro::Gyro(std::uint32_t gyro_id, const compensation::CompensationOptions& as_configured,
           double interval_s, bool has_ros2, const Surroundings& surroundings)
    : id(gyro_id),
      configured(as_configured.for_samples_every(interval_s)),
      options(configured),
      events(surroundings.host, gyro_id, surroundings.instance),
      surroundings_(surroundings),
      has_ros2_(has_ros2),
      pipeline_(std::make_unique<compensation::Compensator>(configured),
                surroundings.is_redundant ? service::InstanceSync(surroundings.instance)
                                          : service::InstanceSync(),
                *this),
      temperature_writers_(
          compensator().probes().size(),
          service::FollowedWriter<Guid>(core::from_seconds(configured.temperature_stale_s))),
      reference_writers_{
          ReferenceWriter(core::from_seconds(configured.temperature_stale_s), kReplayed),
          ReferenceWriter(core::from_seconds(configured.temperature_stale_s)),
          ReferenceWriter(core::from_seconds(configured.temperature_stale_s))},
      stamps_{.lags = std::vector<core::SensorTime>(temperature_writers_.size())} {
  surroundings_.learner.add(compensator());
}

// ---------------------------------------- inputs

void Gyro::take(const msg::AngularRate& message, std::uint64_t run, std::int64_t now_ns) {
  if (pipeline_.follows(run)) {
    clock_locked_ = message.clock_locked();
    clock_offset_ns_ = message.clock_offset_ns();
  }
  pipeline_.push(dds::from_message(message), run, message.publish_time_ns(), now_ns);
}

void Gyro::take(const Arrived& arrived, std::int64_t now_ns) {
  if (const auto* temperature = std::get_if<core::TemperatureSample>(&arrived.sample)) {
    const auto& probes = compensator().probes();
    const auto found = std::find(probes.begin(), probes.end(), temperature->probe);
    if (found == probes.end()) return;
    const auto probe = static_cast<std::size_t>(found - probes.begin());
    temperature_writers_[probe].push(
        *temperature, arrived.writer, now_ns,
        [&](const core::TemperatureSample& sample) { push(sample, probe, now_ns); });
  } else if (const auto* reference = std::get_if<core::RateReferenceSample>(&arrived.sample)) {
    reference_writers_[place_of(reference->kind)].push(
        *reference, arrived.writer, now_ns,
        [&](const core::RateReferenceSample& sample) { pipeline_.push(sample, now_ns); });
  }
}

// Of the writer that is followed.
void Gyro::push(const core::TemperatureSample& temperature, std::size_t probe,
                std::int64_t now_ns) {
  if (temperature.measured && !core::is_paced_by_consumers(temperature.clock)) {
    stamps_.newest = temperature.time;
    const core::SensorTime before = std::exchange(
        stamps_.lags[probe], core::saturating_difference(newest().raw.time, temperature.time));
    stamps_.behind = std::min(before, stamps_.lags[probe]);
  }
  pipeline_.push(temperature, now_ns);
}

void Gyro::limit_probes(std::string_view published, std::int64_t now_ns) {
  compensator().limit_probes(published);
  pipeline_.drain(now_ns);
}

void Gyro::end_inputs_of(const std::vector<Guid>& left, std::int64_t now_ns) {
  const Readiness before = compensator().readiness();
  bool ended = false;
  // What belongs to the rates of a successor is there before they are.
  for (const Guid& writer : left) ended = note_left(writer, now_ns) || ended;
  for (const Guid& writer : left) pipeline_.publisher_gone(dds::run_of(writer), now_ns);
  if (!ended) return;
  end_what_left(compensator());
  const bool waited =
      before == Readiness::kAwaitsTemperature || before == Readiness::kAwaitsReference;
  const bool goes_on = waited && compensator().readiness() != before;
  const bool in_mid_run =
      std::any_of(temperature_writers_.begin(), temperature_writers_.end(),
                  [](const auto& input) { return input.is_gone() && input.is_in_mid_run(); });
  input_ended_ = input_ended_ || ((goes_on || in_mid_run) && is_paced());
  pipeline_.drain(now_ns);
}

bool Gyro::note_left(const Guid& writer, std::int64_t now_ns) {
  bool ended = false;
  for (std::size_t probe = 0; probe < temperature_writers_.size(); ++probe) {
    const auto take = [&](const core::TemperatureSample& sample) { push(sample, probe, now_ns); };
    ended = temperature_writers_[probe].leave(writer, now_ns, take) || ended;
  }
  const auto take = [&](const core::RateReferenceSample& sample) {
    pipeline_.push(sample, now_ns);
  };
  for (ReferenceWriter& input : reference_writers_)
    ended = input.leave(writer, now_ns, take) || ended;
  return ended;
}

void Gyro::end_what_left(compensation::Compensator& compensator) const {
  for (std::size_t p = 0; p < temperature_writers_.size(); ++p) {
    if (temperature_writers_[p].is_gone()) compensator.end_temperature(p);
  }
  for (std::size_t r = 0; r < reference_writers_.size(); ++r) {
    if (reference_writers_[r].is_gone()) compensator.end_references(kReferencePlaces[r]);
  }
}

std::uint64_t Gyro::temperatures_rejected() const noexcept {
  std::uint64_t rejected = 0;
  for (const auto& input : temperature_writers_) rejected += input.rejected();
  return rejected;
}

std::uint64_t Gyro::references_rejected() const noexcept {
  std::uint64_t rejected = 0;
  for (const ReferenceWriter& input : reference_writers_) rejected += input.rejected();
  return rejected;
}

bool Gyro::take_input_ended() noexcept {
  return std::exchange(input_ended_, false);
}

// ---------------------------------------- answers

service::AnswerMark Gyro::prepare(const core::CompensatedSample& answer, std::uint64_t run,
                                  std::uint32_t answered) noexcept {
  dds::to_message(answer, id, surroundings_.instance, message_);
  message_.run_id(run);
  message_.answered(answered);
  message_.clock_locked(clock_locked_);
  message_.clock_offset_ns(clock_offset_ns_);
  return pipeline_.sync().is_alone() ? service::AnswerMark{} : mark_of(message_);
}

void Gyro::write_prepared(bool leads) noexcept {
  const std::int64_t egress_ns = service::monotonic_ns();
  message_.egress_time_ns(egress_ns);
  if (!writer_->write(message_)) ++unwritten_;
  if (leads) write_prepared_alone();
  surroundings_.compute_latency.record(egress_ns - message_.ingress_time_ns());
}

void Gyro::write_prepared_alone() noexcept {
  if (ros2_writer_ && !ros2_writer_->write(message_)) ++unwritten_;
}

bool Gyro::awaits_subscribers() const {
  return surroundings_.await_subscribers > 0 || surroundings_.host.participant().is_secured();
}

// A record or simulation also waits for the subscribers that were asked for, and with security,
// where a match takes a while, for those that are known.
bool Gyro::is_open() {
  if (!has_writer()) return false;
  if (received_by_all_ || compensator().readiness() == Readiness::kNothing) return true;
  received_by_all_ =
      !awaits_subscribers() || !core::is_paced_by_consumers(compensator().waiting_clock());
  return received_by_all_;
}

// Those who received the run before may not be there any more.
void Gyro::begin_run() {
  received_by_all_ = false;
  ticks_with_subscribers_ = 0;
}

bool Gyro::await_model() {
  surroundings_.learner.await_model();
  surroundings_.learner.notify();
  return compensator().readiness() != Readiness::kAwaitsModel;
}

void Gyro::report_progress(std::uint64_t newest, core::SensorTime needed) {
  surroundings_.progress.report(id, newest, needed);
}

// ---------------------------------------- the tick

void Gyro::set_writers(std::unique_ptr<dds::Writer<msg::CompensatedRate>> writer,
                       std::unique_ptr<dds::RosImuWriter> ros2_writer) {
  writer_ = std::move(writer);
  ros2_writer_ = std::move(ros2_writer);
}

// A match is known here before it is known there. Ours begin within 12 ms, so that the second tick
// will do. A reader of another vendor begins with the first heartbeat it receives once it has
// matched, up to a second later on a busy machine, and what was written before is lost to it.
void Gyro::note_subscribers(std::int64_t now_ns) {
  if (!has_writer()) return;
  const int nodes = ros2_writer_ ? ros2_writer_->matched() : 0;
  const bool is_foreign = writer_->met_foreign() || (ros2_writer_ && ros2_writer_->met_foreign());
  const dds::Participant& participant = surroundings_.host.participant();
  const bool is_any_on_its_way =
      participant.is_secured() && (participant.awaits_proof() || !writer_->met_all());
  const bool are_here =
      !is_any_on_its_way && writer_->matched() + nodes >= surroundings_.await_subscribers;
  ticks_with_subscribers_ = are_here ? ticks_with_subscribers_ + 1 : 0;
  received_by_all_ =
      received_by_all_ || ticks_with_subscribers_ >= (is_foreign ? kForeignTicks : kOurTicks);
  const bool waits = !received_by_all_ && compensator().readiness() != Readiness::kNothing;
  if (!waits || subscribers_awaited_ns_ == 0) subscribers_awaited_ns_ = waits ? now_ns : 0;
}

void Gyro::tick(std::int64_t now_ns) {
  hangs_ = compensator().model_late_by() > kHangs;
  pipeline_.set_hangs(hangs_);
  if (answered_ns_ == 0 || compensator().counts().samples_out != answered_) answered_ns_ = now_ns;
  answered_ = compensator().counts().samples_out;
  for (std::size_t probe = 0; probe < temperature_writers_.size(); ++probe) {
    temperature_writers_[probe].follow_who_waits(
        now_ns, [&](const core::TemperatureSample& sample) { push(sample, probe, now_ns); });
  }
  for (ReferenceWriter& input : reference_writers_) {
    input.follow_who_waits(
        now_ns, [&](const core::RateReferenceSample& sample) { pipeline_.push(sample, now_ns); });
  }
  pipeline_.tick(now_ns);
  if (received_by_all_ && is_paced()) pipeline_.report_progress();
}

void Gyro::wait_until_received(std::chrono::milliseconds at_most) {
  writer_->wait_until_received(at_most);
}

}  // namespace zerodrift::services
