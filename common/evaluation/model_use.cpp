// SPDX-License-Identifier: Apache-2.0
#include "common/evaluation/model_use.h"

#include <algorithm>

#include "common/record/bag_files.h"
#include "common/report/numbers.h"

namespace zerodrift::evaluation {
namespace {

using core::Reason;
using core::Rung;

std::uint64_t count_of(const std::array<std::uint64_t, core::kRungs>& rungs, Rung rung) {
  return rungs[static_cast<std::size_t>(rung)];
}

std::uint64_t learned_of(const std::array<std::uint64_t, core::kRungs>& rungs) {
  return count_of(rungs, Rung::kOnlineSvr) + count_of(rungs, Rung::kStack);
}

// Rest is recognised by so many blocks; the stack needs two labels, the online SVR alone its
// initial set.
double shortest_s(const compensation::CompensationOptions& options, double interval_s) {
  const auto& learning = options.learning;
  const double block_s = std::max(1.0, interval_s);
  const double labels = options.scheme == compensation::Scheme::kOnlineSvr
                            ? static_cast<double>(learning.initial_labels)
                            : 2.0;
  return static_cast<double>(learning.rest.initial_blocks) * block_s +
         labels * std::max(block_s, learning.label_interval_s) +
         std::max(block_s, learning.confirm_s) + learning.handover_s;
}

// What would be right; the reason itself has a name.
std::string remedy(Reason reason, compensation::Scheme scheme, bool is_mcap) {
  switch (reason) {
    case Reason::kNoEstimateYet:
      return "a record with rest, or with its true rate (a reference column); by its own noise the "
             "gyro was never at rest";
    case Reason::kInitialSet: return "a longer record, or one with more rest";
    case Reason::kMotion:
    case Reason::kSettling:
      return "a record with more rest, or with its true rate (a reference column); a drift that is "
             "taken for motion needs a larger learning.max_drift_slew_deg_h_s";
    case Reason::kEarthRateUnknown:
      return "earth_rate.mode included (a static test) or known (with latitude and attitude)";
    case Reason::kLevelImplausible:
      return "a learning.max_drift_deg_h above the gyro's largest drift";
    case Reason::kTemperatureMissing:
      return is_mcap
                 ? "a temperature of the probe that the features need (of a ROS 2 bag: "
                   "--temperature-topic PROBE=TOPIC)"
                 : "a column of the temperature that the features need, or --columns that names "
                   "it";
    case Reason::kTemperatureStale:
      return "a temperature_stale_s longer than the temperatures are apart";
    case Reason::kProbeStuck:
      return "another thermometer, or a probe_stuck_s longer than this one stands still";
    case Reason::kRateNotReady:
      return "a temperature_rate.window_s that holds 6 temperatures, and no lag longer than the "
             "record";
    case Reason::kModelWorseThanBias:
      return scheme == compensation::Scheme::kStack
                 ? "features that the drift goes by (kind, probe, scale); holding the last "
                   "stationary bias foretold better"
                 : "scheme stack, which weighs the model and holding, which foretold better";
    case Reason::kPolarityReversed: return "a mounting that turns the axis round";
    case Reason::kInvalidInput: return "rates that are numbers";
    case Reason::kSchemeNone: return "another scheme than none";
    case Reason::kNone:
    case Reason::kCommanded:
    case Reason::kOutsideLearned: break;
  }
  return "a longer record";
}

}  // namespace

// What measured nothing is no sample that a model could compensate: tables that were joined by
// their times have rows of temperature alone.
void ModelUse::add(const core::CompensatedSample& sample) noexcept {
  if (sample.raw.valid == core::PerAxis<bool>{}) return;
  if (first_ == core::kNever) {
    first_ = sample.raw.time;
    interval_s_ = sample.raw.interval_s;
  }
  last_ = std::max(last_, sample.raw.time);
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    Axis& axis = axes_[i];
    axis.measured = axis.measured || sample.raw.valid[i];
    ++axis.samples;
    const bool is_model = sample.rung[i] == Rung::kOnlineSvr || sample.rung[i] == Rung::kStack ||
                          sample.rung[i] == Rung::kPrior;
    if (is_model && !core::lacks_temperature(sample.reason[i])) axis.goes_by_temperature = true;
    ++axis.rungs[static_cast<std::size_t>(sample.rung[i])];
    ++axis.reasons[static_cast<std::size_t>(sample.reason[i])];
  }
}

bool ModelUse::came_into_force(core::Axis axis) const noexcept {
  const auto& rungs = axes_[core::index(axis)].rungs;
  return learned_of(rungs) + count_of(rungs, Rung::kPrior) > 0;
}

double ModelUse::learned_share(core::Axis axis) const noexcept {
  const Axis& own = axes_[core::index(axis)];
  return own.samples == 0
             ? 0.0
             : static_cast<double>(learned_of(own.rungs)) / static_cast<double>(own.samples);
}

Reason ModelUse::commonest_reason() const noexcept {
  std::array<std::uint64_t, core::kReasons> all{};
  for (const Axis& axis : axes_) {
    if (!axis.measured) continue;
    for (std::size_t r = 0; r < all.size(); ++r) all[r] += axis.reasons[r];
  }
  all[static_cast<std::size_t>(Reason::kNone)] = 0;
  return static_cast<Reason>(std::max_element(all.begin(), all.end()) - all.begin());
}

std::string ModelUse::line_of_none(const std::string& record,
                                   const compensation::CompensationOptions& options) const {
  bool came = false;
  for (const auto axis : core::kAxes) {
    if (!is_measured(axis)) continue;
    if (axes_[core::index(axis)].goes_by_temperature) return {};
    came = came || came_into_force(axis);
  }
  const Reason reason = commonest_reason();
  const std::string what =
      came ? "no temperature was ever used, the drift is foretold by its course in time alone: "
           : "no model ever came into force, raw and compensated are not comparable: ";
  return record + ": " + what + std::string(core::name(reason)) + "; " +
         remedy_of(reason, record, options);
}

std::string ModelUse::remedy_of(Reason reason, const std::string& record,
                                const compensation::CompensationOptions& options) const {
  const double spanned_s = first_ == core::kNever ? 0.0 : core::seconds(last_ - first_);
  const double needed_s = shortest_s(options, interval_s_);
  if (reason != Reason::kNoEstimateYet || spanned_s >= needed_s)
    return "what would be right: " + remedy(reason, options.scheme, record::is_mcap_record(record));
  return "the record spans " + report::significant(spanned_s, 3) +
         " s, a first model takes at least " + report::significant(needed_s, 3) + " s at rest";
}

}  // namespace zerodrift::evaluation
