// SPDX-License-Identifier: Apache-2.0
// The candidates of a search as its groups, and what its answers mean.
#pragma once

#include <string>
#include <vector>

#include "common/diagnosis/candidates.h"
#include "common/diagnosis/find_missing.h"
#include "common/diagnosis/finding.h"
#include "common/diagnosis/generic_functions.h"
#include "common/diagnosis/playback.h"
#include "common/diagnosis/search_problem.h"

namespace zerodrift::diagnosis {

// A group's shape: which choice of inputs, then the kShape parameters in the definition's order.
struct ShapeCode {
  std::vector<std::vector<twin::TemperaturePoint>> choices{};
  std::vector<std::string> names{};

  explicit ShapeCode(const Candidate& candidate);
  [[nodiscard]] std::vector<double> encode(const Variant& variant) const;
  [[nodiscard]] Variant decode(const std::vector<double>& shape) const;
};

struct Lineup {
  std::vector<Candidate> named{};
  std::vector<ShapeCode> codes{};  // one each
  std::vector<GenericFunction> generic{};

  void add(Candidate candidate);
  // What a group stands for; null: the other kind of group.
  [[nodiscard]] const Candidate* named_by(GroupId id) const;
  [[nodiscard]] const GenericFunction* generic_by(GroupId id) const;
  // The choice of inputs and shapes that a shape of a named group means.
  [[nodiscard]] Variant variant_of(GroupId id, const std::vector<double>& shape) const;
  // The effect's, or "f(temperature_coil, supply)".
  [[nodiscard]] std::string name_of(GroupId id) const;
  // Each candidate and function as a group. Their columns come from this lineup, the series and the
  // playback, which must outlive them.
  [[nodiscard]] std::vector<CandidateGroup> groups(const MeasuredSeries& series,
                                                   const Playback& playback) const;
  // A found effect with the parameters that its shape and amplitudes are.
  [[nodiscard]] NamedEffect effect_of(const FoundEffect& found) const;
  // The inputs and parameters that a fit of a named group gives, within the limits of its effect.
  [[nodiscard]] NamedEffect fitted_as(const FittedEffect& fitted) const;
};

}  // namespace zerodrift::diagnosis
