// SPDX-License-Identifier: Apache-2.0
#include "services/console/metrics_text.h"

#include <prometheus/metric_family.h>
#include <prometheus/text_serializer.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "common/core/time.h"
#include "common/service/hop_latency.h"
#include "services/console/metric_catalogue.h"
#include "services/console/telemetry.h"

namespace zerodrift::services {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;

constexpr std::array<const char*, 3> kAxes{"x", "y", "z"};
constexpr std::array<const char*, 2> kStreams{"raw", "compensated"};

MetricType type_of(MetricKind kind) {
  switch (kind) {
    case MetricKind::kCounter: return MetricType::Counter;
    case MetricKind::kGauge: return MetricType::Gauge;
    case MetricKind::kHistogram: return MetricType::Histogram;
  }
  return MetricType::Untyped;
}

// Of one name there is one family, and in it each set of labels once.
class Families {
 public:
  void add(const MetricFact& fact, const MetricLabels& labels, double value) {
    ClientMetric metric;
    (fact.kind == MetricKind::kCounter ? metric.counter.value : metric.gauge.value) = value;
    add(fact, labels, std::move(metric));
  }
  void add(const MetricFact& fact, const MetricLabels& labels, ClientMetric metric) {
    if (!seen_.insert({fact.name, labels}).second) return;
    MetricFamily& family = families_[fact.name];
    family.name = fact.name;
    family.help = fact.help;
    family.type = type_of(fact.kind);
    for (const auto& [name, value] : labels) metric.label.push_back({name, value});
    family.metric.push_back(std::move(metric));
  }
  [[nodiscard]] std::string text() const {
    std::vector<MetricFamily> all;
    for (const auto& [name, family] : families_) all.push_back(family);
    return prometheus::TextSerializer().Serialize(all);
  }

 private:
  std::map<std::string, MetricFamily> families_;
  std::set<std::pair<std::string, MetricLabels>> seen_;
};

// "500us" -> 5e-4
std::optional<double> bound_s(std::string_view text) {
  double number = 0.0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
  if (read.ec != std::errc{} || !std::isfinite(number)) return std::nullopt;
  const std::string_view unit(read.ptr,
                              static_cast<std::size_t>(text.data() + text.size() - read.ptr));
  if (unit == "us") return number * 1e-6;
  if (unit == "ms") return number * 1e-3;
  if (unit == "s") return number;
  return std::nullopt;
}

MetricLabels labels_of(const std::string& name) {
  const std::size_t colon = name.find(':');
  MetricLabels labels{{"service", name.substr(0, colon)}};
  if (!service::is_part(name)) return labels;
  const std::string part = name.substr(colon + 1);
  if (const auto gyro = service::gyro_told_of(name)) {
    labels["gyro"] = std::to_string(*gyro);
  } else if (part != service::kLatencyPart) {
    labels["part"] = part;
  }
  return labels;
}

// Of the hops of a service; one whose sum or count isn't known is none.
struct Hop {
  std::vector<ClientMetric::Bucket> buckets{};
  std::optional<std::uint64_t> count{};
  std::optional<double> sum_s{};
};

// True where the member is of a histogram; then it is in `hops`.
bool is_of_histogram(const telemetry::Metric& member, std::map<std::string, Hop>& hops) {
  constexpr std::string_view kBound = "_le_";
  constexpr std::string_view kCount = "_count";
  constexpr std::string_view kSum = "_sum";
  constexpr double kSPerUs = 1e-6;
  constexpr double kLargestCount = 9e15;  // whole numbers of a double
  if (!std::isfinite(member.value())) return false;
  const std::string& name = member.name();
  const auto hop = [&](std::string_view ending) -> Hop& {
    return hops[name.substr(0, name.size() - ending.size())];
  };
  const auto count = static_cast<std::uint64_t>(std::clamp(member.value(), 0.0, kLargestCount));
  const std::size_t at = name.find(kBound);
  if (at != std::string::npos) {
    const auto bound = bound_s(std::string_view(name).substr(at + kBound.size()));
    if (!bound) return false;
    hop(std::string_view(name).substr(at)).buckets.push_back({count, *bound});
  } else if (name.ends_with(kCount)) {
    hop(kCount).count = count;
  } else if (name.ends_with(kSum)) {
    hop(kSum).sum_s = member.value() * kSPerUs;
  } else {
    return false;
  }
  return true;
}

void add_hops(Families& families, const MetricLabels& of, std::map<std::string, Hop>&& hops) {
  for (auto& [name, hop] : hops) {
    if (!hop.count || !hop.sum_s) continue;
    std::sort(hop.buckets.begin(), hop.buckets.end(),
              [](const auto& a, const auto& b) { return a.upper_bound < b.upper_bound; });
    hop.buckets.push_back({*hop.count, std::numeric_limits<double>::infinity()});
    ClientMetric metric;
    metric.histogram = {*hop.count, *hop.sum_s, std::move(hop.buckets)};
    MetricLabels labels = of;
    labels["hop"] = name;
    families.add(metric::kHopLatency, labels, std::move(metric));
  }
}

// `<topic>_<code>`, or `<code>` of a peer: topics of others have any name.
bool add_endpoint_events(Families& families, MetricLabels labels, const telemetry::Metric& member) {
  const std::string_view name = member.name();
  for (const auto& [kind, code] : service::kEndpointCodes) {
    if (!name.ends_with(code)) continue;
    const std::string_view before = name.substr(0, name.size() - std::string_view(code).size());
    if (!before.empty() && !before.ends_with('_')) continue;
    labels["event"] = code;
    if (before.size() > 1) labels["topic"] = before.substr(0, before.size() - 1);
    families.add(metric::kEndpointEvents, labels, member.value());
    return true;
  }
  return false;
}

// False where nothing is known of it.
bool add_member(Families& families, MetricLabels labels, const telemetry::Metric& member) {
  const ServedMember* served = find_served(member.name(), member.unit());
  if (served == nullptr) return add_endpoint_events(families, std::move(labels), member);
  if (served->metric->name == nullptr) return true;
  labels.insert(served->labels.begin(), served->labels.end());
  families.add(*served->metric, labels, member.value() * served->factor);
  return true;
}

// Of these each gyro has a process, all of one name: only what is said of the gyro tells them
// apart.
bool is_of_one_gyro(std::string_view service) {
  const std::string_view name = service.substr(0, service.find(':'));
  return name == "gyro_publisher" || name == "thermal_publisher";
}

// Gives how many members aren't known.
std::size_t add_service(Families& families, const telemetry::ServiceStatus& status) {
  const bool is_of_gyro = service::gyro_told_of(status.service()).has_value();
  if (is_of_one_gyro(status.service()) && !is_of_gyro) return 0;
  const MetricLabels labels = labels_of(status.service());
  const bool is_process = is_of_one_gyro(status.service()) || !service::is_part(status.service());
  // Who ended in order is nobody's concern: its series end, as Prometheus' own targets' do.
  if (ended_in_order(status)) {
    if (is_process)
      families.add(metric::kServiceEnded, labels,
                   static_cast<double>(time_ns(status.timestamp())) / core::kNsPerS);
    return 0;
  }
  if (is_process) {
    families.add(metric::kServiceUp, labels, status.alive() ? 1.0 : 0.0);
    families.add(metric::kServiceUptime, labels, status.uptime_s());
  }
  std::size_t unknown = 0;
  std::map<std::string, Hop> hops;
  const bool has_hops = status.service().ends_with(std::string(":") + service::kLatencyPart);
  for (const auto& member : status.metrics()) {
    if (has_hops && is_of_histogram(member, hops)) continue;
    if (!add_member(families, labels, member)) ++unknown;
  }
  add_hops(families, labels, std::move(hops));
  return unknown;
}

void add_gyro(Families& families, std::uint32_t id, const Gateway::GyroFigures& figures,
              std::int64_t monotonic_ns) {
  const MetricLabels of{{"gyro", std::to_string(id)}};
  families.add(metric::kConsoleSamples, of, static_cast<double>(figures.samples));
  families.add(metric::kConsoleSamplesMissing, of, static_cast<double>(figures.missing));
  families.add(metric::kLastSampleAge, of,
               std::max(0.0, static_cast<double>(monotonic_ns - figures.newest_monotonic_ns) /
                                 core::kNsPerS));
  if (!figures.newest) return;
  const auto& newest = *figures.newest;
  const std::array<double, 3> drift{newest.drift_deg_h().x(), newest.drift_deg_h().y(),
                                    newest.drift_deg_h().z()};
  const std::array<double, 3> sigma{newest.drift_sigma_deg_h().x(), newest.drift_sigma_deg_h().y(),
                                    newest.drift_sigma_deg_h().z()};
  const std::array<telemetry::Mode, 3> modes{newest.x().mode(), newest.y().mode(),
                                             newest.z().mode()};
  for (std::size_t i = 0; i < kAxes.size(); ++i) {
    if (!figures.measured[i]) continue;
    MetricLabels labels = of;
    labels["axis"] = kAxes[i];
    families.add(metric::kAxisMode, labels, static_cast<double>(modes[i]));
    families.add(metric::kAxisDrift, labels, drift[i]);
    families.add(metric::kAxisDriftSigma, labels, sigma[i]);
  }
}

void add_allan(Families& families, const Gateway::GyroAxisStream& which,
               const telemetry::AllanReport& report) {
  const auto& [gyro, axis, stream] = which;
  for (const auto& coefficient : report.coefficients()) {
    if (coefficient.identified() != 1 && coefficient.identified() != 2) continue;
    const MetricLabels labels{{"gyro", std::to_string(gyro)},
                              {"axis", kAxes[axis]},
                              {"stream", kStreams[stream]},
                              {"symbol", coefficient.symbol()},
                              {"unit", coefficient.unit()}};
    if (coefficient.identified() == 1)
      families.add(metric::kAllanCoefficient, labels, coefficient.value());
    families.add(metric::kAllanCoefficientUpper, labels, coefficient.upper());
  }
}

}  // namespace

std::string metrics_text(const MetricsInput& input) {
  Families families;
  families.add(metric::kBuildInfo, {{"version", input.version}, {"commit", input.commit}}, 1.0);
  std::size_t unknown = 0;
  for (const auto& [name, status] : input.services) unknown += add_service(families, status);
  for (const auto& [id, figures] : input.gyros) add_gyro(families, id, figures, input.monotonic_ns);
  for (const auto& [which, report] : input.allan) add_allan(families, which, report);
  families.add(metric::kConsoleClients, {}, static_cast<double>(input.clients));
  families.add(metric::kConsoleFramesDropped, {}, static_cast<double>(input.frames_dropped));
  families.add(metric::kConsoleArrivalsLeftOut, {}, static_cast<double>(input.arrivals_left_out));
  families.add(metric::kConsoleMembersUnknown, {}, static_cast<double>(unknown));
  return families.text();
}

}  // namespace zerodrift::services
