// SPDX-License-Identifier: Apache-2.0
#include "common/allan/chi_square.h"

#include <boost/math/special_functions/beta.hpp>
#include <boost/math/special_functions/erf.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <cassert>
#include <cmath>
#include <numbers>

namespace zerodrift::allan {
namespace {

namespace policies = boost::math::policies;

// Double alone, so that every processor gives the same bits; NaN or infinity in place of
// exceptions.
using Quiet = policies::policy<policies::promote_double<false>, policies::promote_float<false>,
                               policies::domain_error<policies::ignore_error>,
                               policies::pole_error<policies::ignore_error>,
                               policies::overflow_error<policies::ignore_error>,
                               policies::underflow_error<policies::ignore_error>,
                               policies::denorm_error<policies::ignore_error>,
                               policies::rounding_error<policies::ignore_error>,
                               policies::evaluation_error<policies::ignore_error>,
                               policies::indeterminate_result_error<policies::ignore_error>>;

}  // namespace

double normal_quantile(double probability) noexcept {
  assert(probability > 0.0 && probability < 1.0 && "a quantile needs a probability inside (0, 1)");
  return -std::numbers::sqrt2 * boost::math::erfc_inv(2.0 * probability, Quiet());
}

double chi_square_cdf(double x, double degrees_of_freedom) noexcept {
  assert(degrees_of_freedom > 0.0);
  return x > 0.0 ? boost::math::gamma_p(0.5 * degrees_of_freedom, 0.5 * x, Quiet()) : 0.0;
}

double chi_square_quantile(double probability, double degrees_of_freedom) noexcept {
  assert(probability > 0.0 && probability < 1.0 && "a quantile needs a probability inside (0, 1)");
  assert(degrees_of_freedom > 0.0);
  return 2.0 * boost::math::gamma_p_inv(0.5 * degrees_of_freedom, probability, Quiet());
}

// I_x(second/2, first/2), x = second / (second + first f), or its complement, so that neither loses
// digits.
double f_upper_tail(double f, double first_degrees_of_freedom,
                    double second_degrees_of_freedom) noexcept {
  assert(f >= 0.0 && first_degrees_of_freedom > 0.0 && second_degrees_of_freedom > 0.0);
  if (std::isinf(f)) return 0.0;
  const double a = 0.5 * first_degrees_of_freedom, b = 0.5 * second_degrees_of_freedom;
  const double sum = a * f + b;
  return a * f > b ? boost::math::ibeta(b, a, b / sum, Quiet())
                   : boost::math::ibetac(a, b, a * f / sum, Quiet());
}

}  // namespace zerodrift::allan
