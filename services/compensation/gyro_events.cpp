// SPDX-License-Identifier: Apache-2.0
#include "services/compensation/gyro_events.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "common/compensation/input_faults.h"
#include "common/core/integer_time.h"
#include "common/service/counted_event.h"
#include "services/compensation/gyro.h"

namespace zerodrift::services {

using compensation::Readiness;
using core::Reason;
using service::Severity;

namespace {

constexpr std::int64_t kReportWaitingNs = 2000000000;          // after so long it is reported
constexpr core::SensorTime kClocksAgreeWithin{2'000'000'000};  // of one host, or of PTP or NTP

constexpr std::string_view temperature_fault_text(Reason reason) {
  switch (reason) {
    case Reason::kTemperatureMissing:
      return "no temperature of a probe that a feature or the prior needs";
    case Reason::kTemperatureStale:
      return "no temperature of the last temperature_stale_s: its stream stopped, or is stamped "
             "behind the rates";
    default: return "a probe has not moved for probe_stuck_s while others do";
  }
}

using compensation::ReferenceVerdict;
// Refusals that somebody ought to know of; the others are as configured, or in the order of things.
constexpr std::array kReferenceFaults{
    ReferenceVerdict::kUnknownKind,   ReferenceVerdict::kUncertain,
    ReferenceVerdict::kMoreThanEarth, ReferenceVerdict::kEarthRateIncluded,
    ReferenceVerdict::kWrongEpoch,    ReferenceVerdict::kImplausible,
    ReferenceVerdict::kDistrusted};

constexpr std::string_view reference_fault_text(ReferenceVerdict verdict) {
  switch (verdict) {
    case ReferenceVerdict::kUnknownKind: return "a rate reference of an unknown kind; not used";
    case ReferenceVerdict::kUncertain:
      return "a rate reference whose variance is above the limit or no number; not used";
    case ReferenceVerdict::kMoreThanEarth:
      return "a rest reference that turns faster than the Earth; not used";
    case ReferenceVerdict::kEarthRateIncluded:
      return "a rest reference, while earth_rate.mode says that Earth rate counts as drift; not "
             "used, or it would be taken off twice";
    case ReferenceVerdict::kWrongEpoch:
      return "a residual of another model than was in force at its time; not used";
    case ReferenceVerdict::kImplausible:
      return "a residual further off than forecast and residual explain; not used";
    default: return "a residual after several implausible ones; not used until the next label";
  }
}

// By Gyro::kReferencePlaces.
constexpr std::array<std::string_view, Gyro::kReferencePlaces.size()> kReferences{
    "what the true rate is", "whether the gyro rests", "how far the drift is off"};

using Counts = compensation::CompensatorCounts;
constexpr std::array<service::CountedEvent<Counts>, 12> kCountedEvents{
    {{&Counts::invalid, "invalid_sample",
      "a rate is not finite or marked invalid; passed on marked invalid, not learned"},
     {&Counts::duplicates, "duplicate_sample", "a sequence number came twice; answered once"},
     {&Counts::late, "late_sample",
      "a sequence number came after a later one; answered, not learned"},
     {&Counts::too_old, "too_old_sample",
      "a sequence number more than 4096 behind the newest; not answered"},
     {&Counts::missing, "missing_sample", "sequence numbers are missing from the stream"},
     {&Counts::time_faults, "time_fault",
      "a time stamp jumps or does not increase; answered, not learned"},
     {&Counts::late_models, "late_model",
      "the learner was late; samples went out with the model before"},
     {&Counts::labels_skipped, "skipped_label",
      "the learner's queue was full; a label was skipped"},
     {&Counts::short_rests, "short_rest", compensation::kShortRestText},
     {&Counts::own_outputs, "double_correction", compensation::kDoubleCorrectionText},
     {&Counts::costly_priors, "costly_prior", compensation::kCostlyPriorText},
     {&Counts::unforeseen_starts, "unforeseen_start", compensation::kUnforeseenStartText}}};

using SyncCounts = service::InstanceSync::Counts;
constexpr std::array<service::CountedEvent<SyncCounts>, 3> kInstanceEvents{
    {{&SyncCounts::takeovers, "took_over",
      "leads from now on: it takes commands, and writes what one instance writes"},
     {&SyncCounts::step_backs, "stepped_back",
      "is no longer in sync and writes nothing: it differs from a senior one, or its learner "
      "hangs"},
     {&SyncCounts::differing, "instances_differ", "answers otherwise than another"}}};

}  // namespace

service::Occurrence GyroEvents::occurrence(core::SensorTime at) const {
  return {
      .text = "gyro " + std::to_string(id_) + ": ", .gyro_id = id_, .sensor_time_ns = at.count()};
}

void GyroEvents::raise(const char* code, Severity severity, const std::string& text,
                       core::SensorTime at) {
  service::Occurrence raised = occurrence(at);
  raised.code = code;
  raised.severity = severity;
  raised.text += text;
  host_.raise(raised);
}

void GyroEvents::raise_counted(const std::string& code, std::string_view text, std::uint64_t before,
                               std::uint64_t after, core::SensorTime at,
                               const std::string& subject) {
  if (after <= before) return;
  service::Occurrence counted = occurrence(at);
  counted.subject = subject;
  counted.code = code;
  counted.text += text;
  host_.raise_counted(std::move(counted), after - before);
}

void GyroEvents::go_on_from(const compensation::Compensator& compensator) {
  reported_ = compensator.counts();
  reported_temperatures_refused_ = compensator.refused_temperatures();
}

void GyroEvents::report(Gyro& gyro, std::int64_t now_ns) {
  report_waiting(gyro, now_ns);
  report_clocks(gyro);
  report_faults(gyro);
  report_modes(gyro);
  report_temperature(gyro);
  report_instances(gyro);
}

// Silence decides nothing: who is silent may be standing still.
void GyroEvents::report_waiting(Gyro& gyro, std::int64_t now_ns) {
  const core::SensorTime needed = gyro.compensator().needed_time();
  if (gyro.take_input_ended())
    raise("stream_ended", Severity::kWarning,
          "the publisher of a temperature or reference left; going on without", needed);
  const std::int64_t subscribers_ns = gyro.awaits_subscribers_since_ns();
  const std::int64_t since_ns =
      subscribers_ns != 0 ? subscribers_ns : gyro.pipeline().waiting_since_ns();
  const bool is_long = since_ns != 0 && now_ns - since_ns > kReportWaitingNs;
  waiting_ = !is_long              ? ""
             : subscribers_ns != 0 ? "answers wait for subscribers of compensated_rate"
             : gyro.compensator().readiness() == Readiness::kAwaitsReference
                 ? "rates wait for a reference whose publisher says nothing"
                 : "rates wait for temperatures; is thermal_publisher running?";
  if (!is_long || reported_waiting_since_ns_ == since_ns) return;
  reported_waiting_since_ns_ = since_ns;
  raise(subscribers_ns != 0 ? "subscribers_awaited" : "stream_silent", Severity::kWarning, waiting_,
        needed);
}

// A temperature from the future is not used until its time comes, one of long ago passes for stale.
void GyroEvents::report_clocks(const Gyro& gyro) {
  const core::SensorTime rate = gyro.newest().raw.time;
  const core::SensorTime temperature = gyro.newest_temperature();
  const bool is_known = gyro.compensator().counts().samples_out > 0 &&
                        temperature != core::kNever && !gyro.is_paced();
  const core::SensorTime ahead = core::saturating_difference(temperature, rate);
  const core::SensorTime behind = gyro.temperature_behind();
  const bool disagrees = is_known && (ahead > kClocksAgreeWithin || behind > kClocksAgreeWithin);
  if (disagrees && !reported_clocks_) {
    const bool is_ahead = ahead > kClocksAgreeWithin;
    raise("clocks_disagree", Severity::kWarning,
          fmt::format("a temperature is stamped {:.6f} s {} the rates; do their publishers' clocks "
                      "agree?",
                      core::seconds(is_ahead ? ahead : behind), is_ahead ? "ahead of" : "behind"),
          rate);
  }
  reported_clocks_ = disagrees;
}

void GyroEvents::report_faults(const Gyro& gyro) {
  const compensation::CompensatorCounts now = gyro.compensator().counts();
  const compensation::CompensatorCounts& reported = reported_;
  const core::SensorTime at = gyro.newest().raw.time;
  service::raise_grown(host_, kCountedEvents, occurrence(at), reported, now);
  raise_counted("polarity_reversed", compensation::reversed_text(gyro.compensator()),
                reported.reversed_axes, now.reversed_axes, at);
  for (const auto verdict : kReferenceFaults) {
    const auto v = static_cast<std::size_t>(verdict);
    const std::string code = "reference_" + std::string(compensation::name(verdict));
    raise_counted(code, reference_fault_text(verdict), reported.references[v], now.references[v],
                  at);
  }
  reported_ = now;
  report_refused_temperatures(gyro);
  report_second_publishers(gyro);
}

void GyroEvents::report_refused_temperatures(const Gyro& gyro) {
  const auto& probes = gyro.compensator().probes();
  const auto& refused = gyro.compensator().refused_temperatures();
  reported_temperatures_refused_.resize(probes.size());
  for (std::size_t p = 0; p < probes.size(); ++p) {
    if (refused[p].count <= reported_temperatures_refused_[p].count) continue;
    raise_counted("refused_temperature",
                  compensation::refused_text(probes[p], refused[p], gyro.configured.track),
                  reported_temperatures_refused_[p].count, refused[p].count, gyro.newest().raw.time,
                  probes[p]);
  }
  reported_temperatures_refused_ = refused;
}

void GyroEvents::report_second_publishers(const Gyro& gyro) {
  const core::SensorTime at = gyro.newest().raw.time;
  raise_counted("duplicate_publisher", "a second publisher uses this id; only the first is used",
                reported_rejected_, gyro.pipeline().rejected(), at);
  reported_rejected_ = gyro.pipeline().rejected();
  const auto& probes = gyro.compensator().probes();
  reported_temperatures_rejected_.resize(probes.size());
  for (std::size_t p = 0; p < probes.size(); ++p) {
    const std::uint64_t rejected = gyro.temperatures_rejected(p);
    raise_counted("duplicate_publisher",
                  "a second publisher sends temperatures of " + probes[p] +
                      "; only the first is used, until it is gone or silent",
                  reported_temperatures_rejected_[p], rejected, at, probes[p]);
    reported_temperatures_rejected_[p] = rejected;
  }
  for (std::size_t r = 0; r < kReferences.size(); ++r) {
    const std::uint64_t rejected = gyro.references_rejected(r);
    raise_counted(
        "duplicate_publisher",
        fmt::format("a second publisher says {}; only the first is used, until it is gone "
                    "or silent",
                    kReferences[r]),
        reported_references_rejected_[r], rejected, at, std::string(kReferences[r]));
    reported_references_rejected_[r] = rejected;
  }
}

void GyroEvents::report_modes(const Gyro& gyro) {
  for (const auto axis : core::kAxes) {
    const std::size_t i = core::index(axis);
    const auto mode = gyro.newest().mode[i];
    const auto reason = gyro.newest().reason[i];
    if (mode == reported_mode_[i] && reason == reported_reason_[i]) continue;
    // Motion, settling and the like within one mode are one story, which its first event reports.
    const bool goes_on = mode == reported_mode_[i] && core::passes_by_itself(reason) &&
                         core::passes_by_itself(reported_reason_[i]);
    reported_mode_[i] = mode;
    reported_reason_[i] = reason;
    if (goes_on) continue;
    host_.raise({.code = "mode_" + std::string(core::name(axis)),
                 .severity = Severity::kInformation,
                 .text = "axis " + std::string(core::name(axis)) + ": " +
                         std::string(core::name(mode)) + " (" + std::string(core::name(reason)) +
                         ")",
                 .gyro_id = id_,
                 .sensor_time_ns = gyro.newest().raw.time.count()});
  }
}

// The axes share their thermometers: reported once for all of them, each time it begins.
void GyroEvents::report_temperature(const Gyro& gyro) {
  const auto& reasons = gyro.newest().reason;
  const auto fault = std::find_if(reasons.begin(), reasons.end(), core::lacks_temperature);
  const Reason now = fault == reasons.end() ? Reason::kNone : *fault;
  if (now == reported_temperature_fault_) return;
  reported_temperature_fault_ = now;
  if (now == Reason::kNone) return;
  raise(std::string(core::name(now)).c_str(), Severity::kWarning,
        std::string(temperature_fault_text(now)) + "; the model is not used",
        gyro.newest().raw.time);
}

void GyroEvents::report_instances(const Gyro& gyro) {
  const core::SensorTime at = gyro.newest().raw.time;
  if (gyro.hangs() && !reported_hanging_)
    raise("learner_hangs", Severity::kError,
          "a model is late by more than 2 s; samples go out with the one before", at);
  reported_hanging_ = gyro.hangs();
  const service::InstanceSync::Counts now = gyro.pipeline().sync().counts();
  service::Occurrence common = occurrence(at);
  common.text += "instance " + std::to_string(instance_) + " ";
  service::raise_grown(host_, kInstanceEvents, common, reported_sync_, now);
  raise_counted("unheard_samples",
                "instance " + std::to_string(instance_) + " dropped answers that nobody wrote",
                reported_dropped_, gyro.pipeline().dropped(), at);
  reported_sync_ = now;
  reported_dropped_ = gyro.pipeline().dropped();
}

}  // namespace zerodrift::services
