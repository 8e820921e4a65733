// SPDX-License-Identifier: Apache-2.0
// Log Bayes factor of a set of columns beside a model's columns, by generalised least squares in
// the cosine domain.
//
// Model: series = X a + Z b + noise. a: the model's amplitudes, any value or with a prior. In
// coordinates whitened by the noise, Z with X projected out has the Gram matrix G, and
//   b ~ N(0, s² G^-1),  log BF(s) = -q/2 log(1+s²) + s²/(1+s²) chi²/2,  chi² = z'G^-1 z
// (Zellner 1986; q columns, z = Z'P y). s is how many standard errors the amplitudes are large,
// averaged over a log-uniform range. The factor doesn't depend on how the columns are scaled or
// mixed.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/diagnosis/cosine_transform.h"
#include "common/diagnosis/noise_spectrum.h"

namespace zerodrift::diagnosis {

// A column without its mean, scaled to unit norm, split like the rows of SpectralBands.
struct SpectralColumn {
  Eigen::VectorXd singles;
  Eigen::VectorXf rest;  // above the singles, one by one; single precision saves half the memory
  double norm = 0.0;     // of the column without its mean; 0: constant
};

// Missing samples are bridged by a straight line between the means of the valid samples on either
// side, up to 300 and at most half as many as the gap is long; ends are held. Series and columns go
// through the same linear operator, so that what the columns explain they still explain exactly,
// and the noise that a bridge carries into the low coefficients stays near what white noise would
// have had there.
// Short gaps in a share p of n samples, as a bad link makes them, have means over n p² samples at
// least. They take p of white noise's power away but for the frequencies below one in a window,
// some n / window coefficients: there the valid samples' noise, which anything that keeps a
// constant carries in, leaves (1 - p)^-1, 2 p above the rest. So seen as a noise of its own it is
// worth (n / window) (2 p)² / 4 nats, less than one.
class GapBridge {
 public:
  GapBridge() = default;  // bridges nothing
  // valid: 0 is missing.
  explicit GapBridge(std::span<const std::uint8_t> valid);

  [[nodiscard]] double missing_share() const noexcept { return missing_share_; }
  void apply(std::span<double> column) const;

 private:
  struct Gap {
    std::size_t begin = 0, end = 0;               // missing samples
    std::size_t before_begin = 0, after_end = 0;  // of what is averaged on either side
    std::size_t before = 0, after = 0;            // valid samples there
    double left_at = 0.0, right_at = 0.0;         // their mean places

    [[nodiscard]] std::size_t length() const noexcept { return end - begin; }
  };
  void place_means(Gap& gap, std::size_t reach) const;

  std::vector<Gap> gaps_;
  std::vector<std::uint8_t> valid_;
  double missing_share_ = 0.0;
};

// Turns time series into columns. Coefficients weigh (1 - missing)²: once because missing samples
// carry no information, once because bridging takes as much of white noise's power away.
class ColumnTransform {
 public:
  ColumnTransform(const SpectralBands& bands, std::span<const std::uint8_t> valid);

  [[nodiscard]] const SpectralBands& bands() const noexcept { return bands_; }
  [[nodiscard]] double coefficient_weight() const noexcept { return weight_; }
  // As long as the series, and all of it finite.
  [[nodiscard]] bool takes(std::span<const double> values) const;
  // Two at a time, so that many at once cost half. Throws std::logic_error for one that it doesn't
  // take.
  [[nodiscard]] std::vector<SpectralColumn> columns(std::vector<std::vector<double>> values);
  // The series itself: not scaled (norm is 1), missing values may be anything.
  [[nodiscard]] SpectralColumn series(std::span<const double> values,
                                      std::span<const std::uint8_t> valid);

 private:
  [[nodiscard]] SpectralColumn split(const Eigen::VectorXd& cosine) const;

  SpectralBands bands_;
  CosineTransform transform_;
  GapBridge gaps_;
  double weight_;
};

// Cross products of the coefficients above the singles, bin by bin.
[[nodiscard]] Eigen::VectorXd bin_products(const SpectralBands& bands, const SpectralColumn& a,
                                           const SpectralColumn& b);

struct EvidenceOptions {
  // Standard errors that amplitudes are expected to be large: log-uniform in between.
  double smallest_scale = 1.0;
  double largest_scale = 1000.0;
  // A column that keeps less of its whitened square norm beside the model says nothing of its own.
  double smallest_kept_share = 1e-4;

  [[nodiscard]] std::optional<std::string> validate() const;
};

// Z beside X at one noise spectrum.
struct ProjectedColumns {
  Eigen::MatrixXd gram;         // G, of columns of unit norm before whitening
  Eigen::VectorXd products;     // z
  Eigen::VectorXd unprojected;  // diagonal of the whitened Gram matrix before projection
};

struct ColumnEvidence {
  double log_bayes_factor = 0.0;
  double chi_square = 0.0;     // d², that the columns explain at the best fit
  int rank = 0;                // columns that count
  double kept_share = 0.0;     // largest share of a column's square norm left by the model
  Eigen::VectorXd amplitudes;  // of columns of unit norm; 0 where a column doesn't count
  Eigen::MatrixXd covariance;  // of the amplitudes
};

enum class Detail : std::uint8_t { kEvidence, kAmplitudesToo };

// O(q³).
[[nodiscard]] ColumnEvidence column_evidence(const ProjectedColumns& columns,
                                             const EvidenceOptions& options,
                                             Detail detail = Detail::kAmplitudesToo);

// Of an estimate N(value, sd²) that the amplitude lies within limits: what is left of its evidence
// where it can't be anything else. -infinity where the limits contradict each other.
[[nodiscard]] double log_probability_within(double value, double sd, double least, double greatest);

// The same of one whitened amplitude that may be anything, from its estimate and variance.
[[nodiscard]] double log_evidence_of_any_value(double value, double variance,
                                               const EvidenceOptions& options);

// log sum exp; -infinity of nothing.
[[nodiscard]] double log_sum(std::span<const double> logarithms) noexcept;

}  // namespace zerodrift::diagnosis
