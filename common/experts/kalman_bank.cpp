// SPDX-License-Identifier: Apache-2.0
#include "common/experts/kalman_bank.h"

#include <algorithm>
#include <cmath>

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
constexpr double kSmallest = 1e-300;
constexpr double kRuledOut = -50.0;    // of a filter's evidence beside the best one's, in nats
constexpr double kForgetting = 0.998;  // of the evidence, a label: some 500 labels count

}  // namespace

KalmanBank::KalmanBank(const KalmanBankOptions& options) : terms_(options.terms) {
  core::require(terms_.size() <= kBasisTerms, "an expert has more terms than the basis");
  const bool has_slope = options.slopes == SlopeModel::kDamped;
  first_coefficient_ = has_slope ? 2 : 1;
  states_ = first_coefficient_ + terms_.size();
  const auto add_priors = [&](Belief belief) {
    if (terms_.empty()) return beliefs_.push_back(belief);
    for (const double prior : kPriors) {
      belief.prior = prior;
      beliefs_.push_back(belief);
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
  mean_.resize(states_ * filters());
  covariance_.resize(states_ * (states_ + 1) / 2 * filters());
  gain_.resize(states_ * filters());
  innovation_.resize(filters());
  variance_.resize(filters());
  per_deviation_.resize(filters());
  log_weights_.resize(filters());
  weights_.resize(filters());
  reset();
}

void KalmanBank::reset() noexcept {
  knows_ = has_time_ = false;
  unit_variance_ = unit_weight_ = 0.0;
  for (auto* numbers : {&mean_, &covariance_, &log_weights_})
    std::fill(numbers->begin(), numbers->end(), 0.0);
  weigh();
  forecast_ = {};
}

void KalmanBank::restart() noexcept {
  has_time_ = false;
  if (!knows_) return;
  for (std::size_t f = 0; f < filters(); ++f) {
    covariance(0, 0)[f] += kDiffuse * unit_variance_;
    if (first_coefficient_ == 1) continue;
    mean(1)[f] = 0.0;
    covariance(1, 0)[f] = 0.0;
    for (std::size_t j = 2; j < states_; ++j) covariance(j, 1)[f] = 0.0;
    covariance(1, 1)[f] = beliefs_[f].slope_share * unit_variance_ / (unit_s_ * unit_s_);
  }
}

// The geometric mean of the labels' variances, in which one that says less counts less: the first
// label may be of a drift that changes quickly after a cold start, and look a thousand times
// noisier than the others.
void KalmanBank::note_unit(double variance) noexcept {
  if (!(variance > 0.0)) return;
  if (unit_weight_ == 0.0) unit_variance_ = variance;
  const double weight = std::min(1.0, unit_variance_ / variance);
  unit_weight_ += weight;
  unit_variance_ *= std::pow(variance / unit_variance_, weight / unit_weight_);
}

void KalmanBank::begin(const Labelled& label) {
  unit_s_ = label.duration_s;
  for (std::size_t f = 0; f < filters(); ++f) {
    mean(0)[f] = label.drift;
    covariance(0, 0)[f] = kDiffuse * unit_variance_;
    if (first_coefficient_ == 2)
      covariance(1, 1)[f] = beliefs_[f].slope_share * unit_variance_ / (unit_s_ * unit_s_);
    for (std::size_t j = first_coefficient_; j < states_; ++j)
      covariance(j, j)[f] = beliefs_[f].prior * unit_variance_;
  }
}

// The level's walk is white noise integrated; a slope of standard deviation s decays with time T,
// driven so that s is stationary (Singer's model; e.g. Bar-Shalom, Li and Kirubarajan 2001, 8.2.3).
void KalmanBank::predict(double elapsed_s) {
  for (std::size_t f = 0; f < filters(); ++f)
    covariance(0, 0)[f] += beliefs_[f].walk * unit_variance_ * elapsed_s / unit_s_;
  if (first_coefficient_ == 1) return;
  std::array<double, kSlopeTimesS.size()> gone{};
  for (std::size_t i = 0; i < gone.size(); ++i) gone[i] = -std::expm1(-elapsed_s / kSlopeTimesS[i]);
  for (std::size_t f = 0; f < filters(); ++f) {
    const double time_s = kSlopeTimesS[beliefs_[f].slope_time];
    const double lost = gone[beliefs_[f].slope_time];
    const double kept = 1.0 - lost;
    const double reach_s = time_s * lost;
    const double slope_variance =
        beliefs_[f].slope_share * unit_variance_ / (unit_s_ * unit_s_) * time_s;
    // level += reach slope, slope *= kept.
    mean(0)[f] += reach_s * mean(1)[f];
    mean(1)[f] *= kept;
    double& level = covariance(0, 0)[f];
    double& cross = covariance(1, 0)[f];
    double& slope = covariance(1, 1)[f];
    level += 2.0 * reach_s * cross + reach_s * reach_s * slope +
             slope_variance * (2.0 * elapsed_s - 2.0 * reach_s - time_s * lost * lost);
    cross = kept * (cross + reach_s * slope) + slope_variance * lost * lost;
    slope = kept * kept * slope + slope_variance / time_s * (1.0 - kept * kept);
    for (std::size_t j = 2; j < states_; ++j) {
      covariance(j, 0)[f] += reach_s * covariance(j, 1)[f];
      covariance(j, 1)[f] *= kept;
    }
  }
}

void KalmanBank::update(const Labelled& label) {
  const std::size_t n = filters();
  std::fill(gain_.begin(), gain_.end(), 0.0);
  std::fill(innovation_.begin(), innovation_.end(), label.drift);
  std::fill(variance_.begin(), variance_.end(), label.variance);
  const auto row = [&](std::size_t i) {
    if (i == 0) return 1.0;
    return i < first_coefficient_ ? 0.0 : label.basis[terms_[i - first_coefficient_]];
  };
  // Covariance times row, of which only the lower half is kept.
  for (std::size_t i = 0; i < states_; ++i) {
    double* const gain = &gain_[i * n];
    for (std::size_t j = 0; j < states_; ++j) {
      const double weight = row(j);
      if (weight == 0.0) continue;
      const double* const p = i >= j ? covariance(i, j) : covariance(j, i);
      for (std::size_t f = 0; f < n; ++f) gain[f] += p[f] * weight;
    }
  }
  for (std::size_t i = 0; i < states_; ++i) {
    const double weight = row(i);
    for (std::size_t f = 0; f < n; ++f) {
      innovation_[f] -= weight * mean(i)[f];
      variance_[f] += weight * gain_[i * n + f];
    }
  }
  // Rounding, or a covariance that came from anywhere, makes no measurement better than it is.
  for (double& variance : variance_) variance = std::max(variance, label.variance);
  for (std::size_t f = 0; f < n; ++f) per_deviation_[f] = 1.0 / std::sqrt(variance_[f]);
  for (std::size_t f = 0; f < n; ++f) innovation_[f] *= per_deviation_[f];
  for (std::size_t i = 0; i < states_; ++i) {
    double* const gain = &gain_[i * n];
    double* const x = mean(i);
    for (std::size_t f = 0; f < n; ++f) gain[f] *= per_deviation_[f];
    for (std::size_t f = 0; f < n; ++f) x[f] += gain[f] * innovation_[f];
    for (std::size_t j = 0; j <= i; ++j) {
      const double* const other = &gain_[j * n];
      double* const p = covariance(i, j);
      for (std::size_t f = 0; f < n; ++f) p[f] -= gain[f] * other[f];
    }
    double* const own = covariance(i, i);
    for (std::size_t f = 0; f < n; ++f) own[f] = std::max(own[f], 0.0);
  }
}

void KalmanBank::learn(const Labelled& label) {
  note_unit(label.variance);
  if (!knows_) {
    begin(label);
  } else if (has_time_) {
    predict(label.time_s - time_s_);
  }
  update(label);
  if (knows_) note_evidence();
  time_s_ = label.time_s;
  knows_ = has_time_ = true;
  weigh();
  average();
}

// The likelihood of the label's innovation.
void KalmanBank::note_evidence() noexcept {
  for (std::size_t f = 0; f < filters(); ++f) {
    log_weights_[f] = kForgetting * log_weights_[f] -
                      0.5 * (std::log(variance_[f]) + innovation_[f] * innovation_[f]);
  }
  const double most = *std::max_element(log_weights_.begin(), log_weights_.end());
  for (double& weight : log_weights_) weight -= most;
}

void KalmanBank::weigh() noexcept {
  double sum = 0.0;
  for (std::size_t f = 0; f < filters(); ++f) {
    weights_[f] = log_weights_[f] < kRuledOut ? 0.0 : std::exp(log_weights_[f]);
    sum += weights_[f];
  }
  for (double& weight : weights_) weight /= sum;
}

void KalmanBank::average() noexcept {
  forecast_ = {.time_s = time_s_};
  for (std::size_t f = 0; f < filters(); ++f) {
    forecast_.level += weights_[f] * mean(0)[f];
    if (first_coefficient_ == 2)
      forecast_.slope[beliefs_[f].slope_time] += weights_[f] * mean(1)[f];
  }
  for (std::size_t j = first_coefficient_; j < states_; ++j) {
    double& coefficient = forecast_.coefficient[terms_[j - first_coefficient_]];
    for (std::size_t f = 0; f < filters(); ++f) coefficient += weights_[f] * mean(j)[f];
  }
}

// Between filters the logarithms are averaged: where nothing was learned their priors, each ten
// times the other, are all that differs, and the largest would decide alone.
double KalmanBank::coefficient_variance(std::size_t term) const noexcept {
  const std::size_t i = state_of(term);
  double log_sum = 0.0;
  for (std::size_t f = 0; f < filters(); ++f) {
    if (weights_[f] == 0.0) continue;
    const double apart = mean(i)[f] - forecast_.coefficient[term];
    log_sum += weights_[f] * std::log(std::max(covariance(i, i)[f] + apart * apart, kSmallest));
  }
  return std::exp(log_sum);
}

double KalmanBank::coefficient_correlation(std::size_t a, std::size_t b) const noexcept {
  const std::size_t i = std::max(state_of(a), state_of(b));
  const std::size_t j = std::min(state_of(a), state_of(b));
  double sum = 0.0;
  for (std::size_t f = 0; f < filters(); ++f) {
    if (weights_[f] == 0.0) continue;
    const double size = std::sqrt(covariance(i, i)[f] * covariance(j, j)[f]);
    if (size > 0.0) sum += weights_[f] * std::clamp(covariance(i, j)[f] / size, -1.0, 1.0);
  }
  return sum;
}

std::size_t KalmanBank::state_of(std::size_t term) const noexcept {
  const auto found = std::find(terms_.begin(), terms_.end(), term);
  return first_coefficient_ + static_cast<std::size_t>(found - terms_.begin());
}

// What follows from the rest is made anew.
void KalmanBank::carry(core::StateArchive& archive) {
  archive(knows_, has_time_, time_s_, unit_variance_, unit_weight_, unit_s_);
  archive.require(unit_variance_ >= 0.0 && unit_s_ >= 0.0 && (!knows_ || unit_s_ > 0.0));
  archive.require(unit_weight_ >= 0.0 && (unit_variance_ > 0.0) == (unit_weight_ > 0.0));
  archive.numbers(mean_.data(), mean_.size());
  archive.numbers(covariance_.data(), covariance_.size());
  archive.numbers(log_weights_.data(), log_weights_.size());
  for (std::size_t i = 0; i < states_; ++i) {
    for (std::size_t f = 0; f < filters(); ++f) archive.require(covariance(i, i)[f] >= 0.0);
  }
  for (const double weight : log_weights_) archive.require(weight <= 0.0);
  archive.require(std::find(log_weights_.begin(), log_weights_.end(), 0.0) != log_weights_.end());
  if (!archive.reads() || !archive.ok()) return;
  weigh();
  forecast_ = {};
  if (knows_) average();
}

}  // namespace zerodrift::experts
