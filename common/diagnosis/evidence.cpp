// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/evidence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "common/core/require.h"

namespace zerodrift::diagnosis {
namespace {

constexpr std::size_t kLongestMean = 300;
constexpr std::size_t kShortGap = 20;

double mean_of(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

Eigen::Map<Eigen::ArrayXd> array_of(std::vector<double>& values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

// Averages log BF(s) over the range of scales; the grid is fine enough for a factor smooth in log
// s.
double scale_averaged(double chi_square, int rank, const EvidenceOptions& options) {
  constexpr std::size_t kPoints = 14;
  std::array<double, kPoints> terms{};
  const double step = std::log(options.largest_scale / options.smallest_scale) / (kPoints - 1.0);
  for (std::size_t i = 0; i < kPoints; ++i) {
    const double scale = options.smallest_scale * std::exp(step * static_cast<double>(i));
    const double square = scale * scale;
    terms[i] = -0.5 * rank * std::log1p(square) + 0.5 * chi_square * square / (1.0 + square);
  }
  return log_sum(terms) - std::log(static_cast<double>(kPoints));
}

}  // namespace

GapBridge::GapBridge(std::span<const std::uint8_t> valid) : valid_(valid.begin(), valid.end()) {
  const std::size_t n = valid.size();
  std::size_t missing = 0;
  std::size_t missing_in_short = 0;
  for (std::size_t i = 0; i < n;) {
    if (valid[i] != 0) {
      ++i;
      continue;
    }
    Gap gap;
    gap.begin = gap.end = i;
    while (gap.end < n && valid[gap.end] == 0) ++gap.end;
    i = gap.end;
    missing += gap.length();
    if (gap.length() <= kShortGap) missing_in_short += gap.length();
    gaps_.push_back(gap);
  }
  if (n == 0) return;
  missing_share_ = static_cast<double>(missing) / static_cast<double>(n);
  const std::size_t window = missing_in_short * missing_in_short / n;  // n p²
  for (Gap& gap : gaps_) {
    const std::size_t least = gap.length() <= kShortGap ? std::max<std::size_t>(1, window / 2) : 1;
    place_means(gap, std::clamp(std::max(gap.length() / 2, least), std::size_t{1}, kLongestMean));
  }
}

// Means over the valid ones of `reach` samples on either side; the one beside a gap is valid.
void GapBridge::place_means(Gap& gap, std::size_t reach) const {
  gap.before_begin = gap.begin - std::min(gap.begin, reach);
  gap.after_end = std::min(valid_.size(), gap.end + reach);
  for (std::size_t i = gap.before_begin; i < gap.begin; ++i) {
    if (valid_[i] == 0) continue;
    ++gap.before;
    gap.left_at += static_cast<double>(i);
  }
  for (std::size_t i = gap.end; i < gap.after_end; ++i) {
    if (valid_[i] == 0) continue;
    ++gap.after;
    gap.right_at += static_cast<double>(i);
  }
  if (gap.before > 0) gap.left_at /= static_cast<double>(gap.before);
  if (gap.after > 0) gap.right_at /= static_cast<double>(gap.after);
}

void GapBridge::apply(std::span<double> column) const {
  if (gaps_.empty()) return;
  // Of the valid values before each place; the first one is taken off for the rounding's sake.
  const auto first_valid =
      std::find_if(valid_.begin(), valid_.end(), [](auto v) { return v != 0; });
  if (first_valid == valid_.end()) {
    std::fill(column.begin(), column.end(), 0.0);
    return;
  }
  const double origin = column[static_cast<std::size_t>(first_valid - valid_.begin())];
  std::vector<double> sums(column.size() + 1, 0.0);
  for (std::size_t i = 0; i < column.size(); ++i)
    sums[i + 1] = sums[i] + (valid_[i] != 0 ? column[i] - origin : 0.0);
  const auto mean = [&](std::size_t begin, std::size_t end, std::size_t count) {
    return origin + (sums[end] - sums[begin]) / static_cast<double>(count);
  };
  for (const Gap& gap : gaps_) {
    const double left = gap.before > 0 ? mean(gap.before_begin, gap.begin, gap.before) : 0.0;
    const double right = gap.after > 0 ? mean(gap.end, gap.after_end, gap.after) : left;
    const double from = gap.before > 0 ? left : right;
    const bool at_an_end = gap.before == 0 || gap.after == 0;
    for (std::size_t i = gap.begin; i < gap.end; ++i) {
      const double share =
          at_an_end ? 0.0 : (static_cast<double>(i) - gap.left_at) / (gap.right_at - gap.left_at);
      column[i] = from + share * (right - from);
    }
  }
}

ColumnTransform::ColumnTransform(const SpectralBands& bands, std::span<const std::uint8_t> valid)
    : bands_(bands), transform_(bands.samples()), gaps_(valid), weight_(1.0) {
  core::require(valid.size() == bands.samples(), "each sample of the bands is valid or not");
  const double present = 1.0 - gaps_.missing_share();
  weight_ = present * present;
}

SpectralColumn ColumnTransform::split(const Eigen::VectorXd& cosine) const {
  SpectralColumn column;
  column.singles = cosine.segment(1, bands_.singles());
  column.rest = cosine.tail(cosine.size() - 1 - bands_.singles()).cast<float>();
  return column;
}

bool ColumnTransform::takes(std::span<const double> values) const {
  return values.size() == bands_.samples() &&
         std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

std::vector<SpectralColumn> ColumnTransform::columns(std::vector<std::vector<double>> values) {
  constexpr double kConstant = 1e-10;  // of the largest value: what rounding leaves of a constant
  std::vector<SpectralColumn> result;
  for (std::vector<double>& v : values) {
    core::require(takes(v), "columns are finite and as long as the series");
    gaps_.apply(v);
  }
  for (std::size_t i = 0; i < values.size(); i += 2) {
    std::array<Eigen::VectorXd, 2> cosine;
    const std::size_t second = std::min(i + 1, values.size() - 1);
    // Scales may differ by many powers of ten, and the two share a transform's rounding.
    std::array<double, 2> largest{};
    for (std::size_t j = 0; j < 2; ++j) {
      std::vector<double>& v = values[j == 0 ? i : second];
      if (j == 1 && second == i) {
        largest[1] = largest[0];
        break;
      }
      auto column = array_of(v);
      const double peak = column.abs().maxCoeff();
      column -= mean_of(v);
      const double spread = column.abs().maxCoeff();
      largest[j] = spread > kConstant * peak ? spread : 0.0;
      if (largest[j] > 0.0) {
        column /= largest[j];
      } else {
        column.setZero();
      }
    }
    transform_.forward(values[i], values[second], cosine[0], cosine[1]);
    for (std::size_t j = 0; j < (second == i ? 1u : 2u); ++j) {
      cosine[j](0) = 0.0;
      const double norm = cosine[j].norm();
      if (norm > 0.0) cosine[j] *= std::sqrt(weight_) / norm;
      result.push_back(split(cosine[j]));
      result.back().norm = norm * largest[j];
    }
  }
  return result;
}

SpectralColumn ColumnTransform::series(std::span<const double> values,
                                       std::span<const std::uint8_t> valid) {
  std::vector<double> bridged(values.begin(), values.end());
  for (std::size_t i = 0; i < bridged.size(); ++i) {
    if (valid[i] == 0) bridged[i] = 0.0;
  }
  gaps_.apply(bridged);
  const double mean = mean_of(bridged);
  for (double& x : bridged) x -= mean;
  Eigen::VectorXd cosine = transform_.forward(bridged);
  SpectralColumn column = split(cosine * std::sqrt(weight_));
  column.norm = 1.0;
  return column;
}

Eigen::VectorXd bin_products(const SpectralBands& bands, const SpectralColumn& a,
                             const SpectralColumn& b) {
  Eigen::VectorXd products(bands.bins());
  const std::size_t offset = static_cast<std::size_t>(bands.singles()) + 1;
  for (Eigen::Index bin = 0; bin < bands.bins(); ++bin) {
    const Eigen::Index row = bands.singles() + bin;
    const auto begin = static_cast<Eigen::Index>(bands.first(row) - offset);
    const auto length = static_cast<Eigen::Index>(bands.first(row + 1) - bands.first(row));
    products(bin) =
        static_cast<double>(a.rest.segment(begin, length).dot(b.rest.segment(begin, length)));
  }
  return products;
}

std::optional<std::string> EvidenceOptions::validate() const {
  if (!(smallest_scale > 0.0)) {
    return "smallest_scale is " + std::to_string(smallest_scale) + ", must be > 0";
  }
  if (!(largest_scale > smallest_scale)) {
    return "largest_scale is " + std::to_string(largest_scale) + ", must be above smallest_scale";
  }
  if (!(smallest_kept_share > 0.0 && smallest_kept_share < 1.0)) {
    return "smallest_kept_share is " + std::to_string(smallest_kept_share) +
           ", must be inside (0, 1)";
  }
  return std::nullopt;
}

// Of what lies beyond one limit and not the other only the first counts: estimates are far sharper
// than what they are held to is wide.
double log_probability_within(double value, double sd, double least, double greatest) {
  if (!(least < greatest)) return -std::numeric_limits<double>::infinity();
  const double beyond = std::max(least - value, value - greatest) / sd;
  constexpr double kFar = 8.0;  // where the tail's first term is right to 2 %
  if (beyond < kFar) return std::log(0.5 * std::erfc(beyond * std::numbers::sqrt2 / 2.0));
  return -0.5 * beyond * beyond - std::log(beyond * std::sqrt(2.0 * std::numbers::pi));
}

double log_evidence_of_any_value(double value, double variance, const EvidenceOptions& options) {
  ProjectedColumns one;
  one.gram.setConstant(1, 1, 1.0 / variance);
  one.products.setConstant(1, value / variance);
  one.unprojected.setConstant(1, 1.0 / variance);
  return column_evidence(one, options, Detail::kEvidence).log_bayes_factor;
}

double log_sum(std::span<const double> logarithms) noexcept {
  double largest = -std::numeric_limits<double>::infinity();
  for (const double v : logarithms) largest = std::max(largest, v);
  if (!std::isfinite(largest)) return largest;
  double sum = 0.0;
  for (const double v : logarithms) sum += std::exp(v - largest);
  return largest + std::log(sum);
}

ColumnEvidence column_evidence(const ProjectedColumns& columns, const EvidenceOptions& options,
                               Detail detail) {
  const Eigen::Index q = columns.products.size();
  ColumnEvidence evidence;
  // Cholesky in the order given; a column that the model and the columns before it explain is left
  // out. So is one whose rest is what large parts of them leave of each other: what is found there
  // is rounding (products are sums of single precision). Each may keep its share of the one
  // before, and a dozen after another none.
  constexpr double kCancelled = 1e-6;  // of the largest part's square norm
  Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(q, q);
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(q, q);
  Eigen::VectorXd reduced(q);
  std::vector<Eigen::Index> kept;
  for (Eigen::Index j = 0; j < q; ++j) {
    const double full = columns.unprojected(j);
    if (!(full > 0.0)) continue;
    evidence.kept_share = std::max(evidence.kept_share, columns.gram(j, j) / full);
    const auto r = static_cast<Eigen::Index>(kept.size());
    double square = columns.gram(j, j);
    double product = columns.products(j);
    for (Eigen::Index i = 0; i < r; ++i) {
      double value = columns.gram(j, kept[static_cast<std::size_t>(i)]);
      for (Eigen::Index m = 0; m < i; ++m) value -= factor(r, m) * factor(i, m);
      factor(r, i) = value / factor(i, i);
      square -= factor(r, i) * factor(r, i);
      product -= factor(r, i) * reduced(i);
    }
    if (!(square > options.smallest_kept_share * full)) continue;
    // The combination that is left: this column less so much of each before.
    inverse(r, r) = 1.0;
    inverse.row(r).head(r) = -factor.row(r).head(r) * inverse.topLeftCorner(r, r);
    double largest = full;
    for (Eigen::Index i = 0; i < r; ++i) {
      const double part = inverse(r, i) * inverse(r, i);
      largest = std::max(largest, part * columns.unprojected(kept[static_cast<std::size_t>(i)]));
    }
    if (!(square > kCancelled * largest)) continue;
    factor(r, r) = std::sqrt(square);
    reduced(r) = product / factor(r, r);
    inverse.row(r).head(r + 1) /= factor(r, r);
    kept.push_back(j);
  }
  evidence.rank = static_cast<int>(kept.size());
  const auto rank = static_cast<Eigen::Index>(kept.size());
  if (rank > 0) {
    evidence.chi_square = reduced.head(rank).squaredNorm();
    evidence.log_bayes_factor = scale_averaged(evidence.chi_square, evidence.rank, options);
  }
  if (detail == Detail::kEvidence) return evidence;
  evidence.amplitudes = Eigen::VectorXd::Zero(q);
  evidence.covariance = Eigen::MatrixXd::Zero(q, q);
  if (rank == 0) return evidence;
  const auto lower = inverse.topLeftCorner(rank, rank);
  const Eigen::VectorXd amplitudes = lower.transpose() * reduced.head(rank);
  const Eigen::MatrixXd covariance = lower.transpose() * lower;
  for (Eigen::Index i = 0; i < rank; ++i) {
    const Eigen::Index to = kept[static_cast<std::size_t>(i)];
    evidence.amplitudes(to) = amplitudes(i);
    for (Eigen::Index j = 0; j < rank; ++j) {
      evidence.covariance(to, kept[static_cast<std::size_t>(j)]) = covariance(i, j);
    }
  }
  return evidence;
}

}  // namespace zerodrift::diagnosis
