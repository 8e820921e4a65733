// SPDX-License-Identifier: Apache-2.0
// Kernel recursive least squares tracker: Gaussian process regression at a fixed cost.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/regression/drift_scheme.h"
#include "common/regression/kernel.h"
#include "common/regression/schemes/initial_set.h"

namespace zerodrift::regression {

struct KrlsTOptions {
  // Offset, signal variance and noise are taken from these labels, which are then learned.
  InitialSetOptions initial{.labels = 60};
  std::size_t budget = 60;  // basis vectors held at most, >= 1
  double gamma = 1.0;       // of exp(-gamma |x - z|²), > 0; in the features' units^-2
  double lambda = 0.99999;  // back-to-prior forgetting a label; (0, 1], 1 forgets nothing

  // The first wrong key and what would be right; empty if all is well.
  [[nodiscard]] std::optional<std::string> validate() const;

  friend bool operator==(const KrlsTOptions&, const KrlsTOptions&) = default;
};

// S. Van Vaerenbergh, M. Lázaro-Gredilla, I. Santamaría, "Kernel Recursive Least-Squares Tracker
// for Time-Varying Regression", IEEE Trans. Neural Networks and Learning Systems 23 (2012): the
// posterior of a Gaussian process at the basis vectors, one Kalman update a label, back-to-prior
// forgetting (their eq. 17), and the basis vector whose loss changes the mean least leaves when
// there are too many.
//
// The paper keeps K^-1 of the basis, which loses its digits with near or quantised inputs. Here
// the posterior is held in whitened coordinates f = L v, K = L L', in which the prior of v is the
// unit matrix: a basis vector joins with a row of L and a coordinate ~ N(0, 1), and leaves by
// rotations; no inverse is stored. In exact arithmetic both are the same.
//
// The labels' mean with unknown variance until the initial set is complete. O(budget²) a label,
// O(budget³) where a basis vector leaves; predict O(budget²).
class KrlsT final : public DriftScheme {
 public:
  // Throws std::invalid_argument with options.validate()'s sentence.
  explicit KrlsT(const KrlsTOptions& options = {});

  void learn(const DriftLabel& label) override;
  [[nodiscard]] DriftPrediction predict(double time_s,
                                        std::span<const double> features) const override;

  [[nodiscard]] std::size_t basis_size() const noexcept { return static_cast<std::size_t>(size_); }

  // What the initial set gave: offset and variance of the Gaussian process, and what is added to a
  // label's own variance.
  struct Prior {
    double offset = 0.0;
    double signal_variance = 1.0;
    double extra_noise_variance = 0.0;
  };
  [[nodiscard]] const Prior& prior() const noexcept { return prior_; }

 private:
  // x in the coordinates of the basis: k(x) = L weights, and what the basis leaves of k(x, x) = 1.
  struct Projection {
    Eigen::VectorXd weights;
    double novelty;
  };

  void start();
  void update(std::span<const double> features, double target, double noise);
  [[nodiscard]] Projection project(std::span<const double> features) const;
  void join(std::span<const double> features, const Projection& projection);
  [[nodiscard]] Eigen::Index least_missed() const;
  void leave(Eigen::Index row);
  [[nodiscard]] SampleColumns basis() const noexcept;

  KrlsTOptions options_;
  InitialSet initial_;
  Prior prior_;
  bool is_started_ = false;
  Eigen::Index size_ = 0;
  std::size_t stride_;
  std::vector<double> basis_;   // by column
  Eigen::MatrixXd factor_;      // L, lower triangular
  Eigen::VectorXd mean_;        // of v
  Eigen::MatrixXd covariance_;  // of v
};

}  // namespace zerodrift::regression
