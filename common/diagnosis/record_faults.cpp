// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/record_faults.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "common/core/median.h"
#include "common/core/require.h"
#include "common/core/units.h"
#include "common/diagnosis/rounding.h"
#include "common/diagnosis/smallest_step.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {
namespace {

constexpr std::size_t kHalfWindow = 30;
constexpr double kFewestSigmas = 5.0;
constexpr double kSpikeNats = 12.0;  // of all together, after where each could have been
constexpr std::size_t kFewestSpikes = 2;
constexpr std::size_t kFewestInARow = 3;
constexpr std::size_t kFewestDropouts = 3;
constexpr std::size_t kLongestDropout = 5;  // samples; longer is a gap

// Robust standard deviations of ranges of a hundred departures, each with its neighbours: of the
// whole record, unless a range is clearly noisier. Noise that grows, with a temperature say, makes
// no spikes there.
std::vector<double> local_sigmas(const std::vector<double>& departure,
                                 const std::vector<std::uint8_t>& valid, double sigma) {
  constexpr std::size_t kRange = 100;
  // Of three ranges the standard deviation has an error of 6.7 %.
  constexpr double kClearly = 1.25;
  std::vector<double> sigmas;
  std::vector<double> sizes;
  for (std::size_t middle = 0; middle < departure.size(); middle += kRange) {
    sizes.clear();
    const std::size_t begin = middle >= kRange ? middle - kRange : 0;
    for (std::size_t i = begin; i < std::min(middle + 2 * kRange, departure.size()); ++i) {
      if (valid[i] != 0) sizes.push_back(std::abs(departure[i]));
    }
    const double local =
        sizes.size() < kRange ? sigma : core::median_of(sizes) / core::kMedianOfNormal;
    sigmas.push_back(local > kClearly * sigma ? local : sigma);
  }
  std::vector<double> each(departure.size());
  for (std::size_t i = 0; i < each.size(); ++i) each[i] = sigmas[i / kRange];
  return each;
}

// Departure from the median of the neighbours, in robust standard deviations there or steps of the
// reading, whichever is larger.
std::vector<double> departures(std::span<const double> values, std::span<const double> readings,
                               const std::vector<std::uint8_t>& valid) {
  std::vector<double> departure(values.size(), 0.0);
  std::vector<double> around;
  std::vector<double> all;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (valid[i] == 0) continue;
    around.clear();
    const std::size_t begin = i > kHalfWindow ? i - kHalfWindow : 0;
    for (std::size_t j = begin; j < std::min(i + kHalfWindow + 1, values.size()); ++j) {
      if (valid[j] != 0) around.push_back(values[j]);
    }
    departure[i] = values[i] - core::median_of(around);
    all.push_back(std::abs(departure[i]));
  }
  if (all.empty()) return departure;
  // Of a coarse reading more than half may be equal: a step is not a departure.
  const double sigma =
      std::max(core::median_of(all) / core::kMedianOfNormal, smallest_step(readings, valid));
  const std::vector<double> sigmas = local_sigmas(departure, valid, sigma);
  for (std::size_t i = 0; i < departure.size(); ++i)
    departure[i] = sigmas[i] > 0.0 ? departure[i] / sigmas[i] : 0.0;
  return departure;
}

// Standard deviations beyond which samples are a population of their own. One law with heavy tails
// (Laplace's, Student's) thins out: it has more samples just short of any limit than beyond it, and
// more than normal noise explains. What stands apart in more than one sample of twenty is the
// noise's own form, as that of a coarse angle is. Infinite where nothing stands apart.
double limit_of_spikes(const std::vector<double>& departure) {
  constexpr double kSurely = 2.0;  // standard deviations of a count
  constexpr double kLargestShare = 0.05;
  const auto between = [&](double low, double high) {
    return static_cast<double>(std::count_if(departure.begin(), departure.end(), [&](double d) {
      return std::abs(d) > low && std::abs(d) <= high;
    }));
  };
  const auto size = static_cast<double>(departure.size());
  for (double limit = kFewestSigmas;; limit *= std::sqrt(2.0)) {
    const double beyond = between(limit, std::numeric_limits<double>::infinity());
    if (beyond == 0.0) return std::numeric_limits<double>::infinity();
    const double shoulder = limit / std::sqrt(2.0);
    const double normal =
        size * (std::erfc(shoulder / std::sqrt(2.0)) - std::erfc(limit / std::sqrt(2.0)));
    const bool is_rare = beyond <= kLargestShare * size;
    const bool is_apart = between(shoulder, limit) <= beyond + normal + kSurely * std::sqrt(normal);
    if (is_rare && is_apart) return limit;
  }
}

// Farther off than `limit`, with neighbours that are not: what lasts is no spike.
bool is_alone(const std::vector<double>& departure, std::size_t i, double limit) {
  if (!(std::abs(departure[i]) > limit)) return false;
  const bool before = i > 0 && std::abs(departure[i - 1]) > 0.5 * limit;
  const bool after = i + 1 < departure.size() && std::abs(departure[i + 1]) > 0.5 * limit;
  return !before && !after;
}

NamedEffect certain(twin::LocalFault fault) {
  const auto all = twin::effect_catalogue();
  const auto found = std::find_if(all.begin(), all.end(), [fault](const auto& definition) {
    return definition.search.fault == fault;
  });
  core::require(found != all.end(), "the catalogue has each fault of a record");
  NamedEffect effect;
  effect.name = found->kind;
  effect.probability = 1.0;
  return effect;
}

std::optional<NamedEffect> spikes(const MeasuredSeries& series, core::Axis axis,
                                  std::span<const double> residual,
                                  std::vector<std::uint8_t>& sound, std::size_t& left_out) {
  const auto departure = departures(residual, series.rate_radps[core::index(axis)], sound);
  const double limit = limit_of_spikes(departure);
  std::vector<std::size_t> places;
  std::vector<double> heights;
  double nats = 0.0;
  for (std::size_t i = 0; i < departure.size(); ++i) {
    if (!is_alone(departure, i, limit)) continue;
    places.push_back(i);
    heights.push_back(residual[i]);
    nats += 0.5 * departure[i] * departure[i] - std::log(static_cast<double>(departure.size()));
  }
  if (nats < kSpikeNats) return std::nullopt;
  for (const std::size_t i : places) sound[i] = 0;
  if (heights.size() < kFewestSpikes) {
    left_out = heights.size();
    return std::nullopt;
  }
  const auto count = static_cast<double>(heights.size());
  double squares = 0.0;
  for (const double height : heights) squares += height * height;
  NamedEffect effect = certain(twin::LocalFault::kSpikes);
  const double hours = series.interval_s * static_cast<double>(series.size) / core::kSecondsPerHour;
  const double deviation = std::sqrt(squares / count) / core::radps_from_deg_h(1.0);
  effect.parameters = {{"deviation_deg_h", deviation}, {"spikes_per_h", count / hours}};
  effect.standard_errors = {{"deviation_deg_h", deviation / std::sqrt(2.0 * count)},
                            {"spikes_per_h", std::sqrt(count) / hours}};
  effect.log_evidence = nats;
  return effect;
}

// Clipped readings pile up at the limit; those of a coarse reading thin out towards their extremes.
bool piles_up(const std::vector<double>& rate, const std::vector<std::uint8_t>& sound,
              double extreme) {
  constexpr double kPile = 3.0;
  double nearest = extreme;
  double at_extreme = 0.0, at_nearest = 0.0;
  for (std::size_t i = 0; i < rate.size(); ++i) {
    if (sound[i] == 0) continue;
    const double distance = std::abs(rate[i] - extreme);
    if (distance == 0.0) {
      at_extreme += 1.0;
    } else if (nearest == extreme || distance < std::abs(nearest - extreme)) {
      nearest = rate[i];
      at_nearest = 1.0;
    } else if (rate[i] == nearest) {
      at_nearest += 1.0;
    }
  }
  return at_extreme > kPile * at_nearest;
}

bool turns(const std::vector<double>& reference) {
  return std::any_of(reference.begin(), reference.end(), [](double rate) { return rate != 0.0; });
}

std::optional<NamedEffect> saturation(const std::vector<double>& rate,
                                      std::span<const double> residual, bool has_reference,
                                      std::vector<std::uint8_t>& sound) {
  double low = 0.0, high = 0.0;
  bool any = false;
  for (std::size_t i = 0; i < rate.size(); ++i) {
    if (sound[i] == 0) continue;
    low = any ? std::min(low, rate[i]) : rate[i];
    high = any ? std::max(high, rate[i]) : rate[i];
    any = true;
  }
  if (!any || low == high) return std::nullopt;
  const bool at_low = piles_up(rate, sound, low);
  const bool at_high = piles_up(rate, sound, high);
  // A coarse reading of a rate that is held piles up as well, but shows that rate to its step.
  const double step = smallest_step(rate, sound);
  const auto falls_short = [&](std::size_t i) {
    return !has_reference || (rate[i] == high ? -residual[i] : residual[i]) > step;
  };
  std::size_t clipped = 0;
  for (std::size_t begin = 0; begin < rate.size();) {
    std::size_t end = begin;
    bool short_of_it = false;
    do {
      short_of_it = short_of_it || falls_short(end);
      ++end;
    } while (end < rate.size() && rate[end] == rate[begin] && sound[end] != 0);
    const bool extreme = (at_low && rate[begin] == low) || (at_high && rate[begin] == high);
    if (extreme && short_of_it && sound[begin] != 0 && end - begin >= kFewestInARow) {
      std::fill(sound.begin() + static_cast<std::ptrdiff_t>(begin),
                sound.begin() + static_cast<std::ptrdiff_t>(end), std::uint8_t{0});
      clipped += end - begin;
    }
    begin = end;
  }
  if (clipped == 0) return std::nullopt;
  NamedEffect effect = certain(twin::LocalFault::kSaturation);
  effect.parameters = {{"limit_deg_s", std::max(std::abs(low), std::abs(high)) / core::kRadPerDeg}};
  return effect;
}

// An interval that is empty though the times say that no sample is missing is one that their jitter
// left so.
std::optional<NamedEffect> dropped_samples(const MeasuredSeries& series,
                                           const std::vector<std::uint8_t>& valid,
                                           std::size_t holes) {
  std::size_t places = 0, lost = 0;
  for (std::size_t begin = 1; begin < valid.size();) {
    if (valid[begin] != 0) {
      ++begin;
      continue;
    }
    std::size_t end = begin;
    while (end < valid.size() && valid[end] == 0) ++end;
    if (end < valid.size() && end - begin <= kLongestDropout) {
      ++places;
      lost += end - begin;
    }
    begin = end;
  }
  if (holes < places) {
    lost = lost * holes / places;
    places = holes;
  }
  if (places < kFewestDropouts) return std::nullopt;
  NamedEffect effect = certain(twin::LocalFault::kDroppedSamples);
  effect.parameters = {
      {"share", static_cast<double>(lost) / static_cast<double>(valid.size())},
      {"mean_burst_s", lost == places ? 0.0
                                      : series.interval_s * static_cast<double>(lost) /
                                            static_cast<double>(places)}};
  return effect;
}

NamedEffect rounding_effect(const Rounding& found) {
  NamedEffect effect = certain(twin::LocalFault::kRounding);
  if (found.rate_step_radps > 0.0)
    effect.parameters["step_deg_h"] = core::deg_h_from_radps(found.rate_step_radps);
  if (found.reference_step_radps > 0.0)
    effect.parameters["reference_step_deg_h"] = core::deg_h_from_radps(found.reference_step_radps);
  return effect;
}

}  // namespace

RecordFaults find_record_faults(const MeasuredSeries& series, core::Axis axis,
                                std::span<const double> residual_radps) {
  const std::size_t a = core::index(axis);
  RecordFaults faults;
  faults.sound = series.valid[a];
  // A sample lost in a block of many leaves the block's mean: the grid can't show single ones.
  if (auto dropped = dropped_samples(series, series.valid[a], series.holes[a]))
    faults.effects.push_back(*dropped);
  if (auto clipped = saturation(series.rate_radps[a], residual_radps,
                                turns(series.reference_radps[a]), faults.sound))
    faults.effects.push_back(*clipped);
  const Rounding rounded = find_rounding(series, axis, residual_radps);
  // While a table turns faster and faster, each rounding of its rate is another error: no spike.
  std::vector<std::uint8_t> exact = faults.sound;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    if (rounded.of_reference[i] != 0) exact[i] = 0;
  }
  const std::vector<std::uint8_t> looked_at = exact;
  if (auto spiked = spikes(series, axis, residual_radps, exact, faults.left_out))
    faults.effects.push_back(*spiked);
  for (std::size_t i = 0; i < exact.size(); ++i) {
    if (exact[i] != looked_at[i] || rounded.leaves_out(i)) faults.sound[i] = 0;
  }
  faults.rounding_rms_radps = rounded.rms_radps;
  if (rounded.matters()) faults.effects.push_back(rounding_effect(rounded));
  return faults;
}

}  // namespace zerodrift::diagnosis
