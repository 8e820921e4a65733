// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/search_board.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <numeric>
#include <utility>

#include "common/diagnosis/shape_refinement.h"

namespace zerodrift::diagnosis {
namespace {

double missing(std::span<const std::uint8_t> valid) {
  const auto count = std::count(valid.begin(), valid.end(), std::uint8_t{0});
  return static_cast<double>(count) / static_cast<double>(valid.size());
}

}  // namespace

// The base's columns and the series, weighted by the inverse spectrum, and the factor of their
// normal equations.
struct Board::WhitenedBase {
  Base base;
  Eigen::VectorXd inverse_spectrum;
  Eigen::MatrixXd weighted;     // singles x (p + 1)
  Eigen::VectorXd base_series;  // p
  Eigen::VectorXd scale;        // p
  Eigen::LLT<Eigen::MatrixXd> factor;
};

Board::Board(const SearchProblem& problem, const SearchOptions& options, ColumnMemory* memory)
    : problem_(problem),
      options_(options),
      transform_(SpectralBands(problem.series.size(), options.single_coefficients), problem.valid),
      dictionary_(transform_.bands(), problem.interval_s, problem.noise),
      missing_share_(missing(problem.valid)),
      members_(problem.groups.size()) {
  add_active(transform_.series(problem.series, problem.valid), "series", 0.0);
  add_known(problem.known);
  ColumnMemory of_this_board;
  ColumnMemory& kept = memory != nullptr ? *memory : of_this_board;
  kept.begin(problem.valid, options.single_coefficients);
  for (std::size_t g = 0; g < problem.groups.size(); ++g) add_variants(g, kept);
  kept.end();
}

void Board::add_variants(std::size_t g, ColumnMemory& memory) {
  const CandidateGroup& group = problem_.groups[g];
  std::vector<ColumnMemory::Columns> made;
  std::vector<std::vector<double>> unknown;
  for (const CandidateVariant& definition : group.variants) {
    made.push_back(memory.find(group.identity, definition.shape));
    if (made.back() == nullptr) unknown.push_back(definition.shape);
  }
  const std::vector<ColumnMemory::Columns> others = make_columns(g, unknown);
  auto next = others.begin();
  for (std::size_t i = 0; i < group.variants.size(); ++i) {
    if (made[i] == nullptr) {
      made[i] = *next++;
      memory.keep(group.identity, group.variants[i].shape, made[i]);
    }
    members_[g].push_back(variants_.size());
    variants_.push_back(make_variant(g, group.variants[i], std::move(made[i]), all_active()));
  }
}

void Board::add_active(SpectralColumn column, std::string column_name, double ridge) {
  active_.push_back(std::move(column));
  names_.push_back(std::move(column_name));
  ridges_.push_back(ridge);
  std::vector<Eigen::VectorXd> products;
  for (const SpectralColumn& other : active_) {
    products.push_back(bin_products(bands(), active_.back(), other));
  }
  active_products_.push_back(std::move(products));
}

// A known column that the ones before it explain would make the normal equations singular.
void Board::add_known(const std::vector<KnownColumn>& known) {
  for (const KnownColumn& k : known) {
    known_testability_.push_back(Testability::kUnusable);
    if (!transform_.takes(k.values)) continue;
    SpectralColumn column = std::move(transform_.columns({k.values}).front());
    known_testability_.back() =
        column.norm > 0.0 ? Testability::kTestable : Testability::kNotExcited;
    if (!(column.norm > 0.0)) continue;
    const double sd = k.prior_sd * column.norm;  // of a column of unit norm
    add_active(std::move(column), k.name, std::isfinite(sd) ? 1.0 / (sd * sd) : 0.0);
    known_.push_back(active_.size() - 1);
    const Base kept = independent(known_);
    if (kept.size() < known_.size()) known_testability_.back() = Testability::kCollinear;
    known_ = kept;
  }
}

Base Board::independent(const Base& base) const {
  constexpr double kLeastKept = 1e-7;  // of a column's square norm: what single precision leaves
  const auto p = static_cast<Eigen::Index>(base.size());
  const Eigen::MatrixXd gram = weighted_gram(rows(base), Eigen::VectorXd::Ones(bands().rows()));
  // Cholesky in the order given.
  Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(p, p);
  std::vector<Eigen::Index> kept;
  for (Eigen::Index j = 0; j < p; ++j) {
    const auto r = static_cast<Eigen::Index>(kept.size());
    double square = gram(j, j);
    for (Eigen::Index i = 0; i < r; ++i) {
      const double product = gram(j, kept[static_cast<std::size_t>(i)]);
      factor(r, i) = (product - factor.row(r).head(i).dot(factor.row(i).head(i))) / factor(i, i);
      square -= factor(r, i) * factor(r, i);
    }
    if (!(square > kLeastKept * gram(j, j))) continue;
    factor(r, r) = std::sqrt(square);
    kept.push_back(j);
  }
  Base result;
  for (const Eigen::Index j : kept) result.push_back(base[static_cast<std::size_t>(j)]);
  return result;
}

void Board::add_crosses(BoardVariant& v, const Base& actives) const {
  if (v.testability() != Testability::kTestable) return;
  for (const std::size_t active : actives) add_cross(v, active);
}

void Board::add_cross(BoardVariant& v, std::size_t active) const {
  const std::vector<SpectralColumn>& columns = v.columns();
  Eigen::MatrixXd products(bands().bins(), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t j = 0; j < columns.size(); ++j) {
    products.col(static_cast<Eigen::Index>(j)) = bin_products(bands(), columns[j], active_[active]);
  }
  v.cross.resize(std::max(v.cross.size(), active + 1));
  v.cross[active] = std::move(products);
}

BoardVariant Board::make_variant(std::size_t group, CandidateVariant definition,
                                 ColumnMemory::Columns made, const Base& beside) const {
  BoardVariant v{std::move(made), group, std::move(definition), {}};
  add_crosses(v, beside);
  return v;
}

BoardVariant Board::make_variant(std::size_t group, CandidateVariant definition,
                                 const Base& beside) {
  ColumnMemory::Columns made = make_columns(group, {definition.shape}).front();
  return make_variant(group, std::move(definition), std::move(made), beside);
}

Base Board::all_active() const {
  Base all(active_.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

std::vector<ColumnMemory::Columns> Board::make_columns(
    std::size_t group, const std::vector<std::vector<double>>& shapes) {
  std::vector<std::vector<double>> all;
  std::vector<std::size_t> counts;  // of each shape; 0: not usable
  for (const std::vector<double>& shape : shapes) {
    std::vector<std::vector<double>> own = problem_.groups[group].columns(shape);
    const bool usable = std::all_of(own.begin(), own.end(), [&](const std::vector<double>& column) {
      return transform_.takes(column);
    });
    counts.push_back(usable ? own.size() : 0);
    if (usable) std::move(own.begin(), own.end(), std::back_inserter(all));
  }
  std::vector<SpectralColumn> columns = transform_.columns(std::move(all));
  std::vector<ColumnMemory::Columns> made;
  auto next = columns.begin();
  for (const std::size_t count : counts) {
    const auto first = std::exchange(next, next + static_cast<std::ptrdiff_t>(count));
    made.push_back(std::make_shared<const ShapeColumns>(
        made_of({std::move_iterator(first), std::move_iterator(next)})));
  }
  return made;
}

ShapeColumns Board::made_of(std::vector<SpectralColumn> columns) const {
  ShapeColumns v;
  if (columns.empty()) {
    v.testability = Testability::kUnusable;
    return v;
  }
  for (std::size_t j = 0; j < columns.size(); ++j) {
    if (!(columns[j].norm > 0.0)) continue;
    v.columns.push_back(std::move(columns[j]));
    v.which.push_back(j);
  }
  if (v.columns.empty()) {
    v.testability = Testability::kNotExcited;
    return v;
  }
  const auto q = static_cast<Eigen::Index>(v.columns.size());
  v.own.resize(bands().bins(), q * q);
  v.plain_gram.resize(q, q);
  for (Eigen::Index i = 0; i < q; ++i) {
    const SpectralColumn& a = v.columns[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j <= i; ++j) {
      const SpectralColumn& b = v.columns[static_cast<std::size_t>(j)];
      v.own.col(i * q + j) = v.own.col(j * q + i) = bin_products(bands(), a, b);
      v.plain_gram(i, j) = v.plain_gram(j, i) =
          a.singles.dot(b.singles) + v.own.col(i * q + j).sum();
    }
  }
  return v;
}

double Board::series_power() const {
  return active_[0].singles.squaredNorm() + active_products_[0][0].sum();
}

Base Board::activate(std::size_t variant) {
  Base places;
  const std::string& group = problem_.groups[variants_[variant].group].name;
  const ColumnMemory::Columns made = variants_[variant].made;
  for (const SpectralColumn& column : made->columns) {
    places.push_back(active_.size());
    add_active(column, group, 0.0);
  }
  for (BoardVariant& v : variants_) add_crosses(v, places);
  return places;
}

void Board::reshape(std::size_t variant, const std::vector<double>& shape) {
  CandidateVariant definition = variants_[variant].definition;
  definition.shape = shape;
  BoardVariant changed =
      make_variant(variants_[variant].group, std::move(definition), all_active());
  if (changed.testability() == Testability::kTestable) variants_[variant] = std::move(changed);
}

RowSystem Board::rows(const Base& base, const BoardVariant* variant) const {
  const auto x = static_cast<Eigen::Index>(base.size());
  const Eigen::Index q = variant ? static_cast<Eigen::Index>(variant->columns().size()) : 0;
  const Eigen::Index p = x + q;
  const Eigen::Index p1 = p + 1;
  RowSystem r;
  r.singles.resize(bands().singles(), p1);
  r.products.resize(bands().bins(), p1 * p1);
  r.ridge.setZero(p);
  const auto set = [&](Eigen::Index i, Eigen::Index j, const auto& product) {
    r.products.col(i * p1 + j) = product;
    if (i != j) r.products.col(j * p1 + i) = product;
  };
  const auto place = [&](Eigen::Index i) {  // among the active ones; the series comes last
    return i == p ? std::size_t{0} : base[static_cast<std::size_t>(i)];
  };
  const auto is_active = [&](Eigen::Index i) { return i < x || i == p; };
  for (Eigen::Index i = 0; i < p1; ++i) {
    if (is_active(i)) {
      r.singles.col(i) = active_[place(i)].singles;
      if (i < x) r.ridge(i) = ridges_[place(i)];
    } else {
      r.singles.col(i) = variant->columns()[static_cast<std::size_t>(i - x)].singles;
    }
    for (Eigen::Index j = 0; j <= i; ++j) {
      if (is_active(i) && is_active(j)) {
        const std::size_t a = place(i);
        const std::size_t b = place(j);
        set(i, j, active_products_[std::max(a, b)][std::min(a, b)]);
      } else if (is_active(i)) {
        set(i, j, variant->cross[place(i)].col(j - x));
      } else if (is_active(j)) {
        set(i, j, variant->cross[place(j)].col(i - x));
      } else {
        set(i, j, variant->made->own.col((i - x) * q + j - x));
      }
    }
  }
  r.counts.resize(bands().rows());
  for (Eigen::Index row = 0; row < bands().rows(); ++row) {
    r.counts(row) = transform_.coefficient_weight() * bands().count(row);
  }
  return r;
}

NoiseFit Board::fit(const Base& base, const Eigen::VectorXd& start) const {
  return fit_noise(rows(base), dictionary_, options_.noise_fit, start);
}

Board::WhitenedBase Board::whiten(const Base& base, const Eigen::VectorXd& spectrum) const {
  const RowSystem r = rows(base);
  const auto p = static_cast<Eigen::Index>(base.size());
  WhitenedBase w;
  w.base = base;
  w.inverse_spectrum = spectrum.cwiseInverse();
  w.weighted = w.inverse_spectrum.head(bands().singles()).asDiagonal() * r.singles;
  const Eigen::MatrixXd gram = weighted_gram(r, spectrum);
  // Priors of known amplitudes play no part here: what a known column could explain at any
  // amplitude is no news.
  const Eigen::MatrixXd a = gram.topLeftCorner(p, p);
  w.scale = a.diagonal().cwiseSqrt().cwiseInverse();
  if (p > 0) w.factor.compute(w.scale.asDiagonal() * a * w.scale.asDiagonal());
  w.base_series = gram.col(p).head(p);
  return w;
}

ProjectedColumns Board::project(const WhitenedBase& w, const BoardVariant& v) const {
  const std::vector<SpectralColumn>& columns = v.columns();
  const auto q = static_cast<Eigen::Index>(columns.size());
  const auto p = static_cast<Eigen::Index>(w.base.size());
  const Eigen::Index singles = bands().singles();
  Eigen::MatrixXd z(singles, q);
  for (Eigen::Index j = 0; j < q; ++j) z.col(j) = columns[static_cast<std::size_t>(j)].singles;
  const auto bin_weight = w.inverse_spectrum.tail(bands().bins());
  Eigen::MatrixXd with_base = z.transpose() * w.weighted;  // q x (p + 1)
  for (Eigen::Index i = 0; i <= p; ++i) {
    const std::size_t place = i == p ? 0 : w.base[static_cast<std::size_t>(i)];
    with_base.col(i) += v.cross[place].transpose() * bin_weight;
  }
  ProjectedColumns c;
  const Eigen::VectorXd own = v.made->own.transpose() * bin_weight;
  c.gram = z.transpose() * (w.inverse_spectrum.head(singles).asDiagonal() * z) +
           Eigen::Map<const Eigen::MatrixXd>(own.data(), q, q);
  c.unprojected = c.gram.diagonal();
  c.products = with_base.col(p);
  if (p > 0) {
    const Eigen::MatrixXd half =
        w.factor.matrixL().solve(w.scale.asDiagonal() * with_base.leftCols(p).transpose());
    c.gram -= half.transpose() * half;
    c.products -= half.transpose() * w.factor.matrixL().solve(w.scale.cwiseProduct(w.base_series));
  }
  return c;
}

std::vector<ProjectedColumns> Board::project(const Base& base,
                                             const std::vector<std::size_t>& variants,
                                             const Eigen::VectorXd& spectrum) const {
  const WhitenedBase whitened = whiten(base, spectrum);
  std::vector<ProjectedColumns> projected;
  for (const std::size_t i : variants) projected.push_back(project(whitened, variants_[i]));
  return projected;
}

ColumnEvidence Board::evidence(const WhitenedBase& whitened, const BoardVariant& v) const {
  const ProjectedColumns columns = project(whitened, v);
  ColumnEvidence e = column_evidence(columns, options_.evidence, Detail::kEvidence);
  if (e.rank != 1 || v.columns().size() != 1) return e;
  const CandidateGroup& group = problem_.groups[v.group];
  const double norm = v.columns().front().norm;
  const double square = columns.gram(0, 0);
  e.log_bayes_factor +=
      log_probability_within(columns.products(0) / square, 1.0 / std::sqrt(square),
                             group.least_amplitude * norm, group.greatest_amplitude * norm);
  return e;
}

// Lets every variant chosen have the noise if it likes it better than the ones before.
void Board::score_at(Evaluation& evaluation, const Base& base, const RowSystem& base_rows,
                     std::size_t noise, const std::vector<std::size_t>& chosen) const {
  const Eigen::VectorXd& squares = evaluation.noises[noise];
  const double likelihood = noise == 0
                                ? 0.0
                                : restricted_log_likelihood(base_rows, dictionary_, squares) -
                                      evaluation.null.log_likelihood;
  if (!std::isfinite(likelihood)) return;
  const WhitenedBase whitened = whiten(base, dictionary_.spectra() * squares);
  for (const std::size_t i : chosen) {
    const BoardVariant& v = variants_[i];
    if (v.testability() != Testability::kTestable) continue;
    const ColumnEvidence e = evidence(whitened, v);
    VariantScore& score = evaluation.variants[i];
    score.kept_share = std::max(score.kept_share, e.kept_share);
    if (e.rank == 0 || likelihood + e.log_bayes_factor <= score.log_evidence) continue;
    score.log_evidence = likelihood + e.log_bayes_factor;
    score.chi_square = e.chi_square;
    score.rank = e.rank;
    score.noise = noise;
  }
}

// Of variants that make the same columns the first one stands, whichever rounding favours.
void Board::collect_groups(Evaluation& evaluation) const {
  constexpr double kSame = 1e-6;  // of an evidence: what single precision leaves
  evaluation.groups.assign(members_.size(), GroupScore{});
  for (std::size_t g = 0; g < members_.size(); ++g) {
    std::vector<double> terms;
    std::vector<double> priors;
    std::vector<double> listed;  // those that can't be judged too
    GroupScore& score = evaluation.groups[g];
    double best = std::numeric_limits<double>::lowest();
    for (const std::size_t i : members_[g]) {
      const VariantScore& v = evaluation.variants[i];
      const double log_prior = variants_[i].definition.log_prior;
      listed.push_back(log_prior);
      if (!std::isfinite(v.log_evidence)) continue;
      priors.push_back(log_prior);
      terms.push_back(v.log_evidence + log_prior);
      if (terms.back() <= best + kSame * std::max(1.0, std::abs(best))) continue;
      best = terms.back();
      score.best_variant = i;
      score.chi_square = v.chi_square;
      score.rank = v.rank;
    }
    if (!terms.empty())
      score.log_evidence = log_sum(terms) - log_sum(priors) + std::min(0.0, log_sum(listed));
  }
}

Evaluation Board::evaluate(const Base& base, const std::vector<std::size_t>& excluded,
                           const Eigen::VectorXd& start) const {
  Evaluation e;
  const RowSystem base_rows = rows(base);
  e.null = fit_noise(base_rows, dictionary_, options_.noise_fit, start);
  e.noises.push_back(e.null.squares);
  e.variants.resize(variants_.size());
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < variants_.size(); ++i) {
    const bool out =
        std::find(excluded.begin(), excluded.end(), variants_[i].group) != excluded.end();
    if (!out) all.push_back(i);
  }
  score_at(e, base, base_rows, 0, all);
  collect_groups(e);

  // Noise of their own for the leading groups; the first winner's is offered to all, since the
  // null's may have swallowed what a variant explains.
  std::vector<std::size_t> refitted;
  const auto refit = [&](std::size_t variant) {
    const RowSystem full = rows(base, &variants_[variant]);
    const NoiseFit own = fit_noise(full, dictionary_, options_.noise_fit, e.null.squares);
    refitted.push_back(variant);
    if (own.status == NoiseFitStatus::kNoPower) return;
    e.noises.push_back(own.squares);
    score_at(e, base, base_rows, e.noises.size() - 1, members_[variants_[variant].group]);
  };
  const auto refit_leaders = [&](std::size_t count) {
    std::vector<std::size_t> order(members_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return e.groups[a].log_evidence > e.groups[b].log_evidence;
    });
    for (std::size_t i = 0; i < std::min(count, order.size()); ++i) {
      const GroupScore& g = e.groups[order[i]];
      if (!std::isfinite(g.log_evidence)) break;
      if (std::find(refitted.begin(), refitted.end(), g.best_variant) == refitted.end()) {
        refit(g.best_variant);
      }
    }
    collect_groups(e);
  };
  refit_leaders((options_.refits + 1) / 2);
  const auto leader = [&](CandidateKind kind) -> const GroupScore* {
    const GroupScore* best = nullptr;
    for (std::size_t g = 0; g < e.groups.size(); ++g) {
      if (problem_.groups[g].kind != kind || !std::isfinite(e.groups[g].log_evidence)) continue;
      if (!best || e.groups[g].log_evidence > best->log_evidence) best = &e.groups[g];
    }
    return best;
  };
  for (const CandidateKind kind : {CandidateKind::kNamed, CandidateKind::kGeneric}) {
    const GroupScore* best = leader(kind);
    if (!best || best->log_evidence < 1.0) continue;
    const std::size_t noise = e.variants[best->best_variant].noise;
    if (noise != 0) score_at(e, base, base_rows, noise, all);
  }
  collect_groups(e);
  refit_leaders(options_.refits);
  return e;
}

// One shape parameter after the other: the best of some even steps over the range, then by golden
// section between its neighbours. Twice, since parameters depend on each other.
void Board::refine(std::size_t variant, const Base& base, const Eigen::VectorXd& squares) {
  constexpr int kRounds = 2;
  const std::size_t group = variants_[variant].group;
  const std::vector<ShapeRange>& ranges = problem_.groups[group].ranges;
  const CandidateVariant start = variants_[variant].definition;
  if (ranges.size() != start.shape.size()) return;
  const WhitenedBase whitened = whiten(base, dictionary_.spectra() * squares);
  Base beside = base;
  beside.push_back(0);  // the series
  const auto evidence_at = [&](const std::vector<double>& at) {
    const BoardVariant v = make_variant(group, {at, start.log_prior}, beside);
    if (v.testability() != Testability::kTestable) return -std::numeric_limits<double>::infinity();
    return evidence(whitened, v).log_bayes_factor;
  };
  std::vector<double> shape = start.shape;
  double best = evidence_at(shape);
  const auto free = std::count_if(ranges.begin(), ranges.end(), [](const ShapeRange& range) {
    return range.scale != ShapeScale::kFixed;
  });
  for (int round = 0; round < (free > 1 ? kRounds : 1); ++round) {
    for (std::size_t i = 0; i < shape.size(); ++i) {
      std::vector<double> moved = shape;
      const double value = refine_along(i, ranges[i], start.shape[i], moved, evidence_at);
      if (value <= best) continue;
      best = value;
      shape = moved;
    }
  }
  if (shape != start.shape) reshape(variant, shape);
}

}  // namespace zerodrift::diagnosis
