// SPDX-License-Identifier: Apache-2.0
// The unsmoothed compensated stream that a scheme would have made of one axis: every sample within
// a judged label less what was predicted for it; and its statistics. Samples outside the judged
// labels are gaps, so that all streams of one protocol hold the same samples.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/allan/block_statistics.h"
#include "common/allan/coefficients.h"
#include "common/allan/rolling_allan.h"
#include "common/comparison/test_then_train.h"

namespace zerodrift::comparison {

struct StreamReport {
  std::vector<allan::AllanPoint> allan;
  allan::CoefficientReport coefficients;              // N, B, K and the ramp R, with intervals
  allan::PerNoiseTerm<std::optional<double>> slopes;  // read off as the paper may have done
  double block_s = 0.0;                               // a minute, in whole samples
  allan::BlockMoments minute_means;                   // of the means over so long
};

class ResidualStream {
 public:
  ResidualStream(double sample_interval_s, std::span<const std::optional<PredictedPoint>> predicted,
                 double minute_s = 60.0);

  // Sample of point `point`, `missing` samples after the one before; nothing: in no point.
  void add(std::optional<std::size_t> point, double rate_radps, std::uint64_t missing) noexcept;

  [[nodiscard]] StreamReport report() const;

 private:
  std::vector<std::optional<PredictedPoint>> predicted_;
  allan::RollingAllan allan_;
  allan::BlockStatistics minutes_;
};

// Which label a sample belongs to, for samples in the order of time. Begin of a label excluded, its
// end included: a sample's time is the end of its interval.
class PointFinder {
 public:
  explicit PointFinder(std::span<const LabelledPoint> points) : points_(points) {}
  std::optional<std::size_t> find(core::SensorTime time) noexcept;

 private:
  std::span<const LabelledPoint> points_;
  std::size_t next_ = 0;
};

}  // namespace zerodrift::comparison
