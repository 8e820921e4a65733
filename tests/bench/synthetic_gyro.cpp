// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/synthetic_gyro.h"

#include <chrono>
#include <cmath>
#include <numbers>

#include "common/core/units.h"
#include "common/dds/conversions.h"
#include "common/service/monotonic_clock.h"
#include "common/twin/random.h"

namespace zerodrift::bench {
namespace {

constexpr double kNoiseDegH = 2.0;  // of a sample
constexpr double kSwingDegc = 5.0;  // of the chamber, about 25 °C
constexpr double kSwingPeriodS = 600.0;
constexpr double kDriftDegHPerDegc = 0.2;
constexpr double kTemperatureIntervalS = 1.0;

double temperature_degc(double time_s) {
  return 25.0 + kSwingDegc * std::sin(2.0 * std::numbers::pi * time_s / kSwingPeriodS);
}

}  // namespace

SyntheticGyro::SyntheticGyro(dds::Participant& participant, const SyntheticGyroOptions& options)
    : options_(options),
      rates_(participant),
      temperatures_(participant),
      thread_([this] { publish(); }) {}

SyntheticGyro::~SyntheticGyro() {
  stopping_ = true;
  thread_.join();
}

void SyntheticGyro::publish() {
  using Clock = std::chrono::steady_clock;
  const auto period = std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(1.0 / options_.rate_hz));
  const double interval_s = options_.sensor_speed / options_.rate_hz;
  twin::NoiseStream noise(1, "synthetic_gyro");
  core::AngularRateSample rate;
  rate.interval_s = interval_s;
  rate.valid = {true, true, true};
  rate.clock = core::ClockSource::kHardware;
  core::TemperatureSample temperature;
  temperature.probe = "coil";
  temperature.clock = core::ClockSource::kHardware;
  double next_temperature_s = 0.0;
  for (auto due = Clock::now(); !stopping_; due += period) {
    std::this_thread::sleep_until(due);
    ++rate.sequence;
    const double time_s = static_cast<double>(rate.sequence) * interval_s;
    // Readings go ahead of the rates that need them, as a thermometer's do that is read in time.
    if (time_s >= next_temperature_s) {
      next_temperature_s += kTemperatureIntervalS;
      ++temperature.sequence;
      temperature.time = core::from_seconds(time_s);
      temperature.temperature_degc = temperature_degc(time_s);
      auto message = dds::to_message(temperature, options_.gyro_id);
      temperatures_.write(message);
    }
    rate.time = core::from_seconds(time_s);
    const double drift_deg_h = kDriftDegHPerDegc * (temperature_degc(time_s) - 25.0);
    std::uint64_t axis = 0;
    for (double& value : rate.rate_radps)
      value = core::radps_from_deg_h(drift_deg_h +
                                     kNoiseDegH * noise.gaussian(rate.sequence * 3 + axis++));
    auto message = dds::to_message(rate, options_.gyro_id, service::monotonic_ns());
    rates_.write(message);
    newest_ = rate.sequence;
  }
}

}  // namespace zerodrift::bench
