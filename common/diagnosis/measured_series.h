// SPDX-License-Identifier: Apache-2.0
// A record as the diagnosis looks at it: every channel on one uniform grid, block means of what is
// faster than the grid, temperatures smoothed together with their rates. Everything the gyro said
// and everything it was exposed to, and nothing about how it is modelled.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/core/units.h"
#include "common/diagnosis/reading_steps.h"
#include "common/twin/model.h"

namespace zerodrift::diagnosis {

// One row of a record. NaN: not measured.
struct MeasuredRow {
  double time_s = 0.0;
  core::PerAxis<double> rate_radps{};        // frame b
  core::PerAxis<double> reference_radps{};   // true rate, frame b
  std::span<const double> temperature_degc;  // one a probe
  core::PerAxis<double> magnetic_ut{};
  core::PerAxis<double> acceleration_mps2{};
  double vibration_g = 0.0;
  double source_current_ma = 0.0;
  double supply_v = 0.0;
};

// One thermometer on the grid, by local fits over windows about +- half_window_s
// (temperature_course.h).
struct ProbeSeries {
  std::string name;
  std::vector<double> temperature_degc{};
  std::vector<double> rate_degc_per_s{};
  std::vector<double> readings_degc{};  // means over the intervals; NaN: none
  double half_window_s = 0.0;
};

// A channel the record lacks is empty; one it has is complete (short holes are bridged by straight
// lines, ends held).
struct MeasuredSeries {
  static constexpr std::size_t kNotCounted = std::numeric_limits<std::size_t>::max();

  double start_s = 0.0;          // of the first interval
  double interval_s = 0.0;       // of the grid
  double sample_period_s = 0.0;  // of the record
  std::size_t size = 0;
  core::PerAxis<std::vector<double>> rate_radps{};  // 0 where not valid; empty: no such axis
  core::PerAxis<std::vector<std::uint8_t>> valid{};
  // Where the times between two values that follow are half a sample longer than a period: an
  // interval of the grid without a value beside none of these is one that jitter left empty. Not
  // counted: as many as there may be.
  core::PerAxis<std::size_t> holes{kNotCounted, kNotCounted, kNotCounted};
  // Variance of the samples within each interval, (rad/s)²; empty where an interval has fewer than
  // four.
  core::PerAxis<std::vector<double>> sample_variance{};
  bool has_reference = false;
  core::PerAxis<std::vector<double>> reference_radps{};  // all zero without a reference
  // Of single readings, before any mean.
  core::PerAxis<ReadingSteps> rate_steps{};
  core::PerAxis<ReadingSteps> reference_steps{};
  std::vector<ProbeSeries> probes{};
  core::PerAxis<std::vector<double>> magnetic_ut{};
  core::PerAxis<std::vector<double>> acceleration_mps2{};
  std::vector<double> vibration_g{};
  std::vector<double> source_current_ma{};
  std::vector<double> supply_v{};
  // Seconds since the last switch-on at the end of each interval, where supply_v shows one;
  // otherwise the record is taken to begin with it. Samples without supply are not valid.
  std::vector<double> since_power_on_s{};
  std::uint64_t rows = 0;
  std::uint64_t missing_samples = 0;  // the grid expected, from the median period

  [[nodiscard]] bool has(core::Axis axis) const { return !rate_radps[core::index(axis)].empty(); }
  [[nodiscard]] double time_s(std::size_t i) const {
    return start_s + static_cast<double>(i) * interval_s;
  }
};

inline const core::PerAxis<double> kDegPerHour{
    core::radps_from_deg_h(1.0), core::radps_from_deg_h(1.0), core::radps_from_deg_h(1.0)};

struct SeriesOptions {
  std::vector<std::string> probes{};  // names of MeasuredRow::temperature_degc
  bool has_reference = false;
  // Units that the columns are written in.
  core::PerAxis<double> rate_unit_radps = kDegPerHour;
  core::PerAxis<double> reference_unit_radps = kDegPerHour;
  double sample_period_s = 1.0;  // median of the record
  double grid_interval_s = 1.0;  // or the sample period, where that is longer
  double temperature_half_window_s = 45.0;
  std::size_t longest = 40'000;  // grid points; a longer record gets a coarser grid

  // Names the first wrong key.
  [[nodiscard]] std::optional<std::string> validate() const;
};

// Rows in time order go in, the series comes out. Memory O(grid points).
class SeriesBuilder {
 public:
  // Throws std::invalid_argument with validate()'s sentence.
  explicit SeriesBuilder(const SeriesOptions& options);

  void add(const MeasuredRow& row);
  // O(grid points * window). Throws std::invalid_argument where no axis has two valid intervals.
  [[nodiscard]] MeasuredSeries finish();

 private:
  struct Holes {
    std::optional<double> newest_s{};  // a value's
    std::size_t count = 0;

    void add(double time_s, double longest_s);
  };
  struct Mean {
    double sum = 0.0;
    double squares = 0.0;  // about `first`
    double first = 0.0;
    std::uint32_t count = 0;

    void add(double value);
    [[nodiscard]] double mean() const;
    [[nodiscard]] double variance() const;
    void merge(const Mean& other);
  };
  using Channel = std::vector<Mean>;

  [[nodiscard]] std::size_t cell_of(double time_s) const;
  void coarsen();
  [[nodiscard]] std::vector<double> complete(const Channel& channel) const;
  [[nodiscard]] ProbeSeries smoothed(const Channel& channel, const std::string& name) const;
  void mark_power(MeasuredSeries& series) const;
  void take_axis(MeasuredSeries& series, std::size_t axis) const;

  SeriesOptions options_;
  double interval_s_;
  bool blocks_;  // several samples an interval
  std::optional<double> first_time_s_;
  std::size_t cells_ = 0;
  std::uint64_t rows_ = 0;
  // rates, references, magnetic, acceleration, vibration, current, supply, then the probes
  std::vector<Channel> channels_;
  core::PerAxis<Holes> holes_{};
  core::PerAxis<ReadingSteps> rate_steps_{};
  core::PerAxis<ReadingSteps> reference_steps_{};
};

// The temperatures where the model's thermometers are: a first-order lag tau that the model states
// of them is taken off, T = y + tau dy/dt. Else what a quick ramp does is the lag's, and looks like
// effects of the rate's change.
[[nodiscard]] MeasuredSeries without_lags(MeasuredSeries series, const twin::Model& model);

// The intervals from `begin` to before `end` as a record of their own: as much of every channel.
[[nodiscard]] MeasuredSeries part_of(const MeasuredSeries& series, std::size_t begin,
                                     std::size_t end);

}  // namespace zerodrift::diagnosis
