// SPDX-License-Identifier: Apache-2.0
// The whole compensation of one axis, point by point, as Mao et al. (2022) time it in their table 2
// ("from the temperature rate to the compensated output", 15 000 points): the thermometer's
// readings through eq. (12), the features, the forecast, the output less the forecast, and the
// point learned.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "common/core/time.h"

namespace zerodrift::bench {

// A record like theirs, prepared like theirs (common/comparison/paper_preparation.h): 5 h at
// 200 Hz, from -15 °C to 50 °C, a drift of 4 deg/h with the noise that their best compensation
// leaves.
struct PaperLikeRecord {
  struct Reading {
    core::SensorTime time{0};
    double temperature_degc = 0.0;
  };
  struct Point {
    core::SensorTime time{0};       // of the last sample in it
    double temperature_degc = 0.0;  // mean of the minute
    double rate_radps = 0.0;        // mean of the minute: the uncompensated output
    std::size_t readings = 0;       // of the thermometer, up to `time`
  };

  double interval_s = 0.0;      // from point to point
  double point_variance = 0.0;  // of a point as a measurement, (rad/s)²
  std::vector<Reading> readings{};
  std::vector<Point> points{};
};

// The same every time. Takes about a second.
PaperLikeRecord paper_like_record();

struct ChainMeasurement {
  std::size_t labels_held = 0;
  std::vector<double> step_us{};    // least of the repeats
  double residual_rms_deg_h = 0.0;  // of the compensated output
};

// Nothing if stopped by a signal.
std::optional<ChainMeasurement> measure_chain(const PaperLikeRecord& record,
                                              std::size_t labels_held, std::size_t repeats);

// What the experts of an axis cost beside its online SVR, which is left out: those by time and
// temperature and those by time alone, each point a label. Nothing if stopped by a signal.
std::optional<std::vector<double>> measure_experts(const PaperLikeRecord& record,
                                                   std::size_t repeats);

// What the paper states for its own chain, µs a point.
double paper_chain_us();

}  // namespace zerodrift::bench
