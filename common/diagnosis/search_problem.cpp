// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/search_problem.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/core/require.h"

namespace zerodrift::diagnosis {

const CandidateGroup& SearchProblem::group(GroupId id) const {
  const auto found = std::find_if(groups.begin(), groups.end(),
                                  [id](const CandidateGroup& group) { return group.id == id; });
  core::require(found != groups.end(), "a finding is about a group of its problem");
  return *found;
}

void SearchProblem::check() const {
  const std::size_t n = series.size();
  if (valid.size() != n) {
    throw std::invalid_argument("valid has " + std::to_string(valid.size()) +
                                " entries, the series " + std::to_string(n));
  }
  if (!(interval_s > 0.0)) {
    throw std::invalid_argument("interval_s is " + std::to_string(interval_s) + ", must be > 0");
  }
  if (const auto error = noise.validate()) throw std::invalid_argument(*error);
  for (const CandidateGroup& g : groups) {
    if (!g.columns) throw std::invalid_argument("group '" + g.name + "' can't make its columns");
  }
}

std::optional<std::string> SearchProblem::reason_to_refuse(double least_valid_share) const {
  constexpr std::size_t kFewestPoints = 16;
  const std::size_t n = series.size();
  if (n < kFewestPoints) {
    return "the series has " + std::to_string(n) + " points, needs " +
           std::to_string(kFewestPoints);
  }
  std::size_t present = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (valid[i] == 0) continue;
    ++present;
    if (!std::isfinite(series[i])) {
      return "the series is not finite at point " + std::to_string(i);
    }
  }
  const double share = static_cast<double>(present) / static_cast<double>(n);
  if (!(share >= least_valid_share)) {
    return "only " + std::to_string(std::lround(100.0 * share)) + " % of the series is valid";
  }
  return std::nullopt;
}

std::optional<std::string> SearchOptions::validate() const {
  const auto share = [](const char* key, double value) -> std::optional<std::string> {
    if (value > 0.0 && value < 1.0) return std::nullopt;
    return std::string(key) + " is " + std::to_string(value) + ", must be inside (0, 1)";
  };
  if (auto e = share("false_alarm", false_alarm)) return e;
  if (auto e = share("credible_mass", credible_mass)) return e;
  if (auto e = share("form_mismatch_share", form_mismatch_share)) return e;
  if (auto e = share("least_valid_share", least_valid_share)) return e;
  if (auto e = share("unlisted_share", unlisted_share)) return e;
  if (!(mismatch_freedom > 0.0)) {
    return "mismatch_freedom is " + std::to_string(mismatch_freedom) + ", must be > 0";
  }
  if (!(power_separation > 0.0)) {
    return "power_separation is " + std::to_string(power_separation) + ", must be > 0";
  }
  if (single_coefficients < 1) return "single_coefficients is 0, must be >= 1";
  if (refits < 1) return "refits is 0, must be >= 1";
  if (auto e = evidence.validate()) return "evidence: " + *e;
  if (auto e = noise_fit.validate()) return "noise_fit: " + *e;
  return std::nullopt;
}

}  // namespace zerodrift::diagnosis
