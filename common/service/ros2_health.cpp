// SPDX-License-Identifier: Apache-2.0
#include "common/service/ros2_health.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <utility>

#include "common/core/counted.h"
#include "common/core/units.h"

namespace zerodrift::service {
namespace {

using core::Mode;
using core::Reason;
using dds::RosLevel;

constexpr std::chrono::nanoseconds kSilentAfter = std::chrono::seconds(2);
constexpr double kSilentIntervals = 3.0;
constexpr std::size_t kMostServices = 100;  // names may come from anybody
constexpr const char* kPrefix = "zerodrift: ";

bool is_chosen(Reason reason) noexcept {
  return reason == Reason::kSchemeNone || reason == Reason::kCommanded;
}

RosLevel level_of(Mode mode, Reason reason) noexcept {
  if (reason == Reason::kInvalidInput || reason == Reason::kPolarityReversed)
    return RosLevel::kError;
  if (is_chosen(reason)) return RosLevel::kOk;
  const bool passes = core::passes_by_itself(reason);
  if (mode == Mode::kPassthrough) return passes ? RosLevel::kWarn : RosLevel::kError;
  return passes && mode != Mode::kOutOfDomain ? RosLevel::kOk : RosLevel::kWarn;
}

// `invalid`: samples since the report before. The newest sample alone says nothing of a fault that
// comes every so many samples.
std::string text_of(Mode mode, Reason reason, std::uint64_t invalid) {
  std::string text{core::name(mode)};
  if (reason != Reason::kNone) text += " (" + std::string(core::name(reason)) + ")";
  if (invalid == 0 || reason == Reason::kInvalidInput) return text;
  return text + ", " + core::counted(invalid, "sample") + " with " +
         std::string(core::name(Reason::kInvalidInput)) + " since the report before";
}

void judge_axes(const GyroFacts& gyro, dds::RosStatus& status) {
  std::map<std::string, std::string> axes_by_text;
  for (const auto axis : core::kAxes) {
    const std::size_t i = core::index(axis);
    if (!gyro.measured[i]) continue;
    const Mode mode = gyro.newest.mode[i];
    const Reason reason = gyro.newest.reason[i];
    status.level = std::max(status.level, level_of(mode, reason));
    if (gyro.invalid[i] > 0) status.level = RosLevel::kError;
    std::string& axes = axes_by_text[text_of(mode, reason, gyro.invalid[i])];
    axes += (axes.empty() ? "" : ", ") + std::string(core::name(axis));
  }
  for (const auto& [text, axes] : axes_by_text)
    status.message += (status.message.empty() ? "" : "; ") + axes + ": " + text;
  if (!axes_by_text.empty()) return;
  status.level = RosLevel::kError;
  status.message = "no axis has had a valid sample";
}

}  // namespace

bool is_silent(std::chrono::nanoseconds silence, double interval_s) noexcept {
  return silence > kSilentAfter &&
         silence > std::chrono::duration<double>(kSilentIntervals * interval_s);
}

dds::RosStatus status_of(const GyroFacts& gyro, const std::string& service) {
  dds::RosStatus status{.name = kPrefix + service + fmt::format(" gyro {}", gyro.gyro_id),
                        .hardware_id = fmt::format("gyro_{}", gyro.gyro_id)};
  judge_axes(gyro, status);
  if (gyro.health == InstanceSync::Health::kHangs) {
    status.level = RosLevel::kError;
    status.message = "the learner hangs; " + status.message;
  } else if (gyro.health == InstanceSync::Health::kBehind) {
    status.level = std::max(status.level, RosLevel::kWarn);
    status.message = "catches up, and writes nothing; " + status.message;
  }
  if (is_silent(gyro.silence, gyro.newest.raw.interval_s)) {
    status.level = RosLevel::kStale;
    status.message = fmt::format("no sample for {:.0f} s; before: ",
                                 std::chrono::duration<double>(gyro.silence).count()) +
                     status.message;
  }
  for (const auto axis : core::kAxes) {
    const std::size_t i = core::index(axis);
    status.values.emplace_back(
        fmt::format("drift {} [deg/h]", core::name(axis)),
        fmt::format("{:.4f}", core::deg_h_from_radps(gyro.newest.applied_drift_radps[i])));
  }
  status.values.emplace_back("temperature [degC]", fmt::format("{:.3f}", gyro.temperature_degc));
  status.values.emplace_back("model epoch", fmt::format("{}", gyro.newest.model_epoch));
  status.values.emplace_back("sensor time [s]",
                             fmt::format("{:.3f}", core::seconds(gyro.newest.raw.time)));
  return status;
}

void ServiceRoster::receive(const msg::ServiceStatus& status, const Guid& writer) {
  const std::string name(status.service().c_str());
  if (name.find(':') != std::string::npos) return;
  const std::lock_guard lock(mutex_);
  if (!entries_.contains(writer)) {
    std::erase_if(entries_, [&](const auto& entry) {
      return entry.second.name == name && entry.second.presence != Presence::kHere;
    });
    if (entries_.size() >= kMostServices) return;
  }
  entries_[writer] = {.name = name,
                      .state = static_cast<State>(status.state()),
                      .host = status.host().c_str(),
                      .summary = status.summary().c_str(),
                      .process_id = status.process_id()};
}

void ServiceRoster::note_gone(const Guid& writer, dds::Departure departure) {
  const std::lock_guard lock(mutex_);
  const auto found = entries_.find(writer);
  if (found == entries_.end()) return;
  const bool left = departure == dds::Departure::kLeft;
  if (left && found->second.state == State::kStopping) {
    entries_.erase(found);
  } else {
    found->second.presence = left ? Presence::kDied : Presence::kSilent;
  }
}

std::vector<dds::RosStatus> ServiceRoster::statuses() const {
  std::map<std::string, dds::RosStatus> by_name;
  const std::lock_guard lock(mutex_);
  for (const auto& [writer, entry] : entries_) {
    dds::RosStatus status = status_of(entry);
    const auto [place, is_first] = by_name.try_emplace(entry.name, status);
    if (!is_first && status.level > place->second.level) place->second = std::move(status);
  }
  std::vector<dds::RosStatus> all;
  for (auto& [name, status] : by_name) all.push_back(std::move(status));
  return all;
}

dds::RosStatus ServiceRoster::status_of(const Entry& entry) {
  dds::RosStatus status{.name = kPrefix + entry.name, .hardware_id = entry.host};
  const std::string said =
      std::string(state_name(entry.state)) + (entry.summary.empty() ? "" : ", " + entry.summary);
  switch (entry.presence) {
    case Presence::kHere:
      status.level = entry.state == State::kRunning ? RosLevel::kOk : RosLevel::kWarn;
      status.message = said;
      break;
    case Presence::kSilent:
      status.level = RosLevel::kStale;
      status.message = "says nothing; before: " + said;
      break;
    case Presence::kDied:
      status.level = RosLevel::kError;
      status.message = "is gone, and did not stop in order; before: " + said;
      break;
  }
  status.values.emplace_back("process", fmt::format("{}", entry.process_id));
  return status;
}

}  // namespace zerodrift::service
