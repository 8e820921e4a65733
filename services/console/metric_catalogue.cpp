// SPDX-License-Identifier: Apache-2.0
#include "services/console/metric_catalogue.h"

#include <algorithm>
#include <iterator>
#include <vector>

#include "common/compensation/reference_screen.h"
#include "common/core/axis.h"
#include "common/experts/expert.h"

namespace zerodrift::services {
namespace {

using enum MetricKind;

constexpr std::array kUnits{BaseUnit{"1", "", 1.0},
                            BaseUnit{"us", "_seconds", 1e-6},
                            BaseUnit{"s", "_seconds", 1.0},
                            BaseUnit{"B", "_bytes", 1.0},
                            BaseUnit{"degC", "_celsius", 1.0},
                            BaseUnit{"degC/min", "_celsius_per_second", 1.0 / 60.0},
                            BaseUnit{"deg", "_degrees", 1.0},
                            BaseUnit{"deg/h", "_degrees_per_hour", 1.0},
                            BaseUnit{"ppm", "_ratio", 1e-6},
                            BaseUnit{"ppm/degC", "_per_celsius", 1e-6}};

// By who writes it.
// clang-format off
constexpr std::array kFacts{
    // --- several services
    StatusFact{"gyros", "1", {"zerodrift_gyros", kGauge, "Gyros that the service has received samples of."}},
    StatusFact{"samples", "1", {"zerodrift_samples_total", kCounter, "Compensated samples that the service took: monitor, filter, recorder, console."}},
    StatusFact{"duplicates", "1", {"zerodrift_duplicates_total", kCounter, "Samples that had come before, or came too late to be used."}},
    StatusFact{"gaps", "1", {"zerodrift_gaps_total", kCounter, "Gaps in the compensated samples that the service found."}},
    StatusFact{"unwritten", "1", {"zerodrift_unwritten_total", kCounter, "Results that the middleware refused to write."}},
    StatusFact{"too_many_gyros", "1", {"zerodrift_too_many_gyros_total", kCounter, "Samples left out since there are more gyros than the service's --max-gyros."}},
    StatusFact{"{hop}_p50", "us", {"zerodrift_hop_latency_p50_seconds", kGauge, "Latency of a hop that half of the samples kept to, since the service's start."}},
    StatusFact{"{hop}_p99", "us", {"zerodrift_hop_latency_p99_seconds", kGauge, "Latency of a hop that 99 % of the samples kept to, since the service's start."}},
    StatusFact{"{hop}_p999", "us", {"zerodrift_hop_latency_p999_seconds", kGauge, "Latency of a hop that 99.9 % of the samples kept to, since the service's start."}},
    StatusFact{"{hop}_max", "us", {"zerodrift_hop_latency_max_seconds", kGauge, "Longest latency of a hop since the service's start."}},
    StatusFact{"{hop}_incomparable", "1", {"zerodrift_hop_incomparable_total", kCounter, "Samples whose two stamps of a hop were of clocks that can't be compared."}},
    // --- publishers and replays
    StatusFact{"samples_published", "1", {"zerodrift_samples_published_total", kCounter, "Raw samples that were written to angular_rate."}},
    StatusFact{"samples_refused", "1", {"zerodrift_samples_refused_total", kCounter, "Raw samples that the middleware refused to write to angular_rate."}},
    StatusFact{"readings_published", "1", {"zerodrift_readings_published_total", kCounter, "Readings of thermometers and of the environment's sensors that were written."}},
    StatusFact{"finished", "1", {"zerodrift_finished", kGauge, "1 once the source has no more samples, else 0."}},
    StatusFact{"ros2_messages", "1", {"zerodrift_ros2_messages_total", kCounter, "Messages that came from the ROS 2 topics that are the source."}},
    StatusFact{"ros2_messages_missing", "1", {"zerodrift_ros2_messages_missing_total", kCounter, "Messages of the ROS 2 writers that never came, by the writers' own numbers."}},
    StatusFact{"ros2_stamps_missing", "1", {"zerodrift_ros2_stamps_missing_total", kCounter, "ROS 2 messages whose header had no usable stamp."}},
    // --- compensation
    StatusFact{"samples_in", "1", {"zerodrift_samples_in_total", kCounter, "Raw samples that the compensation took in."}},
    StatusFact{"samples_out", "1", {"zerodrift_samples_out_total", kCounter, "Raw samples that the compensation answered with a compensated one."}},
    StatusFact{"missing", "1", {"zerodrift_samples_missing", kGauge, "Sequence numbers of raw samples that the compensation hasn't received; a late sample lowers it."}},
    StatusFact{"rejected", "1", {"zerodrift_samples_rejected_total", kCounter, "Raw samples of a second publisher of the same gyro, which nobody follows."}},
    StatusFact{"invalid", "1", {"zerodrift_samples_invalid_total", kCounter, "Raw samples of which an axis that was measured before, or every axis, wasn't finite or was marked invalid."}},
    StatusFact{"labels", "1", {"zerodrift_labels_total", kCounter, "Drifts measured at rest or by a reference that were given to the learner."}},
    StatusFact{"labels_skipped", "1", {"zerodrift_labels_skipped_total", kCounter, "Measured drifts that were left out since the learner's queue was full."}},
    StatusFact{"temperatures_rejected", "1", {"zerodrift_temperatures_rejected_total", kCounter, "Temperatures of a second publisher of the same gyro and probe, which nobody follows."}},
    StatusFact{"late_models", "1", {"zerodrift_late_models_total", kCounter, "Samples that were answered before the model that was due for them was there."}},
    StatusFact{"references_{verdict}", "1", {"zerodrift_references_total", kCounter, "Rate references that the compensation received, by what it decided about them."}},
    StatusFact{"model_epoch", "1", {"zerodrift_model_epoch", kGauge, "Number of the model in force."}},
    StatusFact{"active", "1", {"zerodrift_active", kGauge, "1 where this instance leads: it takes commands and writes ROS 2's topic."}},
    StatusFact{"health", "1", {"zerodrift_instance_health", kGauge, "Of one of several instances: 0 in sync, 1 behind, 2 its learner hangs."}},
    StatusFact{"takeovers", "1", {"zerodrift_takeovers_total", kCounter, "Times that this instance began to lead."}},
    StatusFact{"step_backs", "1", {"zerodrift_step_backs_total", kCounter, "Times that this instance was in sync and fell behind."}},
    StatusFact{"compared", "1", {"zerodrift_compared_total", kCounter, "Samples whose answer was compared with another instance's."}},
    StatusFact{"differing", "1", {"zerodrift_differing_total", kCounter, "Compared samples whose answers were not equal to the bit."}},
    StatusFact{"unheard", "1", {"zerodrift_samples_unheard_total", kCounter, "Answers that this instance held back and dropped though nobody else wrote them."}},
    StatusFact{"sensor_time", "s", {"zerodrift_sensor_time_seconds", kGauge, "Sensor time of the newest sample, in the gyro's own clock."}},
    StatusFact{"silence", "s", {"zerodrift_silence_seconds", kGauge, "Time without a sample, where that is longer than 2 s and three samples; else 0."}},
    StatusFact{"temperature", "degC", {"zerodrift_temperature_celsius", kGauge, "Temperature that the model was last given."}},
    StatusFact{"temperature_rate", "degC/min", {"zerodrift_temperature_rate_celsius_per_second", kGauge, "Rate of the temperature that the model was last given."}},
    StatusFact{"valid_{axis}", "1", {"zerodrift_axis_valid", kGauge, "1 where the axis was valid in the raw sample."}},
    StatusFact{"measured_{axis}", "1", {"zerodrift_axis_measured", kGauge, "1 where a sample of the axis was ever valid, or none of any axis was."}},
    StatusFact{"mode_{axis}", "1", {"zerodrift_mode", kGauge, "Mode of the axis in this instance, numbered as in zerodrift_axis_mode."}},
    StatusFact{"reason_{axis}", "1", {"zerodrift_reason", kGauge, "Why the axis has its mode in this instance, numbered as in compensated_rate."}},
    StatusFact{"own_output_{axis}", "1", {"zerodrift_own_output", kGauge, "1 while the axis is found to be given what the compensation gives out, so that it is corrected twice."}},
    StatusFact{"drift_{axis}", "deg/h", {"zerodrift_drift_degrees_per_hour", kGauge, "Drift that this instance takes off the axis."}},
    StatusFact{"support_vectors_{axis}", "1", {"zerodrift_support_vectors", kGauge, "Support vectors of the axis' regression."}},
    StatusFact{"applied_rmse_{axis}", "deg/h", {"zerodrift_applied_rmse_degrees_per_hour", kGauge, "RMS error of the applied drift against labels that were measured after it."}},
    StatusFact{"persistence_rmse_{axis}", "deg/h", {"zerodrift_persistence_rmse_degrees_per_hour", kGauge, "RMS error that holding the last stationary mean would have had."}},
    StatusFact{"scale_factor_windows_{axis}", "1", {"zerodrift_scale_factor_windows_total", kCounter, "Windows of motion that the scale factor's error was learned from."}},
    StatusFact{"scale_factor_refused_{axis}", "1", {"zerodrift_scale_factor_refused_total", kCounter, "Windows of motion in which the reference disagreed with itself."}},
    StatusFact{"scale_factor_{axis}", "ppm", {"zerodrift_scale_factor_error_ratio", kGauge, "Error of the scale factor at the present temperature."}},
    StatusFact{"scale_factor_sigma_{axis}", "ppm", {"zerodrift_scale_factor_error_sigma_ratio", kGauge, "One sigma of the scale factor's error."}},
    StatusFact{"scale_factor_slope_{axis}", "ppm/degC", {"zerodrift_scale_factor_slope_per_celsius", kGauge, "Change of the scale factor's error with the temperature."}},
    StatusFact{"scale_factor_slope_sigma_{axis}", "ppm/degC", {"zerodrift_scale_factor_slope_sigma_per_celsius", kGauge, "One sigma of the scale factor's change with the temperature."}},
    StatusFact{"share_{expert}_{axis}", "1", {"zerodrift_expert_share", kGauge, "Share that an expert has earned of the axis' forecast, 0 to 1."}},
    StatusFact{"longest_judged_{axis}", "s", {"zerodrift_longest_judged_seconds", kGauge, "Longest age of a forecast that a label has judged; beyond it the stated variance is an extrapolation."}},
    // --- Allan monitor
    StatusFact{"out_of_order", "1", {"zerodrift_out_of_order_total", kCounter, "Compensated samples that came after later ones and are in no Allan deviation."}},
    StatusFact{"refused", "1", {"zerodrift_intervals_refused_total", kCounter, "Compensated samples whose interval fits no Allan deviation."}},
    StatusFact{"starts", "1", {"zerodrift_allan_starts_total", kCounter, "Times that the Allan deviations began anew, the first one included."}},
    StatusFact{"report_cost", "us", {"zerodrift_report_cost_seconds", kGauge, "Time that the newest Allan reports of all gyros took to compute."}},
    StatusFact{"copy_cost", "us", {"zerodrift_copy_cost_seconds", kGauge, "Longest time for which a copy of the Allan statistics held samples up."}},
    // --- navigation filter
    StatusFact{"losses", "1", {"zerodrift_navigation_losses_total", kCounter, "Gaps too long to be bridged, after which the heading is uncertain."}},
    StatusFact{"unusable", "1", {"zerodrift_navigation_unusable_total", kCounter, "Samples without an interval or with an axis that is no longer measured."}},
    StatusFact{"time_restarts", "1", {"zerodrift_navigation_time_restarts_total", kCounter, "Times that the sensor time began anew under the navigation filter."}},
    StatusFact{"residuals", "1", {"zerodrift_navigation_residuals_total", kCounter, "Residuals of the rates that the navigation filter gave back as references."}},
    StatusFact{"references", "1", {"zerodrift_navigation_references_total", kCounter, "References that the navigation filter gave back to the compensation."}},
    StatusFact{"phase", "1", {"zerodrift_navigation_phase", kGauge, "What the navigation filter does: 0 waits, 1 aligns, 2 navigates."}},
    StatusFact{"at_rest", "1", {"zerodrift_navigation_at_rest", kGauge, "1 where the navigation filter takes the vehicle to be at rest."}},
    StatusFact{"rest", "s", {"zerodrift_navigation_rest_seconds", kGauge, "Time that the vehicle has been at rest, by the navigation filter."}},
    StatusFact{"truth", "1", {"zerodrift_navigation_truth", kGauge, "1 where a true rate is known to hold the navigation against."}},
    StatusFact{"truth_missing", "1", {"zerodrift_navigation_truth_missing_total", kCounter, "Samples for whose time no true rate came."}},
    StatusFact{"updates_{stream}", "1", {"zerodrift_navigation_updates_total", kCounter, "Measurements that the navigation filter took in at rest, by the rates it is given."}},
    StatusFact{"rejected_{stream}", "1", {"zerodrift_navigation_updates_rejected_total", kCounter, "Updates that the navigation filter found implausible, by the rates it is given."}},
    StatusFact{"heading_error_{stream}", "deg", {"zerodrift_heading_error_degrees", kGauge, "Error of the heading against the truth now."}},
    StatusFact{"heading_rms_{stream}", "deg", {"zerodrift_heading_rms_degrees", kGauge, "RMS of the heading's error against the truth so far."}},
    StatusFact{"heading_largest_{stream}", "deg", {"zerodrift_heading_largest_degrees", kGauge, "Largest error of the heading against the truth so far."}},
    StatusFact{"heading_ratio", "1", {"zerodrift_heading_ratio", kGauge, "RMS heading error by raw rates over that by compensated ones."}},
    // --- recorder
    StatusFact{"messages", "1", {"zerodrift_recorder_messages_total", kCounter, "Messages that the recorder has written."}},
    StatusFact{"messages_lost", "1", {"zerodrift_recorder_messages_lost", kGauge, "Messages that didn't reach the recorder's file; one that comes late lowers it."}},
    StatusFact{"bytes", "B", {"zerodrift_recorder_bytes_total", kCounter, "Size of what the recorder has written."}},
    StatusFact{"queue_peak", "B", {"zerodrift_recorder_queue_peak_bytes", kGauge, "Most memory that messages have waited in for the recorder's disk."}},
    StatusFact{"queue_delay_p99", "us", {"zerodrift_recorder_queue_delay_p99_seconds", kGauge, "Time within which 99 % of the messages went from arrival to the disk's thread."}},
    StatusFact{"chunk_write_p99", "us", {"zerodrift_recorder_chunk_write_p99_seconds", kGauge, "Time within which 99 % of the chunks were written to the disk."}},
    // --- live diagnosis, discovery server
    StatusFact{"listened", "s", {"zerodrift_diagnosis_listened_seconds", kGauge, "Length of the record that a live diagnosis has gathered."}},
    StatusFact{"wanted", "s", {"zerodrift_diagnosis_wanted_seconds", kGauge, "Length of the record that a live diagnosis was asked for."}},
    StatusFact{"waiting", "1", {"zerodrift_diagnosis_waiting_samples", kGauge, "Samples of a live diagnosis that wait for their temperature."}},
    StatusFact{"participants", "1", {"zerodrift_discovery_participants", kGauge, "Participants that the discovery server knows."}},
    // --- consoles; of itself each says the first three below, whatever another one's status says
    StatusFact{"clients", "1", {}},
    StatusFact{"frames_dropped", "1", {}},
    StatusFact{"arrivals_left_out", "1", {}},
    StatusFact{"connections", "1", {"zerodrift_console_connections", kGauge, "Connections of any sort that are open at a console."}},
    StatusFact{"connections_refused", "1", {"zerodrift_console_connections_refused_total", kCounter, "WebSockets that a console had no place for."}},
    StatusFact{"commands", "1", {"zerodrift_console_commands_total", kCounter, "Commands that clients of a console have sent."}},
};
// clang-format on

struct Placeholder {
  std::string label;
  std::vector<std::string> words;
};

std::vector<Placeholder> placeholders() {
  std::vector<Placeholder> all{{"axis", {}},
                               {"stream", {"raw", "compensated"}},
                               {"hop", {"sensor", "arrival", "compute", "delivery", "chain"}},
                               {"expert", {}},
                               {"verdict", {}}};
  for (const auto axis : core::kAxes) all[0].words.emplace_back(core::name(axis));
  for (std::size_t k = 0; k < experts::kExperts; ++k) {
    std::string& word = all[3].words.emplace_back(experts::name(static_cast<experts::Expert>(k)));
    std::replace(word.begin(), word.end(), '-', '_');
  }
  for (std::size_t v = 0; v < compensation::kReferenceVerdicts; ++v)
    all[4].words.emplace_back(compensation::name(static_cast<compensation::ReferenceVerdict>(v)));
  return all;
}

using Members = std::map<std::pair<std::string, std::string>, ServedMember>;

// The member with each word of its placeholders.
void expand(const std::string& member, const std::string& unit, const ServedMember& served,
            const std::vector<Placeholder>& known, Members& members) {
  for (const Placeholder& one : known) {
    const std::string written = '{' + one.label + '}';
    const std::size_t at = member.find(written);
    if (at == std::string::npos) continue;
    for (const std::string& word : one.words) {
      ServedMember labelled = served;
      labelled.labels[one.label] = word;
      expand(std::string(member).replace(at, written.size(), word), unit, labelled, known, members);
    }
    return;
  }
  members.emplace(std::pair(member, unit), served);
}

Members made_members() {
  Members members;
  const auto known = placeholders();
  for (const StatusFact& fact : kFacts) {
    const auto* unit = std::find_if(kUnits.begin(), kUnits.end(),
                                    [&](const BaseUnit& one) { return one.written == fact.unit; });
    if (unit == kUnits.end()) continue;
    expand(std::string(fact.member), std::string(fact.unit), {&fact.metric, {}, unit->factor},
           known, members);
  }
  return members;
}

}  // namespace

std::span<const StatusFact> status_facts() {
  return kFacts;
}

std::span<const BaseUnit> base_units() {
  return kUnits;
}

const ServedMember* find_served(const std::string& member, const std::string& unit) {
  static const Members kMembers = made_members();
  const auto found = kMembers.find({member, unit});
  return found != kMembers.end() ? &found->second : nullptr;
}

}  // namespace zerodrift::services
