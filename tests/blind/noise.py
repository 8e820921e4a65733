# SPDX-License-Identifier: Apache-2.0
"""Noise by spectral synthesis, its spectrum on cosines, and sizes measured against it.

Rates in deg/h, one sample a second. Spectral densities are two-sided, (deg/h)²/Hz, as in IEEE Std 952, so that
the Allan variances are N²/tau, (2 ln2/pi) B² and K² tau/3 with tau in hours.
"""
from dataclasses import dataclass

import numpy as np

HOUR_S = 3600.0


@dataclass
class NoiseLevels:
    """0 = not there."""
    n_deg_per_sqrt_h: float = 0.0
    b_deg_h: float = 0.0
    k_deg_per_h_1_5: float = 0.0


def cosine_frequencies(n):
    """Hz of the cosines 1 to n-1 of a record of n seconds."""
    return np.arange(1, n) / (2.0 * n)


# Densities of unit noise: N = 1 deg/sqrt(h), B = 1 deg/h, K = 1 deg/h^1.5, q = 1 arcsec, sigma = 1 deg/h.

def white_density(f):
    return np.full_like(f, HOUR_S)


def flicker_density(f):
    return 1.0 / (2 * np.pi * f)


def walk_density(f):
    # increments of one second, sampled: no f^-2 beyond Nyquist
    return 1.0 / HOUR_S / (2 * np.sin(np.pi * f))**2


def rounding_density(f):
    # 1 arcsec/s is 1 deg/h; the rounding error of the angle is uniform, the rate is its difference
    return (2 * np.sin(np.pi * f))**2 / 12.0


def lorentz_density(f, correlation_s):
    return 2 * correlation_s / (1 + (2 * np.pi * f * correlation_s)**2)


def density(levels, f):
    return (levels.n_deg_per_sqrt_h**2 * white_density(f) + levels.b_deg_h**2 * flicker_density(f) +
            levels.k_deg_per_h_1_5**2 * walk_density(f))


def synthesise(n, density_of, rng):
    """Stationary Gaussian noise with this two-sided density: a piece of a four times longer period, no mean."""
    period = 4 * n
    f = np.fft.rfftfreq(period)[1:]
    amplitude = np.sqrt(density_of(f) * period / 2)
    spectrum = np.zeros(len(f) + 1, dtype=complex)
    spectrum[1:] = amplitude * (rng.standard_normal(len(f)) + 1j * rng.standard_normal(len(f)))
    spectrum[-1] = spectrum[-1].real * np.sqrt(2)
    return np.fft.irfft(spectrum, period)[:n]


def wiener(n, k_deg_per_h_1_5, rng):
    """Random walk from 0 by its Karhunen-Loève series, sum of sqrt(2) Z_j sin((j-1/2) pi t/T)/((j-1/2) pi)."""
    duration_h = n / HOUR_S
    j = np.arange(1, n + 1)
    weights = np.zeros(2 * n, dtype=complex)
    weights[1:n + 1] = np.sqrt(2) * rng.standard_normal(n) / ((j - 0.5) * np.pi)
    turned = 2 * n * np.fft.ifft(weights)[:n] * np.exp(-0.5j * np.pi * np.arange(n) / n)
    return k_deg_per_h_1_5 * np.sqrt(duration_h) * turned.imag


def synthesise_levels(n, levels, rng):
    noise = levels.n_deg_per_sqrt_h * np.sqrt(HOUR_S) * rng.standard_normal(n)
    if levels.b_deg_h > 0:
        noise += synthesise(n, lambda f: levels.b_deg_h**2 * flicker_density(f), rng)
    if levels.k_deg_per_h_1_5 > 0:
        noise += wiener(n, levels.k_deg_per_h_1_5, rng)
    return noise


def cosine_transform(x):
    """Orthonormal DCT-II along the last axis."""
    n = x.shape[-1]
    folded = np.concatenate([x[..., ::2], x[..., 1::2][..., ::-1]], axis=-1)
    k = np.arange(n)
    c = np.real(np.fft.fft(folded, axis=-1) * np.exp(-0.5j * np.pi * k / n)) * np.sqrt(2.0 / n)
    c[..., 0] /= np.sqrt(2)
    return c


class Whitener:
    """Makes noise of a known spectrum white; the mean (cosine 0) is left out, as the bias takes it."""

    def __init__(self, variance):
        self.scale = 1.0 / np.sqrt(variance)

    def whiten(self, x):
        return cosine_transform(x)[..., 1:] * self.scale

    def basis(self, columns):
        """Orthonormal basis of the whitened columns, shape (n-1, columns)."""
        if len(columns) == 0:
            return np.zeros((len(self.scale), 0))
        whitened = self.whiten(np.asarray(columns)).T
        norm = np.linalg.norm(whitened, axis=0)
        left, singular, _ = np.linalg.svd(whitened / np.where(norm > 0, norm, 1), full_matrices=False)
        return left[:, singular > 1e-7 * singular[0]]

    def projected(self, waveform, basis):
        whitened = self.whiten(waveform)
        return whitened - basis @ (basis.T @ whitened)

    def distance(self, waveform, basis):
        """d: the norm of the whitened waveform after the basis is projected out."""
        return float(np.linalg.norm(self.projected(waveform, basis)))

    def fit(self, columns, y):
        """Generalised least squares: coefficients and their covariance. The mean is left free."""
        design = self.whiten(np.asarray(columns)).T
        size = np.linalg.norm(design, axis=0)
        inverse = np.linalg.inv((design / size).T @ (design / size)) / np.outer(size, size)
        return inverse @ (design.T @ self.whiten(y)), inverse


def log_likelihood_gain(truth, parts, rounds=150):
    """Nats by which the true spectrum beats the best non-negative mixture of `parts`, all per cosine.

    Expected Whittle log-likelihood ratio, 1/2 sum(S/M - 1 - ln(S/M)), least over M = sum(theta_j part_j), by
    multiplicative updates. The cosines are first gathered in logarithmic bins.
    """
    edges = np.unique(np.round(np.logspace(0, np.log10(len(truth)), 160)).astype(int)) - 1
    edges[-1] = len(truth)
    count = np.diff(edges)
    s = np.add.reduceat(truth, edges[:-1]) / count
    p = np.array([np.add.reduceat(part, edges[:-1]) / count for part in parts])
    theta = np.array([(s / part).min() for part in p]) + 1e-300
    for _ in range(rounds):
        m = theta @ p
        theta *= np.sqrt((p @ (count * s / m**2)) / (p @ (count / m)))
    ratio = s / (theta @ p)
    return float(0.5 * np.sum(count * (ratio - 1 - np.log(ratio))))
