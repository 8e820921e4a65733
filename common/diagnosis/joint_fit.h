// SPDX-License-Identifier: Apache-2.0
// Columns fitted together with the noise, nothing chosen among them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/diagnosis/search_board.h"
#include "common/diagnosis/search_problem.h"

namespace zerodrift::diagnosis {

// A group at one shape as a joint fit has it.
struct FittedEffect {
  GroupId group{};
  std::vector<double> shape{};
  // Unit of the series over that of the column; joint fit. 0 of a column that is constant or that
  // the others explain.
  std::vector<double> amplitudes{};
  Eigen::MatrixXd covariance{};    // of the amplitudes
  std::vector<double> waveform{};  // amplitudes times columns, mean taken off
  double rms = 0.0;                // of the waveform
};

struct JointFit {
  std::vector<FittedEffect> effects{};           // in the order asked for
  std::vector<CorrectionFinding> corrections{};  // one a known column
  std::vector<NoiseTerm> noise_terms{};
  std::vector<double> noise_squares{};
};

struct ChosenShape {
  GroupId group{};
  std::vector<double> shape{};
};

// The known columns and these groups at these shapes. Nothing where the series says nothing beside
// its known columns or a group has no column that counts. Throws as SearchProblem::check().
[[nodiscard]] std::optional<JointFit> fit_jointly(const SearchProblem& problem,
                                                  std::span<const ChosenShape> chosen,
                                                  const SearchOptions& options);

// The known columns alone: the noise that a search begins with. Groups of the problem count for
// nothing.
[[nodiscard]] std::optional<JointFit> fit_noise_beside(const SearchProblem& problem,
                                                       const SearchOptions& options);

// --- for those who have a board already

// What of a base may be left out behind its known columns.
enum class Idle : std::uint8_t {
  kAnyColumn,
  kHigherPowers,  // of groups that have powers, all but the first
};

// The base without amplitudes that the record speaks against (Bayes factor below 1), the weakest
// first. Powers go from the highest on: which of the lower ones are 0 is a matter of where the
// temperature is counted from, and where one is left out the next one takes its course.
[[nodiscard]] Base with_evidence(const SearchProblem& problem, const SearchOptions& options,
                                 const Board& board, Base base, const Eigen::VectorXd& squares,
                                 Idle idle = Idle::kAnyColumn);

// What the joint amplitudes of `base` say of a variant whose columns are active at `places`.
[[nodiscard]] FittedEffect fitted_effect(const SearchProblem& problem, const Board& board,
                                         std::size_t variant, const Base& places, const Base& base,
                                         const Amplitudes& joint);
// One for each known column; without a joint fit each is 0 and may be anything.
[[nodiscard]] std::vector<CorrectionFinding> corrections_of(const SearchProblem& problem,
                                                            const SearchOptions& options,
                                                            const Board& board,
                                                            const std::optional<Amplitudes>& joint);

}  // namespace zerodrift::diagnosis
