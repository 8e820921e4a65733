// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/curves.h"

#include "common/diagnosis/gap.h"
#include "common/diagnosis/generic_functions.h"
#include "common/diagnosis/held_out.h"

namespace zerodrift::diagnosis {
namespace {

std::vector<double> means_on(const std::vector<double>& centres, const std::vector<double>& values,
                             std::size_t block) {
  std::vector<double> means;
  for (const double centre : centres) {
    const auto begin = static_cast<std::size_t>(centre - 0.5 * static_cast<double>(block));
    double sum = 0.0;
    for (std::size_t i = begin; i < begin + block; ++i) sum += values[i];
    means.push_back(sum / static_cast<double>(block));
  }
  return means;
}

}  // namespace

Waveforms waveforms_of(const MeasuredSeries& series, const std::vector<double>& measured,
                       const std::vector<std::uint8_t>& valid, const std::vector<double>& before,
                       const std::vector<double>& after) {
  const std::size_t block = intervals_in(kMeanS, series.interval_s);
  const BlockMeans means = block_means(measured, valid, block);
  Waveforms curves;
  for (const double centre : means.centre)
    curves.time_s.push_back(series.start_s + centre * series.interval_s);
  curves.measured_radps = means.mean;
  curves.before_radps = means_on(means.centre, before, block);
  curves.after_radps = means_on(means.centre, after, block);
  return curves;
}

std::optional<ResidualAgainstInput> residual_against_input(const AxisDiagnosis& axis,
                                                           const MeasuredSeries& series,
                                                           core::Axis which,
                                                           const std::vector<double>& residual,
                                                           const std::vector<double>& explained,
                                                           const std::vector<std::uint8_t>& valid) {
  const auto channels = moving_inputs(series, which);
  std::string wanted;
  if (axis.unknown && !axis.unknown->depends_on.empty()) {
    wanted = axis.unknown->depends_on.front();
  } else if (!axis.effects.empty() && !axis.effects.front().inputs.empty()) {
    wanted = "temperature_" + axis.effects.front().inputs.front();
  } else if (!axis.where.empty()) {
    wanted = axis.where.front().kind;
  }
  if (channels.empty() || wanted.empty()) return std::nullopt;
  const InputChannel* channel = &channels.front();
  for (const InputChannel& candidate : channels) {
    if (candidate.name == wanted) channel = &candidate;
  }
  const std::size_t block = intervals_in(kMeanS, series.interval_s);
  const BlockMeans means = block_means(residual, valid, block);
  return ResidualAgainstInput{channel->name + " (" + channel->unit + ")",
                              means_on(means.centre, channel->values, block), means.mean,
                              means_on(means.centre, explained, block)};
}

}  // namespace zerodrift::diagnosis
