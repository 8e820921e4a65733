// SPDX-License-Identifier: Apache-2.0
// Composes the experiment that tells apart what a diagnosis could not.
//
// Of explanations i with probabilities p_i, of which an experiment holds i and j apart by d_ij
// standard errors, the expected entropy of the posterior is at most
//   sum_i p_i ln(1 + sum_{j != i} p_j / p_i exp(-d_ij² / 8)),
// exp(-d²/8) being the Bhattacharyya coefficient of two normal distributions (Kolchinsky & Tracey
// 2017, Entropy 19, 361, eq. 10). d_ij: the norm of i's waveform at its fitted size, whitened by
// the model's noise, that is left once the model's own coefficients and j, at any size and in any
// of its shapes, are fitted to it; lessened by what the forms of effects are known to differ by
// (SearchOptions). Entropies are means, and distances the smaller ones, over thermal plants with
// time constants 1.5 times as short and as long as the model's. The search begins with the best
// experiment of the menu and changes one block after the other, keeping what lowers the bound.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/experiment_plan.h"
#include "common/diagnosis/open_question.h"
#include "common/twin/chamber_limits.h"
#include "common/twin/model.h"

namespace zerodrift::diagnosis {

struct DesignOptions {
  std::uint64_t seed = 1;
  std::size_t proposals = 300;  // changes that are tried
};

// Two explanations of a question in standard errors: the smaller of d_ij and d_ji.
struct Separation {
  std::size_t question = 0;
  std::string first;
  std::string second;
  double standard_errors = 0.0;
};

struct Judgement {
  double entropy_nats = 0.0;  // expected, the bound above, of all questions together
  std::vector<Separation> separations{};
};

// How well an experiment answers. Throws std::invalid_argument where a model lists no noise of the
// question's axis: nothing would be too small to see. 10 to 50 ms.
[[nodiscard]] Judgement judge_profile(const std::vector<Question>& questions,
                                      const twin::Profile& profile);

// Below, two explanations can't be distinguished: their posterior odds would change by e at most.
inline constexpr double kLeastStandardErrors = 3.0;

// That stay together, and the key of the limits that would separate them if it were there; empty
// where none would.
struct Inseparable {
  Separation pair;
  std::string channel;
};

struct Design {
  twin::Profile profile;
  Judgement judgement;
  std::string best_of_menu;    // what it does
  twin::Profile menu_profile;  // the best experiment of the menu
  Judgement of_menu;
  std::vector<Inseparable> inseparable{};
};

// Deterministic by the seed. Throws as judge_profile(). O(proposals). `progress` is given the share
// that is done.
[[nodiscard]] Design design(const std::vector<Question>& questions,
                            const twin::ChamberLimits& limits, const DesignOptions& options,
                            const std::function<void(double)>& progress);

}  // namespace zerodrift::diagnosis
