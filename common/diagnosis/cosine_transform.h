// SPDX-License-Identifier: Apache-2.0
// Orthonormal discrete cosine transform, type II:
//
//   c_0 = sqrt(1/n) sum_j x_j,   c_k = sqrt(2/n) sum_j x_j cos(pi (j + 1/2) k / n)
//
// White noise stays white in it, a random walk is exactly diagonal (its precision is the Laplacian
// with free ends, whose eigenvectors these are: Strang 1999, SIAM Review 41, 135), and a ramp
// doesn't leak as it does in a Fourier transform.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <cstddef>
#include <span>
#include <unsupported/Eigen/FFT>
#include <vector>

namespace zerodrift::diagnosis {

// Eigenvalue of the Laplacian that belongs to c_k: 4 sin²(pi k / 2n), the squared frequency of
// differences.
[[nodiscard]] double laplacian_eigenvalue(std::size_t k, std::size_t n) noexcept;

// Lengths without a prime factor above 5, of which Fourier transforms are quick: the shortest from
// `least` on, and the longest up to `most`.
[[nodiscard]] std::size_t smooth_length_from(std::size_t least);
[[nodiscard]] std::size_t smooth_length_up_to(std::size_t most);

// A plan for one length. Any length: Makhoul's permutation (1980, IEEE ASSP 28, 27) and one complex
// Fourier transform for two columns; lengths with a prime factor above 50 go through Bluestein's
// convolution, at four times the price. O(n log n), 0.2 ms a column at n = 18000.
class CosineTransform {
 public:
  explicit CosineTransform(std::size_t length);

  [[nodiscard]] std::size_t length() const noexcept { return length_; }

  // c of x; x.size() == length().
  [[nodiscard]] Eigen::VectorXd forward(std::span<const double> x);
  // c of a and of b, at the price of one.
  void forward(std::span<const double> a, std::span<const double> b, Eigen::VectorXd& a_cosine,
               Eigen::VectorXd& b_cosine);

 private:
  using Complex = std::complex<double>;

  void prepare_bluestein();
  void fourier();  // work_ -> spectrum_
  void fourier_bluestein();

  std::size_t length_;
  std::size_t convolution_length_ = 0;  // 0: direct
  std::vector<Complex> twiddle_;        // exp(-i pi k / 2n), scaled to be orthonormal
  std::vector<Complex> chirp_, chirp_spectrum_;
  std::vector<Complex> work_, spectrum_, padded_, padded_spectrum_;
  Eigen::FFT<double> fft_;
};

}  // namespace zerodrift::diagnosis
