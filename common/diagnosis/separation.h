// SPDX-License-Identifier: Apache-2.0
// How far apart an experiment holds two effects: the norm of what is left of one's waveform once
// the known effects and the other one are fitted to it, whitened by a noise.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/candidates.h"
#include "common/diagnosis/cosine_transform.h"
#include "common/diagnosis/measured_series.h"
#include "common/diagnosis/playback.h"
#include "common/twin/model.h"
#include "common/twin/profile.h"

namespace zerodrift::diagnosis {

using Columns = std::vector<std::vector<double>>;

// Takes off the mean and divides the cosines by a noise's standard deviations (gap.h).
class Whitener {
 public:
  // dct_variances: of a noise, not all of them 0.
  explicit Whitener(std::vector<double> dct_variances);

  // O(n log n) a column.
  [[nodiscard]] Eigen::MatrixXd matrix(const Columns& columns);

 private:
  CosineTransform transform_;
  std::vector<double> variances_;
};

// Of what is left of a whitened waveform beside others. O(n others²).
[[nodiscard]] double norm_beside(const Eigen::VectorXd& waveform, const Eigen::MatrixXd& others);

// The periods and frequencies that the catalogue offers to a search, as if a record showed them.
[[nodiscard]] Scans offered_scans();

// Columns of one of the candidates at each of its variants; no more than enough to cover its
// shapes. None where the experiment doesn't excite it.
[[nodiscard]] std::vector<Columns> rivals_of(const std::string& name, const Candidates& all,
                                             const Playback& playback);

// Only a waveform can be run over an experiment: a noise, or what this catalogue doesn't know, may
// be near or far.
[[nodiscard]] bool can_be_run(const std::string& name);

// What a profile exposes the model's thermometers and all else to, on a grid, without noise and
// without a gyro. The thermometers have no lag. O(duration * 10 Hz).
[[nodiscard]] MeasuredSeries exposure(const twin::Model& model, const twin::Profile& profile,
                                      double interval_s);
// The same with the temperatures of an experiment that differs in neither chamber nor power nor
// length: what they cost is saved.
[[nodiscard]] MeasuredSeries exposure(const twin::Profile& profile, double interval_s,
                                      const std::vector<ProbeSeries>& temperatures);

}  // namespace zerodrift::diagnosis
