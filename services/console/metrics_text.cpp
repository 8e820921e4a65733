// SPDX-License-Identifier: Apache-2.0
#include "services/console/metrics_text.h"

#include <prometheus/metric_family.h>
#include <prometheus/text_serializer.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

namespace zerodrift::services {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;
using Labels = std::vector<ClientMetric::Label>;

constexpr double kNsPerS = 1e9;
constexpr std::array<const char*, 3> kAxes{"x", "y", "z"};
constexpr std::array<const char*, 2> kStreams{"raw", "compensated"};

struct Unit {
  std::string_view written;  // as a service writes it
  const char* suffix;
  double factor;
};
constexpr std::array kUnits{Unit{"us", "_seconds", 1e-6},
                            Unit{"ms", "_seconds", 1e-3},
                            Unit{"s", "_seconds", 1.0},
                            Unit{"degC", "_celsius", 1.0},
                            Unit{"degC/min", "_celsius_per_minute", 1.0},
                            Unit{"deg/h", "_degrees_per_hour", 1.0},
                            Unit{"ppm", "_ratio", 1e-6},
                            Unit{"ppm/degC", "_per_celsius", 1e-6},
                            Unit{"kB", "_bytes", 1024.0}};

// Letters, digits, underscores.
std::string safe_name(std::string_view name) {
  std::string result;
  for (const char c : name) result += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return result;
}

// Of one name there is one family, and in it each set of labels once.
class Families {
 public:
  void add(const std::string& name, const char* help, Labels labels, double value) {
    ClientMetric metric;
    metric.gauge.value = value;
    add(name, help, MetricType::Gauge, std::move(labels), metric);
  }
  void add_histogram(const std::string& name, const char* help, Labels labels,
                     ClientMetric::Histogram histogram) {
    ClientMetric metric;
    metric.histogram = std::move(histogram);
    add(name, help, MetricType::Histogram, std::move(labels), metric);
  }
  [[nodiscard]] std::string text() const {
    std::vector<MetricFamily> all;
    for (const auto& [name, family] : families_) all.push_back(family);
    return prometheus::TextSerializer().Serialize(all);
  }

 private:
  void add(const std::string& name, const char* help, MetricType type, Labels labels,
           ClientMetric metric) {
    std::sort(labels.begin(), labels.end());
    if (!seen_.insert({name, labels}).second) return;
    MetricFamily& family = families_[name];
    if (family.metric.empty()) {
      family.name = name;
      family.help = help;
      family.type = type;
    }
    if (family.type != type) return;
    metric.label = std::move(labels);
    family.metric.push_back(std::move(metric));
  }
  std::map<std::string, MetricFamily> families_;
  std::set<std::pair<std::string, Labels>> seen_;
};

// "500us" -> 5e-4
std::optional<double> bound_s(std::string_view text) {
  double number = 0.0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
  if (read.ec != std::errc{}) return std::nullopt;
  const std::string_view unit(read.ptr,
                              static_cast<std::size_t>(text.data() + text.size() - read.ptr));
  if (unit == "us") return number * 1e-6;
  if (unit == "ms") return number * 1e-3;
  if (unit == "s") return number;
  return std::nullopt;
}

Labels labels_of(const std::string& service) {
  const std::size_t colon = service.find(':');
  Labels labels{{"service", service.substr(0, colon)}};
  if (colon != std::string::npos) labels.push_back({"part", service.substr(colon + 1)});
  return labels;
}

// True where the metric is of a histogram; then it is in `hops`.
bool is_of_histogram(const telemetry::Metric& metric,
                     std::map<std::string, ClientMetric::Histogram>& hops) {
  constexpr std::string_view kBound = "_le_";
  constexpr std::string_view kCount = "_count";
  const std::string& name = metric.name();
  const auto count = static_cast<std::uint64_t>(std::max(0.0, metric.value()));
  const std::size_t at = name.find(kBound);
  if (at != std::string::npos) {
    const auto bound = bound_s(std::string_view(name).substr(at + kBound.size()));
    if (!bound) return false;
    hops[name.substr(0, at)].bucket.push_back({count, *bound});
    return true;
  }
  if (!name.ends_with(kCount)) return false;
  hops[name.substr(0, name.size() - kCount.size())].sample_count = count;
  return true;
}

void add_hops(Families& families, const Labels& of,
              std::map<std::string, ClientMetric::Histogram>&& hops) {
  for (auto& [hop, histogram] : hops) {
    std::sort(histogram.bucket.begin(), histogram.bucket.end(),
              [](const auto& a, const auto& b) { return a.upper_bound < b.upper_bound; });
    histogram.bucket.push_back({histogram.sample_count, std::numeric_limits<double>::infinity()});
    histogram.sample_sum = std::numeric_limits<double>::quiet_NaN();
    Labels labels = of;
    std::erase_if(labels, [](const auto& label) { return label.name == "part"; });
    labels.push_back({"hop", hop});
    families.add_histogram("zerodrift_hop_latency_seconds",
                           "Time from one stamp of a sample's way to the next", std::move(labels),
                           std::move(histogram));
  }
}

void add_metric(Families& families, Labels labels, const telemetry::Metric& metric) {
  std::string name = metric.name();
  const bool has_axis = name.size() > 2 && name[name.size() - 2] == '_' &&
                        (name.back() == 'x' || name.back() == 'y' || name.back() == 'z');
  if (has_axis) {
    labels.push_back({"axis", std::string(1, name.back())});
    name.resize(name.size() - 2);
  }
  const auto* unit = std::find_if(kUnits.begin(), kUnits.end(), [&](const Unit& known) {
    return known.written == metric.unit();
  });
  const bool has_unit = unit != kUnits.end();
  families.add("zerodrift_" + safe_name(name) + (has_unit ? unit->suffix : ""),
               "Of service_status, as the service tells it", std::move(labels),
               metric.value() * (has_unit ? unit->factor : 1.0));
}

void add_service(Families& families, const telemetry::ServiceStatus& status) {
  const Labels labels = labels_of(status.service());
  families.add("zerodrift_service_up", "1: the service reports", labels,
               status.alive() ? 1.0 : 0.0);
  families.add("zerodrift_service_uptime_seconds", "Since the service's start", labels,
               status.uptime_s());
  std::map<std::string, ClientMetric::Histogram> hops;
  const bool has_hops = status.service().ends_with(":latency");
  for (const auto& metric : status.metrics()) {
    if (!has_hops || !is_of_histogram(metric, hops)) add_metric(families, labels, metric);
  }
  add_hops(families, labels, std::move(hops));
}

void add_gyro(Families& families, std::uint32_t id, const Gateway::GyroFigures& figures,
              std::int64_t unix_ns) {
  const Labels of{{"gyro", std::to_string(id)}};
  families.add("zerodrift_console_samples", "Compensated samples that reached the console", of,
               static_cast<double>(figures.samples));
  families.add("zerodrift_console_samples_missing",
               "Sequence numbers that never came since the console's start", of,
               static_cast<double>(figures.missing));
  families.add("zerodrift_last_sample_age_seconds", "Since the newest sample arrived", of,
               std::max(0.0, static_cast<double>(unix_ns - figures.newest_unix_ns) / kNsPerS));
  const auto& newest = figures.newest;
  const std::array<double, 3> drift{newest.drift_deg_h().x(), newest.drift_deg_h().y(),
                                    newest.drift_deg_h().z()};
  const std::array<double, 3> sigma{newest.drift_sigma_deg_h().x(), newest.drift_sigma_deg_h().y(),
                                    newest.drift_sigma_deg_h().z()};
  const std::array<telemetry::Mode, 3> modes{newest.x().mode(), newest.y().mode(),
                                             newest.z().mode()};
  for (std::size_t i = 0; i < kAxes.size(); ++i) {
    Labels labels = of;
    labels.push_back({"axis", kAxes[i]});
    families.add("zerodrift_axis_mode",
                 "0 passthrough, 1 learning, 2 frozen, 3 fallback, 4 out of domain, 5 holding",
                 labels, static_cast<double>(modes[i]));
    families.add("zerodrift_axis_drift_degrees_per_hour", "What is taken off", labels, drift[i]);
    families.add("zerodrift_axis_drift_sigma_degrees_per_hour",
                 "One sigma of what is taken off; NaN: not known", labels, sigma[i]);
  }
}

void add_allan(Families& families, const Gateway::GyroAxisStream& which,
               const telemetry::AllanReport& report) {
  const auto& [gyro, axis, stream] = which;
  for (const auto& coefficient : report.coefficients()) {
    if (coefficient.identified() != 1 && coefficient.identified() != 2) continue;
    const Labels labels{{"gyro", std::to_string(gyro)},
                        {"axis", kAxes[axis]},
                        {"stream", kStreams[stream]},
                        {"symbol", coefficient.symbol()},
                        {"unit", coefficient.unit()}};
    if (coefficient.identified() == 1) {
      families.add("zerodrift_allan_coefficient", "Noise coefficient in its unit", labels,
                   coefficient.value());
    }
    families.add("zerodrift_allan_coefficient_upper", "Upper end of its 95 % interval", labels,
                 coefficient.upper());
  }
}

}  // namespace

std::string metrics_text(const MetricsInput& input) {
  Families families;
  for (const auto& [name, status] : input.services) add_service(families, status);
  for (const auto& [id, figures] : input.gyros) add_gyro(families, id, figures, input.unix_ns);
  for (const auto& [which, report] : input.allan) add_allan(families, which, report);
  families.add("zerodrift_console_clients", "WebSocket clients now", {},
               static_cast<double>(input.clients));
  families.add("zerodrift_console_frames_dropped", "Frames that clients were too slow for", {},
               static_cast<double>(input.frames_dropped));
  families.add("zerodrift_console_arrivals_left_out",
               "Messages that came faster than the console takes them", {},
               static_cast<double>(input.arrivals_left_out));
  return families.text();
}

}  // namespace zerodrift::services
