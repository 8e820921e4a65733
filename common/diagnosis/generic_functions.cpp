// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/generic_functions.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/core/units.h"
#include "common/twin/b_spline.h"
#include "common/twin/low_pass.h"

namespace zerodrift::diagnosis {
namespace {

constexpr int kSplineIntervals = 10;
constexpr int kFineIntervals = 24;

// While the gyro was measured: the supply's step at switch-on is not a movement.
bool moves(const std::vector<double>& values, const std::vector<std::uint8_t>& valid) {
  double low = 0.0, high = 0.0;
  bool any = false;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (valid[i] == 0) continue;
    low = any ? std::min(low, values[i]) : values[i];
    high = any ? std::max(high, values[i]) : values[i];
    any = true;
  }
  return high - low > 1e-9 * std::max(std::abs(low), std::abs(high));
}

std::vector<double> scaled_by(std::vector<double> values, double factor) {
  for (double& value : values) value *= factor;
  return values;
}

// Strictly increasing but for the outer ones.
std::vector<double> knots_of(const std::vector<double>& values, int intervals, Knots spacing) {
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  std::vector<double> inner;
  const double span = sorted.back() - sorted.front();
  for (int i = 0; i <= intervals; ++i) {
    const auto place = static_cast<std::size_t>(
        std::llround(static_cast<double>(sorted.size() - 1) * i / intervals));
    const double knot = spacing == Knots::kQuantiles
                            ? sorted[place]
                            : sorted.front() + span * static_cast<double>(i) / intervals;
    if (inner.empty() || knot > inner.back() + 1e-3 * span) inner.push_back(knot);
  }
  inner.back() = sorted.back();
  return twin::knots_around(inner);
}

std::vector<double> to_unit_range(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  const double middle = 0.5 * (*low + *high);
  const double half = 0.5 * (*high - *low);
  std::vector<double> scaled(values.size());
  std::transform(values.begin(), values.end(), scaled.begin(),
                 [&](double v) { return (v - middle) / half; });
  return scaled;
}

bool is_temperature(const InputChannel& channel) {
  return channel.unit == "°C";
}

// The mean of two others adds nothing to their products.
bool may_multiply(const InputChannel& channel) {
  return channel.name != "time" && channel.origin == ChannelOrigin::kMeasured;
}

// Of the coil's two faces; empty unless both are measured and the middle is not.
std::vector<double> mean_coil(const MeasuredSeries& series) {
  const ProbeSeries* outer = nullptr;
  const ProbeSeries* inner = nullptr;
  std::vector<double> mean;
  for (const ProbeSeries& probe : series.probes) {
    if (probe.name == "coil_outer") outer = &probe;
    if (probe.name == "coil_inner") inner = &probe;
    if (probe.name == "coil") return mean;
  }
  if (outer == nullptr || inner == nullptr) return mean;
  for (std::size_t i = 0; i < series.size; ++i)
    mean.push_back(0.5 * (outer->temperature_degc[i] + inner->temperature_degc[i]));
  return mean;
}

const std::vector<double>* values_of(const std::vector<InputChannel>& channels,
                                     const std::string& name) {
  for (const InputChannel& channel : channels) {
    if (channel.name == name) return &channel.values;
  }
  return nullptr;
}

// Temperatures of places within the winding, as far as its two faces tell.
std::vector<std::vector<double>> inside_coil(const std::vector<InputChannel>& channels,
                                             double interval_s) {
  struct Place {
    double outer_share;
    double lag_s;
  };
  constexpr std::array kPlaces{Place{0.5, 120.0}, Place{0.25, 40.0}, Place{0.75, 40.0}};
  const auto* outer = values_of(channels, "temperature_coil_outer");
  const auto* inner = values_of(channels, "temperature_coil_inner");
  std::vector<std::vector<double>> inside;
  if (outer == nullptr || inner == nullptr) return inside;
  for (const Place& place : kPlaces) {
    twin::LowPass lag(place.lag_s, interval_s);
    std::vector<double> mean(outer->size());
    for (std::size_t i = 0; i < mean.size(); ++i) {
      mean[i] = lag.step(place.outer_share * (*outer)[i] + (1.0 - place.outer_share) * (*inner)[i]);
    }
    inside.push_back(std::move(mean));
  }
  return inside;
}

GenericFunction product_of(const InputChannel& a, const InputChannel& b) {
  const auto u = to_unit_range(a.values);
  const auto v = to_unit_range(b.values);
  std::vector<std::vector<double>> columns(3, std::vector<double>(u.size()));
  for (std::size_t i = 0; i < u.size(); ++i) {
    columns[0][i] = u[i] * v[i];
    columns[1][i] = u[i] * u[i] * v[i];
    columns[2][i] = u[i] * v[i] * v[i];
  }
  const bool thermal = a.family == twin::InputFamily::kTemperature;
  return {{a.name, b.name}, thermal ? b.family : a.family, {std::move(columns)}};
}

}  // namespace

std::vector<InputChannel> moving_inputs(const MeasuredSeries& series, core::Axis axis) {
  std::vector<InputChannel> channels;
  const auto& valid = series.valid[core::index(axis)];
  using twin::InputFamily;
  const auto take = [&](std::string name, std::string unit, InputFamily family,
                        std::vector<double> values) {
    if (moves(values, valid)) {
      channels.push_back({.name = std::move(name),
                          .unit = std::move(unit),
                          .values = std::move(values),
                          .family = family});
    }
  };
  for (const ProbeSeries& probe : series.probes)
    take("temperature_" + probe.name, "°C", InputFamily::kTemperature, probe.temperature_degc);
  auto mean = mean_coil(series);
  if (moves(mean, valid)) {
    channels.push_back({"temperature_coil", "°C", std::move(mean), ChannelOrigin::kMeanOfFaces,
                        InputFamily::kTemperature});
  }
  for (const ProbeSeries& probe : series.probes) {
    take("temperature_rate_" + probe.name, "°C/min", InputFamily::kTemperature,
         scaled_by(probe.rate_degc_per_s, 60.0));
  }
  for (const core::Axis a : core::kAxes) {
    const std::string suffix = a == axis ? "" : "_" + std::string(core::name(a));
    take("rate" + suffix, "deg/h", InputFamily::kRate,
         scaled_by(series.reference_radps[core::index(a)], 1.0 / core::radps_from_deg_h(1.0)));
  }
  for (const core::Axis a : core::kAxes) {
    const std::string name(core::name(a));
    take("magnetic_" + name, "uT", InputFamily::kMagnetic, series.magnetic_ut[core::index(a)]);
    take("acceleration_" + name, "m/s^2", InputFamily::kAcceleration,
         series.acceleration_mps2[core::index(a)]);
  }
  take("vibration", "g", InputFamily::kVibration, series.vibration_g);
  take("source_current", "mA", InputFamily::kSourceCurrent, series.source_current_ma);
  take("supply", "V", InputFamily::kSupply, series.supply_v);
  take("time", "s", InputFamily::kTime, series.since_power_on_s);
  return channels;
}

std::vector<std::vector<double>> spline_basis(const std::vector<double>& values, int intervals,
                                              Knots spacing) {
  const std::vector<double> knots = knots_of(values, intervals, spacing);
  const std::size_t count = knots.size() - twin::kSplineDegree - 1;
  std::vector<std::vector<double>> basis(count, std::vector<double>(values.size(), 0.0));
  for (std::size_t i = 0; i < values.size(); ++i) {
    const twin::LocalSplines local = twin::splines_at(knots, values[i]);
    for (std::size_t d = 0; d < local.values.size(); ++d)
      basis[local.first + d][i] = local.values[d];
  }
  return basis;
}

std::vector<GenericFunction> generic_functions(const std::vector<InputChannel>& channels,
                                               double interval_s) {
  std::vector<GenericFunction> functions;
  for (const InputChannel& channel : channels) {
    GenericFunction function{
        {channel.name}, channel.family, {spline_basis(channel.values, kSplineIntervals)}};
    if (is_temperature(channel)) {
      function.resolutions.push_back(spline_basis(channel.values, kFineIntervals, Knots::kUniform));
    }
    if (channel.origin == ChannelOrigin::kMeanOfFaces) {
      for (const auto& inside : inside_coil(channels, interval_s))
        function.resolutions.push_back(spline_basis(inside, kFineIntervals, Knots::kUniform));
    }
    for (auto& columns : function.resolutions) columns.pop_back();  // they sum to 1: a mean
    functions.push_back(std::move(function));
  }
  for (std::size_t i = 0; i < channels.size(); ++i) {
    for (std::size_t j = i + 1; j < channels.size(); ++j) {
      if (!may_multiply(channels[i]) || !may_multiply(channels[j])) continue;
      functions.push_back(product_of(channels[i], channels[j]));
    }
  }
  return functions;
}

}  // namespace zerodrift::diagnosis
