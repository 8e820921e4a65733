// SPDX-License-Identifier: Apache-2.0
#include "common/allan/stream_statistics.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace zerodrift::allan {
namespace {

constexpr double kLeastWindow = 64.0;  // samples
constexpr double kLeastLongestTau = 16.0;
constexpr double kLeastStuckRun = 20.0;

RollingAllanOptions deviation_options(const StreamStatisticsOptions& options) {
  RollingAllanOptions result;
  result.sample_interval_s = options.sample_interval_s;
  result.window_s = std::max(options.window_s, kLeastWindow * options.sample_interval_s);
  result.longest_tau_s =
      std::max(options.longest_tau_s, kLeastLongestTau * options.sample_interval_s);
  return result;
}

BlockStatisticsOptions block_options(const StreamStatisticsOptions& options) {
  BlockStatisticsOptions result;
  result.sample_interval_s = options.sample_interval_s;
  result.block_s = std::max(options.block_s, options.sample_interval_s);
  result.window_s = std::max(options.window_s, result.block_s);
  return result;
}

StuckDetectorOptions stuck_options(const StreamStatisticsOptions& options) {
  const auto samples = [&](double duration_s) {
    return static_cast<std::uint64_t>(
        std::max(std::ceil(duration_s / options.sample_interval_s), kLeastStuckRun));
  };
  StuckDetectorOptions result;
  result.min_run = samples(options.stuck_after_s);
  result.max_run = samples(options.stuck_surely_s);
  return result;
}

const StreamStatisticsOptions& checked(const StreamStatisticsOptions& options) {
  if (const auto error = options.validate()) throw std::invalid_argument(*error);
  return options;
}

}  // namespace

std::optional<std::string> StreamStatisticsOptions::validate() const {
  const auto positive = [](double value) { return std::isfinite(value) && value > 0.0; };
  const auto found = [](const char* key, double value, const char* right) {
    return std::string(key) + " is " + std::to_string(value) + ", must be " + right;
  };
  if (!positive(sample_interval_s)) return found("sample_interval_s", sample_interval_s, "> 0 s");
  if (!positive(window_s)) return found("window_s", window_s, "> 0 s");
  if (!positive(longest_tau_s)) return found("longest_tau_s", longest_tau_s, "> 0 s");
  if (!positive(block_s)) return found("block_s", block_s, "> 0 s");
  if (!positive(stuck_after_s)) return found("stuck_after_s", stuck_after_s, "> 0 s");
  if (!(std::isfinite(stuck_surely_s) && stuck_surely_s >= stuck_after_s))
    return found("stuck_surely_s", stuck_surely_s, ">= stuck_after_s");
  if (auto error = deviation_options(*this).validate()) return error;
  return block_options(*this).validate();
}

StreamStatistics::StreamStatistics(const StreamStatisticsOptions& options)
    : sample_interval_s_(checked(options).sample_interval_s),
      window_s_(deviation_options(options).window_s),
      deviations_(deviation_options(options)),
      blocks_(block_options(options)),
      stuck_(stuck_options(options)) {}

void StreamStatistics::add(double rate_radps) noexcept {
  const bool counts = std::abs(rate_radps) <= deviations_.largest_rate_radps();
  if (counts) {
    missing_now_ = 0;
  } else {
    count_missing(1);
  }
  deviations_.add(rate_radps);
  if (takes_blocks_) blocks_.add(rate_radps);
  // To 24 bits: a raw rate that was put together again from compensated rate and drift is off by a
  // rounding, and a frozen one must stay frozen.
  stuck_.add(static_cast<double>(static_cast<float>(rate_radps)));
}

void StreamStatistics::gap(std::uint64_t missing_samples) noexcept {
  count_missing(missing_samples);
  deviations_.gap(missing_samples);
  if (takes_blocks_) blocks_.gap(missing_samples);
}

void StreamStatistics::count_missing(std::uint64_t samples) noexcept {
  missing_ += samples;
  missing_now_ += samples;
  longest_gap_ = std::max(longest_gap_, missing_now_);
}

std::size_t StreamStatistics::memory_bytes() const noexcept {
  const double blocks = std::ceil(window_s_ / blocks_.block_s());
  return sizeof(*this) - sizeof(deviations_) + deviations_.memory_bytes() +
         sizeof(double) * static_cast<std::size_t>(std::max(blocks, 1.0));
}

StreamReport StreamStatistics::report(double mean_interval_s) const {
  const double stretch = mean_interval_s / sample_interval_s_;
  const auto points = [&](Span span) {
    auto stretched = deviations_.points(span);
    for (AllanPoint& point : stretched) point.tau_s *= stretch;
    return stretched;
  };
  StreamReport report;
  report.samples = deviations_.samples();
  report.gaps = deviations_.gaps();
  report.missing = missing_;
  report.longest_gap_s = static_cast<double>(longest_gap_) * mean_interval_s;
  report.sample_interval_s = mean_interval_s;
  report.window_s = window_s_;
  report.since_start = points(Span::kSinceStart);
  report.rolling = points(Span::kRolling);
  report.coefficients =
      fit_coefficients(report.since_start, {.most_octaves_left_out = kMostOctavesLeftOut});
  report.block_s = blocks_.block_s() * stretch;
  report.since_start_blocks = blocks_.moments(Span::kSinceStart);
  report.rolling_blocks = blocks_.moments(Span::kRolling);
  report.output = stuck_.output();
  return report;
}

}  // namespace zerodrift::allan
