// SPDX-License-Identifier: Apache-2.0
#include "services/allan_monitor/allan_monitor_node.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/core/counted.h"
#include "common/core/not_known.h"
#include "common/dds/conversions.h"
#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
#include "services/allan_monitor/report_message.h"

namespace zerodrift::services {

using allan::Arrival;
using allan::Excess;
using core::index;
using core::kAxes;
using service::Severity;
using Output = allan::StuckDetector::Output;

namespace {

constexpr std::size_t kMostStrangers = 1024;        // whose replays are paced all the same
constexpr std::int64_t kRepeatNs = 10'000'000'000;  // between two events of what keeps happening
constexpr double kMicro = 1e-3;                     // of a nanosecond count

allan::StreamStatisticsOptions stream_options(const AllanMonitorOptions& options,
                                              double interval_s) {
  allan::StreamStatisticsOptions result;
  result.sample_interval_s = interval_s;
  result.window_s = options.window_s;
  result.longest_tau_s = options.longest_tau_s;
  return result;
}

// At every spacing that samples may have, so that the first one finds nothing wrong.
const AllanMonitorOptions& checked(const AllanMonitorOptions& options) {
  for (const double interval_s :
       {allan::StreamTiming::kShortestIntervalS, allan::StreamTiming::kLongestIntervalS}) {
    if (const auto error = stream_options(options, interval_s).validate()) {
      throw std::invalid_argument("--window, --longest-tau: of samples " +
                                  fmt::format("{:.6g} s apart ", interval_s) + *error);
    }
  }
  return options;
}

std::string code_of(const char* what, core::Axis axis) {
  return std::string(what) + "_" + std::string(core::name(axis));
}

}  // namespace

AllanMonitorNode::AllanMonitorNode(const AllanMonitorOptions& options)
    : options_(checked(options)),
      host_("allan_monitor", options.network, options.supervision),
      gyros_(options.max_gyros),
      stranger_paces_(kMostStrangers),
      writer_(host_.participant(), host_.observer()),
      progress_(host_.participant(), "allan_monitor"),
      reader_(
          host_.participant(),
          [this](const msg::CompensatedRate& m, const dds::SampleOrigin&) { on_sample(m); },
          host_.observer()) {}

int AllanMonitorNode::run() {
  return host_.run([this] { return status(); }, [this] { tick(); },
                   [this] { service::end_within(service::kStopWithin, host_.exit_code()); });
}

// ---------------------------------------- samples

void AllanMonitorNode::on_sample(const msg::CompensatedRate& message) {
  const std::int64_t arrival_ns = service::monotonic_ns();
  const std::lock_guard lock(mutex_);
  const auto sample = dds::from_message(message);
  Gyro* source = gyros_.find_or_make(message.gyro_id(), message.gyro_id());
  if (source == nullptr) {
    leave_out(sample, message.gyro_id());
    return;
  }
  delivery_latency_.record_between(message.egress_time_ns(), arrival_ns);
  chain_latency_.record_between(message.publish_time_ns(), arrival_ns);
  keep_pace(source->id, source->pace, sample);
  if (sample.late) {
    ++source->statistics.counts.out_of_order;  // its place in the stream has passed: it stays a gap
    return;
  }
  place(*source, sample);
}

// A replay waits for this consumer, whether it has a use for the gyro or not.
void AllanMonitorNode::leave_out(const core::CompensatedSample& sample, std::uint32_t gyro_id) {
  newest_stranger_ = gyro_id;
  if (auto* pace = stranger_paces_.find_or_make(gyro_id)) keep_pace(gyro_id, *pace, sample);
}

// Samples that the statistics leave out were taken all the same.
void AllanMonitorNode::keep_pace(std::uint32_t gyro_id, service::ConsumerPace& pace,
                                 const core::CompensatedSample& sample) {
  const bool is_paced = core::is_paced_by_consumers(sample.raw.clock);
  if (pace.take(sample.raw.sequence, is_paced, sample.late)) report_progress(gyro_id, pace);
}

void AllanMonitorNode::place(Gyro& source, const core::CompensatedSample& sample) {
  Counts& counts = source.statistics.counts;
  const allan::Placement placement = source.timing.place(sample.raw.time, sample.raw.interval_s);
  switch (placement.arrival) {
    case Arrival::kRefused:
    case Arrival::kOtherInterval: ++counts.refused; return;
    case Arrival::kDuplicate: ++counts.duplicates; return;
    case Arrival::kBehind: ++counts.out_of_order; return;
    case Arrival::kTimeRestarted: ++counts.time_restarts; break;
    case Arrival::kFirst:
    case Arrival::kNewRate: start(source); break;
    case Arrival::kNext: break;
  }
  if (placement.missing > 0) {
    const double gap_s = static_cast<double>(placement.missing) * source.timing.mean_interval_s();
    ++counts.gaps;
    counts.missing_s += gap_s;
    counts.longest_gap_s = std::max(counts.longest_gap_s, gap_s);
  }
  feed(source, sample, placement.missing);
  source.statistics.interval_s = source.timing.mean_interval_s();
  source.statistics.newest = sample.raw.time;
  ++counts.samples;
}

void AllanMonitorNode::start(Gyro& source) {
  ++source.statistics.counts.starts;
  const auto options = stream_options(options_, source.timing.interval_s());
  for (auto& axis : source.statistics.axes) {
    axis.raw.emplace(options);
    axis.compensated.emplace(options);
    axis.compensating = false;
  }
}

void AllanMonitorNode::feed(Gyro& source, const core::CompensatedSample& sample,
                            std::uint64_t missing) {
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    Axis& statistics = source.statistics.axes[i];
    const bool valid = sample.raw.valid[i];
    if (!valid && statistics.raw->samples() > 0) ++statistics.invalid;
    if (!statistics.compensating && valid && sample.mode[i] != core::Mode::kPassthrough) {
      begin_compensated(statistics, source.timing.interval_s());
    }
    statistics.raw->gap(missing);
    statistics.compensated->gap(missing);
    statistics.raw->add(valid ? sample.raw.rate_radps[i] : core::kNaN);
    statistics.compensated->add(valid ? sample.rate_radps[i] : core::kNaN);
  }
}

// The first correction is a step of the whole drift: both streams begin behind it, or the
// compensated one would look noisier than the raw one for hours.
void AllanMonitorNode::begin_compensated(Axis& axis, double interval_s) {
  axis.compensating = true;
  if (axis.raw->samples() > 0) {
    const auto options = stream_options(options_, interval_s);
    axis.raw.emplace(options);
    axis.compensated.emplace(options);
  }
  axis.raw->begin_blocks();
  axis.compensated->begin_blocks();
}

void AllanMonitorNode::report_progress(std::uint32_t gyro_id, service::ConsumerPace& pace) {
  pace.note_report();
  // It needs no temperatures: a time that nobody waits for.
  progress_.report(gyro_id, pace.newest_sequence(), core::kNever);
}

// ---------------------------------------- reports

void AllanMonitorNode::tick() {
  report_all_progress();
  const std::int64_t now = service::monotonic_ns();
  const bool due =
      !reported_ns_ || static_cast<double>(now - *reported_ns_) >= options_.period_s * 1e9;
  const std::vector<Watch*> watches = copy_statistics(due);
  if (watches.empty()) return;
  reported_ns_ = now;
  for (Watch* watch : watches) report(*watch);
  report_cost_ns_ = service::monotonic_ns() - now;
}

// Also to replays that come later, and of what came since the last round number.
void AllanMonitorNode::report_all_progress() {
  const std::lock_guard lock(mutex_);
  progress_.announce();
  for (auto& [id, source] : gyros_.entries()) {
    if (source.pace.is_waited_for()) report_progress(id, source.pace);
  }
  for (auto& [id, pace] : stranger_paces_.entries()) {
    if (pace.is_waited_for()) report_progress(id, pace);
  }
}

// The lock is held for one gyro at a time.
std::vector<AllanMonitorNode::Watch*> AllanMonitorNode::copy_statistics(bool due) {
  std::vector<Gyro*> known;
  {
    const std::lock_guard lock(mutex_);
    for (auto& [id, source] : gyros_.entries()) known.push_back(&source);
  }
  std::vector<Watch*> copied;
  for (Gyro* source : known) {
    Watch& watch = watches_[source->id];
    watch.gyro = source;
    const std::lock_guard lock(mutex_);
    if (watch.gyro->statistics.counts.samples == 0 && watch.gyro->statistics.counts.refused == 0)
      continue;
    if (!due) continue;
    const std::int64_t began_ns = service::monotonic_ns();
    watch.statistics = watch.gyro->statistics;
    copy_cost_ns_ = std::max(copy_cost_ns_, service::monotonic_ns() - began_ns);
    copied.push_back(&watch);
  }
  return copied;
}

void AllanMonitorNode::report(Watch& watch) {
  report_stream(watch);
  for (const auto axis : kAxes) {
    const auto& statistics = watch.statistics.axes[index(axis)];
    if (statistics.raw && statistics.raw->samples() > 0) report(watch, axis);
  }
}

void AllanMonitorNode::report(Watch& watch, core::Axis axis) {
  const auto& statistics = watch.statistics.axes[index(axis)];
  AxisWatch& watched = watch.axes[index(axis)];
  if (statistics.compensating && !watched.compensating) {
    watched.compensating = true;
    watched.growth.fill(allan::GrowthWatch());
    watched.worse = allan::ExcessWatch();
  }
  const double interval_s = watch.statistics.interval_s;
  const allan::StreamReport raw = statistics.raw->report(interval_s);
  const allan::StreamReport compensated = statistics.compensated->report(interval_s);
  report_noise(watch, axis, raw, compensated);
  report_output(watch, axis, raw);
  publish(watch, axis, Stream::kRaw, raw);
  publish(watch, axis, Stream::kCompensated, compensated);
}

void AllanMonitorNode::publish(const Watch& watch, core::Axis axis, Stream stream,
                               const allan::StreamReport& report) {
  const AxisWatch& verdicts = watch.axes[index(axis)];
  const bool is_raw = stream == Stream::kRaw;
  msg::AllanReport message = to_message(report);
  message.gyro_id(watch.gyro->id);
  message.axis(static_cast<std::uint32_t>(index(axis)));
  message.stream(static_cast<std::uint32_t>(stream));
  message.sensor_time_ns(watch.statistics.newest.count());
  message.noise_grown(verdicts.growth[static_cast<std::size_t>(stream)].grown() ? 1 : 0);
  message.stuck(is_raw && verdicts.output == Output::kStuck ? 1 : 0);
  message.worse_than_raw(!is_raw && verdicts.worse.exceeds() ? 1 : 0);
  writer_.write(message);
}

// ---------------------------------------- events

void AllanMonitorNode::report_noise(Watch& watch, core::Axis axis, const allan::StreamReport& raw,
                                    const allan::StreamReport& compensated) {
  AxisWatch& watched = watch.axes[index(axis)];
  const auto report_finding = [&](const allan::Finding& finding, Stream stream, const char* began,
                                  const char* ended, auto began_text, auto ended_text) {
    if (finding.excess == Excess::kNone || finding.excess == Excess::kLasts) return;
    const bool begins = finding.excess == Excess::kBegan;
    raise(watch, code_of(begins ? began : ended, axis),
          begins ? Severity::kWarning : Severity::kInformation,
          subject(watch.gyro->id, axis, stream) +
              (begins ? began_text : ended_text)(finding, raw.window_s));
  };
  const auto look = [&](Stream stream, const allan::StreamReport& report) {
    return watched.growth[static_cast<std::size_t>(stream)].look(
        report.since_start, report.rolling, report.observed_s(), report.window_s);
  };
  report_finding(look(Stream::kRaw, raw), Stream::kRaw, "noise_grew_raw", "noise_normal_raw",
                 noise_grew, noise_is_back);
  report_finding(look(Stream::kCompensated, compensated), Stream::kCompensated,
                 "noise_grew_compensated", "noise_normal_compensated", noise_grew, noise_is_back);
  report_finding(
      watched.worse.look(paired(compensated.rolling, raw.rolling), compensated.observed_s()),
      Stream::kCompensated, "compensation_harms", "compensation_harms_no_more", worse_than_raw,
      no_longer_worse);
}

void AllanMonitorNode::report_output(Watch& watch, core::Axis axis,
                                     const allan::StreamReport& raw) {
  AxisWatch& watched = watch.axes[index(axis)];
  if (raw.output != watched.output) {
    watched.output = raw.output;
    const bool stuck = raw.output == Output::kStuck;
    raise(watch, code_of(stuck ? "output_stuck" : "output_moves", axis),
          stuck ? Severity::kError : Severity::kInformation,
          subject(watch.gyro->id, axis, Stream::kRaw) +
              (stuck ? "the output does not move: the same value for longer than its noise explains"
                     : "the output moves again"));
  }
  const auto& statistics = watch.statistics.axes[index(axis)];
  report_counted(watch, code_of("invalid_sample", axis),
                 subject(watch.gyro->id, axis, Stream::kRaw) +
                     fmt::format("{} samples were no number or marked invalid; gaps in their place",
                                 statistics.invalid),
                 statistics.invalid, watched.invalid);
}

// A new interval is reported before anything that is found with it.
void AllanMonitorNode::report_stream(Watch& watch) {
  const Statistics& now = watch.statistics;
  const Counts& counts = now.counts;
  const std::string who = fmt::format("gyro {}: ", watch.gyro->id);
  if (counts.starts != watch.starts.count) {
    if (watch.starts.count > 0) {
      raise(watch, "interval_changed", Severity::kWarning,
            who + fmt::format("the sample interval is {:.6g} s, was {:.6g} s; all its Allan "
                              "statistics begin anew",
                              now.interval_s, watch.reported_interval_s));
    }
    watch.starts.count = counts.starts;
    watch.reported_interval_s = now.interval_s;
    for (AxisWatch& axis : watch.axes) {
      axis.growth.fill(allan::GrowthWatch());
      axis.worse = allan::ExcessWatch();
      axis.compensating = false;
    }
  }
  report_counted(watch, "gap",
                 who + fmt::format("{} gap(s) in the stream, {:.6g} s missing in all, the longest "
                                   "{:.6g} s; no difference reaches across one",
                                   counts.gaps, counts.missing_s, counts.longest_gap_s),
                 counts.gaps, watch.gaps);
  report_counted(watch, "time_backwards",
                 who + fmt::format("{} sample(s) came late or with an earlier time; left out",
                                   counts.out_of_order),
                 counts.out_of_order, watch.out_of_order);
  report_counted(
      watch, "duplicate_time",
      who + fmt::format("{} sample(s) with a time that was there; left out", counts.duplicates),
      counts.duplicates, watch.duplicates);
  report_counted(
      watch, "interval_refused",
      who + fmt::format("{} sample(s) whose interval was neither the stream's then nor the time "
                        "since the one before, or not from {:.6g} to {:.6g} s; left out",
                        counts.refused, allan::StreamTiming::kShortestIntervalS,
                        allan::StreamTiming::kLongestIntervalS),
      counts.refused, watch.refused);
  report_counted(watch, "time_restarted",
                 who + "sensor time began anew; the stream goes on after a gap",
                 counts.time_restarts, watch.time_restarts);
}

void AllanMonitorNode::raise(const Watch& watch, std::string code, Severity severity,
                             std::string text, std::uint64_t times) {
  host_.raise_counted({.code = std::move(code),
                       .severity = severity,
                       .text = std::move(text),
                       .gyro_id = watch.gyro->id,
                       .sensor_time_ns = watch.statistics.newest.count()},
                      times);
}

// The first at once, then what came in ten seconds in one.
void AllanMonitorNode::report_counted(const Watch& watch, std::string code, const std::string& text,
                                      std::uint64_t count, Reported& reported) {
  if (count == reported.count) return;
  const std::int64_t now = service::monotonic_ns();
  if (reported.count > 0 && now - reported.at_ns < kRepeatNs) return;
  raise(watch, std::move(code), Severity::kWarning, text, count - reported.count);
  reported = {count, now};
}

service::Status AllanMonitorNode::status() {
  service::Status status;
  Counts sum;
  std::uint64_t strangers = 0;
  std::uint32_t newest_stranger = 0;
  std::size_t gyros = 0;
  bool paced = true;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, source] : gyros_.entries()) {
      paced = paced && source.pace.is_waited_for();
      const Counts& counts = source.statistics.counts;
      sum.samples += counts.samples;
      sum.gaps += counts.gaps;
      sum.out_of_order += counts.out_of_order;
      sum.duplicates += counts.duplicates;
      sum.refused += counts.refused;
      sum.starts += counts.starts;
    }
    gyros = gyros_.size();
    strangers = gyros_.refused();
    newest_stranger = newest_stranger_;
  }
  if (strangers > reported_strangers_.count) {
    host_.raise_counted(
        {.code = "too_many_gyros",
         .severity = Severity::kError,
         .text = fmt::format("gyro {} is one too many: {} gyros are watched (--max-gyros), the "
                             "samples of others are left out",
                             newest_stranger, options_.max_gyros)},
        strangers - reported_strangers_.count);
    reported_strangers_.count = strangers;
  }
  status.state = gyros == 0 ? service::State::kWaiting : service::State::kRunning;
  status.metrics = {{"samples", "1", static_cast<double>(sum.samples)},
                    {"gaps", "1", static_cast<double>(sum.gaps)},
                    {"out_of_order", "1", static_cast<double>(sum.out_of_order)},
                    {"duplicates", "1", static_cast<double>(sum.duplicates)},
                    {"refused", "1", static_cast<double>(sum.refused)},
                    {"too_many_gyros", "1", static_cast<double>(strangers)},
                    {"starts", "1", static_cast<double>(sum.starts)},
                    {"report_cost", "us", static_cast<double>(report_cost_ns_) * kMicro},
                    {"copy_cost", "us", static_cast<double>(copy_cost_ns_) * kMicro}};
  const std::array<const service::HopLatency*, 2> hops{&delivery_latency_, &chain_latency_};
  const std::vector<service::Metric> latencies = service::latency_metrics(hops);
  status.metrics.insert(status.metrics.end(), latencies.begin(), latencies.end());
  status.parts.push_back(service::latency_part(hops));
  status.summary = core::counted(gyros, "gyro");
  status.flow = {.topic = dds::kCompensatedRate.name, .samples = sum.samples, .paced = paced};
  return status;
}

}  // namespace zerodrift::services
