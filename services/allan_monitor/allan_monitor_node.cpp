// SPDX-License-Identifier: Apache-2.0
#include "services/allan_monitor/allan_monitor_node.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/allan/coefficients.h"
#include "common/dds/conversions.h"
#include "common/service/main.h"
#include "common/service/monotonic_clock.h"

namespace zerodrift::services {

using core::index;
using core::kAxes;
using service::Severity;

namespace {

constexpr std::uint64_t kReportEvery = 32;  // samples between two progress reports
constexpr double kBlockS = 60.0;
constexpr double kSameIntervalWithin = 0.5;  // of an interval; farther apart in time is a gap
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMostPoints = 160;  // bound of allan_report's sequences

msg::BlockStatistics to_message(const allan::BlockStatistics& blocks, allan::Span span) {
  const auto moments = blocks.moments(span);
  msg::BlockStatistics message;
  message.block_s(blocks.block_s());
  message.mean_radps(moments.mean);
  message.std_radps(moments.standard_deviation);
  message.blocks(moments.blocks);
  return message;
}

std::vector<msg::AllanPoint> to_message(const std::vector<allan::AllanPoint>& points) {
  std::vector<msg::AllanPoint> messages;
  for (const auto& point : points) {
    if (messages.size() == kMostPoints) break;
    msg::AllanPoint message;
    message.tau_s(point.tau_s);
    message.deviation_radps(point.deviation_radps);
    message.lower_radps(point.lower_radps);
    message.upper_radps(point.upper_radps);
    message.degrees_of_freedom(point.degrees_of_freedom);
    message.pairs(point.pairs);
    messages.push_back(message);
  }
  return messages;
}

msg::NoiseCoefficient to_message(const allan::Coefficient& coefficient) {
  msg::NoiseCoefficient message;
  message.value(coefficient.value);
  message.lower(coefficient.lower);
  message.upper(coefficient.upper);
  message.identified(coefficient.identification == allan::Identification::kInterval ? 1 : 0);
  return message;
}

}  // namespace

AllanMonitorNode::AllanMonitorNode(const AllanMonitorOptions& options)
    : options_(options),
      host_("allan_monitor", options.network),
      writer_(host_.participant(), host_.observer()),
      progress_(host_.participant(), "allan_monitor"),
      reader_(
          host_.participant(),
          [this](const msg::CompensatedRate& m, const dds::SampleOrigin&) { on_sample(m); },
          host_.observer()) {}

void AllanMonitorNode::run() {
  host_.run([this] { return status(); }, [this] { tick(); },
            [] { service::end_within(service::kStopWithin, service::kExitDone); });
}

AllanMonitorNode::Gyro& AllanMonitorNode::gyro(std::uint32_t gyro_id) {
  for (auto& known : gyros_) {
    if (known->id == gyro_id) return *known;
  }
  gyros_.push_back(std::make_unique<Gyro>());
  gyros_.back()->id = gyro_id;
  return *gyros_.back();
}

void AllanMonitorNode::on_sample(const msg::CompensatedRate& message) {
  const std::lock_guard lock(mutex_);
  Gyro& source = gyro(message.gyro_id());
  chain_latency_.record(service::monotonic_ns() - message.publish_time_ns());
  const core::SensorTime time{message.sensor_time_ns()};
  std::uint64_t missing = 0;
  if (source.interval_s <= 0.0) {
    start(source, message);
    if (source.interval_s <= 0.0) return;
  } else if (message.order() != 0 || time <= source.newest) {
    ++source.out_of_order;  // its place in the stream has passed: it stays a gap
    return;
  } else {
    const double steps = core::seconds(time - source.newest) / source.interval_s;
    if (steps > 1.0 + kSameIntervalWithin)
      missing = static_cast<std::uint64_t>(std::llround(steps)) - 1;
  }
  feed(source, message, missing);
  source.newest = time;
  source.newest_sequence =
      std::max<std::uint64_t>(source.newest_sequence, message.sequence_number());
  ++source.samples;
  if (missing > 0) ++source.gaps;
  if (source.paced && ++source.since_report >= kReportEvery) report_progress(source);
}

void AllanMonitorNode::start(Gyro& source, const msg::CompensatedRate& message) {
  source.interval_s = dds::from_message(message).raw.interval_s;
  source.paced = core::is_paced_by_consumers(dds::from_message(message).raw.clock);
  if (source.interval_s <= 0.0) return;
  allan::RollingAllanOptions deviations;
  deviations.sample_interval_s = source.interval_s;
  deviations.window_s = std::max(options_.window_s, 64.0 * source.interval_s);
  deviations.longest_tau_s = std::max(options_.longest_tau_s, 16.0 * source.interval_s);
  allan::BlockStatisticsOptions blocks;
  blocks.sample_interval_s = source.interval_s;
  blocks.block_s = std::max(kBlockS, source.interval_s);
  blocks.window_s = std::max(options_.window_s, blocks.block_s);
  for (auto& axis : source.axes) {
    axis.raw.emplace(deviations, blocks);
    axis.compensated.emplace(deviations, blocks);
  }
}

void AllanMonitorNode::feed(Gyro& source, const msg::CompensatedRate& message,
                            std::uint64_t missing) {
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    Axis& statistics = source.axes[i];
    const bool valid = (message.validity() >> i & 1U) != 0;
    const double compensated = valid ? message.rate_radps()[i] : kNone;
    const double raw = valid ? compensated + message.applied_drift_radps()[i] : kNone;
    if (missing > 0) {
      statistics.raw->deviations.gap(missing);
      statistics.compensated->deviations.gap(missing);
    }
    statistics.raw->deviations.add(raw);
    statistics.compensated->deviations.add(compensated);
    statistics.compensating = statistics.compensating || (valid && message.mode()[i] != 0);
    if (!statistics.compensating) continue;
    if (missing > 0) {
      statistics.raw->blocks.gap(missing);
      statistics.compensated->blocks.gap(missing);
    }
    statistics.raw->blocks.add(raw);
    statistics.compensated->blocks.add(compensated);
  }
}

void AllanMonitorNode::report_progress(Gyro& source) {
  source.since_report = 0;
  // It needs no temperatures: a time that nobody waits for.
  progress_.report(source.id, source.newest_sequence, core::kNever);
}

void AllanMonitorNode::tick() {
  progress_.announce();
  const std::int64_t now = service::monotonic_ns();
  const bool due = static_cast<double>(now - reported_ns_) >= options_.period_s * 1e9;
  if (due) reported_ns_ = now;
  const std::lock_guard lock(mutex_);
  for (const auto& source : gyros_) {
    if (source->paced && source->samples > 0) report_progress(*source);
    if (!due || source->interval_s <= 0.0) continue;
    for (const auto axis : kAxes) {
      const Axis& statistics = source->axes[index(axis)];
      if (statistics.raw->deviations.samples() == 0) continue;
      publish(*source, axis, 0, *statistics.raw);
      publish(*source, axis, 1, *statistics.compensated);
    }
  }
}

void AllanMonitorNode::publish(const Gyro& source, core::Axis axis, std::uint32_t stream,
                               const Stream& statistics) {
  const auto since_start = statistics.deviations.points(allan::Span::kSinceStart);
  msg::AllanReport report;
  report.gyro_id(source.id);
  report.axis(static_cast<std::uint32_t>(index(axis)));
  report.stream(stream);
  report.gaps(static_cast<std::uint32_t>(statistics.deviations.gaps()));
  report.sensor_time_ns(source.newest.count());
  report.samples(statistics.deviations.samples());
  report.sample_interval_s(source.interval_s);
  report.window_s(options_.window_s);
  report.since_start_blocks(to_message(statistics.blocks, allan::Span::kSinceStart));
  report.rolling_blocks(to_message(statistics.blocks, allan::Span::kRolling));
  const auto fit = allan::fit_coefficients(since_start);
  report.angle_random_walk(to_message(fit[allan::NoiseTerm::kAngleRandomWalk]));
  report.bias_instability(to_message(fit[allan::NoiseTerm::kBiasInstability]));
  report.rate_random_walk(to_message(fit[allan::NoiseTerm::kRateRandomWalk]));
  report.since_start(to_message(since_start));
  report.rolling(to_message(statistics.deviations.points(allan::Span::kRolling)));
  writer_.write(report);
}

service::Status AllanMonitorNode::status() {
  service::Status status;
  const std::lock_guard lock(mutex_);
  double samples = 0.0;
  double gaps = 0.0;
  double late = 0.0;
  for (const auto& source : gyros_) {
    samples += static_cast<double>(source->samples);
    gaps += static_cast<double>(source->gaps);
    late += static_cast<double>(source->out_of_order);
  }
  status.state = gyros_.empty() ? service::State::kWaiting : service::State::kRunning;
  status.metrics = {
      {"samples", "1", samples},
      {"gaps", "1", gaps},
      {"out_of_order", "1", late},
      {"chain_p50", "us", static_cast<double>(chain_latency_.percentile_ns(0.5)) * 1e-3},
      {"chain_p99", "us", static_cast<double>(chain_latency_.percentile_ns(0.99)) * 1e-3}};
  status.summary = std::to_string(gyros_.size()) + " gyro(s)";
  return status;
}

}  // namespace zerodrift::services
