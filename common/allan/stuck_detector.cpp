// SPDX-License-Identifier: Apache-2.0
#include "common/allan/stuck_detector.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace zerodrift::allan {
namespace {

const StuckDetectorOptions& checked(const StuckDetectorOptions& options) {
  if (const auto error = options.validate()) throw std::invalid_argument(*error);
  return options;
}

}  // namespace

std::optional<std::string> StuckDetectorOptions::validate() const {
  if (min_run < 2) return "min_run is " + std::to_string(min_run) + ", must be >= 2 samples";
  if (max_run < min_run) {
    return "max_run is " + std::to_string(max_run) +
           ", must be >= min_run = " + std::to_string(min_run);
  }
  if (!(false_alarm_probability > 0.0 && false_alarm_probability < 1.0)) {
    return "false_alarm_probability is " + std::to_string(false_alarm_probability) +
           ", must be inside (0, 1)";
  }
  if (!(longest_run_factor >= 1.0 && std::isfinite(longest_run_factor))) {
    return "longest_run_factor is " + std::to_string(longest_run_factor) + ", must be >= 1";
  }
  return std::nullopt;
}

StuckDetector::StuckDetector(const StuckDetectorOptions& options) : options_(checked(options)) {}

StuckDetector::Output StuckDetector::add(double value) noexcept {
  if (!std::isfinite(value)) return output_;
  if (run_ > 0 && value == value_) {
    ++run_;
    if (output_ == Output::kAlive && run_ >= options_.min_run && run_ >= stuck_run())
      output_ = Output::kStuck;
    return output_;
  }
  learn_finished_run();
  value_ = value;
  run_ = 1;
  output_ = Output::kAlive;
  return output_;
}

void StuckDetector::learn_finished_run() noexcept {
  if (run_ == 0 || output_ == Output::kStuck) return;
  repeats_ += run_ - 1;
  ++changes_;
  longest_run_ = std::max(longest_run_, run_);
}

double StuckDetector::repeat_probability() const noexcept {
  return static_cast<double>(repeats_ + 1) / static_cast<double>(repeats_ + changes_ + 2);
}

std::uint64_t StuckDetector::stuck_run() const noexcept {
  const auto longest_allowed = static_cast<double>(options_.max_run);
  const double chance =
      1.0 + std::ceil(std::log(options_.false_alarm_probability) / std::log(repeat_probability()));
  const double seen =
      1.0 + std::ceil(options_.longest_run_factor * static_cast<double>(longest_run_));
  const double run = std::max({static_cast<double>(options_.min_run), chance, seen});
  return static_cast<std::uint64_t>(std::min(run, longest_allowed));
}

}  // namespace zerodrift::allan
