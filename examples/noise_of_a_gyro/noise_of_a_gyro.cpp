// SPDX-License-Identifier: Apache-2.0
// Angle random walk of a gyro at rest: rates in deg/h, one a line, from standard input.
//   noise_of_a_gyro INTERVAL_S < rates.txt
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <vector>

#include "common/allan/coefficients.h"
#include "common/allan/deviations.h"
#include "common/allan/noise_units.h"
#include "common/core/units.h"

int main(int argc, char** argv) {
  using namespace zerodrift;
  const double interval_s = argc == 2 ? std::atof(argv[1]) : 0.0;
  if (!(interval_s > 0.0)) {
    std::fprintf(stderr, "usage: noise_of_a_gyro INTERVAL_S < rates.txt\n");
    return 2;
  }
  std::vector<double> rates_radps;
  for (double rate_deg_h = 0.0; std::cin >> rate_deg_h;)
    rates_radps.push_back(core::radps_from_deg_h(rate_deg_h));

  const auto points = allan::overlapping_allan(allan::angle_from_rate(rates_radps, interval_s),
                                               interval_s, allan::TauGrid::kOctave);
  const auto fit = allan::identify_noise(points);
  const auto& n = fit[allan::NoiseTerm::kAngleRandomWalk];
  if (n.identification != allan::Identification::kInterval) {
    std::printf("these rates don't tell the angle random walk\n");
    return 1;
  }
  std::printf("N = %.4g deg/sqrt(h) (%.4g to %.4g)\n", allan::angle_random_walk_deg_rth(n.value),
              allan::angle_random_walk_deg_rth(n.lower), allan::angle_random_walk_deg_rth(n.upper));
  return 0;
}
