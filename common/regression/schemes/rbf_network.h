// SPDX-License-Identifier: Apache-2.0
// Radial basis function network, trained once: the first of the two batch schemes that Mao et al.
// (2022) compare with, tables 1 to 3.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "common/regression/drift_scheme.h"
#include "common/regression/kernel.h"
#include "common/regression/schemes/initial_set.h"

namespace zerodrift::regression {

struct RbfNetworkOptions {
  InitialSetOptions initial{};
  std::size_t centres = 25;  // most of them, >= 1; there are never more than distinct samples
  // Width of the Gaussians over the mean distance of a centre to its two nearest neighbours; > 0.
  double overlap = 3.0;
  // Ridge on the output weights per label, in units of the targets' variance; > 0.
  double ridge = 1e-4;

  // The first wrong key and what would be right; empty if all is well.
  [[nodiscard]] std::optional<std::string> validate() const;

  friend bool operator==(const RbfNetworkOptions&, const RbfNetworkOptions&) = default;
};

// f(x) = w_0 + sum_j w_j exp(-|x - c_j|² / (2 width²)): centres by k-means started from a
// farthest-point traversal, one width by the distances of neighbouring centres (Moody & Darken,
// Neural Computation 1, 1989), weights by regularised least squares (QR). Nothing is drawn at
// random. The labels' mean until the initial set is complete, frozen after that; the variance is
// unknown throughout. Training O(labels centres²), predict O(centres).
class RbfNetwork final : public DriftScheme {
 public:
  // Throws std::invalid_argument with options.validate()'s sentence.
  explicit RbfNetwork(const RbfNetworkOptions& options = {});

  void learn(const DriftLabel& label) override;
  [[nodiscard]] DriftPrediction predict(double time_s,
                                        std::span<const double> features) const override;

  [[nodiscard]] bool is_trained() const noexcept { return is_trained_; }
  [[nodiscard]] std::size_t centre_count() const noexcept { return weights_.size(); }

 private:
  void train();
  [[nodiscard]] SampleColumns centres() const noexcept {
    return {centres_.data(), weights_.size(), initial_.dimension(), weights_.size()};
  }

  RbfNetworkOptions options_;
  InitialSet initial_;
  bool is_trained_ = false;
  double offset_ = 0.0;  // w_0 once trained
  Kernel kernel_;
  std::vector<double> centres_;  // by column
  std::vector<double> weights_;
};

}  // namespace zerodrift::regression
