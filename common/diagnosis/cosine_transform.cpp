// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/cosine_transform.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "common/core/require.h"

namespace zerodrift::diagnosis {
namespace {

constexpr std::size_t kLargestDirectFactor = 50;

std::size_t largest_prime_factor(std::size_t n) {
  std::size_t largest = 1;
  for (std::size_t p = 2; p * p <= n; ++p) {
    while (n % p == 0) {
      largest = p;
      n /= p;
    }
  }
  return std::max(largest, n);
}

}  // namespace

std::size_t smooth_length_from(std::size_t least) {
  std::size_t shortest = std::bit_ceil(least);
  for (std::size_t five = 1; five < shortest; five *= 5) {
    for (std::size_t odd = five; odd < shortest; odd *= 3) {
      std::size_t length = odd;
      while (length < least) length *= 2;
      shortest = std::min(shortest, length);
    }
  }
  return shortest;
}

std::size_t smooth_length_up_to(std::size_t most) {
  for (std::size_t length = most; length > 0; --length) {
    std::size_t rest = length;
    for (const std::size_t prime : {2U, 3U, 5U}) {
      while (rest % prime == 0) rest /= prime;
    }
    if (rest == 1) return length;
  }
  return 0;
}

double laplacian_eigenvalue(std::size_t k, std::size_t n) noexcept {
  const double s =
      std::sin(0.5 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(n));
  return 4.0 * s * s;
}

CosineTransform::CosineTransform(std::size_t length)
    : length_(length), twiddle_(length), work_(length), spectrum_(length) {
  core::require(length > 0, "a cosine transform has at least one point");
  const double n = static_cast<double>(length);
  for (std::size_t k = 0; k < length; ++k) {
    const double norm = k == 0 ? std::sqrt(1.0 / n) : std::sqrt(2.0 / n);
    twiddle_[k] = std::polar(norm, -0.5 * std::numbers::pi * static_cast<double>(k) / n);
  }
  if (largest_prime_factor(length) > kLargestDirectFactor) prepare_bluestein();
}

void CosineTransform::prepare_bluestein() {
  convolution_length_ = smooth_length_from(2 * length_ - 1);
  chirp_.resize(length_);
  padded_.assign(convolution_length_, Complex{});
  padded_spectrum_.resize(convolution_length_);
  chirp_spectrum_.resize(convolution_length_);
  for (std::size_t k = 0; k < length_; ++k) {
    const std::size_t square = k * k % (2 * length_);  // exact, so that the phase stays accurate
    chirp_[k] = std::polar(
        1.0, -std::numbers::pi * static_cast<double>(square) / static_cast<double>(length_));
    padded_[k] = std::conj(chirp_[k]);
    if (k > 0) padded_[convolution_length_ - k] = std::conj(chirp_[k]);
  }
  fft_.fwd(chirp_spectrum_.data(), padded_.data(), static_cast<Eigen::Index>(convolution_length_));
}

void CosineTransform::fourier_bluestein() {
  const auto m = static_cast<Eigen::Index>(convolution_length_);
  std::fill(padded_.begin(), padded_.end(), Complex{});
  for (std::size_t k = 0; k < length_; ++k) padded_[k] = work_[k] * chirp_[k];
  fft_.fwd(padded_spectrum_.data(), padded_.data(), m);
  for (std::size_t k = 0; k < convolution_length_; ++k) padded_spectrum_[k] *= chirp_spectrum_[k];
  fft_.inv(padded_.data(), padded_spectrum_.data(), m);
  for (std::size_t k = 0; k < length_; ++k) spectrum_[k] = padded_[k] * chirp_[k];
}

void CosineTransform::fourier() {
  if (length_ == 1) {
    spectrum_[0] = work_[0];
  } else if (convolution_length_ > 0) {
    fourier_bluestein();
  } else {
    fft_.fwd(spectrum_.data(), work_.data(), static_cast<Eigen::Index>(length_));
  }
}

void CosineTransform::forward(std::span<const double> a, std::span<const double> b,
                              Eigen::VectorXd& a_cosine, Eigen::VectorXd& b_cosine) {
  core::require(a.size() == length_ && b.size() == length_,
                "columns are as long as their cosine transform");
  const std::size_t n = length_;
  for (std::size_t j = 0; j < n; ++j) {  // even samples forwards, odd ones backwards
    const std::size_t to = j % 2 == 0 ? j / 2 : n - 1 - j / 2;
    work_[to] = {a[j], b[j]};
  }
  fourier();
  a_cosine.resize(static_cast<Eigen::Index>(n));
  b_cosine.resize(static_cast<Eigen::Index>(n));
  for (std::size_t k = 0; k < n; ++k) {  // the two real signals' spectra out of the complex one
    const Complex forwards = spectrum_[k];
    const Complex backwards = std::conj(spectrum_[k == 0 ? 0 : n - k]);
    const Complex of_a = 0.5 * (forwards + backwards);
    const Complex of_b = Complex{0.0, -0.5} * (forwards - backwards);
    const auto row = static_cast<Eigen::Index>(k);
    a_cosine(row) = (twiddle_[k] * of_a).real();
    b_cosine(row) = (twiddle_[k] * of_b).real();
  }
}

Eigen::VectorXd CosineTransform::forward(std::span<const double> x) {
  Eigen::VectorXd cosine;
  Eigen::VectorXd same;
  forward(x, x, cosine, same);
  return cosine;
}

}  // namespace zerodrift::diagnosis
