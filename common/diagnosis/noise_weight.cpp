// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/noise_weight.h"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>
#include <unsupported/Eigen/FFT>

#include "common/core/require.h"
#include "common/diagnosis/cosine_transform.h"

namespace zerodrift::diagnosis {

std::vector<double> dct_variances(std::span<const NoiseTerm> terms, std::span<const double> squares,
                                  std::size_t size, double interval_s) {
  core::require(terms.size() == squares.size(), "each noise term has its square");
  std::vector<double> variances(size, 0.0);
  std::vector<double> eigenvalues(size);
  for (std::size_t k = 1; k < size; ++k) eigenvalues[k] = laplacian_eigenvalue(k, size);
  for (std::size_t t = 0; t < terms.size(); ++t) {
    if (squares[t] == 0.0) continue;
    const UnitSpectrum spectrum(terms[t], interval_s);
    for (std::size_t k = 1; k < size; ++k) variances[k] += squares[t] * spectrum(eigenvalues[k]);
  }
  return variances;
}

std::vector<double> divided_by_noise(std::span<const double> series,
                                     std::span<const double> variances) {
  using Complex = std::complex<double>;
  const std::size_t n = series.size();
  core::require(variances.size() == n, "each coefficient of a series has its noise variance");
  if (n == 0) return {};
  std::vector<Complex> mirrored(2 * n);
  for (std::size_t i = 0; i < n; ++i) mirrored[i] = mirrored[2 * n - 1 - i] = series[i];
  std::vector<Complex> spectrum;
  Eigen::FFT<double> fft;
  fft.fwd(spectrum, mirrored);
  spectrum[0] = spectrum[n] = 0.0;  // the mirrored series has no component at n
  for (std::size_t k = 1; k < n; ++k) {
    const double weight = variances[k] > 0.0 ? 1.0 / variances[k] : 0.0;
    spectrum[k] *= weight;
    spectrum[2 * n - k] *= weight;
  }
  fft.inv(mirrored, spectrum);
  std::vector<double> weighted(n);
  for (std::size_t i = 0; i < n; ++i) weighted[i] = mirrored[i].real();
  return weighted;
}

double mean_of_valid(std::span<const double> values, std::span<const std::uint8_t> valid) {
  double sum = 0.0, count = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (valid[i] == 0) continue;
    sum += values[i];
    count += 1.0;
  }
  return count > 0.0 ? sum / count : 0.0;
}

void centre(std::vector<double>& values, std::span<const std::uint8_t> valid) {
  const double mean = mean_of_valid(values, valid);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = valid[i] != 0 ? values[i] - mean : 0.0;
}

double weighted_square(std::vector<double> series, std::span<const std::uint8_t> valid,
                       std::span<const double> variances) {
  centre(series, valid);
  series.resize(variances.size());
  const auto weighted = divided_by_noise(series, variances);
  return std::inner_product(series.begin(), series.end(), weighted.begin(), 0.0);
}

double variance_of_mean(std::span<const std::uint8_t> valid, std::span<const double> variances) {
  const auto n = static_cast<Eigen::Index>(variances.size());
  Eigen::VectorXd weights(n);
  for (Eigen::Index i = 0; i < n; ++i) weights(i) = valid[static_cast<std::size_t>(i)] != 0 ? 1 : 0;
  if (!(weights.sum() > 0.0)) return 0.0;
  weights /= weights.sum();
  CosineTransform transform(variances.size());
  const Eigen::VectorXd cosine =
      transform.forward({weights.data(), static_cast<std::size_t>(weights.size())});
  return cosine.cwiseAbs2().dot(Eigen::Map<const Eigen::VectorXd>(variances.data(), n));
}

double noise_gain_nats(std::vector<double> series, std::span<const std::uint8_t> valid,
                       std::span<const double> before, std::span<const double> after) {
  core::require(before.size() == after.size(), "two noise models are compared on one series");
  const std::size_t n = after.size();
  if (n < 2 || !(before[1] > 0.0) || !(after[1] > 0.0)) return 0.0;
  centre(series, valid);
  series.resize(n);
  const Eigen::VectorXd cosine = CosineTransform(n).forward(series);
  double gain = 0.0;
  for (std::size_t k = 1; k < n; ++k) {
    const double square =
        cosine(static_cast<Eigen::Index>(k)) * cosine(static_cast<Eigen::Index>(k));
    gain += 0.5 * (std::log(before[k] / after[k]) + square / before[k] - square / after[k]);
  }
  return gain;
}

double line_gain_nats(std::vector<double> series, std::span<const std::uint8_t> valid,
                      std::span<const double> variances, double frequency_hz, double interval_s) {
  const std::size_t n = variances.size();
  centre(series, valid);
  series.resize(n);
  const auto weighted = divided_by_noise(series, variances);
  std::array<std::vector<double>, 2> line;
  for (std::size_t i = 0; i < n; ++i) {
    const double angle =
        2.0 * std::numbers::pi * frequency_hz * interval_s * static_cast<double>(i);
    line[0].push_back(valid[i] != 0 ? std::sin(angle) : 0.0);
    line[1].push_back(valid[i] != 0 ? std::cos(angle) : 0.0);
  }
  const auto product = [](const std::vector<double>& a, const std::vector<double>& b) {
    return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
  };
  Eigen::Matrix2d gram;
  Eigen::Vector2d products;
  for (int i = 0; i < 2; ++i) {
    const auto own = divided_by_noise(line[static_cast<std::size_t>(i)], variances);
    for (int j = 0; j < 2; ++j) gram(i, j) = product(own, line[static_cast<std::size_t>(j)]);
    products(i) = product(weighted, line[static_cast<std::size_t>(i)]);
  }
  if (!(gram.determinant() > 0.0)) return 0.0;
  return 0.5 * products.dot(gram.inverse() * products);
}

}  // namespace zerodrift::diagnosis
