// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/unknown_effect.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "common/diagnosis/rounded_text.h"

namespace zerodrift::diagnosis {
namespace {

// Where the curve bends: the largest of each stretch that reaches half of the largest of all.
std::vector<std::size_t> bends_of(const std::vector<double>& rate, double largest) {
  constexpr double kCounts = 0.5;
  std::vector<std::size_t> bends;
  double sign = 0.0;
  for (std::size_t i = 0; i < rate.size(); ++i) {
    const bool counts = std::abs(rate[i]) >= kCounts * largest;
    const double here = counts ? std::copysign(1.0, rate[i]) : 0.0;
    if (counts && here != sign) {
      bends.push_back(i);
    } else if (counts && std::abs(rate[i]) > std::abs(rate[bends.back()])) {
      bends.back() = i;
    }
    sign = here;
  }
  return bends;
}

std::string shape_in_words(const std::vector<double>& input, const std::vector<double>& rate,
                           const InputChannel& channel) {
  const auto largest = std::max_element(
      rate.begin(), rate.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  const auto place = static_cast<std::size_t>(largest - rate.begin());
  const std::string where = " " + channel.unit + " in " + channel.name;
  const auto is_inside = [&](std::size_t i) { return i > 0 && i + 1 < rate.size(); };
  if (!is_inside(place)) return "grows towards " + rounded(input[place]) + where;
  std::vector<std::string> places;
  for (const std::size_t bend : bends_of(rate, std::abs(*largest))) {
    if (is_inside(bend)) places.push_back(rounded(input[bend]));
  }
  return (places.size() > 1 ? "bumps at " : "bump at ") + joined(places) + where;
}

struct Table {
  std::vector<double> input{};
  std::vector<double> rate_radps{};
};

// Mean of the waveform over quantile bins of the channel.
Table tabulated(const InputChannel& channel, const std::vector<double>& waveform) {
  constexpr std::size_t kBins = 24;
  Table table;
  std::vector<std::size_t> order(channel.values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return channel.values[a] < channel.values[b];
  });
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    const std::size_t begin = order.size() * bin / kBins;
    const std::size_t end = order.size() * (bin + 1) / kBins;
    if (begin == end) continue;
    double x = 0.0, y = 0.0;
    for (std::size_t i = begin; i < end; ++i) {
      x += channel.values[order[i]];
      y += waveform[order[i]];
    }
    const auto count = static_cast<double>(end - begin);
    table.input.push_back(x / count);
    table.rate_radps.push_back(y / count);
  }
  return table;
}

// Over the first input.
void tabulate(UnknownEffect& unknown, const std::vector<InputChannel>& channels,
              const std::vector<double>& waveform) {
  for (const InputChannel& channel : channels) {
    if (channel.name != unknown.depends_on.front()) continue;
    Table table = tabulated(channel, waveform);
    unknown.input = std::move(table.input);
    unknown.rate_radps = std::move(table.rate_radps);
  }
}

}  // namespace

std::string dependence_in_words(const std::vector<std::string>& depends_on,
                                const std::vector<double>& waveform,
                                const std::vector<InputChannel>& channels) {
  const auto channel = std::find_if(channels.begin(), channels.end(), [&](const InputChannel& c) {
    return c.name == depends_on.front();
  });
  if (depends_on.size() > 1 || channel == channels.end()) {
    std::string text = "something that depends on " + depends_on.front();
    for (std::size_t i = 1; i < depends_on.size(); ++i) text += ", " + depends_on[i];
    return text;
  }
  const Table table = tabulated(*channel, waveform);
  return shape_in_words(table.input, table.rate_radps, *channel);
}

UnknownEffect unknown_effect(const FittedEffect& found, const GenericFunction& function,
                             const std::vector<InputChannel>& channels) {
  UnknownEffect unknown;
  unknown.rms_radps = found.rms;
  unknown.depends_on = function.depends_on;
  unknown.description = dependence_in_words(function.depends_on, found.waveform, channels);
  tabulate(unknown, channels, found.waveform);
  return unknown;
}

UnknownEffect unknown_as_formulas(std::string description, std::vector<NamedEffect> formulas,
                                  std::vector<std::string> depends_on,
                                  const std::vector<double>& waveform,
                                  const std::vector<InputChannel>& channels) {
  UnknownEffect unknown;
  unknown.description = std::move(description);
  double squares = 0.0;
  for (const double w : waveform) squares += w * w;
  unknown.rms_radps = std::sqrt(squares / static_cast<double>(waveform.size()));
  unknown.depends_on = std::move(depends_on);
  tabulate(unknown, channels, waveform);
  unknown.formulas = std::move(formulas);
  return unknown;
}

}  // namespace zerodrift::diagnosis
