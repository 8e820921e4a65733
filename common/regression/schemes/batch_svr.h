// SPDX-License-Identifier: Apache-2.0
// Support vector regression trained once, by LIBSVM: the second of the two batch schemes that Mao
// et al. (2022) compare with, tables 1 to 3.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "common/regression/drift_scheme.h"
#include "common/regression/schemes/initial_set.h"

namespace zerodrift::regression {

struct BatchSvrOptions {
  InitialSetOptions initial{};
  double box_constraint = 10.0;  // C, > 0; of targets scaled to a standard deviation of 1
  double gamma = 1.0;            // of exp(-gamma |x - z|²), > 0; in the features' units^-2
  double epsilon = 0.1;          // tube half-width, >= 0; of the scaled targets

  // The first wrong key and what would be right; empty if all is well.
  [[nodiscard]] std::optional<std::string> validate() const;

  friend bool operator==(const BatchSvrOptions&, const BatchSvrOptions&) = default;
};

// epsilon-SVR with RBF kernel on targets less their mean over their standard deviation. The labels'
// mean until the initial set is complete, frozen after that; the variance is unknown throughout.
// Training O(labels²) or more, predict O(support vectors). LIBSVM keeps its kernel matrix in float
// and uses the C library's exp: equal to the bit on one machine, not between different ones.
class BatchSvr final : public DriftScheme {
 public:
  // Throws std::invalid_argument with options.validate()'s sentence. Silences LIBSVM's printing,
  // for the whole process.
  explicit BatchSvr(const BatchSvrOptions& options = {});
  ~BatchSvr() override;
  BatchSvr(const BatchSvr&) = delete;
  BatchSvr& operator=(const BatchSvr&) = delete;

  void learn(const DriftLabel& label) override;
  [[nodiscard]] DriftPrediction predict(double time_s,
                                        std::span<const double> features) const override;

  [[nodiscard]] bool is_trained() const noexcept { return model_ != nullptr; }
  [[nodiscard]] std::size_t support_size() const noexcept;

 private:
  struct Model;

  BatchSvrOptions options_;
  InitialSet initial_;
  double offset_ = 0.0;
  double scale_ = 1.0;
  std::unique_ptr<const Model> model_;
};

}  // namespace zerodrift::regression
