// SPDX-License-Identifier: Apache-2.0
#include "common/measurement/standstill_watch.h"

#include <algorithm>
#include <cmath>

namespace zerodrift::measurement {
namespace {

// A coarse thermometer shows the same while the others move by a step or two of its own.
constexpr double kMostOwnSteps = 5.0;

}  // namespace

StandstillWatch::StandstillWatch(std::size_t probes) : probes_(probes) {
  for (Probe& probe : probes_)
    probe.others_degc.assign(probes, std::numeric_limits<double>::quiet_NaN());
}

void StandstillWatch::add(core::SensorTime time, const std::vector<double>& readings_degc) {
  for (std::size_t p = 0; p < probes_.size(); ++p) {
    Probe& probe = probes_[p];
    const double reading = readings_degc[p];
    if (!std::isfinite(reading)) continue;
    if (reading == probe.value_degc && time >= probe.since) {
      stay(probe, time, readings_degc);
      continue;
    }
    const double step = std::abs(reading - probe.value_degc);
    if (step > 0.0) probe.smallest_step_degc = std::min(probe.smallest_step_degc, step);
    probe.value_degc = reading;
    probe.since = time;
    probe.others_degc = readings_degc;
  }
}

void StandstillWatch::stay(Probe& probe, core::SensorTime time,
                           const std::vector<double>& readings_degc) {
  double moved = 0.0;
  for (std::size_t q = 0; q < readings_degc.size(); ++q) {
    const double by = std::abs(readings_degc[q] - probe.others_degc[q]);
    if (std::isfinite(by)) moved = std::max(moved, by);
  }
  const bool is_coarse =
      moved < kMostOwnSteps * probe.smallest_step_degc && std::isfinite(probe.smallest_step_degc);
  Standstill& worst = probe.worst;
  if (!is_coarse && moved > worst.moved_degc) worst = {probe.since, 0.0, probe.value_degc, moved};
  if (worst.moved_degc > 0.0 && worst.since == probe.since)
    worst.duration_s = core::seconds(time - probe.since);
}

}  // namespace zerodrift::measurement
