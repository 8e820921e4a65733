// SPDX-License-Identifier: Apache-2.0
// What the search knows of its columns: coefficients, cross products, and the evidence of every
// variant beside a base.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "common/diagnosis/column_memory.h"
#include "common/diagnosis/search_problem.h"

namespace zerodrift::diagnosis {

// Columns that a hypothesis takes for granted, by their place among the active ones.
using Base = std::vector<std::size_t>;

struct BoardVariant {
  ColumnMemory::Columns made;  // there always
  std::size_t group = 0;
  CandidateVariant definition;
  std::vector<Eigen::MatrixXd> cross;  // per active column that it stands beside: bins x q

  [[nodiscard]] Testability testability() const { return made->testability; }
  [[nodiscard]] const std::vector<SpectralColumn>& columns() const { return made->columns; }
};

struct VariantScore {
  double log_evidence = -std::numeric_limits<double>::infinity();
  double chi_square = 0.0;
  int rank = 0;
  std::size_t noise = 0;  // of Evaluation::noises, where the evidence is largest
  double kept_share = 0.0;
};

struct GroupScore {
  double log_evidence = -std::numeric_limits<double>::infinity();
  std::size_t best_variant = 0;  // of the board
  double chi_square = 0.0;
  int rank = 0;
};

// All groups beside one base.
struct Evaluation {
  NoiseFit null;
  std::vector<Eigen::VectorXd> noises;  // squares; the first is the null's
  std::vector<VariantScore> variants;
  std::vector<GroupScore> groups;
};

class Board {
 public:
  // Columns that the memory has are not made again.
  Board(const SearchProblem& problem, const SearchOptions& options, ColumnMemory* memory = nullptr);

  [[nodiscard]] std::size_t group_count() const noexcept { return members_.size(); }
  [[nodiscard]] const std::vector<std::size_t>& members(std::size_t group) const {
    return members_[group];
  }
  [[nodiscard]] const BoardVariant& variant(std::size_t i) const { return variants_[i]; }
  [[nodiscard]] const NoiseDictionary& dictionary() const noexcept { return dictionary_; }
  [[nodiscard]] const SpectralBands& bands() const noexcept { return transform_.bands(); }
  [[nodiscard]] double missing_share() const noexcept { return missing_share_; }
  [[nodiscard]] double coefficient_weight() const noexcept {
    return transform_.coefficient_weight();
  }
  [[nodiscard]] double series_power() const;
  // Places of the known columns that count, in their order; testability of every one given.
  [[nodiscard]] const Base& known() const noexcept { return known_; }
  [[nodiscard]] const std::vector<Testability>& known_testability() const noexcept {
    return known_testability_;
  }
  [[nodiscard]] const SpectralColumn& active(std::size_t i) const { return active_[i]; }
  [[nodiscard]] const std::string& active_name(std::size_t i) const { return names_[i]; }

  // The base without the columns that those before them explain: beside them the normal equations
  // would be singular.
  [[nodiscard]] Base independent(const Base& base) const;

  // Adds a variant's columns to the active ones; their places.
  Base activate(std::size_t variant);
  // Replaces a variant by the same effect at another shape.
  void reshape(std::size_t variant, const std::vector<double>& shape);

  [[nodiscard]] RowSystem rows(const Base& base, const BoardVariant* variant = nullptr) const;
  [[nodiscard]] NoiseFit fit(const Base& base, const Eigen::VectorXd& start = {}) const;

  // Evidence of all groups but the excluded ones; noise fitted from `start` on.
  [[nodiscard]] Evaluation evaluate(const Base& base, const std::vector<std::size_t>& excluded,
                                    const Eigen::VectorXd& start) const;
  // Moves the shape of a variant to the largest evidence at one noise.
  void refine(std::size_t variant, const Base& base, const Eigen::VectorXd& squares);

  // Variants beside a base at a spectrum.
  [[nodiscard]] std::vector<ProjectedColumns> project(const Base& base,
                                                      const std::vector<std::size_t>& variants,
                                                      const Eigen::VectorXd& spectrum) const;

 private:
  struct WhitenedBase;

  void add_variants(std::size_t group, ColumnMemory& memory);
  [[nodiscard]] BoardVariant make_variant(std::size_t group, CandidateVariant definition,
                                          ColumnMemory::Columns made, const Base& beside) const;
  // The same as the only one of its kind.
  [[nodiscard]] BoardVariant make_variant(std::size_t group, CandidateVariant definition,
                                          const Base& beside);
  // Of several shapes at once: a transform takes two columns.
  [[nodiscard]] std::vector<ColumnMemory::Columns> make_columns(
      std::size_t group, const std::vector<std::vector<double>>& shapes);
  [[nodiscard]] ShapeColumns made_of(std::vector<SpectralColumn> columns) const;
  void add_active(SpectralColumn column, std::string column_name, double ridge);
  void add_known(const std::vector<KnownColumn>& known);
  [[nodiscard]] Base all_active() const;
  // Columns of a variant stay near in memory while all the active ones pass them.
  void add_crosses(BoardVariant& variant, const Base& actives) const;
  void add_cross(BoardVariant& variant, std::size_t active) const;
  [[nodiscard]] WhitenedBase whiten(const Base& base, const Eigen::VectorXd& spectrum) const;
  [[nodiscard]] ProjectedColumns project(const WhitenedBase& base,
                                         const BoardVariant& variant) const;
  [[nodiscard]] ColumnEvidence evidence(const WhitenedBase& base,
                                        const BoardVariant& variant) const;
  void score_at(Evaluation& evaluation, const Base& base, const RowSystem& base_rows,
                std::size_t noise, const std::vector<std::size_t>& chosen) const;
  void collect_groups(Evaluation& evaluation) const;

  const SearchProblem& problem_;
  const SearchOptions& options_;
  ColumnTransform transform_;
  NoiseDictionary dictionary_;
  double missing_share_ = 0.0;
  std::vector<SpectralColumn> active_;  // 0: the series
  std::vector<std::string> names_;
  std::vector<double> ridges_;
  std::vector<std::vector<Eigen::VectorXd>> active_products_;  // [i][j], j <= i
  Base known_;
  std::vector<Testability> known_testability_;
  std::vector<BoardVariant> variants_;
  std::vector<std::vector<std::size_t>> members_;
};

}  // namespace zerodrift::diagnosis
