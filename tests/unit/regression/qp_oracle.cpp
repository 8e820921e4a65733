// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/regression/qp_oracle.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace zerodrift::regression::testing {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double plain_kernel(const Kernel& kernel, const std::vector<double>& a,
                    const std::vector<double>& b) {
  double squared = 0.0, product = 0.0;
  for (std::size_t d = 0; d < a.size(); ++d) {
    squared += (a[d] - b[d]) * (a[d] - b[d]);
    product += a[d] * b[d];
  }
  const double s = std::sqrt(2.0 * kernel.gamma * squared);  // distance in length scales
  switch (kernel.kind) {
    case KernelKind::kRbf: return std::exp(-kernel.gamma * squared);
    case KernelKind::kMatern32: return (1.0 + std::sqrt(3.0) * s) * std::exp(-std::sqrt(3.0) * s);
    case KernelKind::kMatern52:
      return (1.0 + std::sqrt(5.0) * s + 5.0 * s * s / 3.0) * std::exp(-std::sqrt(5.0) * s);
    case KernelKind::kPolynomial:
      return std::pow(kernel.gamma * product + kernel.offset, kernel.degree);
    case KernelKind::kLinear: return product;
  }
  return 0.0;
}

class Solver {
 public:
  Solver(const OnlineSvrOptions& options, const std::vector<Sample>& samples,
         const std::vector<double>& weights)
      : n_(samples.size()),
        box_(n_, options.box_constraint),
        epsilon_(options.epsilon),
        gram_(n_ * n_),
        theta_(n_, 0.0) {
    for (std::size_t i = 0; i < weights.size(); ++i) box_[i] *= weights[i];
    for (std::size_t i = 0; i < n_; ++i) {
      for (std::size_t j = 0; j < n_; ++j) {
        gram_[i * n_ + j] = plain_kernel(options.kernel, samples[i].x, samples[j].x);
      }
      gradient_.push_back(-static_cast<long double>(samples[i].y));
    }
  }

  // Slope of the objective for raising or lowering theta_i; infinite at the bound.
  [[nodiscard]] double slope_up(std::size_t i) const {
    if (theta_[i] >= box_[i]) return kInfinity;
    return static_cast<double>(gradient_[i]) + (theta_[i] >= 0.0 ? epsilon_ : -epsilon_);
  }
  [[nodiscard]] double slope_down(std::size_t i) const {
    if (theta_[i] <= -box_[i]) return -kInfinity;
    return static_cast<double>(gradient_[i]) + (theta_[i] > 0.0 ? epsilon_ : -epsilon_);
  }

  // One pair step. False once no pair can lower the objective by more than the tolerance in slope.
  bool step(double tolerance) {
    std::size_t up = 0;
    for (std::size_t i = 1; i < n_; ++i) {
      if (slope_up(i) < slope_up(up)) up = i;
    }
    const double slope = slope_up(up);
    double best = 0.0, worst = -kInfinity;
    std::size_t down = n_;
    for (std::size_t j = 0; j < n_; ++j) {
      const double violation = slope_down(j) - slope;
      worst = std::max(worst, violation);
      if (j == up || violation <= 0.0) continue;
      const double gain = violation * violation / curvature(up, j);
      if (gain > best) {
        best = gain;
        down = j;
      }
    }
    if (worst <= tolerance || down == n_) return false;
    move(up, down, (slope_down(down) - slope) / curvature(up, down));
    return true;
  }

  [[nodiscard]] const std::vector<double>& theta() const { return theta_; }

 private:
  [[nodiscard]] double curvature(std::size_t i, std::size_t j) const {
    return std::max(gram_[i * n_ + i] + gram_[j * n_ + j] - 2.0 * gram_[i * n_ + j], 1e-15);
  }

  // Stops at bounds and at zero, where the slope of epsilon |theta| changes.
  void move(std::size_t up, std::size_t down, double length) {
    const double up_limit = theta_[up] < 0.0 ? 0.0 : box_[up];
    const double down_limit = theta_[down] > 0.0 ? 0.0 : -box_[down];
    const double up_room = up_limit - theta_[up], down_room = theta_[down] - down_limit;
    const double t = std::min({length, up_room, down_room});
    theta_[up] = t == up_room ? up_limit : theta_[up] + t;
    theta_[down] = t == down_room ? down_limit : theta_[down] - t;
    for (std::size_t k = 0; k < n_; ++k) {
      gradient_[k] +=
          static_cast<long double>(t) * (static_cast<long double>(gram_[up * n_ + k]) -
                                         static_cast<long double>(gram_[down * n_ + k]));
    }
  }

  std::size_t n_;
  std::vector<double> box_;
  double epsilon_;
  std::vector<double> gram_, theta_;
  std::vector<long double> gradient_;
};

}  // namespace

double OracleModel::expansion(const std::vector<double>& x) const {
  double value = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    value += theta[i] * plain_kernel(kernel, samples[i].x, x);
  }
  return value;
}

OracleModel solve_batch(const OnlineSvrOptions& options, const std::vector<Sample>& samples,
                        double tolerance, const std::vector<double>& weights) {
  constexpr int kMaxSteps = 3000000;
  Solver solver(options, samples, weights);
  int steps = 0;
  while (steps < kMaxSteps && solver.step(tolerance)) ++steps;
  double up = kInfinity, down = -kInfinity;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    up = std::min(up, solver.slope_up(i));
    down = std::max(down, solver.slope_down(i));
  }
  return {
      samples,          solver.theta(), options.kernel, std::min(-up, -down), std::max(-up, -down),
      steps < kMaxSteps};
}

}  // namespace zerodrift::regression::testing
