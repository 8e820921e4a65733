// SPDX-License-Identifier: Apache-2.0
#include "services/console/telemetry.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/allan/noise_units.h"
#include "common/compensation/thermal_coverage.h"
#include "common/core/mode.h"
#include "common/core/not_known.h"
#include "common/core/one_line.h"
#include "common/core/samples.h"
#include "common/core/time.h"
#include "common/core/units.h"

namespace zerodrift::services {

using core::deg_h_from_radps;

namespace {

using core::kNaN;
using core::kNsPerS;
constexpr std::int64_t kLongestWayNs = 60 * kNsPerS;  // a replay's sample may wait
constexpr double kSecondsPerMinute = 60.0;
constexpr double kArcsecPerRad = 3600.0 / core::kRadPerDeg;
constexpr double kMicrosecondsPerNs = 1e-3;

double deg(double rad) {
  return rad / core::kRadPerDeg;
}

namespace {

template <typename Of>
void set_axes(telemetry::Vector3& out, Of of) {
  out.set_x(of(0));
  out.set_y(of(1));
  out.set_z(of(2));
}

template <typename Array>
void set_deg_h(telemetry::Vector3& out, const Array& radps) {
  set_axes(out, [&](std::size_t i) { return deg_h_from_radps(radps[i]); });
}

void set_sigma(telemetry::Vector3& out, const msg::CompensatedRate& sample) {
  out.set_x(sigma_deg_h(sample.drift_variance_radps2()[0]));
  out.set_y(sigma_deg_h(sample.drift_variance_radps2()[1]));
  out.set_z(sigma_deg_h(sample.drift_variance_radps2()[2]));
}

void set_coefficient(telemetry::AllanReport& out, const char* symbol, const char* unit,
                     double per_si, const msg::NoiseCoefficient& from) {
  auto& coefficient = *out.add_coefficients();
  coefficient.set_symbol(symbol);
  coefficient.set_unit(unit);
  coefficient.set_value(from.value() * per_si);
  coefficient.set_lower(from.lower() * per_si);
  coefficient.set_upper(from.upper() * per_si);
  coefficient.set_identified(static_cast<std::uint32_t>(from.identified()));
}

void set_point(telemetry::AllanPoint& out, const msg::AllanPoint& from) {
  out.set_tau_s(from.tau_s());
  out.set_deviation_deg_h(deg_h_from_radps(from.deviation_radps()));
  out.set_lower_deg_h(deg_h_from_radps(from.lower_radps()));
  out.set_upper_deg_h(deg_h_from_radps(from.upper_radps()));
  out.set_degrees_of_freedom(from.degrees_of_freedom());
  out.set_noise_exponent(from.noise_exponent());
}

double seconds_or_nan(std::chrono::nanoseconds duration) {
  return dds::is_endless(duration) ? kNaN : std::chrono::duration<double>(duration).count();
}

}  // namespace

}  // namespace

void set_time(google::protobuf::Timestamp& out, std::int64_t time_ns) {
  const std::int64_t rest = time_ns % kNsPerS;
  out.set_seconds(time_ns / kNsPerS - (rest < 0 ? 1 : 0));
  out.set_nanos(static_cast<std::int32_t>(rest < 0 ? rest + kNsPerS : rest));
}

std::int64_t time_ns(const google::protobuf::Timestamp& time) {
  return time.seconds() * kNsPerS + time.nanos();
}

double sigma_deg_h(double variance_radps2) {
  return variance_radps2 >= 0.0 ? deg_h_from_radps(std::sqrt(variance_radps2)) : kNaN;
}

bool is_valid(const msg::CompensatedRate& sample, std::size_t axis) {
  return (sample.validity() >> axis & 1U) != 0 && core::is_rate(sample.rate_radps()[axis]);
}

double raw_deg_h(const msg::CompensatedRate& sample, std::size_t axis) {
  if (!is_valid(sample, axis)) return kNaN;
  return deg_h_from_radps(sample.rate_radps()[axis] + sample.applied_drift_radps()[axis]);
}

double compensated_deg_h(const msg::CompensatedRate& sample, std::size_t axis) {
  return is_valid(sample, axis) ? deg_h_from_radps(sample.rate_radps()[axis]) : kNaN;
}

double degc_per_min(double degc_per_s) {
  return degc_per_s * kSecondsPerMinute;
}

std::int64_t publish_unix_ns(const msg::CompensatedRate& sample,
                             const service::ArrivalClocks& arrival) {
  std::int64_t way_ns = 0;
  const bool overflows =
      __builtin_sub_overflow(arrival.monotonic_ns, sample.publish_time_ns(), &way_ns);
  if (overflows || sample.publish_time_ns() == 0 || way_ns < 0 || way_ns > kLongestWayNs) return 0;
  return arrival.unix_ns - way_ns;
}

telemetry::AxisState axis_state(const msg::CompensatedRate& sample, std::size_t axis) {
  telemetry::AxisState state;
  const auto mode = static_cast<core::Mode>(sample.mode()[axis]);
  state.set_mode(static_cast<telemetry::Mode>(sample.mode()[axis]));
  const auto reason = static_cast<core::Reason>(sample.reason()[axis]);
  if (reason != core::Reason::kNone || mode != core::Mode::kLearning)
    state.set_reason(std::string(core::name(reason)));
  state.set_rung(std::string(core::name(static_cast<core::Rung>(sample.rung()[axis]))));
  return state;
}

telemetry::CompensatedRate to_telemetry(const msg::CompensatedRate& sample) {
  telemetry::CompensatedRate out;
  set_time(*out.mutable_timestamp(), sample.sensor_time_ns());
  out.set_gyro_id(sample.gyro_id());
  out.set_sequence_number(sample.sequence_number());
  set_axes(*out.mutable_raw_deg_h(), [&](std::size_t i) { return raw_deg_h(sample, i); });
  set_axes(*out.mutable_compensated_deg_h(),
           [&](std::size_t i) { return compensated_deg_h(sample, i); });
  set_deg_h(*out.mutable_drift_deg_h(), sample.applied_drift_radps());
  set_sigma(*out.mutable_drift_sigma_deg_h(), sample);
  *out.mutable_x() = axis_state(sample, 0);
  *out.mutable_y() = axis_state(sample, 1);
  *out.mutable_z() = axis_state(sample, 2);
  out.set_model_epoch(sample.model_epoch());
  out.set_validity(sample.validity());
  out.set_instance(sample.instance());
  out.set_answered(sample.answered());
  std::int64_t way_ns = 0;
  const bool compares =
      !__builtin_sub_overflow(sample.egress_time_ns(), sample.publish_time_ns(), &way_ns) &&
      sample.publish_time_ns() != 0 && way_ns >= 0 && way_ns <= kLongestWayNs;
  out.set_latency_us(compares ? static_cast<double>(way_ns) * kMicrosecondsPerNs : kNaN);
  return out;
}

void append(const msg::CompensatedRate& sample, telemetry::SampleBatch& batch) {
  batch.add_sensor_time_ns(sample.sensor_time_ns());
  batch.add_raw_x_deg_h(raw_deg_h(sample, 0));
  batch.add_raw_y_deg_h(raw_deg_h(sample, 1));
  batch.add_raw_z_deg_h(raw_deg_h(sample, 2));
  batch.add_compensated_x_deg_h(compensated_deg_h(sample, 0));
  batch.add_compensated_y_deg_h(compensated_deg_h(sample, 1));
  batch.add_compensated_z_deg_h(compensated_deg_h(sample, 2));
}

void set_newest(const msg::CompensatedRate& sample, const service::ArrivalClocks& arrival,
                telemetry::SampleBatch& batch) {
  batch.set_gyro_id(sample.gyro_id());
  *batch.mutable_x() = axis_state(sample, 0);
  *batch.mutable_y() = axis_state(sample, 1);
  *batch.mutable_z() = axis_state(sample, 2);
  set_sigma(*batch.mutable_drift_sigma_deg_h(), sample);
  batch.set_model_epoch(sample.model_epoch());
  batch.set_sequence_number(sample.sequence_number());
  batch.set_validity(sample.validity());
  batch.set_instance(sample.instance());
  batch.set_answered(sample.answered());
  batch.set_publish_unix_ns(publish_unix_ns(sample, arrival));
  batch.set_sample_interval_s(sample.interval_s());
}

telemetry::AllanReport to_telemetry(const msg::AllanReport& report) {
  telemetry::AllanReport out;
  set_time(*out.mutable_timestamp(), report.sensor_time_ns());
  out.set_gyro_id(report.gyro_id());
  out.set_axis(report.axis());
  out.set_stream(report.stream());
  out.set_samples(report.samples());
  out.set_sample_interval_s(report.sample_interval_s());
  out.set_window_s(report.window_s());
  for (const auto& point : report.since_start()) set_point(*out.add_since_start(), point);
  for (const auto& point : report.rolling()) set_point(*out.add_rolling(), point);
  set_coefficient(out, "Q", "arcsec", kArcsecPerRad, report.quantization());
  set_coefficient(out, "N", "deg/sqrt(h)", allan::kDegPerRootHour, report.angle_random_walk());
  set_coefficient(out, "B", "deg/h", deg_h_from_radps(1.0), report.bias_instability());
  set_coefficient(out, "K", "deg/h/sqrt(h)", allan::kDegPerHourPerRootHour,
                  report.rate_random_walk());
  set_coefficient(out, "R", "deg/h^2", allan::kDegPerHourPerHour, report.rate_ramp());
  out.set_reduced_chi_square(report.reduced_chi_square());
  out.set_gaps(report.gaps());
  out.set_missing(report.missing());
  out.set_stuck(report.stuck() != 0);
  out.set_noise_grown(report.noise_grown() != 0);
  out.set_worse_than_raw(report.worse_than_raw() != 0);
  out.set_block_s(report.since_start_blocks().block_s());
  out.set_since_start_block_std_deg_h(deg_h_from_radps(report.since_start_blocks().std_radps()));
  out.set_rolling_block_std_deg_h(deg_h_from_radps(report.rolling_blocks().std_radps()));
  out.set_block_count(report.since_start_blocks().blocks());
  return out;
}

telemetry::NavigationState to_telemetry(const msg::NavigationState& state) {
  telemetry::NavigationState out;
  set_time(*out.mutable_timestamp(), state.sensor_time_ns());
  out.set_gyro_id(state.gyro_id());
  out.set_stream(state.stream());
  out.set_phase(state.phase());
  out.set_at_rest(state.at_rest() != 0);
  out.set_heading_deg(deg(state.heading_rad()));
  out.set_roll_deg(deg(state.roll_rad()));
  out.set_pitch_deg(deg(state.pitch_rad()));
  out.set_heading_sigma_deg(deg(state.attitude_sigma_rad()[2]));
  out.set_heading_error_deg(deg(state.heading_error_rad()));
  out.set_attitude_error_deg(deg(state.attitude_error_rad()));
  set_deg_h(*out.mutable_gyro_bias_deg_h(), state.gyro_bias_radps());
  set_deg_h(*out.mutable_gyro_bias_sigma_deg_h(), state.gyro_bias_sigma_radps());
  out.set_updates(state.updates());
  out.set_rejected(state.rejected());
  return out;
}

telemetry::TwinReport to_telemetry(const msg::TwinReport& report) {
  telemetry::TwinReport out;
  set_time(*out.mutable_timestamp(), report.sensor_time_ns());
  out.set_gyro_id(report.gyro_id());
  out.set_axis(report.axis());
  out.set_verdict(core::one_line(report.verdict().c_str()));
  out.set_model(core::one_line(report.model().c_str()));
  out.set_record(core::one_line(report.record().c_str()));
  out.set_text(core::one_line(report.text().c_str()));
  out.set_next_experiment(core::one_line(report.next_experiment().c_str()));
  out.set_input(core::one_line(report.input().c_str()));
  out.set_held_out(report.held_out() != 0);
  out.set_before_rms_deg_h(deg_h_from_radps(report.before_rms_radps()));
  out.set_after_rms_deg_h(deg_h_from_radps(report.after_rms_radps()));
  out.set_noise_floor_rms_deg_h(deg_h_from_radps(report.noise_floor_rms_radps()));
  for (const auto& effect : report.effects()) {
    auto& named = *out.add_effects();
    named.set_name(core::one_line(effect.name().c_str()));
    for (const auto& other : effect.alternatives()) {
      auto& alternative = *named.add_alternatives();
      alternative.set_name(core::one_line(other.name().c_str()));
      alternative.set_probability(other.probability());
    }
    named.set_probability(effect.probability());
    named.set_share_of_gap(effect.share_of_gap());
  }
  for (const auto& point : report.points()) {
    out.add_time_s(point.time_s());
    out.add_measured_deg_h(deg_h_from_radps(point.measured_radps()));
    out.add_twin_deg_h(deg_h_from_radps(point.twin_radps()));
    out.add_repaired_deg_h(deg_h_from_radps(point.repaired_radps()));
    out.add_input_value(point.input());
  }
  out.set_wall_time_ns(report.wall_time_ns());
  return out;
}

telemetry::ThermalCoverage to_telemetry(const msg::ThermalCoverage& coverage) {
  using Grid = compensation::ThermalCoverage;
  telemetry::ThermalCoverage out;
  out.set_gyro_id(coverage.gyro_id());
  out.set_model_epoch(coverage.model_epoch());
  out.set_step_degc(Grid::kStepDegc);
  for (const double edge : Grid::kRateEdgesDegcPerMin) out.add_rate_edges_degc_per_min(edge);
  for (std::size_t i = 0; i < coverage.labels_x().size(); ++i) {
    const std::array labels{coverage.labels_x()[i], coverage.labels_y()[i], coverage.labels_z()[i]};
    if (labels == decltype(labels){}) continue;
    auto& cell = *out.add_cells();
    cell.set_from_degc(Grid::kLowestDegc +
                       Grid::kStepDegc * static_cast<double>(i % Grid::kTemperatures));
    cell.set_rate(static_cast<std::uint32_t>(i / Grid::kTemperatures));
    for (const std::uint32_t of_axis : labels) cell.add_labels(of_axis);
  }
  return out;
}

telemetry::ServiceStatus to_telemetry(const msg::ServiceStatus& status, std::int64_t unix_ns) {
  telemetry::ServiceStatus out;
  set_time(*out.mutable_timestamp(), unix_ns);
  out.set_service(core::one_line(status.service().c_str()));
  out.set_host(core::one_line(status.host().c_str()));
  out.set_process_id(status.process_id());
  out.set_state(service::state_name(static_cast<service::State>(status.state())));
  out.set_uptime_s(static_cast<double>(status.uptime_ms()) * 1e-3);
  out.set_summary(core::one_line(status.summary().c_str()));
  for (const auto& from : status.metrics()) {
    auto& metric = *out.add_metrics();
    metric.set_name(core::one_line(from.name().c_str()));
    metric.set_unit(core::one_line(from.unit().c_str()));
    metric.set_value(from.value());
  }
  out.set_alive(status.state() != static_cast<std::uint32_t>(service::State::kStopping));
  return out;
}

bool ended_in_order(const telemetry::ServiceStatus& status) {
  return status.state() == service::state_name(service::State::kStopping);
}

telemetry::Event to_telemetry(const msg::Event& event) {
  telemetry::Event out;
  set_time(*out.mutable_timestamp(), event.wall_time_ns());
  out.set_service(core::one_line(event.service().c_str()));
  out.set_code(core::one_line(event.code().c_str()));
  out.set_text(core::one_line(event.text().c_str()));
  out.set_severity(event.severity());
  out.set_gyro_id(event.gyro_id());
  out.set_count(event.count());
  out.set_sensor_time_ns(event.sensor_time_ns());
  return out;
}

telemetry::Endpoint to_telemetry(const dds::RemoteEndpoint& endpoint) {
  telemetry::Endpoint out;
  out.set_topic(endpoint.topic);
  out.set_is_writer(endpoint.is_writer);
  out.set_process(core::one_line(endpoint.process.c_str()));
  out.set_reliability(endpoint.reliability);
  out.set_durability(endpoint.durability);
  out.set_ownership(endpoint.ownership);
  out.set_ownership_strength(endpoint.ownership_strength);
  out.set_liveliness(endpoint.liveliness);
  out.set_lease_s(seconds_or_nan(endpoint.lease));
  out.set_deadline_s(seconds_or_nan(endpoint.deadline));
  out.set_problem(core::one_line(endpoint.problem.c_str()));
  return out;
}

}  // namespace zerodrift::services
