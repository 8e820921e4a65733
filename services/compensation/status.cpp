// SPDX-License-Identifier: Apache-2.0
// What the service says of itself. Samples wait while data_mutex_ is held: under it plain values
// are copied, and nothing else.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/counted.h"
#include "common/core/sequence_gap.h"
#include "common/core/units.h"
#include "common/experts/expert.h"
#include "common/service/monotonic_clock.h"
#include "common/service/ros2_health.h"
#include "services/compensation/compensation_node.h"

namespace zerodrift::services {
namespace {

// online_svr: as names of metrics are spelled.
std::string metric_name(experts::Expert expert) {
  std::string name{experts::name(expert)};
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

// Of the scale factor's error at the present temperature; its windows show whether the reference
// agrees with itself.
void add_scale_factor(const compensation::ScaleFactorState& state, const std::string& suffix,
                      service::StatusPart& part) {
  constexpr double kPpm = 1e-6;
  const auto add = [&](const char* name, const char* unit, double value) {
    part.metrics.push_back({name + suffix, unit, value});
  };
  add("scale_factor_windows", "1", static_cast<double>(state.windows));
  add("scale_factor_refused", "1", static_cast<double>(state.refused));
  if (!state.is_known) return;
  add("scale_factor", "ppm", state.error / kPpm);
  add("scale_factor_sigma", "ppm", state.sigma / kPpm);
  add("scale_factor_slope", "ppm/degC", state.per_degc / kPpm);
  add("scale_factor_slope_sigma", "ppm/degC", state.per_degc_sigma / kPpm);
}

}  // namespace

struct CompensationNode::Seen {
  std::uint32_t id = 0;
  compensation::CompensatorCounts counts{};
  core::CompensatedSample newest{};
  core::PerAxis<bool> measured{};
  core::PerAxis<bool> own_output{};
  std::chrono::nanoseconds silence{};
  core::PerAxis<compensation::TestThenTrain> records{};
  core::PerAxis<std::size_t> support_vectors{};
  core::PerAxis<std::optional<compensation::StackState>> stacks{};
  core::PerAxis<std::optional<compensation::ScaleFactorState>> scale_factors{};
  double temperature_degc = 0.0;
  double temperature_rate_degc_per_s = 0.0;
  std::uint64_t rejected = 0;
  std::uint64_t temperatures_rejected = 0;
  std::uint64_t references_rejected = 0;
  std::uint64_t unwritten = 0;
  bool is_paced = false;
  bool is_alone = true;
  bool leads = true;
  service::InstanceSync::Health health{};
  service::InstanceSync::Counts sync{};
  std::uint64_t dropped = 0;
  const char* waiting = "";
};

CompensationNode::Seen CompensationNode::see(const Gyro& source) {
  const compensation::Compensator& compensator = source.compensator();
  const service::InstanceSync& sync = source.pipeline().sync();
  Seen seen{.id = source.id,
            .counts = compensator.counts(),
            .newest = source.newest(),
            .measured = compensator.measured(),
            .silence = source.silence(service::monotonic_ns()),
            .temperature_degc = compensator.temperature_degc(),
            .temperature_rate_degc_per_s = compensator.temperature_rate_degc_per_s(),
            .rejected = source.pipeline().rejected(),
            .temperatures_rejected = source.temperatures_rejected(),
            .references_rejected = source.references_rejected(),
            .unwritten = source.unwritten(),
            .is_paced = source.is_paced(),
            .is_alone = sync.is_alone(),
            .leads = sync.leads(),
            .health = sync.health(),
            .sync = sync.counts(),
            .dropped = source.pipeline().dropped(),
            .waiting = source.events.waiting()};
  for (const auto axis : core::kAxes) {
    seen.own_output[core::index(axis)] = compensator.is_given_own_output(axis);
    seen.records[core::index(axis)] = compensator.test_then_train(axis);
    seen.support_vectors[core::index(axis)] = compensator.support_vectors(axis);
    seen.stacks[core::index(axis)] = compensator.stack_state(axis);
    seen.scale_factors[core::index(axis)] = compensator.scale_factor(axis);
  }
  return seen;
}

service::Status CompensationNode::status() {
  const std::array<const service::HopLatency*, 3> hops{&sensor_latency_, &arrival_latency_,
                                                       &compute_latency_};
  std::vector<Seen> all;
  all.reserve(128);
  {
    const std::lock_guard lock(data_mutex_);
    for (const auto& [id, source] : gyros_.entries()) all.push_back(see(source));
  }
  service::Status status;
  status.state = all.empty() ? service::State::kWaiting : service::State::kRunning;
  status.summary = core::counted(all.size(), "gyro");
  if (rivals_.has_rival()) {
    status.state = service::State::kDegraded;
    status.summary += "; another compensation answers the same";
  }
  status.parts.push_back(service::latency_part(hops));
  compensation::CompensatorCounts sum;
  std::uint64_t rejected = 0;
  std::uint64_t unwritten = 0;
  for (const Seen& seen : all) {
    sum.samples_in += seen.counts.samples_in;
    sum.samples_out += seen.counts.samples_out;
    sum.missing = core::saturating_sum(sum.missing, seen.counts.missing);
    sum.duplicates += seen.counts.duplicates + seen.counts.too_old;
    rejected += seen.rejected;
    unwritten += seen.unwritten;
    status.parts.push_back(part(seen));
  }
  status.metrics = {{"gyros", "1", static_cast<double>(all.size())},
                    {"samples_in", "1", static_cast<double>(sum.samples_in)},
                    {"samples_out", "1", static_cast<double>(sum.samples_out)},
                    {"missing", "1", static_cast<double>(sum.missing)},
                    {"duplicates", "1", static_cast<double>(sum.duplicates)},
                    {"rejected", "1", static_cast<double>(rejected)},
                    {"unwritten", "1", static_cast<double>(unwritten)}};
  status.flow = {.topic = dds::kAngularRate.name,
                 .samples = sum.samples_in,
                 .paced = std::all_of(all.begin(), all.end(), std::mem_fn(&Seen::is_paced))};
  const std::vector<service::Metric> latencies = service::latency_metrics(hops);
  status.metrics.insert(status.metrics.end(), latencies.begin(), latencies.end());
  return status;
}

service::StatusPart CompensationNode::part(const Seen& seen) {
  service::StatusPart part{.name = std::to_string(seen.id), .summary = seen.waiting};
  const auto add = [&](std::string name, std::string unit, double value) {
    part.metrics.push_back({std::move(name), std::move(unit), value});
  };
  add("invalid", "1", static_cast<double>(seen.counts.invalid));
  add("labels", "1", static_cast<double>(seen.counts.labels));
  add("labels_skipped", "1", static_cast<double>(seen.counts.labels_skipped));
  add("temperatures_rejected", "1", static_cast<double>(seen.temperatures_rejected));
  add("late_models", "1", static_cast<double>(seen.counts.late_models));
  for (std::size_t v = 0; v < compensation::kReferenceVerdicts; ++v) {
    if (seen.counts.references[v] == 0) continue;
    add("references_" +
            std::string(compensation::name(static_cast<compensation::ReferenceVerdict>(v))),
        "1", static_cast<double>(seen.counts.references[v]));
  }
  if (seen.references_rejected > 0)
    add("references_rejected", "1", static_cast<double>(seen.references_rejected));
  add("model_epoch", "1", static_cast<double>(seen.newest.model_epoch));
  add("active", "1", seen.leads ? 1.0 : 0.0);
  if (!seen.is_alone) {
    add("health", "1", static_cast<double>(seen.health));
    add("takeovers", "1", static_cast<double>(seen.sync.takeovers));
    add("step_backs", "1", static_cast<double>(seen.sync.step_backs));
    add("compared", "1", static_cast<double>(seen.sync.compared));
    add("differing", "1", static_cast<double>(seen.sync.differing));
    add("unheard", "1", static_cast<double>(seen.dropped));
  }
  add("sensor_time", "s", core::seconds(seen.newest.raw.time));
  const bool is_silent = service::is_silent(seen.silence, seen.newest.raw.interval_s);
  add("silence", "s", is_silent ? core::seconds(seen.silence) : 0.0);
  add("temperature", "degC", seen.temperature_degc);
  add("temperature_rate", "degC/min", seen.temperature_rate_degc_per_s * 60.0);
  for (const auto axis : core::kAxes) {
    const std::size_t i = core::index(axis);
    const std::string suffix = "_" + std::string(core::name(axis));
    const auto& record = seen.records[i];
    add("valid" + suffix, "1", seen.newest.raw.valid[i] ? 1.0 : 0.0);
    // Of a gyro whose axes were never valid all are shown.
    const bool has_any = seen.measured != core::PerAxis<bool>{};
    add("measured" + suffix, "1", seen.measured[i] || !has_any ? 1.0 : 0.0);
    add("mode" + suffix, "1", static_cast<double>(seen.newest.mode[i]));
    add("reason" + suffix, "1", static_cast<double>(seen.newest.reason[i]));
    add("own_output" + suffix, "1", seen.own_output[i] ? 1.0 : 0.0);
    add("drift" + suffix, "deg/h", core::deg_h_from_radps(seen.newest.applied_drift_radps[i]));
    add("support_vectors" + suffix, "1", static_cast<double>(seen.support_vectors[i]));
    add("applied_rmse" + suffix, "deg/h", core::deg_h_from_radps(std::sqrt(record.applied_mse)));
    add("persistence_rmse" + suffix, "deg/h", core::deg_h_from_radps(std::sqrt(record.held_mse)));
    if (seen.scale_factors[i]) add_scale_factor(*seen.scale_factors[i], suffix, part);
    if (!seen.stacks[i]) continue;
    // Of the forecast in force: who has earned which share of it, and the longest age of the newest
    // label that was judged; beyond it the stated variance is an extrapolation.
    for (std::size_t k = 0; k < experts::kExperts; ++k) {
      const auto expert = static_cast<experts::Expert>(k);
      add("share_" + metric_name(expert) + suffix, "1", seen.stacks[i]->shares[k]);
    }
    add("longest_judged" + suffix, "s", seen.stacks[i]->longest_judged_s.value_or(0.0));
  }
  return part;
}

}  // namespace zerodrift::services
