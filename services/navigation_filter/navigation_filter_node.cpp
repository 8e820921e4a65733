// SPDX-License-Identifier: Apache-2.0
#include "services/navigation_filter/navigation_filter_node.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "common/core/counted.h"
#include "common/core/units.h"
#include "common/dds/conversions.h"
#include "common/navigation/navigation_input.h"
#include "common/service/counted_event.h"
#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
#include "services/navigation_filter/state_message.h"

namespace zerodrift::services {

using navigation::Phase;
using navigation::Stream;
using service::Severity;

namespace {

constexpr std::size_t kMostStrangers = 1024;  // whose replays are paced all the same
constexpr std::array kFilters{Stream::kRaw, Stream::kCompensated};

constexpr const char* name(Phase phase) {
  switch (phase) {
    case Phase::kWaiting: return "waiting";
    case Phase::kAligning: return "aligning";
    case Phase::kNavigating: return "navigating";
  }
  return "unknown";
}

constexpr const char* name(Stream stream) {
  return stream == Stream::kRaw ? "raw" : "compensated";
}

navigation::NavigationSample to_navigation(const msg::CompensatedRate& message) {
  const core::CompensatedSample received = dds::from_message(message);
  navigation::NavigationSample sample = navigation::to_navigation(received);
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    sample.noise_variance[i] = navigation::noise_variance(message.rate_covariance_radps2()[4 * i],
                                                          received.drift_variance[i]);
  }
  return sample;
}

using Counts = navigation::NavigationCounts;
constexpr std::array<service::CountedEvent<Counts>, 6> kCountedEvents{
    {{&Counts::gaps, "gap", "samples are missing; turned through at the rates around them"},
     {&Counts::losses, "heading_lost", "a gap too long to bridge; the heading is uncertain since"},
     {&Counts::time_restarts, "time_restarted",
      "sensor time began anew; the heading is uncertain since"},
     {&Counts::unusable, "unusable_sample",
      "an axis is not valid or there is no interval; bridged as a gap"},
     {&Counts::clipped, "clipped_sample", "an axis is saturated; the attitude is uncertain since"},
     {&Counts::duplicates, "duplicate_time", "a time that was there or is past; left out"}}};

}  // namespace

NavigationFilterNode::NavigationFilterNode(const NavigationFilterOptions& options)
    : options_(options),
      host_("navigation_filter", options.network, options.supervision),
      gyros_(options.max_gyros),
      strangers_(kMostStrangers),
      state_writer_(host_.participant(), host_.observer()),
      reference_writer_(host_.participant(), host_.observer()),
      progress_(host_.participant(), "navigation_filter"),
      reference_reader_(
          host_.participant(),
          [this](const msg::RateReference& m, const dds::SampleOrigin& origin) {
            on_reference(m, origin.writer);
          },
          host_.observer()),
      rate_reader_(
          host_.participant(),
          [this](const msg::CompensatedRate& m, const dds::SampleOrigin&) { on_sample(m); },
          host_.observer()) {
  // A configuration that cannot work is found here, not with the first sample.
  const navigation::GyroNavigation check(options_.navigation);
}

int NavigationFilterNode::run() {
  return host_.run([this] { return status(); }, [this] { tick(); },
                   [this] { service::end_within(service::kStopWithin, host_.exit_code()); });
}

// ---------------------------------------- samples

NavigationFilterNode::Gyro* NavigationFilterNode::gyro(std::uint32_t gyro_id) {
  return gyros_.find_or_make(gyro_id, gyro_id, options_.navigation);
}

void NavigationFilterNode::on_sample(const msg::CompensatedRate& message) {
  const std::int64_t arrival_ns = service::monotonic_ns();
  const std::lock_guard lock(mutex_);
  delivery_latency_.record_between(message.egress_time_ns(), arrival_ns);
  chain_latency_.record_between(message.publish_time_ns(), arrival_ns);
  Gyro* source = gyro(message.gyro_id());
  if (source == nullptr) {
    ++stranger_samples_;
    const std::uint32_t id = message.gyro_id();
    if (auto* pace = strangers_.find_or_make(id)) keep_pace(id, *pace, message);
    return;
  }
  source->navigation.push(to_navigation(message));
  give_references(*source);
  keep_pace(source->id, source->pace, message);
}

// Of the truth alone: the rest is what filters say, this one among them.
void NavigationFilterNode::on_reference(const msg::RateReference& message, const Guid& writer) {
  const core::RateReferenceSample reference = dds::from_message(message);
  if (!core::is_true_rate(reference.kind) ||
      reference.valid != core::PerAxis<bool>{true, true, true})
    return;
  const std::lock_guard lock(mutex_);
  Gyro* source = gyro(message.gyro_id());
  if (source == nullptr) return;
  source->truth_writer.push(reference, writer, service::monotonic_ns(),
                            [&](const auto& followed) { source->push_truth(followed); });
  give_references(*source);
}

void NavigationFilterNode::give_references(Gyro& source) {
  while (const auto reference = source.navigation.take_reference()) {
    if (!options_.gives_references) continue;
    auto message = dds::to_message(*reference, source.id);
    if (!reference_writer_.write(message)) ++unwritten_;
  }
}

void NavigationFilterNode::keep_pace(std::uint32_t gyro_id, service::ConsumerPace& pace,
                                     const msg::CompensatedRate& message) {
  const auto clock = static_cast<core::ClockSource>(message.clock_source());
  if (pace.take(message.sequence_number(), core::is_paced_by_consumers(clock),
                message.order() != 0))
    report_progress(gyro_id, pace);
}

void NavigationFilterNode::report_progress(std::uint32_t gyro_id, service::ConsumerPace& pace) {
  pace.note_report();
  // It needs no temperatures: a time that nobody waits for.
  progress_.report(gyro_id, pace.newest_sequence(), core::kNever);
}

// ---------------------------------------- states

void NavigationFilterNode::tick() {
  progress_.announce();
  const std::int64_t now = service::monotonic_ns();
  const bool due =
      !published_ns_ || static_cast<double>(now - *published_ns_) >= options_.period_s * 1e9;
  if (due) published_ns_ = now;
  const std::lock_guard lock(mutex_);
  for (auto& [id, source] : gyros_.entries()) {
    source.truth_writer.follow_who_waits(
        now, [&](const auto& followed) { source.push_truth(followed); });
    source.navigation.give_up_waiting();
    give_references(source);
    if (source.pace.is_waited_for()) report_progress(id, source.pace);
    if (due) publish_states(source);
    report_counts(source);
  }
  for (auto& [id, pace] : strangers_.entries()) {
    if (pace.is_waited_for()) report_progress(id, pace);
  }
}

void NavigationFilterNode::publish_states(Gyro& source) {
  if (source.navigation.phase() == Phase::kWaiting) return;
  const auto publish = [&](Stream stream) {
    auto message = to_message(source.navigation, stream, source.id, options_.navigation.frame);
    state_writer_.write(message);
  };
  for (const Stream stream : kFilters) publish(stream);
  if (source.navigation.knows_truth()) publish(Stream::kTruth);
}

void NavigationFilterNode::report_counts(Gyro& source) {
  const navigation::NavigationCounts& now = source.navigation.counts();
  const std::int64_t time_ns = source.navigation.time().count();
  const std::string who = fmt::format("gyro {}: ", source.id);
  service::raise_grown(host_, kCountedEvents,
                       {.text = who, .gyro_id = source.id, .sensor_time_ns = time_ns},
                       source.reported, now);
  source.reported = now;
  const Phase phase = source.navigation.phase();
  if (phase != source.reported_phase) {
    source.reported_phase = phase;
    host_.raise({.code = std::string("phase_") + name(phase),
                 .severity = Severity::kInformation,
                 .text = who + name(phase),
                 .gyro_id = source.id,
                 .sensor_time_ns = time_ns});
  }
  report_truth(source);
  const auto& doubt = source.navigation.heading_doubt();
  if (doubt && !source.reported_doubt) {
    source.reported_doubt = true;
    host_.raise({.code = "heading_doubted",
                 .severity = Severity::kWarning,
                 .text = who + text(*doubt),
                 .gyro_id = source.id,
                 .sensor_time_ns = time_ns});
  }
  const auto compass = source.navigation.compass();
  if (!compass || source.reported_compass) return;
  source.reported_compass = true;
  const bool found = *compass == navigation::CompassVerdict::kFound;
  host_.raise({.code = found ? "heading_found" : "heading_unknown",
               .severity = found ? Severity::kInformation : Severity::kWarning,
               .text = who + std::string(navigation::text(*compass)),
               .gyro_id = source.id,
               .sensor_time_ns = time_ns});
}

void NavigationFilterNode::report_truth(Gyro& source) {
  const auto& doubt = source.navigation.truth_doubt();
  if (doubt && !source.reported_truth_doubt) {
    source.reported_truth_doubt = true;
    host_.raise({.code = "truth_doubted",
                 .severity = Severity::kWarning,
                 .text = fmt::format(
                     "gyro {}: no heading is judged: {}", source.id,
                     objection(*doubt, {.axes = {true, true, true}, .latitude_known = true})),
                 .gyro_id = source.id,
                 .sensor_time_ns = source.navigation.time().count()});
  }
  const core::SensorTime lost_at = source.navigation.truth_lost_at();
  if (lost_at == source.reported_truth_lost_at) return;
  source.reported_truth_lost_at = lost_at;
  if (lost_at == core::kNever) return;
  host_.raise(
      {.code = "truth_lost",
       .severity = Severity::kWarning,
       .text = fmt::format("gyro {}: true rates were missing for longer than is bridged; no "
                           "heading is judged any more until the filter starts anew",
                           source.id),
       .gyro_id = source.id,
       .sensor_time_ns = lost_at.count()});
}

struct NavigationFilterNode::Seen {
  std::uint32_t id = 0;
  bool truth = false;
  bool at_rest = false;
  Phase phase = Phase::kWaiting;
  double rest_s = 0.0;
  navigation::NavigationCounts counts{};
  std::array<navigation::StreamErrors, 2> errors{};
  std::array<navigation::StreamCounts, 2> streams{};
};

service::Status NavigationFilterNode::status() {
  std::vector<Seen> all;
  std::uint64_t strangers = 0;
  std::uint64_t unwritten = 0;
  bool paced = true;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, source] : gyros_.entries()) {
      const navigation::GyroNavigation& n = source.navigation;
      paced = paced && source.pace.is_waited_for();
      all.push_back({.id = id,
                     .truth = n.knows_truth(),
                     .at_rest = n.at_rest(),
                     .phase = n.phase(),
                     .rest_s = n.rest_s(),
                     .counts = n.counts(),
                     .errors = {n.errors(Stream::kRaw), n.errors(Stream::kCompensated)},
                     .streams = {n.counts(Stream::kRaw), n.counts(Stream::kCompensated)}});
    }
    strangers = stranger_samples_;
    unwritten = unwritten_;
  }
  if (strangers > reported_stranger_samples_) {
    host_.raise_counted(
        {.code = "too_many_gyros",
         .severity = Severity::kError,
         .text = fmt::format("{} gyros are navigated by (--max-gyros), the samples of others are "
                             "left out",
                             options_.max_gyros)},
        strangers - reported_stranger_samples_);
    reported_stranger_samples_ = strangers;
  }
  service::Status status;
  status.state = all.empty() ? service::State::kWaiting : service::State::kRunning;
  status.summary = core::counted(all.size(), "gyro");
  navigation::NavigationCounts sum;
  for (const Seen& seen : all) {
    sum.samples += seen.counts.samples;
    sum.gaps += seen.counts.gaps;
    sum.losses += seen.counts.losses;
    sum.duplicates += seen.counts.duplicates;
    sum.unusable += seen.counts.unusable;
    sum.time_restarts += seen.counts.time_restarts;
    sum.residuals += seen.counts.residuals;
    service::StatusPart part{.name = std::to_string(seen.id)};
    const auto add = [&](std::string metric, const char* unit, double value) {
      part.metrics.push_back({std::move(metric), unit, value});
    };
    add("phase", "1", static_cast<double>(seen.phase));
    add("at_rest", "1", seen.at_rest ? 1.0 : 0.0);
    add("rest", "s", seen.rest_s);
    add("references", "1", static_cast<double>(seen.counts.references));
    add("truth", "1", seen.truth ? 1.0 : 0.0);
    add("truth_missing", "1", static_cast<double>(seen.counts.truth_missing));
    for (const Stream stream : kFilters) {
      const auto i = static_cast<std::size_t>(stream);
      const std::string suffix = std::string("_") + name(stream);
      add("updates" + suffix, "1", static_cast<double>(seen.streams[i].updates));
      add("rejected" + suffix, "1", static_cast<double>(seen.streams[i].rejected));
      if (seen.errors[i].samples == 0) continue;
      if (seen.truth)
        add("heading_error" + suffix, "deg", seen.errors[i].heading_now / core::kRadPerDeg);
      add("heading_rms" + suffix, "deg", seen.errors[i].heading_rms() / core::kRadPerDeg);
      add("heading_largest" + suffix, "deg", seen.errors[i].heading_largest / core::kRadPerDeg);
    }
    if (seen.errors[1].heading_square_sum > 0.0)
      add("heading_ratio", "1", seen.errors[0].heading_rms() / seen.errors[1].heading_rms());
    status.parts.push_back(std::move(part));
  }
  status.flow = {.topic = dds::kCompensatedRate.name, .samples = sum.samples, .paced = paced};
  status.metrics = {{"samples", "1", static_cast<double>(sum.samples)},
                    {"gaps", "1", static_cast<double>(sum.gaps)},
                    {"losses", "1", static_cast<double>(sum.losses)},
                    {"duplicates", "1", static_cast<double>(sum.duplicates)},
                    {"unusable", "1", static_cast<double>(sum.unusable)},
                    {"time_restarts", "1", static_cast<double>(sum.time_restarts)},
                    {"residuals", "1", static_cast<double>(sum.residuals)},
                    {"unwritten", "1", static_cast<double>(unwritten)},
                    {"too_many_gyros", "1", static_cast<double>(strangers)}};
  const std::array<const service::HopLatency*, 2> hops{&delivery_latency_, &chain_latency_};
  const std::vector<service::Metric> latencies = service::latency_metrics(hops);
  status.metrics.insert(status.metrics.end(), latencies.begin(), latencies.end());
  status.parts.push_back(service::latency_part(hops));
  return status;
}

}  // namespace zerodrift::services
