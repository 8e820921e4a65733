// SPDX-License-Identifier: Apache-2.0
#include "common/experts/kalman_bank.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/core/require.h"

namespace zerodrift::experts {
namespace {

// What each filter believes, in variances of a label: from a level that is nearly constant to one
// that moves as much as a label's noise from label to label.
constexpr std::array kWalks{1e-6, 1e-4, 1e-3, 1e-2, 1e-1, 1.0};
constexpr std::array kSlopeWalks{1e-6, 1e-3};
constexpr std::array kSlopeShares{1e-7, 1e-5, 1e-3, 1e-1};
constexpr std::array kPriors{1e1, 1e3, 1e5};  // a coefficient of 3, 30 or 300 label deviations
constexpr double kDiffuse = 1e8;
constexpr double kForgetting = 0.998;  // of the evidence, a label: some 500 labels count

}  // namespace

KalmanBank::KalmanBank(const KalmanBankOptions& options) : options_(options) {
  core::require(options.terms.size() <= kBasisTerms, "an expert has more terms than the basis");
  const bool has_slope = options.slopes == SlopeModel::kDamped;
  first_coefficient_ = has_slope ? 2 : 1;
  states_ = first_coefficient_ + options.terms.size();
  const auto add_priors = [&](Filter filter) {
    if (options.terms.empty()) return filters_.push_back(filter);
    for (const double prior : kPriors) {
      filter.prior = prior;
      filters_.push_back(filter);
    }
  };
  if (!has_slope) {
    for (const double walk : kWalks) add_priors({.walk = walk});
  } else {
    for (const double walk : kSlopeWalks) {
      for (const double share : kSlopeShares) {
        for (std::size_t i = 0; i < kSlopeTimesS.size(); ++i)
          add_priors({.walk = walk, .slope_share = share, .slope_time = i});
      }
    }
  }
  weights_.assign(filters_.size(), 1.0 / static_cast<double>(filters_.size()));
}

void KalmanBank::begin(const Labelled& label) {
  unit_variance_ = label.variance;
  unit_s_ = label.duration_s;
  for (Filter& filter : filters_) {
    filter.covariance[0][0] = kDiffuse * unit_variance_;
    filter.mean[0] = label.drift;
    if (first_coefficient_ == 2)
      filter.covariance[1][1] = filter.slope_share * unit_variance_ / (unit_s_ * unit_s_);
    for (std::size_t j = first_coefficient_; j < states_; ++j)
      filter.covariance[j][j] = filter.prior * unit_variance_;
  }
}

// The level's walk is white noise integrated; a slope of standard deviation s decays with time T,
// driven so that s is stationary (e.g. Bar-Shalom, Li and Kirubarajan 2001, 8.2.3, Singer's model).
void KalmanBank::predict(Filter& filter, double elapsed_s) const {
  auto& p = filter.covariance;
  p[0][0] += filter.walk * unit_variance_ * elapsed_s / unit_s_;
  if (first_coefficient_ == 1) return;
  const double time_s = kSlopeTimesS[filter.slope_time];
  const double variance = filter.slope_share * unit_variance_ / (unit_s_ * unit_s_);
  const double gone = -std::expm1(-elapsed_s / time_s);
  const double kept = 1.0 - gone;
  const double reach_s = time_s * gone;
  // x0 += reach x1, x1 *= kept.
  filter.mean[0] += reach_s * filter.mean[1];
  filter.mean[1] *= kept;
  for (std::size_t j = 0; j < states_; ++j) p[0][j] += reach_s * p[1][j];
  for (std::size_t j = 0; j < states_; ++j) p[j][0] += reach_s * p[j][1];
  for (std::size_t j = 0; j < states_; ++j) p[1][j] *= kept;
  for (std::size_t j = 0; j < states_; ++j) p[j][1] *= kept;
  p[0][0] += variance * time_s * (2.0 * elapsed_s - 2.0 * reach_s - time_s * gone * gone);
  p[0][1] += variance * time_s * gone * gone;
  p[1][0] = p[0][1];
  p[1][1] += variance * (1.0 - kept * kept);
}

double KalmanBank::update(Filter& filter, const Labelled& label) const {
  auto& p = filter.covariance;
  std::array<double, kMostStates> row{};
  row[0] = 1.0;
  for (std::size_t j = first_coefficient_; j < states_; ++j)
    row[j] = label.basis[options_.terms[j - first_coefficient_]];
  std::array<double, kMostStates> gain{};
  double innovation = label.drift;
  double variance = label.variance;
  for (std::size_t i = 0; i < states_; ++i) {
    for (std::size_t j = 0; j < states_; ++j) gain[i] += p[i][j] * row[j];
    innovation -= row[i] * filter.mean[i];
    variance += row[i] * gain[i];
  }
  for (std::size_t i = 0; i < states_; ++i) {
    filter.mean[i] += gain[i] * innovation / variance;
    for (std::size_t j = 0; j <= i; ++j) {
      p[i][j] -= gain[i] * gain[j] / variance;
      p[j][i] = p[i][j];
    }
    p[i][i] = std::max(p[i][i], 0.0);
  }
  return -0.5 * (std::log(2.0 * std::numbers::pi * variance) + innovation * innovation / variance);
}

void KalmanBank::learn(const Labelled& label) {
  if (!knows_) begin(label);
  double most = -1e300;
  for (Filter& filter : filters_) {
    if (knows_) predict(filter, label.time_s - time_s_);
    const double likelihood = update(filter, label);
    if (knows_) filter.log_weight = kForgetting * filter.log_weight + likelihood;
    most = std::max(most, filter.log_weight);
  }
  double sum = 0.0;
  for (std::size_t i = 0; i < filters_.size(); ++i) {
    filters_[i].log_weight -= most;
    sum += weights_[i] = std::exp(filters_[i].log_weight);
  }
  for (double& weight : weights_) weight /= sum;
  time_s_ = label.time_s;
  knows_ = true;
  average();
}

void KalmanBank::average() {
  forecast_ = {.time_s = time_s_};
  for (std::size_t i = 0; i < filters_.size(); ++i) {
    const Filter& filter = filters_[i];
    const double weight = weights_[i];
    forecast_.level += weight * filter.mean[0];
    if (first_coefficient_ == 2) forecast_.slope[filter.slope_time] += weight * filter.mean[1];
    for (std::size_t j = first_coefficient_; j < states_; ++j)
      forecast_.coefficient[options_.terms[j - first_coefficient_]] += weight * filter.mean[j];
  }
}

}  // namespace zerodrift::experts
