// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/noise_level.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "common/core/median.h"
#include "common/core/not_known.h"
#include "common/core/require.h"
#include "common/diagnosis/posterior.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {

using twin::EffectDefinition;
using twin::EffectSpec;

namespace {

constexpr std::size_t kRanges = 12;
constexpr std::size_t kFewestInRange = 30;
constexpr double kVarianceOfLogSquare = 4.0 * 1.362;  // times 1/n, of a median absolute deviation
constexpr double kKinds = 5.0;

// An input with the name of the place, where it is a temperature.
struct Follower {
  std::vector<double> values{};
  std::optional<twin::TemperaturePoint> point{};
};

struct Difference {
  std::size_t place;  // of the middle value
  double value;       // of the variance of one
};

std::vector<Difference> second_differences(std::span<const double> values,
                                           std::span<const std::uint8_t> valid) {
  const double norm = 1.0 / std::sqrt(6.0);
  std::vector<Difference> differences;
  for (std::size_t i = 0; i + 2 < values.size();) {
    if (valid[i] == 0 || valid[i + 1] == 0 || valid[i + 2] == 0) {
      ++i;
      continue;
    }
    differences.push_back({i + 1, norm * (values[i] - 2.0 * values[i + 1] + values[i + 2])});
    i += 3;
  }
  return differences;
}

// The variance in one range of an input.
struct Range {
  double input = 0.0;
  double square = 0.0;
  double count = 0.0;
};

// Nothing where the input stands still or readings are too coarse.
std::vector<Range> ranges_of(std::vector<Difference> differences,
                             const std::vector<double>& input) {
  std::stable_sort(
      differences.begin(), differences.end(),
      [&](const Difference& a, const Difference& b) { return input[a.place] < input[b.place]; });
  if (differences.size() < kRanges * kFewestInRange) return {};
  const double first = input[differences.front().place];
  const double last = input[differences.back().place];
  if (!(last - first > 1e-9 * std::max(std::abs(first), std::abs(last)))) return {};
  std::vector<Range> ranges;
  for (std::size_t r = 0; r < kRanges; ++r) {
    const std::size_t begin = differences.size() * r / kRanges;
    const std::size_t end = differences.size() * (r + 1) / kRanges;
    Range range;
    std::vector<double> sizes;
    for (std::size_t i = begin; i < end; ++i) {
      range.input += input[differences[i].place];
      sizes.push_back(std::abs(differences[i].value));
    }
    range.count = static_cast<double>(end - begin);
    range.input /= range.count;
    const double sigma = core::median_of(std::move(sizes)) / core::kMedianOfNormal;
    if (!(sigma > 0.0)) return {};
    range.square = sigma * sigma;
    ranges.push_back(range);
  }
  return ranges;
}

// Log likelihood that a straight line of the logarithm in the input gains over a constant, nats.
double gain_of_line(const std::vector<Range>& ranges) {
  double weight = 0.0, x = 0.0, y = 0.0;
  for (const Range& range : ranges) {
    weight += range.count;
    x += range.count * range.input;
    y += range.count * std::log(range.square);
  }
  x /= weight;
  y /= weight;
  double xx = 0.0, xy = 0.0;
  for (const Range& range : ranges) {
    xx += range.count * (range.input - x) * (range.input - x);
    xy += range.count * (range.input - x) * (std::log(range.square) - y);
  }
  return xx > 0.0 ? 0.5 * xy * xy / xx / kVarianceOfLogSquare : 0.0;
}

std::vector<Follower> followers(const TrialInput& input) {
  const MeasuredSeries& series = input.series;
  std::vector<Follower> all;
  for (const twin::TemperaturePoint point : input.playback.measured_points()) {
    all.push_back({.values = temperatures(input.playback, point), .point = point});
  }
  for (const ProbeSeries& probe : series.probes) {
    Follower size_of_rate;
    for (const double rate : probe.rate_degc_per_s) size_of_rate.values.push_back(std::abs(rate));
    all.push_back(std::move(size_of_rate));
  }
  Follower size_of_rate;
  for (const double rate : series.reference_radps[core::index(input.axis)])
    size_of_rate.values.push_back(std::abs(rate));
  all.push_back(std::move(size_of_rate));
  for (const auto* channel : {&series.vibration_g, &series.source_current_ma, &series.supply_v}) {
    if (!channel->empty()) all.push_back({.values = *channel});
  }
  std::vector<double> time(series.size);
  std::iota(time.begin(), time.end(), 0.0);
  all.push_back({.values = std::move(time)});
  return all;
}

// Variance = constant + growing exp(2 k (T - T0)), with exp(...) of mean 1 over the ranges.
struct Growth {
  double constant = 0.0;
  double growing = 0.0;
  double per_degc = 0.0;
  double reference_degc = 0.0;
  double misfit = std::numeric_limits<double>::infinity();
};

Growth growth_at(const std::vector<Range>& ranges, double per_degc) {
  Growth growth{.per_degc = per_degc};
  double mean = 0.0;
  for (const Range& range : ranges)
    mean += std::exp(2.0 * per_degc * (range.input - ranges.front().input)) /
            static_cast<double>(ranges.size());
  growth.reference_degc = ranges.front().input + 0.5 * std::log(mean) / per_degc;
  std::vector<double> shape;
  for (const Range& range : ranges)
    shape.push_back(std::exp(2.0 * per_degc * (range.input - growth.reference_degc)));
  // Least squares of relative errors, neither part below 0.
  double cc = 0.0, cs = 0.0, ss = 0.0, c = 0.0, s = 0.0;
  for (std::size_t r = 0; r < ranges.size(); ++r) {
    const double w = 1.0 / ranges[r].square;
    cc += w * w;
    cs += w * w * shape[r];
    ss += w * w * shape[r] * shape[r];
    c += w;
    s += w * shape[r];
  }
  const double determinant = cc * ss - cs * cs;
  if (!(determinant > 1e-12 * cc * ss)) return growth;
  growth.constant = (c * ss - s * cs) / determinant;
  growth.growing = (s * cc - c * cs) / determinant;
  if (growth.constant < 0.0) {
    growth.constant = 0.0;
    growth.growing = s / ss;
  }
  if (!(growth.growing > 0.0)) return growth;
  growth.misfit = 0.0;
  for (std::size_t r = 0; r < ranges.size(); ++r) {
    const double off = std::log(ranges[r].square / (growth.constant + growth.growing * shape[r]));
    growth.misfit += 0.5 * ranges[r].count * off * off / kVarianceOfLogSquare;
  }
  return growth;
}

Growth best_growth(const std::vector<Range>& ranges) {
  Growth best;
  for (const double sign : {-1.0, 1.0}) {
    for (double per_degc = 0.002; per_degc < 0.3; per_degc *= 1.2) {
      Growth growth = growth_at(ranges, sign * per_degc);
      if (growth.misfit < best.misfit) best = growth;
    }
  }
  return best;
}

// The catalogue's white noise that reads a temperature.
const EffectDefinition& growing_effect() {
  const auto all = twin::effect_catalogue();
  const auto found = std::find_if(all.begin(), all.end(), [](const EffectDefinition& d) {
    return d.spectrum.law == twin::NoiseLaw::kWhite && !d.inputs.empty();
  });
  core::require(found != all.end(), "the catalogue has a white noise that follows a temperature");
  return *found;
}

// The best of one kind of input and what all of that kind explain together.
struct Best {
  const Follower* follower = nullptr;
  double nats = -std::numeric_limits<double>::infinity();
};

bool counts_angle(const twin::Model& model, core::Axis axis) {
  return std::any_of(model.effects.begin(), model.effects.end(), [&](const EffectSpec& spec) {
    const EffectDefinition* definition = twin::find_effect(spec.kind);
    return spec.axis == axis && definition != nullptr && !spec.parameters.empty() &&
           definition->spectrum.law == twin::NoiseLaw::kQuantization;
  });
}

// The white noise that does not grow is what the fit leaves of it.
void lower_constant_noise(Trial& trial, core::Axis axis, double constant_radps, double interval_s) {
  for (EffectSpec& spec : trial.repaired.effects) {
    const EffectDefinition* definition = twin::find_effect(spec.kind);
    if (spec.axis != axis || definition == nullptr || spec.parameters.empty()) continue;
    const twin::Spectrum& spectrum = definition->spectrum;
    if (spectrum.law != twin::NoiseLaw::kWhite || !definition->inputs.empty()) continue;
    double& value = spec.parameters[spectrum.scale];
    const double to = constant_radps * std::sqrt(interval_s) / spectrum.si_per_unit;
    const auto changed = std::find_if(
        trial.recalibrated.begin(), trial.recalibrated.end(), [&](const Recalibration& change) {
          return change.name == spec.kind && change.parameter == spectrum.scale;
        });
    constexpr double kAsBefore = 0.15;  // relative; the file's own error is as large
    const double from = changed != trial.recalibrated.end() ? changed->from : value;
    if (std::abs(to - from) <= kAsBefore * from) {
      value = from;
      if (changed != trial.recalibrated.end()) trial.recalibrated.erase(changed);
      return;
    }
    if (changed != trial.recalibrated.end()) {
      changed->to = to;
    } else {
      trial.recalibrated.push_back({spec.kind, spectrum.scale, from, to, kAsBefore * from});
    }
    value = to;
    return;
  }
}

}  // namespace

std::optional<GrowingNoise> growing_noise(std::span<const double> remainder,
                                          const TrialInput& input, const SearchOptions& options) {
  const auto differences = second_differences(remainder, input.valid);
  const auto all = followers(input);
  const double of_slope =
      differences.empty() ? 0.0 : 0.5 * std::log(static_cast<double>(differences.size()));
  const Follower* best = nullptr;
  double nats_of_best = -std::numeric_limits<double>::infinity();
  double nats_of_others = 0.0;  // of a constant level
  for (const Follower& follower : all) {
    const auto ranges = ranges_of(differences, follower.values);
    if (ranges.empty()) continue;
    const double nats = gain_of_line(ranges) - of_slope;
    if (!follower.point) {
      nats_of_others = std::max(nats_of_others, nats);
    } else if (nats > nats_of_best) {
      best = &follower;
      nats_of_best = nats;
    }
  }
  const double needed = std::log(kKinds / options.false_alarm);
  if (best == nullptr || nats_of_best < needed || nats_of_best < nats_of_others + needed)
    return std::nullopt;
  const Growth growth = best_growth(ranges_of(differences, best->values));
  if (!std::isfinite(growth.misfit)) return std::nullopt;
  const EffectDefinition& definition = growing_effect();
  GrowingNoise found;
  found.constant_radps = std::sqrt(growth.constant);
  NamedEffect& effect = found.effect;
  effect.name = definition.kind;
  effect.inputs = {std::string(twin::name(*best->point))};
  effect.log_evidence = nats_of_best;
  effect.probability =
      probabilities(std::array{nats_of_best, nats_of_others}, nats_of_best, options).front();
  const double to_file = std::sqrt(input.series.interval_s) / definition.spectrum.si_per_unit;
  for (const twin::ParameterDefinition& parameter : definition.parameters) {
    double& value = effect.parameters[parameter.name];
    if (parameter.name == definition.spectrum.scale) {
      value = std::sqrt(growth.growing) * to_file;
    } else {
      value =
          parameter.role == twin::ParameterRole::kShape ? growth.per_degc : growth.reference_degc;
    }
  }
  return found;
}

void take_growing_noise(Trial& trial, std::span<const double> remainder, const TrialInput& input,
                        const SearchOptions& options) {
  const std::string& kind = growing_effect().kind;
  EffectSpec* waiting = nullptr;
  for (EffectSpec& spec : trial.repaired.effects) {
    if (spec.axis != input.axis || spec.kind != kind) continue;
    if (!spec.parameters.empty()) return;
    waiting = &spec;
  }
  if (counts_angle(trial.repaired, input.axis)) return;
  auto found = growing_noise(remainder, input, options);
  if (!found) return;
  if (waiting != nullptr) {
    waiting->parameters = found->effect.parameters;
    waiting->inputs = found->effect.inputs;
    for (const auto& [name, value] : found->effect.parameters)
      trial.recalibrated.push_back({kind, name, 0.0, value, core::kNaN});
  } else {
    trial.repaired.effects.push_back({.kind = kind,
                                      .axis = input.axis,
                                      .parameters = found->effect.parameters,
                                      .inputs = found->effect.inputs,
                                      .origin = {.by = "diagnose",
                                                 .record = input.options.record,
                                                 .date = input.options.date,
                                                 .evidence = "noise against temperature"}});
    trial.effects.push_back(std::move(found->effect));
  }
  lower_constant_noise(trial, input.axis, found->constant_radps, input.series.interval_s);
}

}  // namespace zerodrift::diagnosis
