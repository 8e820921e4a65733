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

std::string shape_in_words(const std::vector<double>& input, const std::vector<double>& rate,
                           const InputChannel& channel) {
  const auto largest = std::max_element(
      rate.begin(), rate.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  const double at = input[static_cast<std::size_t>(largest - rate.begin())];
  const bool inside = largest != rate.begin() && largest + 1 != rate.end();
  const std::string place = rounded(at) + " " + channel.unit + " in " + channel.name;
  return (inside ? "bump at " : "grows towards ") + place;
}

// Mean of the waveform over quantile bins of the channel.
void tabulate(UnknownEffect& unknown, const InputChannel& channel,
              const std::vector<double>& waveform) {
  constexpr std::size_t kBins = 24;
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
    unknown.input.push_back(x / count);
    unknown.rate_radps.push_back(y / count);
  }
}

}  // namespace

UnknownEffect unknown_effect(const FittedEffect& found, const GenericFunction& function,
                             const std::vector<InputChannel>& channels) {
  UnknownEffect unknown;
  unknown.rms_radps = found.rms;
  unknown.depends_on = function.depends_on;
  unknown.description = "something that depends on " + function.depends_on.front();
  for (std::size_t i = 1; i < function.depends_on.size(); ++i)
    unknown.description += ", " + function.depends_on[i];
  for (const InputChannel& channel : channels) {
    if (channel.name != unknown.depends_on.front()) continue;
    tabulate(unknown, channel, found.waveform);
    if (unknown.depends_on.size() == 1)
      unknown.description = shape_in_words(unknown.input, unknown.rate_radps, channel);
  }
  return unknown;
}

UnknownEffect unknown_as_formulas(std::vector<NamedEffect> formulas,
                                  std::vector<std::string> depends_on,
                                  const std::vector<double>& waveform,
                                  const std::vector<InputChannel>& channels) {
  UnknownEffect unknown;
  std::vector<std::string> texts;
  for (const NamedEffect& summand : formulas) texts.push_back(summand.formula);
  unknown.description = joined(texts);
  double squares = 0.0;
  for (const double w : waveform) squares += w * w;
  unknown.rms_radps = std::sqrt(squares / static_cast<double>(waveform.size()));
  for (const InputChannel& channel : channels) {
    if (channel.name == depends_on.front()) tabulate(unknown, channel, waveform);
  }
  unknown.depends_on = std::move(depends_on);
  unknown.formulas = std::move(formulas);
  return unknown;
}

}  // namespace zerodrift::diagnosis
