// SPDX-License-Identifier: Apache-2.0
#include "common/allan/record_analysis.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <stdexcept>

#include "common/allan/confidence.h"
#include "common/core/not_known.h"
#include "common/core/samples.h"

namespace zerodrift::allan {
namespace {

using core::kNaN;
constexpr double kFewestDegreesOfFreedom = 2.0;
constexpr std::uint64_t kMissingShare = 10;  // at most one in so many samples of a cluster
constexpr double kLongestCascadeTauS = 1e5;
constexpr double kLongestCascadeClusters = 0x1.0p24;

SeriesOptions checked(const SeriesOptions& options) {
  if (const auto error = options.validate()) throw std::invalid_argument(*error);
  return options;
}

// --- series with missing samples

// Running sums over a series; the mean is taken off, which changes no deviation and keeps digits.
struct RunningSums {
  std::vector<double> rate;          // [k]: of the samples before k that are there
  std::vector<std::uint32_t> count;  // [k]: how many those are

  explicit RunningSums(std::span<const double> series) {
    double sum = 0.0;
    std::uint64_t measured = 0;
    for (const double value : series) {
      if (!std::isfinite(value)) continue;
      sum += value;
      ++measured;
    }
    const double mean = measured == 0 ? 0.0 : sum / static_cast<double>(measured);
    rate.assign(series.size() + 1, 0.0);
    count.assign(series.size() + 1, 0);
    for (std::size_t i = 0; i < series.size(); ++i) {
      const bool is_there = std::isfinite(series[i]);
      rate[i + 1] = rate[i] + (is_there ? series[i] - mean : 0.0);
      count[i + 1] = count[i] + (is_there ? 1 : 0);
    }
  }
  [[nodiscard]] std::size_t samples() const { return rate.size() - 1; }
};

struct DifferenceSums {
  double squares = 0.0;
  double products = 0.0;  // with the difference one tau later
  std::uint64_t square_count = 0;
  std::uint64_t product_count = 0;
};

struct MeasuredCluster {
  double mean = 0.0;
  std::uint64_t count = 0;
};

MeasuredCluster cluster_at(const RunningSums& sums, std::size_t k, std::size_t m) {
  const std::uint64_t count = sums.count[k + m] - sums.count[k];
  const double sum = sums.rate[k + m] - sums.rate[k];
  return {count == 0 ? 0.0 : sum / static_cast<double>(count), count};
}

// Differences of neighbouring cluster means whose clusters have at least `fewest` samples each.
DifferenceSums differences(const RunningSums& sums, std::size_t m, std::uint64_t fewest) {
  DifferenceSums found;
  for (std::size_t k = 0; k + 2 * m <= sums.samples(); ++k) {
    const std::uint64_t first = sums.count[k + m] - sums.count[k];
    if (first < fewest) continue;
    const MeasuredCluster b = cluster_at(sums, k + m, m);
    if (b.count < fewest) continue;
    const double d = b.mean - cluster_at(sums, k, m).mean;
    found.squares += d * d;
    ++found.square_count;
    if (k + 3 * m > sums.samples()) continue;
    const MeasuredCluster c = cluster_at(sums, k + 2 * m, m);
    if (c.count < fewest) continue;
    found.products += d * (c.mean - b.mean);
    ++found.product_count;
  }
  return found;
}

struct ChosenDifferences {
  DifferenceSums sums;
  GapRule rule = GapRule::kComplete;
};

ChosenDifferences choose_differences(const RunningSums& sums, std::size_t m) {
  const DifferenceSums complete = differences(sums, m, m);
  const std::uint64_t may_lack = m / kMissingShare;
  if (may_lack == 0) return {complete, GapRule::kComplete};
  const DifferenceSums nearly = differences(sums, m, m - may_lack);
  if (2 * complete.square_count >= nearly.square_count) return {complete, GapRule::kComplete};
  return {nearly, GapRule::kNearlyComplete};
}

// --- points

// The design of an estimate of cluster size m from so many terms.
EstimateDesign design_of(Statistic statistic, NoiseType noise, double m, double terms) {
  EstimateDesign design{.noise = noise, .cluster_size = m, .terms = terms, .terms_per_tau = m};
  switch (statistic) {
    case Statistic::kAdev: design.terms_per_tau = 1.0; break;
    case Statistic::kMdev:
    case Statistic::kTdev: design.averaging = Averaging::kModified; break;
    case Statistic::kHdev:
      design.difference = Difference::kThird;
      design.terms_per_tau = 1.0;
      break;
    case Statistic::kOhdev: design.difference = Difference::kThird; break;
    case Statistic::kOadev:
    case Statistic::kTotdev: break;
  }
  return design;
}

// NIST SP 1065 table 10.
double total_degrees_of_freedom(NoiseType noise, double record_over_tau, double otherwise) {
  switch (noise) {
    case NoiseType::kAngleRandomWalk: return 1.5 * record_over_tau;
    case NoiseType::kBiasInstability: return 1.17 * record_over_tau - 0.22;
    case NoiseType::kRateRandomWalk: return 0.93 * record_over_tau - 0.36;
    case NoiseType::kQuantization: break;
  }
  return otherwise;
}

double degrees_of_freedom(Statistic statistic, NoiseType noise, double m, double terms,
                          double samples) {
  if (statistic != Statistic::kTotdev)
    return equivalent_degrees_of_freedom(design_of(statistic, noise, m, terms));
  const double pairs = std::max(1.0, samples - 2.0 * m + 1.0);
  const double overlapping =
      equivalent_degrees_of_freedom(design_of(Statistic::kOadev, noise, m, pairs));
  return std::max(1.0, total_degrees_of_freedom(noise, samples / m, overlapping));
}

std::vector<AllanPoint> allan_points(const std::vector<GappedPoint>& gapped) {
  std::vector<AllanPoint> points;
  points.reserve(gapped.size());
  for (const GappedPoint& one : gapped) points.push_back(one.point);
  return points;
}

std::vector<GappedPoint> gapped_points(const std::vector<AllanPoint>& points) {
  std::vector<GappedPoint> gapped;
  gapped.reserve(points.size());
  for (const AllanPoint& point : points) gapped.push_back({point, GapRule::kComplete});
  return gapped;
}

CurvePoint curve_point(const AllanPoint& p) {
  return {p.tau_s, p.deviation_radps, p.lower_radps, p.upper_radps, p.degrees_of_freedom, p.pairs,
          p.noise};
}

std::optional<AllanPoint> lowest_of(const std::vector<AllanPoint>& points) {
  std::optional<AllanPoint> lowest;
  for (const AllanPoint& point : points) {
    if (point.degrees_of_freedom < kFewestDegreesOfFreedom) continue;
    if (!lowest || point.deviation_radps < lowest->deviation_radps) lowest = point;
  }
  return lowest;
}

// What a bandwidth holds down is low without saying anything of the gyro.
std::vector<AllanPoint> beyond_bandwidth(std::vector<AllanPoint> points,
                                         const CoefficientReport& fit) {
  if (fit.short_taus == ShortTaus::kNeverWhite) return {};
  if (fit.short_taus == ShortTaus::kBandLimited)
    std::erase_if(points,
                  [&](const AllanPoint& p) { return p.tau_s < 0.999 * fit.shortest_tau_s; });
  return points;
}

RollingAllan cascade_for(const SeriesOptions& options) {
  RollingAllanOptions cascade;
  cascade.sample_interval_s = options.nominal_interval_s;
  cascade.grid = options.grid;
  cascade.longest_tau_s =
      std::max(kLongestCascadeTauS, kLongestCascadeClusters * options.nominal_interval_s);
  // So that rates of 40 rad/s fit also where tau is longer.
  cascade.angle_resolution_rad *= cascade.longest_tau_s / kLongestCascadeTauS;
  cascade.panes = 1;  // no window is asked for
  cascade.window_s = kLongestCascadeClusters * options.nominal_interval_s;
  return RollingAllan(cascade);
}

}  // namespace

std::vector<GappedPoint> overlapping_allan_with_gaps(std::span<const double> rate_radps,
                                                     double sample_interval_s, TauGrid grid,
                                                     double confidence) {
  assert(sample_interval_s > 0.0);
  if (std::all_of(rate_radps.begin(), rate_radps.end(), [](double y) { return std::isfinite(y); }))
    return gapped_points(overlapping_allan(angle_from_rate(rate_radps, sample_interval_s),
                                           sample_interval_s, grid, confidence));
  const RunningSums sums(rate_radps);
  std::vector<GappedPoint> points;
  NoiseType noise = NoiseType::kAngleRandomWalk;
  for (const Cluster& cluster : clusters(grid, rate_radps.size() / 2)) {
    const auto m = static_cast<std::size_t>(cluster.size());
    const auto [found, rule] = choose_differences(sums, m);
    if (found.square_count == 0) continue;
    const auto terms = static_cast<double>(found.square_count);
    const double mean_square = found.squares / terms;
    const double clusters_there = static_cast<double>(found.product_count) / static_cast<double>(m);
    if (clusters_there >= kClustersToIdentifyNoise && mean_square > 0.0) {
      const double product = found.products / static_cast<double>(found.product_count);
      noise = noise_type_from_lag1(product / mean_square, clusters_there);
    }
    AllanPoint p;
    p.tau_s = static_cast<double>(m) * sample_interval_s;
    p.deviation_radps = std::sqrt(0.5 * mean_square);
    p.pairs = found.square_count;
    p.clusters = terms / static_cast<double>(m);
    p.noise = noise;
    p.degrees_of_freedom = equivalent_degrees_of_freedom(
        design_of(Statistic::kOadev, noise, static_cast<double>(m), terms));
    const Bounds bounds = deviation_bounds(p.deviation_radps, p.degrees_of_freedom, confidence);
    p.lower_radps = bounds.lower;
    p.upper_radps = bounds.upper;
    points.push_back({p, rule});
  }
  return points;
}

Stretch longest_stretch(std::span<const double> rate_radps) {
  Stretch longest;
  Stretch current;
  for (std::size_t i = 0; i < rate_radps.size(); ++i) {
    if (!std::isfinite(rate_radps[i])) {
      current = {i + 1, 0};
      continue;
    }
    ++current.count;
    if (current.count > longest.count) longest = current;
  }
  return longest;
}

std::vector<CurvePoint> deviation_curve(Statistic statistic, std::span<const double> angle_rad,
                                        double sample_interval_s, TauGrid grid, double confidence) {
  std::vector<CurvePoint> curve;
  const auto allan = overlapping_allan(angle_rad, sample_interval_s, grid, confidence);
  if (statistic == Statistic::kOadev) {
    for (const AllanPoint& point : allan) curve.push_back(curve_point(point));
    return curve;
  }
  const auto samples = static_cast<double>(angle_rad.size() - 1);
  for (const AllanPoint& at : allan) {
    const auto m = static_cast<std::size_t>(std::llround(at.tau_s / sample_interval_s));
    const auto found = deviation(statistic, angle_rad, sample_interval_s, m);
    if (!found) continue;
    CurvePoint p{.tau_s = found->tau_s, .deviation = found->deviation, .terms = found->terms};
    p.noise = at.noise;
    p.degrees_of_freedom = degrees_of_freedom(statistic, at.noise, static_cast<double>(m),
                                              static_cast<double>(found->terms), samples);
    const Bounds bounds = deviation_bounds(p.deviation, p.degrees_of_freedom, confidence);
    p.lower = bounds.lower;
    p.upper = bounds.upper;
    curve.push_back(p);
  }
  return curve;
}

std::optional<std::string> SeriesOptions::validate() const {
  if (!(std::isfinite(nominal_interval_s) && nominal_interval_s > 0.0)) {
    return "nominal_interval_s is " + std::to_string(nominal_interval_s) + ", must be > 0 s";
  }
  if (!(confidence > 0.0 && confidence < 1.0))
    return "confidence is " + std::to_string(confidence) + ", must be between 0 and 1";
  if (statistics.empty()) return "statistics is empty, must name at least one";
  return std::nullopt;
}

SeriesAnalysis::SeriesAnalysis(const SeriesOptions& options) : options_(checked(options)) {
  if (options_.most_kept_samples == 0) cascade_.emplace(cascade_for(options_));
}

void SeriesAnalysis::add(double rate_radps) {
  if (!core::is_rate(rate_radps)) {
    gap(1);
    return;
  }
  if (pending_missing_ > 0) pass_over_missing();
  check_.add(rate_radps, place_++);
  if (!cascade_ && kept_.size() >= options_.most_kept_samples) give_up_keeping();
  cascade_ ? into_cascade(rate_radps) : kept_.push_back(rate_radps);
}

// Before the first sample nothing is missing, and what is missing at the end interrupts nothing.
void SeriesAnalysis::gap(std::uint64_t missing_samples) {
  if (check_.samples() > 0) pending_missing_ += missing_samples;
}

void SeriesAnalysis::pass_over_missing() {
  ++interruptions_;
  missing_ += pending_missing_;
  place_ += pending_missing_;
  if (!cascade_ && pending_missing_ > options_.most_kept_samples - kept_.size()) give_up_keeping();
  if (cascade_) {
    cascade_->gap(pending_missing_);
  } else {
    kept_.insert(kept_.end(), static_cast<std::size_t>(pending_missing_), kNaN);
  }
  pending_missing_ = 0;
}

void SeriesAnalysis::into_cascade(double rate_radps) {
  if (std::abs(rate_radps) > cascade_->largest_rate_radps()) ++too_large_;
  cascade_->add(rate_radps);
}

void SeriesAnalysis::give_up_keeping() {
  cascade_.emplace(cascade_for(options_));
  for (const double rate_radps : kept_) into_cascade(rate_radps);
  kept_ = {};
}

std::vector<GappedPoint> SeriesAnalysis::allan(double sample_interval_s) const {
  if (!cascade_) {
    return overlapping_allan_with_gaps(kept_, sample_interval_s, options_.grid,
                                       options_.confidence);
  }
  auto points = gapped_points(cascade_->points(Span::kSinceStart, options_.confidence));
  for (GappedPoint& one : points)
    one.point.tau_s *= sample_interval_s / options_.nominal_interval_s;
  return points;
}

StatisticCurve SeriesAnalysis::curve(Statistic statistic, double sample_interval_s) const {
  StatisticCurve curve{.statistic = statistic, .points = {}, .stretch = std::nullopt};
  Stretch stretch{0, kept_.size()};
  if (missing_ > 0) curve.stretch = stretch = longest_stretch(kept_);
  const auto angle = angle_from_rate(
      std::span<const double>(kept_).subspan(stretch.begin, stretch.count), sample_interval_s);
  curve.points =
      deviation_curve(statistic, angle, sample_interval_s, options_.grid, options_.confidence);
  return curve;
}

SeriesReport SeriesAnalysis::report(double sample_interval_s) const {
  assert(sample_interval_s > 0.0);
  SeriesReport report;
  report.findings = check_.findings();
  report.missing = missing_;
  report.interruptions = interruptions_;
  report.too_large = too_large_;
  report.method = cascade_        ? SeriesMethod::kCascade
                  : missing_ == 0 ? SeriesMethod::kFullOverlap
                                  : SeriesMethod::kFullOverlapWithGaps;
  report.allan = allan(sample_interval_s);
  const std::vector<AllanPoint> points = allan_points(report.allan);
  for (const Statistic statistic : options_.statistics) {
    if (statistic == Statistic::kOadev) {
      StatisticCurve own;
      for (const AllanPoint& point : points) own.points.push_back(curve_point(point));
      report.curves.push_back(std::move(own));
    } else if (cascade_) {
      report.left_out.push_back(statistic);
    } else {
      report.curves.push_back(curve(statistic, sample_interval_s));
    }
  }
  CoefficientOptions fit;
  fit.confidence = options_.confidence;
  if (report.findings.is_constant) return report;
  report.coefficients = identify_noise(points, fit);
  const std::vector<AllanPoint> of_the_gyro = beyond_bandwidth(points, report.coefficients);
  report.slopes = read_slopes(of_the_gyro);
  report.lowest = lowest_of(of_the_gyro);
  return report;
}

std::optional<double> coefficient_ratio(const CoefficientReport& numerator,
                                        const CoefficientReport& denominator, NoiseTerm term) {
  const Coefficient& above = numerator[term];
  const Coefficient& below = denominator[term];
  const bool known = above.identification == Identification::kInterval &&
                     below.identification == Identification::kInterval && below.value > 0.0;
  if (!known) return std::nullopt;
  return above.value / below.value;
}

}  // namespace zerodrift::allan
