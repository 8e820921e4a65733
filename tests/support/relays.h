// SPDX-License-Identifier: Apache-2.0
// A Preisach operator of many relays, which shares nothing with the twin's hysteresis.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

namespace zerodrift::test {

// `count` relays around one temperature: their centres are normal with spread_degc, their half
// widths are the magnitudes of normal values with width_degc. Together they switch between -1
// and 1.
inline std::vector<double> relays(int count, const std::vector<double>& temperature_degc,
                                  double centre_degc, double spread_degc, double width_degc,
                                  std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> sum(temperature_degc.size(), 0.0);
  for (int relay = 0; relay < count; ++relay) {
    const double at = centre_degc + spread_degc * normal(random);
    const double half_width = std::abs(width_degc * normal(random));
    double state = temperature_degc.front() > at ? 1.0 : -1.0;
    for (std::size_t i = 0; i < sum.size(); ++i) {
      if (temperature_degc[i] > at + half_width) state = 1.0;
      if (temperature_degc[i] < at - half_width) state = -1.0;
      sum[i] += state / count;
    }
  }
  return sum;
}

}  // namespace zerodrift::test
