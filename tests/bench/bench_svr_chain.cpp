// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/bench_svr_chain.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "common/allan/noise_units.h"
#include "common/comparison/compared_scheme.h"
#include "common/comparison/paper_preparation.h"
#include "common/comparison/paper_procedure.h"
#include "common/compensation/axis_stack.h"
#include "common/core/units.h"
#include "common/service/host.h"
#include "common/thermal/sliding_mean_rate.h"
#include "common/twin/simulation.h"
#include "services/zerodrift/progress_bar.h"

namespace zerodrift::bench {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr double kSampleRateHz = 200.0;
constexpr double kAngleRandomWalkDegRth = 2.21e-4;
constexpr double kTemperatureScaleDegc = 10.0;
constexpr double kSecondsPerMinute = 60.0;
constexpr const char* kProbe = "coil";

twin::EffectSpec effect(const char* kind, std::map<std::string, double> parameters) {
  return {.kind = kind, .axis = core::Axis::kX, .parameters = std::move(parameters)};
}

// Axis x of config/models/paper_fog.yaml.
twin::Model paper_like_gyro() {
  twin::Model model;
  model.gyro_id = "paper_fog";
  model.probes = {{.name = kProbe,
                   .node = twin::TemperaturePoint::kCoil,
                   .rate_hz = 10.0,
                   .lag_s = 5.0,
                   .noise_degc = 0.005,
                   .quantisation_degc = 0.01}};
  model.effects = {
      effect("bias", {{"bias_deg_h", -1.5715}}),
      effect("bias_temperature", {{"reference_degc", 25.0},
                                  {"c1_deg_h_per_degc", 0.06657},
                                  {"c2_deg_h_per_degc2", 1.4823e-3}}),
      effect("shupe", {{"coefficient_deg_h_min_per_degc", 3.286}}),
      effect("coil_lag", {{"coefficient_deg_h_min_per_degc", -1.854}, {"tau_s", 900.0}}),
      effect("warm_up", {{"amplitude_deg_h", -0.7}, {"tau_s", 900.0}}),
      effect("angle_random_walk", {{"coefficient_deg_per_sqrt_h", kAngleRandomWalkDegRth}}),
      effect("bias_instability", {{"coefficient_deg_h", 1.81e-3}}),
      effect("rate_random_walk", {{"coefficient_deg_per_h_1_5", 1.57e-2}})};
  return model;
}

// config/profiles/paper_chamber.yaml.
twin::Profile paper_like_chamber() {
  twin::Profile profile;
  profile.duration_s = 18000.0;
  profile.initial_temperature_degc = -15.0;
  profile.chamber = {{600.0, -15.0}, {4500.0, 50.0}};
  return profile;
}

// White noise of N has the variance N²/tau in a mean over tau.
double variance_of_a_minute() {
  const double n_rad_rts = allan::angle_random_walk_rad_rts(kAngleRandomWalkDegRth);
  return n_rad_rts * n_rad_rts / comparison::kPaperWindowS;
}

compensation::CompensationOptions chain_options(const PaperLikeRecord& record,
                                                std::size_t labels_held) {
  compensation::CompensationOptions options;
  options.features = {{.kind = thermal::FeatureKind::kTemperature, .probe = kProbe},
                      {.kind = thermal::FeatureKind::kTemperatureRate, .probe = kProbe},
                      {.kind = thermal::FeatureKind::kPulseMean}};
  options.learning.label_interval_s = record.interval_s;
  options.model.capacity = labels_held;
  return options;
}

class Chain {
 public:
  Chain(const PaperLikeRecord& record, std::size_t labels_held)
      : record_(record),
        scheme_(comparison::make_compared_scheme("online-svr", chain_options(record, labels_held),
                                                 {})) {
    follow_temperature(record.points.front());
  }

  // The compensated output of a point, rad/s. The points from the second on, in order.
  double compensate(std::size_t i) {
    const PaperLikeRecord::Point& point = record_.points[i];
    follow_temperature(point);
    // In the units of comparison::paper_points().
    const std::array<double, comparison::kPaperFeatures> features{
        point.temperature_degc / kTemperatureScaleDegc,
        temperature_rate_.rate_degc_per_s().value() * kSecondsPerMinute,
        core::deg_h_from_radps(record_.points[i - 1].rate_radps)};
    const double time_s = core::seconds(point.time);
    scheme_->observe(time_s, features);
    const double compensated_radps = point.rate_radps - scheme_->predict(time_s, features).drift;
    scheme_->learn({.time_s = time_s,
                    .duration_s = record_.interval_s,
                    .features = features,
                    .drift = point.rate_radps,
                    .variance = record_.point_variance});
    return compensated_radps;
  }

 private:
  void follow_temperature(const PaperLikeRecord::Point& point) {
    for (; next_reading_ < point.readings; ++next_reading_) {
      const PaperLikeRecord::Reading& reading = record_.readings[next_reading_];
      temperature_rate_.add(reading.time, reading.temperature_degc);
    }
  }

  const PaperLikeRecord& record_;
  std::size_t next_reading_ = 0;
  thermal::SlidingMeanRate temperature_rate_{thermal::SlidingMeanRateOptions{}};
  std::unique_ptr<regression::DriftScheme> scheme_;
};

}  // namespace

PaperLikeRecord paper_like_record() {
  constexpr std::uint64_t kSeed = 1;
  const twin::Model model = paper_like_gyro();
  const twin::Profile profile = paper_like_chamber();
  twin::GyroSimulation gyro(model, profile, kSeed, kSampleRateHz);
  twin::ThermometerSimulation thermometer(model, profile, kSeed, kProbe);
  comparison::PaperPreparation rates(1.0 / kSampleRateHz, profile.duration_s);
  comparison::PaperPreparation temperatures(1.0 / kSampleRateHz, profile.duration_s);
  PaperLikeRecord record;
  auto reading = thermometer.next();
  while (const auto sample = gyro.next()) {
    for (; reading && reading->time <= sample->time; reading = thermometer.next())
      record.readings.push_back({reading->time, reading->temperature_degc});
    temperatures.add(record.readings.back().temperature_degc);
    if (!rates.add(sample->rate_radps[core::index(core::Axis::kX)])) continue;
    record.points.push_back({sample->time, temperatures.points().back(), rates.points().back(),
                             record.readings.size()});
  }
  record.interval_s = rates.interval_s();
  record.point_variance = variance_of_a_minute();
  return record;
}

std::optional<ChainMeasurement> measure_chain(const PaperLikeRecord& record,
                                              std::size_t labels_held, std::size_t repeats) {
  ChainMeasurement measured{.labels_held = labels_held};
  measured.step_us.assign(record.points.size() - 1, std::numeric_limits<double>::infinity());
  std::vector<double> residuals(measured.step_us.size());
  services::ProgressBar bar("chain, " + std::to_string(labels_held) + " labels");
  for (std::size_t repeat = 0; repeat < repeats; ++repeat) {
    Chain chain(record, labels_held);
    for (std::size_t step = 0; step < residuals.size(); ++step) {
      const auto begin = Clock::now();
      residuals[step] = chain.compensate(step + 1);
      const std::chrono::duration<double, std::micro> spent = Clock::now() - begin;
      measured.step_us[step] = std::min(measured.step_us[step], spent.count());
    }
    bar.show(static_cast<double>(repeat + 1) / static_cast<double>(repeats));
    if (service::wait_for_stop(0ms)) return std::nullopt;
  }
  const auto judged = std::span(residuals).subspan(comparison::kPaperInitialPoints);
  measured.residual_rms_deg_h =
      core::deg_h_from_radps(comparison::moments(judged).root_mean_square);
  return measured;
}

std::optional<std::vector<double>> measure_experts(const PaperLikeRecord& record,
                                                   std::size_t repeats) {
  std::vector<compensation::AxisLabel> labels;
  experts::ThermalMemory memory;
  thermal::SlidingMeanRate temperature_rate{thermal::SlidingMeanRateOptions{}};
  for (const PaperLikeRecord::Point& point : record.points) {
    const double temperature = point.temperature_degc / kTemperatureScaleDegc;
    temperature_rate.add(point.time, point.temperature_degc);
    const double rate = temperature_rate.rate_degc_per_s().value_or(0.0) * kSecondsPerMinute;
    labels.push_back({.time = point.time,
                      .duration_s = record.interval_s,
                      .drift_radps = point.rate_radps,
                      .variance = record.point_variance,
                      .features = compensation::FeatureArray{temperature, rate},
                      .thermal = memory.advance(point.time, temperature, rate)});
  }
  std::vector<double> label_us(labels.size(), std::numeric_limits<double>::infinity());
  for (std::size_t repeat = 0; repeat < repeats; ++repeat) {
    compensation::AxisStack stack(2, 1);
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const auto begin = Clock::now();
      stack.learn(labels[i]);
      const std::chrono::duration<double, std::micro> spent = Clock::now() - begin;
      label_us[i] = std::min(label_us[i], spent.count());
    }
    if (service::wait_for_stop(0ms)) return std::nullopt;
  }
  return label_us;
}

double paper_chain_us() {
  for (const auto& row : comparison::paper_figures()) {
    if (row.scheme == "online-svr") return 1e6 * row.seconds_a_point;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace zerodrift::bench
