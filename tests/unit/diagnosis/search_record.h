// SPDX-License-Identifier: Apache-2.0
// A chamber record of plain vectors for tests of the search: inputs, coloured noise and the
// candidate groups a diagnosis would make of them.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "common/diagnosis/search_problem.h"
#include "tests/unit/allan/noise_sources.h"

namespace zerodrift::diagnosis::test {

using Series = std::vector<double>;

inline Series low_pass(const Series& x, double tau_s, double interval_s) {
  if (tau_s <= 0.0) return x;
  Series y(x.size());
  const double memory = std::exp(-interval_s / tau_s);
  double state = x.front();
  for (std::size_t i = 0; i < x.size(); ++i) {
    state = memory * state + (1.0 - memory) * x[i];
    y[i] = state;
  }
  return y;
}

inline Series derivative(const Series& x, double interval_s) {
  Series d(x.size(), 0.0);
  if (x.size() < 3) return d;
  for (std::size_t i = 1; i + 1 < x.size(); ++i) d[i] = (x[i + 1] - x[i - 1]) / (2.0 * interval_s);
  d.front() = d[1];
  d.back() = d[d.size() - 2];
  return d;
}

inline Series map(const Series& x, const std::function<double(double)>& f) {
  Series y(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) y[i] = f(x[i]);
  return y;
}

inline Series product(const Series& a, const Series& b) {
  Series y(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) y[i] = a[i] * b[i];
  return y;
}

inline Series difference(const Series& a, const Series& b) {
  Series y(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) y[i] = a[i] - b[i];
  return y;
}

// Natural cubic splines would do as well; hats are easier to check. `count` - 1 columns: the
// constant is out.
inline std::vector<Series> hats(const Series& x, int count) {
  const auto [low, high] = std::minmax_element(x.begin(), x.end());
  const double from = *low;
  const double spacing = (*high - from) / (count - 1);
  std::vector<Series> columns;
  for (int k = 1; k < count; ++k) {
    const double centre = from + k * spacing;
    columns.push_back(
        map(x, [=](double v) { return std::max(0.0, 1.0 - std::abs(v - centre) / spacing); }));
  }
  return columns;
}

inline Series play(const Series& x, double width) {
  Series y(x.size());
  double state = x.front();
  for (std::size_t i = 0; i < x.size(); ++i) {
    state = std::max(x[i] - width, std::min(x[i] + width, state));
    y[i] = state;
  }
  return y;
}

// Ramps of several slopes both ways over -20..60 °C with soaks; three probes that lag by different
// amounts; turns, tilts, field, vibration and current in blocks.
struct Chamber {
  std::size_t n;
  double interval_s;
  std::vector<Series> probes;  // °C
  Series rate, cross_a, cross_b, tilt, field, vibration, current;

  Chamber(std::size_t points, double interval, std::uint64_t seed)
      : n(points), interval_s(interval) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    const std::vector<double> targets{-20, -20, 60, 60, 10, 10, 50, 20, 20, -10, 40, 40, 25};
    std::vector<double> durations;
    double total = 0.0;
    for (std::size_t i = 0; i < targets.size(); ++i) {
      durations.push_back(0.4 + uniform(random));
      total += durations.back();
    }
    Series air(n, 25.0);
    double from = 25.0;
    std::size_t at = 0;
    for (std::size_t i = 0; i < targets.size(); ++i) {
      const auto length = static_cast<std::size_t>(durations[i] / total * static_cast<double>(n));
      const std::size_t end = i + 1 == targets.size() ? n : std::min(n, at + length);
      for (std::size_t j = at; j < end; ++j) {
        air[j] = from +
                 (targets[i] - from) * static_cast<double>(j - at) / static_cast<double>(end - at);
      }
      from = targets[i];
      at = end;
    }
    const double span_s = static_cast<double>(n) * interval_s;
    const Series coil =
        low_pass(low_pass(air, span_s / 120.0, interval_s), span_s / 60.0, interval_s);
    probes = {coil, low_pass(coil, span_s / 45.0, interval_s),
              low_pass(air, span_s / 20.0, interval_s)};
    rate = blocks(random, 0.6, 1.0);
    cross_a = blocks(random, 0.4, 1.0);
    cross_b = blocks(random, 0.4, 1.0);
    tilt = blocks(random, 0.5, 1.0);
    field = blocks(random, 0.5, 1.0);
    vibration = map(blocks(random, 0.3, 1.0), [](double v) { return v * v; });
    current = low_pass(blocks(random, 1.0, 1.0), span_s / 200.0, interval_s);
  }

  Series blocks(std::mt19937_64& random, double active_share, double size) const {
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    std::normal_distribution<double> normal;
    Series x(n, 0.0);
    for (std::size_t at = 0; at < n;) {
      const auto length =
          static_cast<std::size_t>((0.005 + 0.02 * uniform(random)) * static_cast<double>(n)) + 1;
      const double value = uniform(random) < active_share ? size * normal(random) : 0.0;
      for (std::size_t j = at; j < std::min(n, at + length); ++j) x[j] = value;
      at += length;
    }
    return x;
  }

  double span_s() const { return static_cast<double>(n) * interval_s; }
  Series time() const {
    Series t(n);
    for (std::size_t i = 0; i < n; ++i)
      t[i] = (static_cast<double>(i) + 0.5) / static_cast<double>(n);
    return t;
  }
  // Probe 0..2, or 3: the mean of the first two.
  Series temperature(double index, double lag_s = 0.0) const {
    const auto i = static_cast<std::size_t>(index);
    Series t = probes[std::min<std::size_t>(i, 2)];
    if (i == 3) {
      for (std::size_t j = 0; j < n; ++j) t[j] = 0.5 * (probes[0][j] + probes[1][j]);
    }
    return low_pass(t, lag_s, interval_s);
  }
};

struct NoiseLevels {
  double white = 1.0;         // N, for a standard deviation of 1 at 1 s
  double flicker = 0.05;      // B
  double random_walk = 3e-4;  // K
};

inline Series coloured_noise(std::size_t n, double interval_s, const NoiseLevels& levels,
                             std::uint64_t seed) {
  allan::test::WhiteNoise white(levels.white, interval_s, 3 * seed + 1);
  allan::test::Flicker flicker(levels.flicker, interval_s, 0.3 * interval_s, 22, 3 * seed + 2);
  allan::test::RandomWalk walk(levels.random_walk, interval_s, 3 * seed + 3);
  Series x(n);
  for (double& v : x) v = white.next() + flicker.next() + walk.next();
  return x;
}

// Named and generic groups, some 35 with 20 variants where they have inner parameters. `c` must
// outlive them.
inline std::vector<CandidateGroup> usual_groups(const Chamber& c) {
  using twin::InputFamily;
  using Shape = std::vector<double>;
  std::vector<CandidateGroup> groups;
  const double span = c.span_s();
  const auto centred = [](double t) { return (t - 25.0) / 30.0; };
  const auto add = [&](std::string name, InputFamily family, std::vector<Shape> shapes,
                       std::function<std::vector<Series>(const Shape&)> columns,
                       std::vector<ShapeRange> ranges = {}, std::optional<GroupId> parent = {}) {
    CandidateGroup g;
    g.id = static_cast<GroupId>(groups.size());
    g.name = std::move(name);
    g.family = family;
    g.parent = parent;
    g.ranges = std::move(ranges);
    g.columns = std::move(columns);
    for (Shape& s : shapes) g.variants.push_back({std::move(s), 0.0});
    groups.push_back(std::move(g));
  };
  std::vector<Shape> lagged;
  for (double probe = 0; probe < 4; ++probe) {
    for (const double lag : {0.0, span / 200, span / 80, span / 40, span / 15}) {
      lagged.push_back({probe, lag});
    }
  }
  const auto rate_of = [&c](const Series& t) { return derivative(t, c.interval_s); };
  add("bias_temperature", InputFamily::kTemperature, lagged, [=, &c](const Shape& s) {
    const Series t = map(c.temperature(s[0], s[1]), centred);
    return std::vector<Series>{t, product(t, t), product(t, product(t, t))};
  });
  add("shupe", InputFamily::kTemperature, {{0}, {1}, {2}, {3}},
      [=, &c](const Shape& s) { return std::vector<Series>{rate_of(c.temperature(s[0]))}; });
  std::vector<Shape> lags;
  for (double probe = 0; probe < 4; ++probe) {
    for (double tau = span / 150; tau < span / 7; tau *= 1.7) lags.push_back({probe, tau});
  }
  add(
      "coil_lag", InputFamily::kTemperature, lags,
      [=, &c](const Shape& s) { return std::vector<Series>{rate_of(c.temperature(s[0], s[1]))}; },
      {ShapeRange{}, ShapeRange{ShapeScale::kLogarithmic, span / 200, span / 5, 1.7}},
      groups.back().id);
  std::vector<Shape> pairs;
  for (double pair = 0; pair < 3; ++pair) {
    for (const double lag : {0.0, span / 200, span / 80, span / 40, span / 15}) {
      pairs.push_back({pair, lag});
    }
  }
  const auto gradient = [&c](const Shape& s) {
    const auto pair = static_cast<int>(s[0]);
    return difference(c.temperature(pair == 2 ? 1 : 0, s[1]),
                      c.temperature(pair == 0 ? 1 : 2, s[1]));
  };
  add("gradient", InputFamily::kTemperature, pairs,
      [=](const Shape& s) { return std::vector<Series>{gradient(s)}; });
  add("gradient_rate", InputFamily::kTemperature, pairs,
      [=](const Shape& s) { return std::vector<Series>{rate_of(gradient(s))}; });
  add("shupe_temperature", InputFamily::kTemperature, lagged, [=, &c](const Shape& s) {
    const Series t = c.temperature(s[0], s[1]);
    return std::vector<Series>{product(map(t, centred), rate_of(t))};
  });
  std::vector<Shape> widths;
  for (double probe = 0; probe < 4; ++probe) {
    for (const double width : {2.0, 4.0, 7.0, 12.0}) widths.push_back({probe, width});
  }
  add("hysteresis", InputFamily::kTemperature, widths, [=, &c](const Shape& s) {
    const Series t = c.temperature(s[0]);
    return std::vector<Series>{difference(t, play(t, s[1])), difference(t, play(t, 2.0 * s[1]))};
  });
  std::vector<Shape> steps;
  for (double probe = 0; probe < 3; ++probe) {
    for (double at = -10; at < 55; at += 5) steps.push_back({probe, at});
  }
  add("temperature_step", InputFamily::kTemperature, steps, [=, &c](const Shape& s) {
    return std::vector<Series>{
        map(c.temperature(s[0]), [=](double t) { return t > s[1] ? 1.0 : 0.0; })};
  });
  std::vector<Shape> periods;
  for (double probe = 0; probe < 3; ++probe) {
    for (double period = 3.0; period < 20.0; period *= 1.15) periods.push_back({probe, period});
  }
  add("etalon_fringe", InputFamily::kTemperature, periods, [=, &c](const Shape& s) {
    const double k = 2.0 * std::numbers::pi / s[1];
    const Series t = c.temperature(s[0]);
    return std::vector<Series>{map(t, [=](double v) { return std::sin(k * v); }),
                               map(t, [=](double v) { return std::cos(k * v); })};
  });
  std::vector<Shape> warm;
  for (const double tau : {0.01, 0.02, 0.05, 0.1, 0.2}) {
    for (const double power : {0.5, 0.75, 1.0}) warm.push_back({tau, power});
  }
  const Series time = c.time();
  add("warm_up", InputFamily::kTime, warm, [=](const Shape& s) {
    return std::vector<Series>{
        map(time, [=](double t) { return std::exp(-std::pow(t / s[0], s[1])); })};
  });
  add("rate_ramp", InputFamily::kTime, {{0}, {1}}, [=](const Shape& s) {
    return std::vector<Series>{
        map(time, [=](double t) { return s[0] < 0.5 ? t : std::log(t + 0.02); })};
  });
  const auto single = [&](std::string name, InputFamily family, Series x) {
    add(std::move(name), family, {{}},
        [x = std::move(x)](const Shape&) { return std::vector<Series>{x}; });
  };
  single("scale_factor", InputFamily::kRate, c.rate);
  single("scale_factor_nonlinearity", InputFamily::kRate,
         map(c.rate, [](double w) { return w * w * w; }));
  single("scale_factor_asymmetry", InputFamily::kRate,
         map(c.rate, [](double w) { return std::abs(w); }));
  add("scale_factor_temperature", InputFamily::kRate, {{0}, {1}, {2}, {3}},
      [=, &c](const Shape& s) {
        return std::vector<Series>{product(c.rate, map(c.temperature(s[0]), centred))};
      });
  add("misalignment", InputFamily::kRate, {{}}, [&c](const Shape&) {
    return std::vector<Series>{c.cross_a, c.cross_b};
  });
  single("acceleration_sensitivity", InputFamily::kAcceleration, c.tilt);
  single("vibration_rectification", InputFamily::kVibration, c.vibration);
  single("magnetic", InputFamily::kMagnetic, c.field);
  single("source_intensity", InputFamily::kSourceCurrent, c.current);
  std::vector<Shape> lines;
  for (double cycles = 6.3; cycles < 2000.0 && cycles < 0.3 * static_cast<double>(c.n);
       cycles *= 1.5) {
    lines.push_back({cycles});
  }
  add("line", InputFamily::kTime, lines, [=](const Shape& s) {
    const double k = 2.0 * std::numbers::pi * s[0];
    return std::vector<Series>{map(time, [=](double t) { return std::sin(k * t); }),
                               map(time, [=](double t) { return std::cos(k * t); })};
  });
  const std::size_t named = groups.size();
  for (int probe = 0; probe < 4; ++probe) {
    add("spline of T" + std::to_string(probe), InputFamily::kTemperature, {{double(probe)}},
        [=, &c](const Shape& s) { return hats(c.temperature(s[0]), 12); });
    add("spline of dT" + std::to_string(probe), InputFamily::kTemperature, {{double(probe)}},
        [=, &c](const Shape& s) { return hats(rate_of(c.temperature(s[0])), 10); });
  }
  add("spline of W", InputFamily::kRate, {{}}, [=, &c](const Shape&) { return hats(c.rate, 10); });
  add("spline of time", InputFamily::kTime, {{}}, [=](const Shape&) { return hats(time, 12); });
  add("spline of field", InputFamily::kMagnetic, {{}},
      [=, &c](const Shape&) { return hats(c.field, 10); });
  for (std::size_t g = named; g < groups.size(); ++g) groups[g].kind = CandidateKind::kGeneric;
  return groups;
}

// Of unit standard deviation, mean 0.
inline Series standardised(Series x) {
  double mean = 0.0;
  for (const double v : x) mean += v;
  mean /= static_cast<double>(x.size());
  double squares = 0.0;
  for (double& v : x) {
    v -= mean;
    squares += v * v;
  }
  for (double& v : x) v /= std::sqrt(squares / static_cast<double>(x.size()));
  return x;
}

// The factor that gives a waveform the separation d in noise of known levels: its norm whitened by
// the exact white and random-walk and the nearly exact flicker spectrum, DC left out.
inline double scale_for(const Series& waveform, double d, double interval_s,
                        const NoiseLevels& levels) {
  CosineTransform transform(waveform.size());
  const Eigen::VectorXd c = transform.forward(waveform);
  double square = 0.0;
  for (Eigen::Index k = 1; k < c.size(); ++k) {
    const double l = laplacian_eigenvalue(static_cast<std::size_t>(k), waveform.size());
    const double variance =
        levels.white * levels.white * unit_spectrum({NoiseKind::kWhite, 0.0}, l, interval_s) +
        levels.flicker * levels.flicker * unit_spectrum({NoiseKind::kFlicker, 0.0}, l, interval_s) +
        levels.random_walk * levels.random_walk *
            unit_spectrum({NoiseKind::kRandomWalk, 0.0}, l, interval_s);
    square += c(k) * c(k) / variance;
  }
  return d / std::sqrt(square);
}

}  // namespace zerodrift::diagnosis::test
