// SPDX-License-Identifier: Apache-2.0
// Every metric that /metrics serves, once: its name, type and help by Prometheus' conventions, and
// of those that come from a service's status the member that it is made of. What only counts up is
// a counter and ends in _total; a count that can fall is a gauge.
#pragma once

#include <array>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace zerodrift::services {

enum class MetricKind { kCounter, kGauge, kHistogram };

struct MetricFact {
  const char* name;  // in base units; null: a member that isn't served
  MetricKind kind;
  const char* help;  // one sentence
};

// A member of service_status. {axis}, {stream}, {hop}, {expert} and {verdict} stand for each of
// their words and are labels; a member of another unit than this is another one.
struct StatusFact {
  std::string_view member;
  std::string_view unit;  // as the service writes it
  MetricFact metric;
};
std::span<const StatusFact> status_facts();

// A unit as services write it: the words that a name in base units ends with, and the factor.
struct BaseUnit {
  std::string_view written;
  std::string_view words;
  double factor;
};
std::span<const BaseUnit> base_units();

using MetricLabels = std::map<std::string, std::string>;
struct ServedMember {
  const MetricFact* metric;
  MetricLabels labels;
  double factor;
};
// Null: the catalogue doesn't know it. O(log members).
const ServedMember* find_served(const std::string& member, const std::string& unit);

namespace metric {

using enum MetricKind;

inline constexpr MetricFact kBuildInfo{
    "zerodrift_build_info", kGauge,
    "1, with the version and the commit that this console was built of as labels."};

// Of each service.
inline constexpr MetricFact kServiceUp{
    "zerodrift_service_up", kGauge,
    "1 while the service reports, 0 after it died or gave up; one that ended in order has none."};
inline constexpr MetricFact kServiceEnded{
    "zerodrift_service_ended_timestamp_seconds", kGauge,
    "Unix time at which the service said that it stops, in order; none once it is back."};
inline constexpr MetricFact kServiceUptime{"zerodrift_service_uptime_seconds", kGauge,
                                           "Time since the start of the service's process."};
inline constexpr MetricFact kHopLatency{
    "zerodrift_hop_latency_seconds", kHistogram,
    "Time from one stamp of a sample's way to the next, by hop, since the service's start."};
inline constexpr MetricFact kEndpointEvents{
    "zerodrift_endpoint_events_total", kCounter,
    "What the middleware noticed about endpoints of a topic, or without one about a peer."};

// Of each gyro, as the console receives its samples.
inline constexpr MetricFact kConsoleSamples{"zerodrift_console_samples_total", kCounter,
                                            "Compensated samples that reached the console."};
inline constexpr MetricFact kConsoleSamplesMissing{
    "zerodrift_console_samples_missing", kGauge,
    "Sequence numbers that haven't come since the console's start; a late sample lowers it."};
inline constexpr MetricFact kLastSampleAge{
    "zerodrift_last_sample_age_seconds", kGauge,
    "Time since the newest compensated sample reached the console; where none ever did, since the "
    "gyro's publisher is known to it."};
inline constexpr MetricFact kAxisMode{
    "zerodrift_axis_mode", kGauge,
    "Mode in the newest compensated sample, of an axis that was ever measured: 0 passthrough, "
    "1 learning, 2 frozen, 3 fallback, 4 out of domain, 5 holding."};
inline constexpr MetricFact kAxisDrift{"zerodrift_axis_drift_degrees_per_hour", kGauge,
                                       "Drift that the newest compensated sample had taken off."};
inline constexpr MetricFact kAxisDriftSigma{
    "zerodrift_axis_drift_sigma_degrees_per_hour", kGauge,
    "One sigma of the drift that was taken off; NaN where it is not known."};
inline constexpr MetricFact kAllanCoefficient{
    "zerodrift_allan_coefficient", kGauge,
    "Noise coefficient that the Allan deviation identified, in the unit of its label."};
inline constexpr MetricFact kAllanCoefficientUpper{
    "zerodrift_allan_coefficient_upper", kGauge,
    "Upper end of the noise coefficient's 95 % interval, in the unit of its label."};

// Of the console itself.
inline constexpr MetricFact kConsoleClients{"zerodrift_console_clients", kGauge,
                                            "WebSocket clients that are connected now."};
inline constexpr MetricFact kConsoleFramesDropped{
    "zerodrift_console_frames_dropped_total", kCounter,
    "Frames of samples that were left out for clients that were too slow."};
inline constexpr MetricFact kConsoleArrivalsLeftOut{
    "zerodrift_console_arrivals_left_out_total", kCounter,
    "Messages that came faster than this console takes them, or of more gyros, thermometers or "
    "services than it keeps."};
inline constexpr MetricFact kConsoleMembersUnknown{
    "zerodrift_console_members_unknown", kGauge,
    "Members of the services' statuses that this console knows no metric for."};

inline constexpr std::array kOfConsole{kBuildInfo,
                                       kServiceUp,
                                       kServiceEnded,
                                       kServiceUptime,
                                       kHopLatency,
                                       kEndpointEvents,
                                       kConsoleSamples,
                                       kConsoleSamplesMissing,
                                       kLastSampleAge,
                                       kAxisMode,
                                       kAxisDrift,
                                       kAxisDriftSigma,
                                       kAllanCoefficient,
                                       kAllanCoefficientUpper,
                                       kConsoleClients,
                                       kConsoleFramesDropped,
                                       kConsoleArrivalsLeftOut,
                                       kConsoleMembersUnknown};

}  // namespace metric

}  // namespace zerodrift::services
