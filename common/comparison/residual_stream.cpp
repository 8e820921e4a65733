// SPDX-License-Identifier: Apache-2.0
#include "common/comparison/residual_stream.h"

#include <algorithm>

namespace zerodrift::comparison {
namespace {

allan::RollingAllanOptions allan_options(double sample_interval_s) {
  allan::RollingAllanOptions options;
  options.sample_interval_s = sample_interval_s;
  options.grid = allan::TauGrid::kQuarterOctave;
  options.window_s = std::max(options.window_s, 64.0 * sample_interval_s);
  options.panes = 1;  // only the statistics since the start are asked for
  return options;
}

}  // namespace

ResidualStream::ResidualStream(double sample_interval_s,
                               std::span<const std::optional<PredictedPoint>> predicted,
                               double minute_s)
    : predicted_(predicted.begin(), predicted.end()),
      allan_(allan_options(sample_interval_s)),
      minutes_({.sample_interval_s = sample_interval_s,
                .block_s = std::max(minute_s, sample_interval_s),
                .window_s = std::max(minute_s, sample_interval_s)}) {}

void ResidualStream::add(std::optional<std::size_t> point, double rate_radps,
                         std::uint64_t missing) noexcept {
  const bool judged = point && predicted_[*point];
  if (missing > 0) {
    allan_.gap(missing);
    minutes_.gap(missing);
  }
  if (!judged) {
    allan_.gap(1);
    minutes_.gap(1);
    return;
  }
  const double residual = rate_radps - predicted_[*point]->drift_radps;
  allan_.add(residual);
  minutes_.add(residual);
}

StreamReport ResidualStream::report() const {
  StreamReport out;
  out.allan = allan_.points(allan::Span::kSinceStart);
  allan::CoefficientOptions options;
  options.fitted[allan::index(allan::NoiseTerm::kRateRamp)] = true;
  out.coefficients = allan::fit_coefficients(out.allan, options);
  out.slopes = allan::read_slopes(out.allan);
  out.block_s = minutes_.block_s();
  out.minute_means = minutes_.moments(allan::Span::kSinceStart);
  return out;
}

std::optional<std::size_t> PointFinder::find(core::SensorTime time) noexcept {
  while (next_ < points_.size() && points_[next_].end < time) ++next_;
  if (next_ == points_.size() || time <= points_[next_].begin) return std::nullopt;
  return next_;
}

}  // namespace zerodrift::comparison
