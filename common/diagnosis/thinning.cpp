// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/thinning.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "common/diagnosis/cosine_transform.h"

namespace zerodrift::diagnosis {
namespace {

constexpr std::size_t kMostBlocks = 2000;
// Several, since what else is missing may make another one look best.
constexpr std::size_t kKeptOfAPlace = 3;

// The residual and its noise on blocks of the record.
class Coarse {
 public:
  Coarse(const Playback& playback, std::span<const double> weighted,
         std::span<const double> variances)
      : block_((variances.size() + kMostBlocks - 1) / kMostBlocks),
        count_(smooth_length_up_to(variances.size() / block_)),
        playback_(playback.averaged(block_)),
        weighted_(static_cast<Eigen::Index>(count_)),
        inverse_variance_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(count_))),
        transform_(count_) {
    for (std::size_t i = 0; i < count_; ++i) {
      const auto of_block = weighted.subspan(i * block_, block_);
      double sum = 0.0;
      for (const double value : of_block) sum += value;
      weighted_(static_cast<Eigen::Index>(i)) = sum;
    }
    // Coefficient k of what is constant over blocks is sqrt(block) times that of its means, at the
    // same number of periods in the time that the blocks cover.
    const double longer =
        static_cast<double>(variances.size()) / static_cast<double>(count_ * block_);
    for (std::size_t k = 1; k < count_; ++k) {
      const auto place = static_cast<std::size_t>(std::lround(static_cast<double>(k) * longer));
      const double variance = variances[std::min(place, variances.size() - 1)];
      if (variance > 0.0)
        inverse_variance_(static_cast<Eigen::Index>(k)) = static_cast<double>(block_) / variance;
    }
  }

  // Half the square over its noise that each variant's first column explains, nats.
  [[nodiscard]] std::vector<double> gains(const Candidate& candidate) {
    std::vector<double> gains;
    const auto& variants = candidate.variants;
    for (std::size_t i = 0; i < variants.size(); i += 2) {
      const std::size_t second = std::min(i + 1, variants.size() - 1);
      const auto a = column(candidate, variants[i]);
      const auto b = column(candidate, variants[second]);
      Eigen::VectorXd a_cosine, b_cosine;
      transform_.forward(a, b, a_cosine, b_cosine);
      gains.push_back(gain(a, a_cosine));
      if (second != i) gains.push_back(gain(b, b_cosine));
    }
    return gains;
  }

 private:
  [[nodiscard]] std::vector<double> column(const Candidate& candidate,
                                           const Variant& variant) const {
    const twin::EffectContext context = context_of(candidate, variant, playback_.interval_s());
    auto column = std::move(columns_of(playback_, *candidate.definition, context).front());
    column.resize(count_);
    return column;
  }

  [[nodiscard]] double gain(std::span<const double> column, const Eigen::VectorXd& cosine) const {
    constexpr double kConstant = 1e-20;  // of the mean's square: what rounding leaves of it
    const double square = cosine.tail(cosine.size() - 1).squaredNorm();
    const double information = cosine.cwiseAbs2().dot(inverse_variance_);
    if (!(square > kConstant * cosine(0) * cosine(0) && information > 0.0)) return 0.0;
    const double along =
        Eigen::Map<const Eigen::VectorXd>(column.data(), weighted_.size()).dot(weighted_);
    return 0.5 * along * along / information;
  }

  std::size_t block_;
  std::size_t count_;
  Playback playback_;
  Eigen::VectorXd weighted_;  // sums over blocks
  Eigen::VectorXd inverse_variance_;
  CosineTransform transform_;
};

std::optional<std::string> threshold_of(const Candidate& candidate) {
  for (const twin::ParameterDefinition& parameter : candidate.definition->parameters) {
    if (parameter.rule == twin::SearchRule::kThreshold) return parameter.name;
  }
  return std::nullopt;
}

// Of variants at one place, likeliest first: the log prior that the first ones have when they stand
// for all.
void keep_best(const std::vector<std::size_t>& order, std::span<const double> gains,
               const Candidate& candidate, std::vector<Variant>& kept) {
  const std::size_t count = std::min(kKeptOfAPlace, order.size());
  double all = 0.0;
  double of_kept = 0.0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const double share = std::exp(gains[order[i]] - gains[order.front()]);
    all += share;
    if (i < count) of_kept += share;
  }
  for (std::size_t i = 0; i < count; ++i) {
    kept.push_back(candidate.variants[order[i]]);
    kept.back().log_prior += std::log(all / of_kept);
  }
}

void thin_out(Candidate& candidate, const std::string& threshold, Coarse& coarse) {
  const std::vector<double> gains = coarse.gains(candidate);
  std::map<std::pair<std::vector<twin::TemperaturePoint>, double>, std::vector<std::size_t>> places;
  for (std::size_t i = 0; i < gains.size(); ++i) {
    const Variant& variant = candidate.variants[i];
    places[{variant.inputs, variant.shapes.at(threshold)}].push_back(i);
  }
  std::vector<Variant> kept;
  for (auto& [place, order] : places) {
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return gains[a] > gains[b]; });
    keep_best(order, gains, candidate, kept);
  }
  candidate.variants = std::move(kept);
}

}  // namespace

void thin_out(std::vector<Candidate>& candidates, const Playback& playback,
              std::span<const double> weighted, std::span<const double> variances) {
  std::optional<Coarse> coarse;
  for (Candidate& candidate : candidates) {
    const auto threshold = threshold_of(candidate);
    if (!threshold || variances.size() < 2) continue;
    if (!coarse) coarse.emplace(playback, weighted, variances);
    thin_out(candidate, *threshold, *coarse);
  }
}

}  // namespace zerodrift::diagnosis
