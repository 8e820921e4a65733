// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/mounting.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

namespace zerodrift::compensation {
namespace {

constexpr std::size_t kN = core::kAxisCount;
using Rows = std::array<core::PerAxis<double>, kN>;
constexpr Rows kIdentity{{{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}};

// Nothing where the text is none of x, -x, y, ...
std::optional<core::PerAxis<double>> row_of(std::string_view axis) {
  const bool is_reversed = axis.starts_with('-');
  if (is_reversed || axis.starts_with('+')) axis.remove_prefix(1);
  for (const auto candidate : core::kAxes) {
    if (core::name(candidate) != axis) continue;
    core::PerAxis<double> row{};
    row[core::index(candidate)] = is_reversed ? -1.0 : 1.0;
    return row;
  }
  return std::nullopt;
}

const std::vector<double>& elements_of(const MountingOptions& options) {
  return options.matrix.empty() ? options.general_matrix : options.matrix;
}

Rows rows_of(const MountingOptions& options) {
  Rows rows = kIdentity;
  const std::vector<double>& elements = elements_of(options);
  for (std::size_t i = 0; i < kN; ++i) {
    if (!options.axes.empty()) rows[i] = row_of(options.axes[i]).value_or(rows[i]);
    if (elements.empty()) continue;
    for (std::size_t j = 0; j < kN; ++j) rows[i][j] = elements[kN * i + j];
  }
  return rows;
}

// Largest element of M Mᵀ - 1; infinite where one of M is no number.
double off_orthogonal(const Rows& rows) {
  double largest = 0.0;
  for (std::size_t i = 0; i < kN; ++i) {
    for (std::size_t j = 0; j < kN; ++j) {
      double product = i == j ? -1.0 : 0.0;
      for (std::size_t k = 0; k < kN; ++k) product += rows[i][k] * rows[j][k];
      if (!std::isfinite(product)) return std::numeric_limits<double>::infinity();
      largest = std::max(largest, std::abs(product));
    }
  }
  return largest;
}

std::optional<std::string> find_wrong_matrix(const MountingOptions& options, const char* key,
                                             const std::vector<double>& elements, double limit) {
  if (elements.empty()) return std::nullopt;
  if (elements.size() != kN * kN) {
    return std::string(key) + ": found " + std::to_string(elements.size()) +
           " numbers, expected 9, row by row";
  }
  const double off = off_orthogonal(rows_of(options));
  if (off <= limit) return std::nullopt;
  return std::string(key) + ": found rows off orthogonal by " + std::to_string(off) +
         ", expected at most " + std::to_string(limit) +
         (limit < kGeneralTo ? " (mounting.general_matrix takes axes that are not square)" : "");
}

}  // namespace

std::optional<std::string> Mounting::find_wrong(const MountingOptions& options) {
  const int given = static_cast<int>(!options.axes.empty()) +
                    static_cast<int>(!options.matrix.empty()) +
                    static_cast<int>(!options.general_matrix.empty());
  if (given > 1) return "mounting: found more than one of axes, matrix and general_matrix";
  if (!options.axes.empty()) {
    core::PerAxis<bool> used{};
    for (const std::string& axis : options.axes) {
      const auto row = row_of(axis);
      for (std::size_t j = 0; row && j < kN; ++j) used[j] = used[j] || (*row)[j] != 0.0;
    }
    if (options.axes.size() != kN || used != core::PerAxis<bool>{true, true, true})
      return "mounting.axes: found another list, expected each of x, y, z once, with or without -";
  }
  if (auto line = find_wrong_matrix(options, "mounting.matrix", options.matrix, kOrthogonalTo))
    return line;
  return find_wrong_matrix(options, "mounting.general_matrix", options.general_matrix, kGeneralTo);
}

Mounting::Mounting(const MountingOptions& options)
    : rows_(rows_of(options)), identity_(rows_ == kIdentity) {}

core::PerAxis<double> Mounting::rate_radps_b(
    const core::PerAxis<double>& gyro_radps) const noexcept {
  if (identity_) return gyro_radps;
  core::PerAxis<double> rates{};
  for (std::size_t i = 0; i < kN; ++i) {
    for (std::size_t j = 0; j < kN; ++j) {
      if (rows_[i][j] != 0.0) rates[i] += rows_[i][j] * gyro_radps[j];
    }
  }
  return rates;
}

core::AngularRateSample Mounting::in_b(const core::AngularRateSample& sample) const noexcept {
  if (identity_) return sample;
  core::AngularRateSample mounted = sample;
  mounted.rate_radps = rate_radps_b(sample.rate_radps);
  for (std::size_t i = 0; i < kN; ++i) {
    mounted.valid[i] = true;
    mounted.clipped[i] = false;
    for (std::size_t j = 0; j < kN; ++j) {
      if (rows_[i][j] == 0.0) continue;
      mounted.valid[i] = mounted.valid[i] && sample.valid[j];
      mounted.clipped[i] = mounted.clipped[i] || sample.clipped[j];
    }
  }
  return mounted;
}

}  // namespace zerodrift::compensation
