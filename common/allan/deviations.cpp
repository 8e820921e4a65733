// SPDX-License-Identifier: Apache-2.0
#include "common/allan/deviations.h"

#include <cassert>
#include <cmath>
#include <numeric>

#include "common/allan/confidence.h"

namespace zerodrift::allan {
namespace {

using Angles = std::span<const double>;

struct Mean {
  double sum = 0.0;
  std::uint64_t count = 0;

  void add(double value) {
    sum += value;
    ++count;
  }
};

double second_difference(Angles x, std::size_t k, std::size_t m) {
  return x[k + 2 * m] - 2.0 * x[k + m] + x[k];
}

double third_difference(Angles x, std::size_t k, std::size_t m) {
  return x[k + 3 * m] - 3.0 * x[k + 2 * m] + 3.0 * x[k + m] - x[k];
}

// Of a difference of the given order.
template <typename Difference>
Mean difference_squares(Difference difference, std::size_t order, Angles x, std::size_t m,
                        std::size_t stride) {
  Mean mean;
  for (std::size_t k = 0; k + order * m < x.size(); k += stride) {
    const double d = difference(x, k, m);
    mean.add(d * d);
  }
  return mean;
}

// Squares of second differences averaged over m neighbours, by a running sum. SP 1065 eq. 14.
Mean modified_squares(Angles x, std::size_t m) {
  Mean mean;
  if (x.size() < 3 * m) return mean;
  double sum = 0.0;
  for (std::size_t k = 0; k < m; ++k) sum += second_difference(x, k, m);
  for (std::size_t k = 0;; ++k) {
    const double average = sum / static_cast<double>(m);
    mean.add(average * average);
    if (k + 3 * m >= x.size()) return mean;
    sum += third_difference(x, k, m);
  }
}

// Second differences centred on every inner point of the record, which goes on beyond its ends as
// its reflection through the end point. SP 1065 eq. 25.
Mean total_squares(Angles x, std::size_t m) {
  Mean mean;
  const std::size_t last = x.size() - 1;
  if (x.size() < 3 || m > last - 1) return mean;
  for (std::size_t k = 1; k < last; ++k) {
    const double before = k >= m ? x[k - m] : 2.0 * x[0] - x[m - k];
    const double after = k + m <= last ? x[k + m] : 2.0 * x[last] - x[2 * last - k - m];
    const double d = before - 2.0 * x[k] + after;
    mean.add(d * d);
  }
  return mean;
}

Mean squares(Statistic statistic, Angles x, std::size_t m) {
  switch (statistic) {
    case Statistic::kAdev: return difference_squares(second_difference, 2, x, m, m);
    case Statistic::kOadev: return difference_squares(second_difference, 2, x, m, 1);
    case Statistic::kMdev:
    case Statistic::kTdev: return modified_squares(x, m);
    case Statistic::kHdev: return difference_squares(third_difference, 3, x, m, m);
    case Statistic::kOhdev: return difference_squares(third_difference, 3, x, m, 1);
    case Statistic::kTotdev: return total_squares(x, m);
  }
  return {};
}

// Mean square of the difference of a white noise of unit variance, over the same of its rate: 2 for
// second, 6 for third differences.
double normalisation(Statistic statistic) {
  return statistic == Statistic::kHdev || statistic == Statistic::kOhdev ? 6.0 : 2.0;
}

// Mean of d_k d_{k+m} over the mean of d_k².
double lag1_autocorrelation(Angles x, std::size_t m, double mean_square) {
  Mean products;
  for (std::size_t k = 0; k + 3 * m < x.size(); ++k) {
    products.add(second_difference(x, k, m) * second_difference(x, k + m, m));
  }
  return products.sum / static_cast<double>(products.count) / mean_square;
}

}  // namespace

std::vector<double> angle_from_rate(std::span<const double> rate_radps, double sample_interval_s) {
  assert(sample_interval_s > 0.0);
  std::vector<double> angle(rate_radps.size() + 1, 0.0);
  if (rate_radps.empty()) return angle;
  const double mean = std::accumulate(rate_radps.begin(), rate_radps.end(), 0.0) /
                      static_cast<double>(rate_radps.size());
  for (std::size_t i = 0; i < rate_radps.size(); ++i)
    angle[i + 1] = angle[i] + (rate_radps[i] - mean) * sample_interval_s;
  return angle;
}

std::optional<DeviationPoint> deviation(Statistic statistic, std::span<const double> angle_rad,
                                        double sample_interval_s, std::size_t cluster_size) {
  assert(sample_interval_s > 0.0 && cluster_size >= 1);
  const Mean mean = squares(statistic, angle_rad, cluster_size);
  if (mean.count == 0) return std::nullopt;
  const double tau_s = static_cast<double>(cluster_size) * sample_interval_s;
  const double variance =
      mean.sum / static_cast<double>(mean.count) / (normalisation(statistic) * tau_s * tau_s);
  const double scale = statistic == Statistic::kTdev ? tau_s / std::sqrt(3.0) : 1.0;
  return DeviationPoint{tau_s, scale * std::sqrt(variance), mean.count};
}

std::vector<AllanPoint> overlapping_allan(std::span<const double> angle_rad,
                                          double sample_interval_s, TauGrid grid,
                                          double confidence) {
  std::vector<AllanPoint> points;
  NoiseType noise = NoiseType::kAngleRandomWalk;
  const std::uint64_t largest = angle_rad.size() < 3 ? 0 : (angle_rad.size() - 1) / 2;
  for (const Cluster& cluster : clusters(grid, largest)) {
    const auto m = static_cast<std::size_t>(cluster.size());
    const auto measured = deviation(Statistic::kOadev, angle_rad, sample_interval_s, m);
    if (!measured) break;
    const double rad = measured->deviation * measured->tau_s;
    const double clusters_in_record =
        static_cast<double>(measured->terms) / static_cast<double>(m) - 1.0;
    if (clusters_in_record >= kClustersToIdentifyNoise && rad > 0.0) {
      noise = noise_type_from_lag1(lag1_autocorrelation(angle_rad, m, 2.0 * rad * rad),
                                   clusters_in_record);
    }
    const double edf = equivalent_degrees_of_freedom({.noise = noise,
                                                      .cluster_size = static_cast<double>(m),
                                                      .terms = static_cast<double>(measured->terms),
                                                      .terms_per_tau = static_cast<double>(m)});
    const Bounds bounds = deviation_bounds(measured->deviation, edf, confidence);
    points.push_back({measured->tau_s, measured->deviation, measured->terms, edf, bounds.lower,
                      bounds.upper, noise,
                      static_cast<double>(measured->terms) / static_cast<double>(m)});
  }
  return points;
}

}  // namespace zerodrift::allan
