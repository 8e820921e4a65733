// SPDX-License-Identifier: Apache-2.0
// The public learners that `zerodrift_bench svr` measures beside ours. Their headers stay in
// bench_svr_peers.cpp.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "tests/bench/synthetic_drift.h"

namespace zerodrift::bench {

// One setting for all learners.
inline constexpr double kRbfGamma = 3.0;
inline constexpr double kBoxConstraint = 10.0;
inline constexpr double kTubeHalfWidth = 0.02;

// Epsilon-SVR trained anew each time.
class LibsvmRegression {
 public:
  // tolerance: LIBSVM's stopping tolerance, of the dual gradient; its own default is 1e-3.
  explicit LibsvmRegression(double tolerance);
  ~LibsvmRegression();
  LibsvmRegression(const LibsvmRegression&) = delete;
  LibsvmRegression& operator=(const LibsvmRegression&) = delete;

  // Takes over the window that the next train() learns. Apart from train(), because a retrained
  // learner could keep it up to date a sample at a time.
  void load(std::span<const DriftPoint> window);
  // Needs a loaded window. Throws std::runtime_error with LIBSVM's sentence.
  void train();
  // Needs a train() after the last load().
  [[nodiscard]] double predict(const DriftFeatures& x) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

std::string libsvm_version_text();

// Kernel recursive least squares at dlib's default tolerance. It has no window: its dictionary
// grows by what it finds new, and it never forgets.
class DlibKrls {
 public:
  // False where dlib wasn't there at build time; then nothing else of this class may be called.
  static bool is_built_in();

  DlibKrls();
  ~DlibKrls();
  DlibKrls(DlibKrls&&) noexcept;
  DlibKrls& operator=(DlibKrls&&) noexcept;

  void learn(const DriftPoint& point);
  [[nodiscard]] double predict(const DriftFeatures& x) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace zerodrift::bench
