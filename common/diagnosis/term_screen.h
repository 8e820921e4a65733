// SPDX-License-Identifier: Apache-2.0
// Looks through a whole grammar of terms for those that explain a series, quickly: on means over
// blocks, in the lowest coefficients of the cosine transform, at one noise. What it finds is worth
// an evidence; it gives none itself.
//
//   1. every factor by itself; the best ones behind a lag too
//   2. products of a factor with a plain operand, for all pairs of operands; from the best of them
//      one factor after the other over all its forms and values
//   3. values of the best ones between those listed, by steps that halve
//
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/formula_terms.h"
#include "common/diagnosis/noise_spectrum.h"
#include "common/diagnosis/playback.h"

namespace zerodrift::diagnosis {

struct ScreenQuestion {
  std::span<const double> series;  // about its mean, as long as the playback
  std::span<const std::uint8_t> valid;
  const Playback& playback;
  core::Axis axis = core::Axis::kX;
  // What the model has, and what was found: what they explain is no news.
  std::vector<std::vector<double>> known{};
  std::span<const NoiseTerm> noise_terms;
  std::span<const double> noise_squares;
};

struct ScreenedTerm {
  Term term;
  double score = 0.0;  // half the explained square over the noise plus the log prior, nats
};

class TermScreen {
 public:
  // The operands must outlive it. O(known * samples).
  TermScreen(const ScreenQuestion& question, std::span<const Operand> operands);
  ~TermScreen();
  TermScreen(const TermScreen&) = delete;
  TermScreen& operator=(const TermScreen&) = delete;

  // The best ones with a score above 0, each of another structure, best first. At most some 30 000
  // terms of 2000 points are looked at: 2 s.
  [[nodiscard]] std::vector<ScreenedTerm> best(std::size_t count);
  // Takes what this term explains off what is looked for.
  void take_off(const Term& term);
  // The record on the grid of the screen.
  [[nodiscard]] const Playback& playback() const;
  // Of what each term adds beside the known (and what was taken off): the largest share that the
  // columns of one effect, on the grid of the screen, explain.
  [[nodiscard]] std::vector<double> shares_explained_by(
      const std::vector<std::vector<std::vector<double>>>& effects,
      std::span<const ScreenedTerm> terms);

 private:
  class Work;
  std::unique_ptr<Work> work_;
};

}  // namespace zerodrift::diagnosis
