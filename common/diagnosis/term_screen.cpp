// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/term_screen.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/core/require.h"
#include "common/diagnosis/cosine_transform.h"
#include "common/diagnosis/evidence.h"
#include "common/diagnosis/noise_weight.h"

namespace zerodrift::diagnosis {
namespace {

constexpr std::size_t kMostPoints = 2000;
constexpr std::size_t kCoefficients = 900;
// Of a column's square: what is left of less beside the known says nothing of its own.
constexpr double kLeastKept = 1e-4;
constexpr std::size_t kBatch = 64;

using Wave = std::vector<double>;
using Waves = std::vector<Wave>;

Wave means_over(std::span<const double> values, std::size_t block, std::size_t count) {
  Wave means(count, 0.0);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < block; ++j) means[i] += values[i * block + j];
    means[i] /= static_cast<double>(block);
  }
  return means;
}

// Means over what is valid; a block with less than half of it is not.
struct Averaged {
  Wave means;
  std::vector<std::uint8_t> valid;
};

Averaged means_of_valid(std::span<const double> values, std::span<const std::uint8_t> valid,
                        std::size_t block, std::size_t count) {
  Averaged averaged{Wave(count, 0.0), std::vector<std::uint8_t>(count, 0)};
  for (std::size_t i = 0; i < count; ++i) {
    std::size_t present = 0;
    for (std::size_t j = i * block; j < (i + 1) * block; ++j) {
      if (valid[j] == 0) continue;
      averaged.means[i] += values[j];
      ++present;
    }
    if (2 * present < block) {
      averaged.means[i] = 0.0;
      continue;
    }
    averaged.means[i] /= static_cast<double>(present);
    averaged.valid[i] = 1;
  }
  return averaged;
}

Wave product_of(const Wave& a, const Wave& b) {
  Wave product(a.size());
  std::transform(a.begin(), a.end(), b.begin(), product.begin(), std::multiplies<>());
  return product;
}

struct FactorWave {
  Factor factor;
  Wave wave;
};

// The best first, each structure once.
std::vector<ScreenedTerm> ranked(std::vector<ScreenedTerm> terms, std::size_t count) {
  std::stable_sort(terms.begin(), terms.end(),
                   [](const ScreenedTerm& a, const ScreenedTerm& b) { return a.score > b.score; });
  std::vector<ScreenedTerm> best;
  for (ScreenedTerm& term : terms) {
    if (best.size() == count || !(term.score > 0.0)) break;
    const bool is_new = std::none_of(best.begin(), best.end(), [&](const ScreenedTerm& other) {
      return same_structure(other.term, term.term);
    });
    if (is_new) best.push_back(std::move(term));
  }
  return best;
}

// Gram and Schmidt; 0 in place of what those before it say.
Eigen::MatrixXd orthonormal(Eigen::MatrixXd columns) {
  for (Eigen::Index j = 0; j < columns.cols(); ++j) {
    const double full = columns.col(j).squaredNorm();
    for (Eigen::Index i = 0; i < j; ++i)
      columns.col(j) -= columns.col(i) * columns.col(i).dot(columns.col(j));
    const double left = columns.col(j).squaredNorm();
    columns.col(j) *= left > kLeastKept * full ? 1.0 / std::sqrt(left) : 0.0;
  }
  return columns;
}

std::size_t block_of(std::size_t size) {
  return (size + kMostPoints - 1) / kMostPoints;
}

}  // namespace

class TermScreen::Work {
 public:
  Work(const ScreenQuestion& question, std::span<const Operand> operands)
      : operands_(operands),
        axis_(question.axis),
        block_(block_of(question.series.size())),
        playback_(question.playback.averaged(block_)),
        size_(smooth_length_up_to(playback_.inputs().size())),
        averaged_(means_of_valid(question.series, question.valid, block_, size_)),
        transform_(SpectralBands(size_, std::min(kCoefficients, size_ - 1)), averaged_.valid) {
    const auto singles = transform_.bands().singles();
    const auto variances =
        dct_variances(question.noise_terms, question.noise_squares, size_, playback_.interval_s());
    weight_.resize(singles);
    for (Eigen::Index k = 0; k < singles; ++k) {
      const double variance = variances[static_cast<std::size_t>(k) + 1];
      weight_(k) = variance > 0.0 ? 1.0 / std::sqrt(variance) : 0.0;
    }
    series_ = weight_.cwiseProduct(transform_.series(averaged_.means, averaged_.valid).singles);
    basis_.resize(singles, 0);
    for (const auto& column : question.known) take_off(means_over(column, block_, size_));
    make_factors();
  }

  [[nodiscard]] const Playback& playback() const { return playback_; }

  [[nodiscard]] std::vector<ScreenedTerm> best(std::size_t count) {
    std::vector<ScreenedTerm> all = single_terms();
    std::vector<ScreenedTerm> products = product_terms(count);
    all.insert(all.end(), products.begin(), products.end());
    for (const auto& of : {ranked(all, count), ranked(products, count)}) {
      for (const ScreenedTerm& term : of) add_lagged(term.term, all);
    }
    std::vector<ScreenedTerm> leaders = ranked(std::move(all), 2 * count);
    for (ScreenedTerm& term : leaders) refine(term);
    return ranked(std::move(leaders), count);
  }

  void take_off(const Term& term) { take_off(wave_of(term)); }

  [[nodiscard]] std::vector<double> shares_explained_by(const std::vector<Waves>& effects,
                                                        std::span<const ScreenedTerm> terms) {
    Waves waves;
    for (const ScreenedTerm& term : terms) waves.push_back(wave_of(term.term));
    std::vector<double> largest(terms.size(), 0.0);
    if (terms.empty()) return largest;
    const Eigen::MatrixXd targets = projected(whitened(std::move(waves)));
    const Eigen::VectorXd full = targets.colwise().squaredNorm();
    for (const Waves& effect : effects) {
      Waves cut = effect;
      for (Wave& column : cut) column.resize(size_);
      const Eigen::MatrixXd basis = orthonormal(projected(whitened(std::move(cut))));
      const Eigen::VectorXd explained = (basis.transpose() * targets).colwise().squaredNorm();
      for (std::size_t t = 0; t < largest.size(); ++t) {
        const auto column = static_cast<Eigen::Index>(t);
        if (full(column) > 0.0) largest[t] = std::max(largest[t], explained(column) / full(column));
      }
    }
    return largest;
  }

 private:
  // --- one term

  [[nodiscard]] Wave run(const WrittenTerm& term) const {
    const twin::DefinitionPtr definition = definition_of(term, axis_);
    twin::EffectContext context = default_context(*definition, axis_, playback_.interval_s());
    for (const auto& [name, value] : term.shapes) context.parameters[name] = value;
    Wave wave = playback_.run(*definition, context);
    wave.resize(size_);
    return wave;
  }
  [[nodiscard]] Wave wave_of(const Term& term) const { return run(written(term, operands_)); }

  [[nodiscard]] Eigen::MatrixXd whitened(Waves waves) {
    const auto count = static_cast<Eigen::Index>(waves.size());
    const std::vector<SpectralColumn> columns = transform_.columns(std::move(waves));
    Eigen::MatrixXd z(weight_.size(), count);
    for (Eigen::Index j = 0; j < count; ++j) {
      const SpectralColumn& column = columns[static_cast<std::size_t>(j)];
      if (column.norm > 0.0) {
        z.col(j) = weight_.cwiseProduct(column.singles);
      } else {
        z.col(j).setZero();
      }
    }
    return z;
  }

  // Without what the known explains; 0 where that is all.
  [[nodiscard]] Eigen::MatrixXd projected(Eigen::MatrixXd z) const {
    const Eigen::VectorXd before = z.colwise().squaredNorm();
    z -= basis_ * (basis_.transpose() * z);
    for (Eigen::Index j = 0; j < z.cols(); ++j) {
      if (!(z.col(j).squaredNorm() > kLeastKept * before(j))) z.col(j).setZero();
    }
    return z;
  }

  // Square that each of them explains, over the noise.
  [[nodiscard]] std::vector<double> explained(Waves waves) {
    const Eigen::MatrixXd z = projected(whitened(std::move(waves)));
    const Eigen::VectorXd products = z.transpose() * series_;
    std::vector<double> squares(static_cast<std::size_t>(z.cols()), 0.0);
    for (Eigen::Index j = 0; j < z.cols(); ++j) {
      const double own = z.col(j).squaredNorm();
      if (own > 0.0)
        squares[static_cast<std::size_t>(j)] =
            transform_.coefficient_weight() * products(j) * products(j) / own;
    }
    return squares;
  }

  [[nodiscard]] double score(const Term& term) {
    return 0.5 * explained({wave_of(term)}).front() + log_prior_of(term, operands_);
  }

  void take_off(Wave wave) {
    Waves one;
    one.push_back(std::move(wave));
    const Eigen::VectorXd z = projected(whitened(std::move(one)));
    const double norm = z.norm();
    if (!(norm > 0.0)) return;
    basis_.conservativeResize(Eigen::NoChange, basis_.cols() + 1);
    basis_.rightCols(1) = z / norm;
    series_ -= basis_.rightCols(1) * (basis_.rightCols(1).transpose() * series_);
  }

  // --- all terms

  void make_factors() {
    for (std::size_t o = 0; o < operands_.size(); ++o) {
      of_operand_.emplace_back();
      for (std::size_t f = 0; f < kFormCount; ++f) {
        for (const Factor& factor : grid_of(operands_[o], o, static_cast<Form>(f)))
          of_operand_.back().push_back({factor, wave_of({.factors = {factor}})});
      }
    }
  }

  // Factors of an operand to start a product from: each plain one, few of each bent form.
  [[nodiscard]] std::vector<const FactorWave*> starts(std::size_t operand) const {
    constexpr std::size_t kOfAForm = 3;
    std::vector<const FactorWave*> chosen;
    for (std::size_t f = 0; f < kFormCount; ++f) {
      const Form form = static_cast<Form>(f);
      if (form == Form::kCube || form == Form::kExp || form == Form::kCreep) continue;
      const auto of_form = with_form(operand, form);
      const std::size_t wanted = form == Form::kPlain ? of_form.size() : kOfAForm;
      const std::size_t count = std::min(wanted, of_form.size());
      for (std::size_t i = 0; i < count; ++i)
        chosen.push_back(of_form[(2 * i + 1) * of_form.size() / (2 * count)]);
    }
    return chosen;
  }

  [[nodiscard]] std::vector<const FactorWave*> with_form(std::size_t operand, Form form) const {
    std::vector<const FactorWave*> chosen;
    for (const FactorWave& factor : of_operand_[operand]) {
      if (factor.factor.form == form) chosen.push_back(&factor);
    }
    return chosen;
  }

  // Scores of `fixed` times each of the others; alone where there is no fixed one.
  void score_all(const FactorWave* fixed, std::span<const FactorWave* const> others,
                 std::vector<ScreenedTerm>& scored) {
    for (std::size_t begin = 0; begin < others.size(); begin += kBatch) {
      const auto batch = others.subspan(begin, std::min(kBatch, others.size() - begin));
      Waves waves;
      for (const FactorWave* other : batch)
        waves.push_back(fixed ? product_of(fixed->wave, other->wave) : other->wave);
      const auto squares = explained(std::move(waves));
      for (std::size_t i = 0; i < batch.size(); ++i) {
        Term term{.factors = {batch[i]->factor}};
        if (fixed) term.factors.push_back(fixed->factor);
        const double prior = log_prior_of(term, operands_);
        scored.push_back({std::move(term), 0.5 * squares[i] + prior});
      }
    }
  }

  [[nodiscard]] std::vector<ScreenedTerm> single_terms() {
    std::vector<ScreenedTerm> all;
    for (const auto& factors : of_operand_) {
      std::vector<const FactorWave*> pointers;
      for (const FactorWave& factor : factors) pointers.push_back(&factor);
      score_all(nullptr, pointers, all);
    }
    return ranked(std::move(all), std::numeric_limits<std::size_t>::max());
  }

  [[nodiscard]] std::vector<ScreenedTerm> product_terms(std::size_t count) {
    std::vector<ScreenedTerm> all;
    for (std::size_t b = 0; b < operands_.size(); ++b) {
      // What an input was, while it is something else: what shaking leaves behind once it ends.
      for (const FactorWave* behind : with_form(b, Form::kLag)) score_all(behind, starts(b), all);
      const auto plain = with_form(b, Form::kPlain);
      for (std::size_t a = 0; a < operands_.size(); ++a) {
        if (a == b) continue;
        for (const FactorWave* factor : plain) score_all(factor, starts(a), all);
      }
    }
    std::vector<ScreenedTerm> leaders = ranked(std::move(all), count);
    for (ScreenedTerm& term : leaders) climb(term);
    return leaders;
  }

  // One factor after the other over all its forms and values.
  void climb(ScreenedTerm& term) {
    constexpr int kRounds = 2;
    for (int round = 0; round < kRounds; ++round) {
      for (const std::size_t moved : {0U, 1U}) {
        const Factor kept = term.term.factors[1 - moved];
        const FactorWave fixed{kept, wave_of({.factors = {kept}})};
        std::vector<const FactorWave*> others;
        for (const FactorWave& factor : of_operand_[term.term.factors[moved].operand])
          others.push_back(&factor);
        std::vector<ScreenedTerm> scored{term};
        score_all(&fixed, others, scored);
        const auto best =
            std::max_element(scored.begin(), scored.end(),
                             [](const auto& x, const auto& y) { return x.score < y.score; });
        if (best == scored.begin()) continue;
        term.score = best->score;
        term.term.factors[moved] = best->term.factors.front();
      }
    }
  }

  void add_lagged(const Term& term, std::vector<ScreenedTerm>& all) {
    if (term.lag_s > 0.0) return;
    for (const double lag_s : lags_looked_at_s()) {
      Term lagged = term;
      lagged.lag_s = lag_s;
      all.push_back({lagged, score(lagged)});
    }
  }

  // --- between the values looked at

  struct Knob {
    double* value;
    double step;
    bool is_ratio;
    double lowest;
    double highest;
  };

  [[nodiscard]] std::vector<Knob> knobs_of(Term& term) const {
    constexpr double kRatio = 1.6;
    constexpr double kShortestLagS = 10.0;
    constexpr double kNarrowest = 0.02;  // of half the range
    const double longest_lag_s = 0.25 * playback_.interval_s() * static_cast<double>(size_);
    std::vector<Knob> knobs;
    for (Factor& factor : term.factors) {
      const Operand& operand = operands_[factor.operand];
      const double half = operand.half_range();
      if (!operand.has_zero && factor.form != Form::kExp)
        knobs.push_back({&factor.centre, 0.15 * half, false, operand.lowest - 2.0 * half,
                         operand.highest + 2.0 * half});
      if (factor.form == Form::kLag) {
        knobs.push_back({&factor.width, kRatio, true, kShortestLagS, longest_lag_s});
      } else if (factor.width != 0.0) {
        knobs.push_back({&factor.width, kRatio, true, kNarrowest * half, 20.0 * half});
      }
      if (factor.form == Form::kCreep) {
        // The slower way is told by how far the faster one leaves it.
        for (double* way_s : {&factor.rise_s, &factor.fall_s})
          knobs.push_back({way_s, kRatio, true, kShortestLagS, 2.0 * longest_lag_s});
      }
    }
    if (term.lag_s > 0.0)
      knobs.push_back({&term.lag_s, kRatio, true, kShortestLagS, longest_lag_s});
    return knobs;
  }

  void refine(ScreenedTerm& screened) {
    constexpr int kHalvings = 5;
    std::vector<Knob> knobs = knobs_of(screened.term);
    for (int halving = 0; halving < kHalvings; ++halving) {
      for (Knob& knob : knobs) {
        for (const double sign : {1.0, -1.0}) {
          const double before = *knob.value;
          const double moved =
              knob.is_ratio ? before * std::pow(knob.step, sign) : before + sign * knob.step;
          if (std::abs(moved) < knob.lowest && knob.is_ratio) continue;
          if (std::abs(moved) > knob.highest && knob.is_ratio) continue;
          if (!knob.is_ratio && (moved < knob.lowest || moved > knob.highest)) continue;
          *knob.value = moved;
          const double now = score(screened.term);
          if (now > screened.score) {
            screened.score = now;
            break;
          }
          *knob.value = before;
        }
        knob.step = knob.is_ratio ? std::sqrt(knob.step) : 0.5 * knob.step;
      }
    }
  }

  std::span<const Operand> operands_;
  core::Axis axis_;
  std::size_t block_;
  Playback playback_;
  std::size_t size_;
  Averaged averaged_;
  ColumnTransform transform_;
  Eigen::VectorXd weight_;
  Eigen::VectorXd series_;
  Eigen::MatrixXd basis_;  // orthonormal
  std::vector<std::vector<FactorWave>> of_operand_;
};

TermScreen::TermScreen(const ScreenQuestion& question, std::span<const Operand> operands)
    : work_(std::make_unique<Work>(question, operands)) {}

TermScreen::~TermScreen() = default;

std::vector<ScreenedTerm> TermScreen::best(std::size_t count) {
  return work_->best(count);
}

void TermScreen::take_off(const Term& term) {
  work_->take_off(term);
}

const Playback& TermScreen::playback() const {
  return work_->playback();
}

std::vector<double> TermScreen::shares_explained_by(
    const std::vector<std::vector<std::vector<double>>>& effects,
    std::span<const ScreenedTerm> terms) {
  return work_->shares_explained_by(effects, terms);
}

}  // namespace zerodrift::diagnosis
