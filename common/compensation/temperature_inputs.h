// SPDX-License-Identifier: Apache-2.0
// The temperatures of the probes that matter, each reading in its queue until its sensor time has
// come, then in its probe's track and in the experts' thermal memory.
//
// The data path's thread; noexcept, no allocation; O(1) a reading.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/compensation/drift_prior.h"
#include "common/compensation/input_alignment.h"
#include "common/compensation/options.h"
#include "common/core/mode.h"
#include "common/core/samples.h"
#include "common/core/state_archive.h"
#include "common/experts/thermal_basis.h"
#include "common/thermal/features.h"
#include "common/thermal/temperature_track.h"

namespace zerodrift::compensation {

// What the experts' thermal basis counts temperatures and rates in: as the features that the
// regression has, of the first temperature and of the first rate.
struct ThermalScales {
  explicit ThermalScales(const CompensationOptions& options);

  double temperature_degc = 1.0;
  double rate_degc_per_s = 1.0;
};

// What of a probe was refused, and the last of it. Of what this process was given: no part of the
// state.
struct RefusedReadings {
  std::uint64_t count = 0;
  thermal::ReadingVerdict why{};
  thermal::Reading last{};
  std::optional<double> newest_degc{};  // of the readings that were taken until then
};

// What the last refused reading of a probe was and what would be right, a line for people.
[[nodiscard]] std::string refused_text(const std::string& probe, const RefusedReadings& refused,
                                       const thermal::TemperatureTrackOptions& track);

class TemperatureInputs {
 public:
  // One line where the tracks can't reach back as far as a probe that stands still is compared with
  // the others. Of options that are in range.
  [[nodiscard]] static std::optional<std::string> find_wrong(const CompensationOptions& options);

  // `longest_lag_s`: how far back features look.
  TemperatureInputs(const CompensationOptions& options, double longest_lag_s);

  void push(const core::TemperatureSample& sample) noexcept;
  // A rate came (TemperatureQueue::note_rate).
  void note_rate() noexcept { queue_.note_rate(); }
  // Whoever published the probe left.
  void end(std::size_t probe) noexcept { queue_.end(probe); }
  // Probes that are not among those named, separated by commas, and never came, are not
  // waited for.
  void limit(std::string_view published) noexcept;
  void give_up_waiting(core::SensorTime rate_time) noexcept;

  // Everything that a rate sample of that time is to know has come.
  [[nodiscard]] bool complete_for(core::SensorTime rate_time) const noexcept {
    return queue_.complete_to(rate_time - delay_);
  }
  // Takes what a rate sample of that time knows. True: a track has a new reading.
  bool take_for(core::SensorTime rate_time) noexcept;

  // The source of rates began anew: what is of publishers that left goes.
  void restart_ended() noexcept { queue_.restart_ended(); }
  // Their time began anew.
  void restart() noexcept { queue_.restart(); }
  // The rates' time began anew: tracks and thermal memory begin anew with it.
  void forget_time() noexcept;

  [[nodiscard]] const std::vector<std::string>& probes() const noexcept { return probes_; }
  [[nodiscard]] const std::vector<thermal::TemperatureTrack>& tracks() const noexcept {
    return tracks_;
  }
  [[nodiscard]] const experts::ThermalState& thermal_state() const noexcept {
    return thermal_.state();
  }
  // For the prior, by probe; NaN where too old or never measured. Valid until the next call.
  [[nodiscard]] const std::vector<PriorReading>& readings(core::SensorTime now) noexcept;
  // Why features of that status, or made now, are not to be relied on; kNone: they are.
  [[nodiscard]] core::Reason reason(thermal::FeatureStatus status,
                                    core::SensorTime now) const noexcept;
  // Newest of the first probe, NaN where there is none.
  [[nodiscard]] double first_degc() const noexcept;
  [[nodiscard]] double first_rate_degc_per_s() const noexcept;
  // Of the first probe there is no temperature that is young enough.
  [[nodiscard]] bool is_stale(core::SensorTime now) const noexcept;

  // Part of the state already.
  [[nodiscard]] bool has_received(const core::TemperatureSample& sample) const noexcept;
  [[nodiscard]] std::uint64_t received() const noexcept { return received_; }
  // Not finite, implausible, late.
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }
  [[nodiscard]] const std::vector<RefusedReadings>& refused_by_probe() const noexcept {
    return refused_by_probe_;
  }

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) {
    archive(queue_);
    for (auto& track : tracks_) archive(track);
    archive(thermal_, received_, refused_);
  }

 private:
  // Which reading the experts' thermal basis follows, and its scales.
  struct Basis {
    Basis(const CompensationOptions& options, const std::vector<std::string>& probes);

    std::optional<std::size_t> probe{};
    ThermalScales scales;
  };

  void refuse(std::size_t probe, thermal::ReadingVerdict why,
              const thermal::Reading& reading) noexcept;
  // A probe has stood still for long while another moved.
  [[nodiscard]] bool one_is_stuck(core::SensorTime now) const noexcept;

  std::vector<std::string> probes_;
  core::SensorTime delay_;
  core::SensorTime stuck_after_;
  core::SensorTime stale_after_;
  Basis basis_;
  TemperatureQueue queue_;
  std::vector<thermal::TemperatureTrack> tracks_;
  experts::ThermalMemory thermal_;
  std::vector<PriorReading> readings_;
  std::uint64_t received_ = 0;
  std::uint64_t refused_ = 0;
  std::vector<RefusedReadings> refused_by_probe_;
};

}  // namespace zerodrift::compensation
