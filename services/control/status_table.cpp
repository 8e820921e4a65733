// SPDX-License-Identifier: Apache-2.0
#include "services/control/status_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/core/mode.h"
#include "common/core/not_known.h"
#include "common/core/units.h"
#include "common/report/numbers.h"
#include "common/service/host.h"
#include "common/service/monotonic_clock.h"

namespace zerodrift::services {

using core::deg_h_from_radps;

namespace {

constexpr const char* kRow = "{:<4} {:>9} {:>9} {:>7} {:>11} {:>10} {:>9} {:>9}\n";
constexpr const char* kHopRow = "{:<28} {:>9} {:>9} {:>9} {:>9} {:>10}\n";
constexpr std::size_t kEventsShown = 6;
constexpr double kUnknown = -1.0;
constexpr double kMinute = 60.0;

bool is_publisher_of_a_gyro(std::string_view service) {
  return service.starts_with("gyro_publisher:") || service.starts_with("replay:");
}

std::string known(const char* format, double value) {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : "-";
}

std::string figure(double rate_radps) {
  return report::significant(deg_h_from_radps(rate_radps), 4);
}

std::string figure(const msg::BlockStatistics& blocks) {
  return blocks.blocks() > 1 ? figure(blocks.std_radps()) : "-";
}

std::string latency_text(double latency_us) {
  if (latency_us >= 1e6) return report::significant(latency_us * 1e-6, 3) + " s";
  if (latency_us >= 1e3) return report::significant(latency_us * 1e-3, 3) + " ms";
  return report::significant(latency_us, 3) + " us";
}

}  // namespace

const msg::AllanPoint* StatusBoard::minute_point(const msg::AllanReport& report) {
  const auto distance = [](const msg::AllanPoint& point) {
    return std::abs(std::log(point.tau_s() / kMinute));
  };
  const auto& points = report.since_start();
  const auto nearest =
      std::min_element(points.begin(), points.end(),
                       [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
  return nearest == points.end() || distance(*nearest) > std::log(1.5) ? nullptr : &*nearest;
}

std::string StatusBoard::part(std::uint32_t gyro) const {
  return services_.compensation_of(gyro) + ':' + std::to_string(gyro);
}

double StatusBoard::age_s(const ServiceTable::Service& service) {
  return static_cast<double>(service::monotonic_ns() - service.said_ns) * 1e-9;
}

StatusBoard::StatusBoard(dds::Participant& participant)
    : status_reader_(
          participant,
          [this](const msg::ServiceStatus& m, const dds::SampleOrigin& o) { note(m, o.writer); },
          {}, [this](const Guid& writer, dds::Departure) { note_gone(writer); }),
      report_reader_(participant,
                     [this](const msg::AllanReport& m, const dds::SampleOrigin&) { note(m); }),
      event_reader_(participant,
                    [this](const msg::Event& m, const dds::SampleOrigin&) { note(m); }) {}

void StatusBoard::note(const msg::ServiceStatus& status, const Guid& writer) {
  const std::lock_guard lock(mutex_);
  services_.note(status, writer, service::monotonic_ns());
}

void StatusBoard::note_gone(const Guid& writer) {
  const std::lock_guard lock(mutex_);
  services_.note_gone(writer);
}

void StatusBoard::note(const msg::AllanReport& report) {
  const std::lock_guard lock(mutex_);
  if (report.axis() > 2 || report.stream() > 1) return;
  if (auto* newest = reports_.find_or_make({report.gyro_id(), report.axis(), report.stream()}))
    *newest = report;
}

void StatusBoard::note(const msg::Event& event) {
  const std::lock_guard lock(mutex_);
  std::string of = event.service().c_str();
  if (event.gyro_id() != 0) of += ":" + std::to_string(event.gyro_id());
  events_.push_back(fmt::format("{:>9.1f} s  {:<14} {} ({}x)",
                                static_cast<double>(event.sensor_time_ns()) * 1e-9, of,
                                event.text().c_str(), event.count()));
  if (events_.size() > kEventsShown) events_.erase(events_.begin());
}

double StatusBoard::metric(const std::string& service, const std::string& name,
                           double otherwise) const {
  return services_.metric(service, name, otherwise);
}

bool StatusBoard::has(const std::string& service) {
  const std::lock_guard lock(mutex_);
  return services_.find(service) != nullptr;
}

bool StatusBoard::has_compensation() {
  const std::lock_guard lock(mutex_);
  return services_.has_compensation();
}

std::vector<std::string> StatusBoard::addressees(std::uint32_t gyro) {
  const std::lock_guard lock(mutex_);
  return services_.addressees(gyro);
}

bool StatusBoard::all_are_led() {
  const std::lock_guard lock(mutex_);
  return services_.all_are_led();
}

bool StatusBoard::finished() {
  const std::lock_guard lock(mutex_);
  return all_sources_ended() && all_answered();
}

StatusBoard::Counts StatusBoard::counts() {
  const std::lock_guard lock(mutex_);
  return {.nothing_more_comes = nothing_more_comes(),
          .published = published(),
          .answered = metric(services_.compensation(), "samples_out", 0.0),
          .monitored = metric("allan_monitor", "samples", 0.0)};
}

double StatusBoard::answered() {
  const std::lock_guard lock(mutex_);
  return metric(services_.compensation(), "samples_out", 0.0);
}

double StatusBoard::sensor_time_s() {
  const std::lock_guard lock(mutex_);
  const auto known = services_.gyros();
  return known.empty() ? 0.0 : metric(part(known.front()), "sensor_time", 0.0);
}

std::vector<std::string> StatusBoard::publishers() const {
  std::vector<std::string> names;
  for (const auto& [service, said] : services_.entries()) {
    if (is_publisher_of_a_gyro(service)) names.push_back(service);
  }
  return names;
}

double StatusBoard::published() const {
  double all = 0.0;
  for (const std::string& service : publishers()) all += metric(service, "samples_published", 0.0);
  return all;
}

bool StatusBoard::has_come_to_its_end(const std::string& publisher) const {
  return metric(publisher, "finished", 0.0) != 0.0;
}

std::vector<std::string> StatusBoard::short_of_their_end() const {
  std::vector<std::string> all = publishers();
  std::erase_if(all, [&](const std::string& service) { return has_come_to_its_end(service); });
  return all;
}

bool StatusBoard::all_sources_ended() const {
  return !publishers().empty() && short_of_their_end().empty();
}

bool StatusBoard::nothing_more_comes() const {
  const std::vector<std::string> rest = short_of_their_end();
  return !publishers().empty() &&
         std::none_of(rest.begin(), rest.end(), [&](const std::string& service) {
           return services_.find(service)->is_alive;
         });
}

bool StatusBoard::all_answered() const {
  const double all = published();
  return all > 0.0 && metric(services_.compensation(), "samples_out", kUnknown) == all;
}

bool StatusBoard::nothing_lost() {
  const std::lock_guard lock(mutex_);
  const std::string compensation = services_.compensation();
  const double out = metric(compensation, "samples_out", kUnknown);
  return all_answered() && metric(compensation, "missing", kUnknown) == 0.0 &&
         metric(compensation, "unwritten", kUnknown) == 0.0 &&
         metric("allan_monitor", "samples", kUnknown) == out;
}

// An axis that the gyro has, valid just now or not.
bool StatusBoard::is_shown(const std::string& of, const std::string& suffix) const {
  return metric(of, "measured" + suffix, 0.0) != 0.0;
}

std::string StatusBoard::axis_row(std::uint32_t gyro, core::Axis axis) const {
  const std::string of = part(gyro);
  const std::string suffix = "_" + std::string(core::name(axis));
  if (!is_shown(of, suffix)) return "";
  std::string raw_std = "-", left_std = "-", ratio = "-", raw_minute = "-", left_minute = "-",
              held = "-";
  const auto number = static_cast<std::uint32_t>(core::index(axis));
  const auto raw = reports_.entries().find({gyro, number, 0});
  const auto left = reports_.entries().find({gyro, number, 1});
  if (raw != reports_.entries().end() && left != reports_.entries().end()) {
    const auto& raw_blocks = raw->second.since_start_blocks();
    const auto& left_blocks = left->second.since_start_blocks();
    raw_std = figure(raw_blocks);
    left_std = figure(left_blocks);
    if (left_blocks.std_radps() > 0.0) {
      ratio = fmt::format("{:.1f}", raw_blocks.std_radps() / left_blocks.std_radps());
    }
    const msg::AllanPoint* raw_point = minute_point(raw->second);
    const msg::AllanPoint* left_point = minute_point(left->second);
    if (raw_point != nullptr && left_point != nullptr) {
      raw_minute = figure(raw_point->deviation_radps());
      left_minute = figure(left_point->deviation_radps());
      // Neighbouring means differ by sqrt(2) Allan deviations.
      held = figure(std::sqrt(2.0) * raw_point->deviation_radps());
    }
  }
  return fmt::format(kRow, core::name(axis), raw_std, left_std, ratio, held, raw_minute,
                     left_minute, report::significant(metric(of, "drift" + suffix, 0.0), 4));
}

// "x, y: compensating (reason)", a line for each that is different.
std::string StatusBoard::modes(std::uint32_t gyro) const {
  const std::string of = part(gyro);
  std::vector<std::pair<std::string, std::string>> axes_by_mode;
  for (const auto axis : core::kAxes) {
    const std::string suffix = "_" + std::string(core::name(axis));
    if (!is_shown(of, suffix)) continue;
    std::string mode(core::name(static_cast<core::Mode>(metric(of, "mode" + suffix, 0.0))));
    const auto reason = static_cast<core::Reason>(metric(of, "reason" + suffix, 0.0));
    if (reason != core::Reason::kNone) mode += fmt::format(" ({})", core::name(reason));
    const auto same = std::find_if(axes_by_mode.begin(), axes_by_mode.end(),
                                   [&](const auto& one) { return one.first == mode; });
    if (same == axes_by_mode.end()) {
      axes_by_mode.emplace_back(mode, core::name(axis));
    } else {
      same->second += ", " + std::string(core::name(axis));
    }
  }
  const double silence_s = metric(of, "silence", 0.0);
  std::string text =
      silence_s > 0.0 ? fmt::format("no sample for {:.0f} s; before:\n", silence_s) : "";
  for (const auto& [mode, axes] : axes_by_mode) text += fmt::format("{}: {}\n", axes, mode);
  return text;
}

// Of any axis and stream, which have the same grid and blocks; null where nothing was reported.
const msg::AllanReport* StatusBoard::first_report(std::uint32_t gyro) const {
  const auto report = reports_.entries().lower_bound({gyro, 0, 0});
  const bool is_of_gyro = report != reports_.entries().end() && std::get<0>(report->first) == gyro;
  return is_of_gyro ? &report->second : nullptr;
}

// What the blocks of the monitor's means are: longer than a minute where samples are rare.
std::string StatusBoard::means_of(std::uint32_t gyro) const {
  const msg::AllanReport* report = first_report(gyro);
  if (report == nullptr) return "means";
  return fmt::format("{:.3g} s means", report->since_start_blocks().block_s());
}

// Which cluster time the Allan columns hold: the grid's nearest to a minute.
std::string StatusBoard::minute_heading(std::uint32_t gyro) const {
  const msg::AllanReport* report = first_report(gyro);
  const msg::AllanPoint* point = report == nullptr ? nullptr : minute_point(*report);
  return point == nullptr ? "ADEV raw" : fmt::format("ADEV {:.0f} s", point->tau_s());
}

std::string StatusBoard::gyro_table(std::uint32_t gyro) const {
  const std::string of = part(gyro);
  std::string text;
  const ServiceTable::Service* said = services_.find(of);
  if (said != nullptr && !said->is_alive) {
    text = fmt::format("gyro {}: {} {}; its figures are {:.0f} s old\n", gyro, service_of(of),
                       said->ended_in_order ? "has ended" : "is gone", age_s(*said));
  }
  text += fmt::format(
      "gyro {}   sensor time {:.1f} s   labels {:.0f}   model epoch {:.0f}\n"
      "temperature {} degC, {} degC/min; deg/h, std of {}:\n",
      gyro, metric(of, "sensor_time", 0.0), metric(of, "labels", 0.0),
      metric(of, "model_epoch", 0.0), known("{:.3f}", metric(of, "temperature", core::kNaN)),
      known("{:+.4f}", metric(of, "temperature_rate", core::kNaN)), means_of(gyro));
  text += fmt::format(kRow, "axis", "raw std", "comp std", "ratio", "persistence",
                      minute_heading(gyro), "comp", "drift");
  for (const auto axis : core::kAxes) text += axis_row(gyro, axis);
  return text + modes(gyro);
}

// Of several that answer the same: who is what.
std::string StatusBoard::instances() const {
  static constexpr std::array<const char*, 3> kHealth{"in sync", "catching up",
                                                      "its learner hangs"};
  std::string text;
  for (const auto& [name, said] : services_.entries()) {
    const auto health = said.metrics.find("health");
    const std::size_t colon = name.find(':');
    if (!said.is_alive || health == said.metrics.end() || colon == std::string::npos) continue;
    const auto index = static_cast<std::size_t>(health->second);
    const bool leads = metric(name, "active", 0.0) > 0.0;
    text += fmt::format(
        "{} of gyro {}: {}{}\n"
        "  answers compared {:.0f}, differing {:.0f}; took the lead {:.0f} times\n",
        name.substr(0, colon), name.substr(colon + 1),
        index < kHealth.size() ? kHealth[index] : "?", leads ? ", leads" : "",
        metric(name, "compared", 0.0), metric(name, "differing", 0.0),
        metric(name, "takeovers", 0.0));
  }
  return text;
}

// Who was there and isn't.
std::string StatusBoard::departures() const {
  std::string text;
  for (const auto& [name, said] : services_.entries()) {
    if (said.is_alive || service_of(name) != name) continue;
    text += fmt::format("{} {}; its last status is {:.0f} s old\n", name,
                        said.ended_in_order ? "has ended" : "is gone", age_s(said));
  }
  return text;
}

std::string StatusBoard::totals() const {
  const std::string compensation = services_.compensation();
  return fmt::format(
      "samples: published {:.0f}  in {:.0f}  out {:.0f}  monitored {:.0f}\n"
      "         missing {:.0f}  duplicates {:.0f}  rejected {:.0f}\n",
      published(), metric(compensation, "samples_in", 0.0),
      metric(compensation, "samples_out", 0.0), metric("allan_monitor", "samples", 0.0),
      metric(compensation, "missing", 0.0), metric(compensation, "duplicates", 0.0),
      metric(compensation, "rejected", 0.0));
}

std::optional<std::string> StatusBoard::service_of_hop(const Hop& hop) const {
  const bool is_compensations = std::string_view(hop.service) == "compensation";
  std::string name = is_compensations ? services_.compensation() : hop.service;
  const ServiceTable::Service* said = services_.find(name + ":latency");
  if (said == nullptr || !said->is_alive) return std::nullopt;
  return name;
}

std::string StatusBoard::hop_row(const Hop& hop) const {
  const std::string name(hop.name);
  const std::optional<std::string> service = service_of_hop(hop);
  const double count = service ? metric(*service + ":latency", name + "_count", 0.0) : 0.0;
  if (count == 0.0) return "";
  const auto latency = [&](const char* what) {
    return latency_text(metric(*service, name + what, 0.0));
  };
  return fmt::format(kHopRow, hop.heading, latency("_p50"), latency("_p99"), latency("_p999"),
                     latency("_max"), fmt::format("{:.0f}", count));
}

std::string StatusBoard::hops() const {
  std::string rows;
  for (const Hop& hop : kHops) rows += hop_row(hop);
  if (rows.empty()) return "";
  return fmt::format(kHopRow, "latency", "p50", "p99", "p99.9", "max", "samples") + rows;
}

std::string StatusBoard::table() {
  const std::lock_guard lock(mutex_);
  if (services_.entries().empty()) return "";
  std::string text;
  for (const std::uint32_t gyro : services_.gyros()) text += gyro_table(gyro);
  text += instances() + departures() + totals() + hops();
  for (const auto& event : events_) text += "  " + event + "\n";
  return text;
}

std::string StatusBoard::summary() {
  const bool complete = nothing_lost() && finished();
  const std::lock_guard lock(mutex_);
  std::string text;
  for (const std::uint32_t gyro : services_.gyros()) {
    for (const auto axis : core::kAxes) {
      const std::string suffix = "_" + std::string(core::name(axis));
      if (!is_shown(part(gyro), suffix)) continue;
      text += fmt::format(
          "gyro {} axis {}: test-then-train RMSE of the newest labels:\n"
          "  applied {}, last stationary minute {} deg/h\n",
          gyro, core::name(axis),
          report::significant(metric(part(gyro), "applied_rmse" + suffix, 0.0), 4),
          report::significant(metric(part(gyro), "persistence_rmse" + suffix, 0.0), 4));
    }
  }
  if (complete)
    return text + "every raw sample was answered exactly once and reached the monitor\n";
  if (!all_sources_ended() && nothing_more_comes()) {
    return text + fmt::format("gone before the end of its source: {}\n",
                              fmt::join(short_of_their_end(), ", "));
  }
  if (!all_sources_ended()) {
    return text + "stopped before the source's end; the counts are the services' last reports\n";
  }
  return text + "samples are missing: published, in, out and monitored differ\n";
}

}  // namespace zerodrift::services
