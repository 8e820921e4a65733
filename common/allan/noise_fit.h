// SPDX-License-Identifier: Apache-2.0
// Generalised non-negative least squares of a noise model on an Allan variance curve, and the
// evidence for a further term. Inner part of fit_coefficients.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/allan/allan_point.h"
#include "common/allan/noise_model.h"
#include "common/allan/point_covariance.h"

namespace zerodrift::allan {

// The points in units in which their errors are independent with variance 1 under `model`:
// L⁻¹ D⁻¹ (.), D the standard deviations, L L' = correlation + kNugget. The nugget keeps the
// weights tame where the tabulated correlation of close taus is off by a per cent.
class Whitening {
 public:
  Whitening(const std::vector<AllanPoint>& points, const NoiseModel& model);
  // Before there is a model: independent points, deviations from the measured variances.
  explicit Whitening(const std::vector<AllanPoint>& points);

  [[nodiscard]] Eigen::VectorXd of(const Eigen::VectorXd& values) const;
  [[nodiscard]] double log_determinant() const;  // of correlation + kNugget
  [[nodiscard]] const PointCovariance& covariance() const { return covariance_; }

  // Estimates gain * values, gain given for whitened values: their covariance where the points'
  // true covariance is `truth` (the sandwich).
  [[nodiscard]] Eigen::MatrixXd propagated(const Eigen::MatrixXd& gain,
                                           const PointCovariance& truth) const;

 private:
  PointCovariance covariance_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
};

struct FittedModel {
  NoiseModel model;
  ShapeSet allowed = 0;
  ShapeSet active = 0;  // with a positive square
  Whitening whitening;
  double residual = 0.0;  // squared length of the whitened residual
  int iterations = 0;
  bool converged = false;
};

// Squares of the allowed shapes at the frequency and time constant of `start`, weights from the
// fitted model itself, iterated until they rest.
[[nodiscard]] FittedModel fit_model(const std::vector<AllanPoint>& points, ShapeSet allowed,
                                    const NoiseModel& start, int max_iterations);

// Whitened columns of `shapes`, then of the logarithm of frequency and time constant of those of
// the active shapes that have one. Least squares with known scale of each column.
struct Design {
  std::vector<Shape> shapes;
  std::vector<Shape> parameters;  // of which the frequency or time constant has a column
  Eigen::MatrixXd columns;        // scaled to length 1
  Eigen::VectorXd lengths;
  Eigen::LDLT<Eigen::MatrixXd> normal;

  Design(const std::vector<AllanPoint>& points, const Whitening& whitening, const NoiseModel& model,
         ShapeSet set, bool with_parameters);

  [[nodiscard]] Eigen::VectorXd solve_scaled(const Eigen::VectorXd& whitened) const;
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& whitened) const;
  [[nodiscard]] Eigen::MatrixXd gain() const;
};

// The measured variances.
[[nodiscard]] Eigen::VectorXd measured(const std::vector<AllanPoint>& points);

// Frequency and time constant of the active shapes moved to where the curve is most likely: within
// half an octave (f) or two octaves (T), then by Newton steps. About 35 short fits each.
[[nodiscard]] FittedModel refined(const std::vector<AllanPoint>& points, FittedModel fit,
                                  int max_iterations);

// -2 ln likelihood of the cube roots, up to a constant of the points. Without the determinant a
// model that scatters more would always be a better explanation.
[[nodiscard]] double misfit(const std::vector<AllanPoint>& points, const FittedModel& fit);

// Whether the points can tell the frequency and the time constant of the active shapes from the
// other shapes.
[[nodiscard]] bool is_resolved(const std::vector<AllanPoint>& points, const FittedModel& fit);

// The candidate that is missed most, added; nothing where no candidate of the set shows enough
// evidence.
[[nodiscard]] std::optional<FittedModel> with_missing_shape(const std::vector<AllanPoint>& points,
                                                            const FittedModel& fit,
                                                            ShapeSet candidates,
                                                            int max_iterations);

// Whether a point of the curve came out smaller than chance lets it in one of ten thousand records
// of such a model. Least squares don't see it: a model that is too high says of itself that the
// points scatter by as much.
[[nodiscard]] bool is_too_high(const std::vector<AllanPoint>& points, const FittedModel& fit);

// The most likely model in which a Markov noise stands for what grows without end, which may come
// back beside it; nothing where none does.
[[nodiscard]] std::optional<FittedModel> with_markov_for_growth(
    const std::vector<AllanPoint>& points, const FittedModel& fit, int max_iterations);

}  // namespace zerodrift::allan
