// SPDX-License-Identifier: Apache-2.0
#include "services/allan_monitor/report_message.h"

#include <vector>

namespace zerodrift::services {
namespace {

using allan::NoiseTerm;

constexpr std::size_t kMostPoints = 160;  // bound of allan_report's sequences

msg::BlockStatistics to_message(const allan::BlockMoments& moments, double block_s) {
  msg::BlockStatistics message;
  message.block_s(block_s);
  message.mean_radps(moments.mean);
  message.std_radps(moments.standard_deviation);
  message.blocks(moments.blocks);
  return message;
}

std::vector<msg::AllanPoint> to_message(const std::vector<allan::AllanPoint>& points) {
  std::vector<msg::AllanPoint> messages;
  for (const auto& point : points) {
    if (messages.size() == kMostPoints) break;
    msg::AllanPoint message;
    message.tau_s(point.tau_s);
    message.deviation_radps(point.deviation_radps);
    message.lower_radps(point.lower_radps);
    message.upper_radps(point.upper_radps);
    message.degrees_of_freedom(point.degrees_of_freedom);
    message.pairs(point.pairs);
    message.noise_exponent(static_cast<std::int32_t>(point.noise));
    messages.push_back(message);
  }
  return messages;
}

// As allan_report.idl says.
constexpr std::uint64_t identified(allan::Identification identification,
                                   allan::ShortTaus short_taus) {
  switch (identification) {
    case allan::Identification::kInterval: return 1;
    case allan::Identification::kUpperBound: return 2;
    case allan::Identification::kWithheld:
      return short_taus == allan::ShortTaus::kNeverWhite ? 4 : 3;
    case allan::Identification::kNotFitted: break;
  }
  return 0;
}

msg::NoiseCoefficient to_message(const allan::CoefficientReport& fit, NoiseTerm term) {
  const allan::Coefficient& coefficient = fit[term];
  msg::NoiseCoefficient message;
  message.value(coefficient.value);
  message.lower(coefficient.lower);
  message.upper(coefficient.upper);
  message.identified(identified(coefficient.identification, fit.short_taus));
  return message;
}

}  // namespace

msg::AllanReport to_message(const allan::StreamReport& report) {
  msg::AllanReport message;
  message.gaps(static_cast<std::uint32_t>(report.gaps));
  message.missing(report.missing);
  message.longest_gap_s(report.longest_gap_s);
  message.samples(report.samples);
  message.sample_interval_s(report.sample_interval_s);
  message.window_s(report.window_s);
  message.since_start_blocks(to_message(report.since_start_blocks, report.block_s));
  message.rolling_blocks(to_message(report.rolling_blocks, report.block_s));
  const auto& fit = report.coefficients;
  message.fitted_points(static_cast<std::uint32_t>(fit.points));
  message.reduced_chi_square(fit.reduced_chi_square);
  message.quantization(to_message(fit, NoiseTerm::kQuantization));
  message.angle_random_walk(to_message(fit, NoiseTerm::kAngleRandomWalk));
  message.bias_instability(to_message(fit, NoiseTerm::kBiasInstability));
  message.rate_random_walk(to_message(fit, NoiseTerm::kRateRandomWalk));
  message.rate_ramp(to_message(fit, NoiseTerm::kRateRamp));
  message.since_start(to_message(report.since_start));
  message.rolling(to_message(report.rolling));
  return message;
}

}  // namespace zerodrift::services
