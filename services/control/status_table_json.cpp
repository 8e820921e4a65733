// SPDX-License-Identifier: Apache-2.0
// The figures of the status table for programs. What is not known is null.
#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "common/core/mode.h"
#include "common/core/not_known.h"
#include "common/core/units.h"
#include "services/control/status_table.h"

namespace zerodrift::services {

using Json = nlohmann::ordered_json;

namespace {

using core::kNaN;

// NaN is written as null.
double spread_deg_h(const msg::AllanReport* report) {
  if (report == nullptr || report->since_start_blocks().blocks() < 2) return kNaN;
  return core::deg_h_from_radps(report->since_start_blocks().std_radps());
}

Json allan_of(const msg::AllanReport* report, const msg::AllanPoint* minute) {
  if (report == nullptr) return nullptr;
  return {{"samples", report->samples()},
          {"block_s", report->since_start_blocks().block_s()},
          {"block_std_deg_h", spread_deg_h(report)},
          {"minute_tau_s", minute == nullptr ? kNaN : minute->tau_s()},
          {"minute_deviation_deg_h",
           minute == nullptr ? kNaN : core::deg_h_from_radps(minute->deviation_radps())}};
}

}  // namespace

std::string StatusBoard::json() {
  const bool is_complete = nothing_lost();
  const bool is_finished = finished();
  const std::lock_guard lock(mutex_);
  const std::string compensation = services_.compensation();
  Json json{{"gyros", Json::array()}};
  for (const std::uint32_t gyro : services_.gyros())
    json["gyros"].push_back(Json::parse(gyro_json(gyro)));
  json["samples"] = {{"published", publishers().empty() ? kNaN : published()},
                     {"in", metric(compensation, "samples_in", kNaN)},
                     {"out", metric(compensation, "samples_out", kNaN)},
                     {"monitored", metric("allan_monitor", "samples", kNaN)},
                     {"missing", metric(compensation, "missing", kNaN)},
                     {"duplicates", metric(compensation, "duplicates", kNaN)},
                     {"rejected", metric(compensation, "rejected", kNaN)}};
  json["finished"] = is_finished;
  json["nothing_lost"] = is_complete;
  json["hops"] = Json::array();
  for (const Hop& hop : kHops) {
    const std::string name(hop.name);
    const std::optional<std::string> service = service_of_hop(hop);
    const double count = service ? metric(*service + ":latency", name + "_count", 0.0) : 0.0;
    if (count == 0.0) continue;
    json["hops"].push_back({{"service", *service},
                            {"hop", hop.name},
                            {"p50_us", metric(*service, name + "_p50", kNaN)},
                            {"p99_us", metric(*service, name + "_p99", kNaN)},
                            {"p999_us", metric(*service, name + "_p999", kNaN)},
                            {"max_us", metric(*service, name + "_max", kNaN)},
                            {"samples", count}});
  }
  json["services"] = Json::object();
  json["gone"] = Json::object();
  for (const auto& [name, said] : services_.entries()) {
    if (said.is_alive) {
      json["services"][name] = said.metrics;
    } else {
      json["gone"][name] = {{"ended_in_order", said.ended_in_order},
                            {"age_s", age_s(said)},
                            {"last_metrics", said.metrics}};
    }
  }
  json["events"] = events_;
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string StatusBoard::gyro_json(std::uint32_t gyro) const {
  const std::string of = part(gyro);
  const ServiceTable::Service* compensation = services_.find(of);
  const bool is_alive = compensation != nullptr && compensation->is_alive;
  Json json{{"gyro_id", gyro},
            {"compensation", service_of(of)},
            {"compensation_alive", is_alive},
            {"age_s", compensation == nullptr ? kNaN : age_s(*compensation)},
            {"silence_s", metric(of, "silence", kNaN)},
            {"sensor_time_s", metric(of, "sensor_time", kNaN)},
            {"temperature_degc", metric(of, "temperature", kNaN)},
            {"temperature_rate_degc_per_min", metric(of, "temperature_rate", kNaN)},
            {"labels", metric(of, "labels", kNaN)},
            {"model_epoch", metric(of, "model_epoch", kNaN)},
            {"axes", Json::array()}};
  // {"lagged": 0.6, ...}: what share each expert has of a stack's forecast; empty without a stack.
  const auto shares_of = [&](const std::string& suffix) {
    Json shares = Json::object();
    if (compensation == nullptr) return shares;
    constexpr std::string_view kPrefix = "share_";
    for (const auto& [name, share] : compensation->metrics) {
      if (!name.starts_with(kPrefix) || !name.ends_with(suffix)) continue;
      shares[name.substr(kPrefix.size(), name.size() - kPrefix.size() - suffix.size())] = share;
    }
    return shares;
  };
  // Null where it isn't learned; its figures are null before a window has come into force.
  const auto scale_factor_of = [&](const std::string& suffix) -> Json {
    const double windows = metric(of, "scale_factor_windows" + suffix, kNaN);
    if (std::isnan(windows)) return nullptr;
    return {{"error_ppm", metric(of, "scale_factor" + suffix, kNaN)},
            {"sigma_ppm", metric(of, "scale_factor_sigma" + suffix, kNaN)},
            {"slope_ppm_per_degc", metric(of, "scale_factor_slope" + suffix, kNaN)},
            {"slope_sigma_ppm_per_degc", metric(of, "scale_factor_slope_sigma" + suffix, kNaN)},
            {"windows", windows},
            {"windows_refused", metric(of, "scale_factor_refused" + suffix, kNaN)}};
  };
  for (const auto axis : core::kAxes) {
    const std::string suffix = "_" + std::string(core::name(axis));
    if (!is_shown(of, suffix)) continue;
    const auto report = [&](std::uint32_t stream) -> const msg::AllanReport* {
      const auto found =
          reports_.entries().find({gyro, static_cast<std::uint32_t>(core::index(axis)), stream});
      return found == reports_.entries().end() ? nullptr : &found->second;
    };
    const auto mode = static_cast<core::Mode>(metric(of, "mode" + suffix, 0.0));
    const auto reason = static_cast<core::Reason>(metric(of, "reason" + suffix, 0.0));
    const auto minute = [](const msg::AllanReport* of_stream) {
      return of_stream == nullptr ? nullptr : minute_point(*of_stream);
    };
    json["axes"].push_back(
        {{"axis", core::name(axis)},
         {"mode", core::name(mode)},
         {"reason", core::name(reason)},
         {"shares", shares_of(suffix)},
         {"scale_factor", scale_factor_of(suffix)},
         {"drift_deg_h", metric(of, "drift" + suffix, kNaN)},
         {"applied_rmse_deg_h", metric(of, "applied_rmse" + suffix, kNaN)},
         {"persistence_rmse_deg_h", metric(of, "persistence_rmse" + suffix, kNaN)},
         {"support_vectors", metric(of, "support_vectors" + suffix, kNaN)},
         {"raw", allan_of(report(0), minute(report(0)))},
         {"compensated", allan_of(report(1), minute(report(1)))},
         {"ratio", spread_deg_h(report(0)) / spread_deg_h(report(1))}});
  }
  return json.dump();
}

}  // namespace zerodrift::services
