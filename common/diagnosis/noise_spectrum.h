// SPDX-License-Identifier: Apache-2.0
// The noise of a record as a non-negative sum of known spectra over the coefficients of its cosine
// transform, fitted by restricted maximum likelihood beside the columns of a regression.
//
// Variance of coefficient k of n samples, interval dt, l = 4 sin²(pi k / 2n):
//   white          N² / dt                      angle random walk N (IEEE Std 952 annex C)
//   flicker        B² / sqrt(l)                 one-sided spectrum B² / (pi f)
//   random walk    K² dt / l                    exact
//   quantisation   Q² l / dt²                   white angle
//   Markov         s² (1-p²) / ((1-p)² + p l)   p = exp(-dt/T)
// The off-diagonal terms that Markov and flicker noise have in this basis are left out.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace zerodrift::diagnosis {

enum class NoiseKind : std::uint8_t { kWhite, kFlicker, kRandomWalk, kQuantization, kMarkov };

[[nodiscard]] std::string_view name(NoiseKind kind) noexcept;

struct NoiseTerm {
  NoiseKind kind = NoiseKind::kWhite;
  double correlation_s = 0.0;  // Markov only
};

// Variance of a coefficient of the given eigenvalue for a squared noise coefficient of 1.
class UnitSpectrum {
 public:
  UnitSpectrum(const NoiseTerm& term, double interval_s) noexcept;

  [[nodiscard]] double operator()(double eigenvalue) const noexcept;

 private:
  NoiseKind kind_;
  double interval_s_;
  double memory_;   // Markov: from sample to sample
  double forgets_;  // 1 - memory
};
[[nodiscard]] inline double unit_spectrum(const NoiseTerm& term, double eigenvalue,
                                          double interval_s) noexcept {
  return UnitSpectrum(term, interval_s)(eigenvalue);
}

// White, flicker, random walk, quantisation, and Markov at correlation times a factor of four apart
// from ten samples to an eighth of the record.
[[nodiscard]] std::vector<NoiseTerm> usual_noise_terms(std::size_t samples, double interval_s);

// A coefficient known beforehand, as from the twin's model file.
struct KnownNoise {
  NoiseTerm term;
  double square = 0.0;          // N², B², K², Q² or s²
  double relative_sigma = 0.3;  // standard error of the square, relative
};

enum class UnlistedNoise : std::uint8_t {
  kFree,      // the usual terms may take any value
  kExcluded,  // only the known terms
};

struct NoisePrior {
  std::vector<KnownNoise> known;
  UnlistedNoise unlisted = UnlistedNoise::kFree;

  [[nodiscard]] std::optional<std::string> validate() const;
};

// How the n - 1 coefficients above DC are grouped: the lowest ones each a row, the others in bins
// of constant ratio, a bin's spectrum taken as constant.
class SpectralBands {
 public:
  SpectralBands(std::size_t samples, std::size_t single_coefficients, double bin_ratio = 1.04);

  [[nodiscard]] std::size_t samples() const noexcept { return samples_; }
  [[nodiscard]] Eigen::Index singles() const noexcept { return singles_; }
  [[nodiscard]] Eigen::Index bins() const noexcept { return rows() - singles_; }
  [[nodiscard]] Eigen::Index rows() const noexcept {
    return static_cast<Eigen::Index>(first_.size()) - 1;
  }
  // Coefficients of a row: first(row) .. first(row + 1) - 1.
  [[nodiscard]] std::size_t first(Eigen::Index row) const {
    return first_[static_cast<std::size_t>(row)];
  }
  [[nodiscard]] double count(Eigen::Index row) const {
    return static_cast<double>(first(row + 1) - first(row));
  }
  // laplacian_eigenvalue() of coefficient k.
  [[nodiscard]] double eigenvalue(std::size_t k) const { return eigenvalues_[k]; }

 private:
  std::size_t samples_;
  Eigen::Index singles_;
  std::vector<std::size_t> first_;
  std::vector<double> eigenvalues_;
};

// Columns of a regression and the series in the cosine domain. Singles are rows; a bin is the
// (p + 1)² cross products of its coefficients, flattened. Only these enter the likelihood.
struct RowSystem {
  Eigen::MatrixXd singles;   // singles x (p + 1), the last column is the series
  Eigen::MatrixXd products;  // bins x (p + 1)²
  Eigen::VectorXd ridge;     // p, inverse prior variance of each amplitude; 0: any amplitude
  // Coefficients a row stands for; the bins' share of missing samples taken off.
  Eigen::VectorXd counts;  // singles + bins

  [[nodiscard]] Eigen::Index columns() const noexcept { return ridge.size(); }
};

// The spectra as a matrix over the rows of the bands, with the prior in the same terms.
class NoiseDictionary {
 public:
  NoiseDictionary(const SpectralBands& bands, double interval_s, const NoisePrior& prior);

  [[nodiscard]] const std::vector<NoiseTerm>& terms() const noexcept { return terms_; }
  [[nodiscard]] Eigen::Index size() const noexcept { return spectra_.cols(); }
  [[nodiscard]] const Eigen::MatrixXd& spectra() const noexcept {
    return spectra_;
  }  // rows x terms
  // A known square enters as if seen before with 2 / relative_sigma² degrees of freedom.
  [[nodiscard]] const Eigen::VectorXd& prior_square() const noexcept { return prior_square_; }
  [[nodiscard]] const Eigen::VectorXd& prior_freedom() const noexcept { return prior_freedom_; }

 private:
  std::vector<NoiseTerm> terms_;
  Eigen::MatrixXd spectra_;
  Eigen::VectorXd prior_square_, prior_freedom_;
};

struct NoiseFitOptions {
  int max_iterations = 200;
  double settled_nats = 1e-4;  // gain that the next step promises

  [[nodiscard]] std::optional<std::string> validate() const;
};

enum class NoiseFitStatus : std::uint8_t {
  kConverged,
  kIterationLimit,
  kNoPower,  // nothing is left to fit a noise to
};

struct NoiseFit {
  NoiseFitStatus status = NoiseFitStatus::kNoPower;
  Eigen::VectorXd squares;      // one per term: N², B², ...
  Eigen::VectorXd spectrum;     // variance of a coefficient, per row
  double log_likelihood = 0.0;  // restricted, prior of the noise included, nats
  double promised_nats = 0.0;   // left to gain by the quadratic model at the end
  int iterations = 0;
};

// Restricted log likelihood up to constants, with the prior of the noise:
//   -1/2 [sum counts log S + log |A| + y'Py],  A = X'X/S + ridge   (Patterson & Thompson 1971)
// O(singles p²).
[[nodiscard]] double restricted_log_likelihood(const RowSystem& rows,
                                               const NoiseDictionary& dictionary,
                                               const Eigen::VectorXd& squares);

// Its gradient by the squares.
[[nodiscard]] Eigen::VectorXd restricted_gradient(const RowSystem& rows,
                                                  const NoiseDictionary& dictionary,
                                                  const Eigen::VectorXd& squares);

// Maximises the restricted likelihood over squares >= 0: some multiplicative steps (monotone,
// Févotte & Idier 2011), then Fisher scoring with bounds and step halving until the next step
// promises less than settled_nats. `start`: squares to begin at; empty: from the record. Some 10
// iterations of O(singles p² + rows terms²). Throws std::invalid_argument with validate()'s
// sentence.
[[nodiscard]] NoiseFit fit_noise(const RowSystem& rows, const NoiseDictionary& dictionary,
                                 const NoiseFitOptions& options = {},
                                 const Eigen::VectorXd& start = {});

// Amplitudes of the regression's columns by generalised least squares, and their covariance. Empty
// where the columns depend on each other.
struct Amplitudes {
  Eigen::VectorXd values;
  Eigen::MatrixXd covariance;
};

[[nodiscard]] std::optional<Amplitudes> fit_amplitudes(const RowSystem& rows,
                                                       const Eigen::VectorXd& spectrum);

// X'X/S of all columns and the series, (p + 1)², ridge not included.
[[nodiscard]] Eigen::MatrixXd weighted_gram(const RowSystem& rows, const Eigen::VectorXd& spectrum);

// Power of the residual in an octave of frequency over that of a noise spectrum.
struct OctavePower {
  double lowest_hz = 0.0;
  double highest_hz = 0.0;
  double ratio = 0.0;
  double degrees_of_freedom = 0.0;
  double excess_probability = 1.0;   // that noise alone is as strong or stronger
  double deficit_probability = 1.0;  // that it is as weak or weaker
};

// Compares the residual of the regression under `spectrum` (per row) with it, octave by octave from
// the top. Flexible noise absorbs effects; against noise known beforehand they show here.
[[nodiscard]] std::vector<OctavePower> power_by_octave(const RowSystem& rows,
                                                       const SpectralBands& bands,
                                                       const Eigen::VectorXd& spectrum,
                                                       double interval_s);

}  // namespace zerodrift::diagnosis
