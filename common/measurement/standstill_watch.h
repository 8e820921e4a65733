// SPDX-License-Identifier: Apache-2.0
// Which thermometer shows the same for long while another one moves: it is stuck, as a probe that
// came off its bus is. How far that is from what its steps can show is told by its own steps.
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "common/core/time.h"

namespace zerodrift::measurement {

// The time that one shows the same while another moves the most.
struct Standstill {
  core::SensorTime since{0};
  double duration_s = 0.0;
  double value_degc = 0.0;
  double moved_degc = 0.0;  // the other
};

// One thread. No allocation a row. Readings that aren't there (NaN) say nothing.
class StandstillWatch {
 public:
  explicit StandstillWatch(std::size_t probes);

  // A row's readings, degC, by probe. O(probes²).
  void add(core::SensorTime time, const std::vector<double>& readings_degc);
  [[nodiscard]] const Standstill& worst(std::size_t probe) const { return probes_[probe].worst; }

 private:
  struct Probe {
    double value_degc = std::numeric_limits<double>::quiet_NaN();
    double smallest_step_degc = std::numeric_limits<double>::infinity();
    core::SensorTime since{0};
    std::vector<double> others_degc{};  // at that time
    Standstill worst{};
  };
  void stay(Probe& probe, core::SensorTime time, const std::vector<double>& readings_degc);

  std::vector<Probe> probes_;
};

}  // namespace zerodrift::measurement
