// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/temperature_course.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "common/diagnosis/coarse_readings.h"
#include "common/diagnosis/measured_series.h"
#include "common/diagnosis/natural_spline.h"

namespace zerodrift::diagnosis {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kHalfS = 45.0;
constexpr double kPerMinute = 1.0 / 60.0;

using Course = std::function<double(double time_s)>;

struct Reading {
  double noise_degc = 0.005;
  double step_degc = 0.01;
  std::uint64_t seed = 1;
};

std::vector<double> readings(const Course& course, std::size_t seconds, const Reading& of) {
  std::mt19937_64 random(of.seed);
  std::normal_distribution<double> normal;
  std::vector<double> values;
  for (std::size_t i = 0; i < seconds; ++i) {
    const double value = course(static_cast<double>(i)) + of.noise_degc * normal(random);
    values.push_back(of.step_degc > 0.0 ? std::round(value / of.step_degc) * of.step_degc : value);
  }
  return values;
}

double slope_at(const Course& course, double time_s) {
  return 0.5 * (course(time_s + 1.0) - course(time_s - 1.0));
}

// The slope over the longest window alone.
double in_one_window(const std::vector<double>& values, std::size_t centre) {
  const auto half = static_cast<std::ptrdiff_t>(kHalfS);
  double sum = 0.0, squares = 0.0;
  for (std::ptrdiff_t k = -half; k <= half; ++k) {
    const double offset = static_cast<double>(k);
    sum += offset * values[static_cast<std::size_t>(static_cast<std::ptrdiff_t>(centre) + k)];
    squares += offset * offset;
  }
  return sum / squares;
}

struct Errors {  // root mean squares, degC/s
  double chosen = 0.0;
  double one_window = 0.0;
};

Errors errors_of(const Course& course, std::size_t seconds, const Reading& of, std::size_t begin,
                 std::size_t end) {
  const auto values = readings(course, seconds, of);
  const TemperatureCourse found = temperature_course(values, 1.0, kHalfS);
  Errors errors;
  for (std::size_t i = begin; i < end; ++i) {
    const double truth = slope_at(course, static_cast<double>(i));
    errors.chosen += std::pow(found.degc_per_s[i] - truth, 2);
    errors.one_window += std::pow(in_one_window(values, i) - truth, 2);
  }
  const auto count = static_cast<double>(end - begin);
  return {std::sqrt(errors.chosen / count), std::sqrt(errors.one_window / count)};
}

// Law: what is a quadratic is returned as it is, at the ends too.
TEST(TemperatureCourse, AQuadraticComesBack) {
  std::vector<double> values;
  const auto course = [](double t) { return 20.0 + 0.01 * t - 2e-5 * t * t; };
  for (int i = 0; i < 600; ++i) values.push_back(course(i));
  const TemperatureCourse found = temperature_course(values, 1.0, kHalfS);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto t = static_cast<double>(i);
    EXPECT_NEAR(found.degc[i], course(t), 1e-9) << i;
    EXPECT_NEAR(found.degc_per_s[i], 0.01 - 4e-5 * t, 1e-9) << i;
  }
  constexpr double kLagS = 20.0;
  const TemperatureCourse sooner = temperature_course(values, 1.0, kHalfS, kLagS);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto t = static_cast<double>(i);
    EXPECT_NEAR(sooner.degc[i], course(t) + kLagS * (0.01 - 4e-5 * t), 1e-9) << i;
    EXPECT_NEAR(sooner.degc_per_s[i], 0.01 - 4e-5 * (t + kLagS), 1e-9) << i;
  }
}

// A ramp that begins within seconds, as the outer layers of a coil see a chamber's: a window of a
// minute and a half smears its edge.
TEST(TemperatureCourse, AnEdgeIsNotSmeared) {
  const Course edge = [](double t) {
    const double since = t - 300.0;
    if (since < 0.0) return 20.0;
    return 20.0 + 5.0 * kPerMinute * (since - 20.0 * (1.0 - std::exp(-since / 20.0)));
  };
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Errors e = errors_of(edge, 900, {.seed = seed}, 255, 400);
    EXPECT_LT(e.chosen, 0.35 * e.one_window) << seed;
  }
}

// Where nothing turns quickly the long window's answer stands, whatever the thermometer.
TEST(TemperatureCourse, ASlowCourseIsNoNoisierForIt) {
  const Course slow = [](double t) { return 20.0 + 3.0 * std::sin(t / 3000.0); };
  for (const Reading& of : {Reading{}, Reading{0.02, 0.0}, Reading{0.02, 0.0625},
                            Reading{0.0, 0.0625}, Reading{0.1, 0.01}}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      Reading own = of;
      own.seed = seed;
      const Errors e = errors_of(slow, 4000, own, 100, 3900);
      EXPECT_LT(e.chosen, 1.25 * e.one_window)
          << of.noise_degc << ' ' << of.step_degc << ' ' << seed;
    }
  }
}

// What is left of a thermometer's errors in the slope is multiplied by a Shupe effect and is no
// noise of the gyro's: behind a lag, too, it is far less than a window of 45 s leaves, which by
// itself has twice the error for 20 s.
TEST(TemperatureCourse, ASlopeIsAsExactAsTheReadingsAllow) {
  constexpr double kLagS = 20.0;
  const Course ramps = [](double t) { return 20.0 + 10.0 * std::sin(t / 900.0); };
  for (const Reading& of :
       {Reading{0.003, 0.01}, Reading{0.09, 0.01}, Reading{0.03, 0.1}, Reading{0.09, 0.3}}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      Reading own = of;
      own.seed = seed;
      const auto values = readings(ramps, 6000, own);
      const double of_window = errors_of(ramps, 6000, own, 100, 5900).one_window;
      const TemperatureCourse found = temperature_course(values, 1.0, kHalfS, kLagS);
      double squares = 0.0;
      for (std::size_t i = 100; i < 5900; ++i) {
        const auto t = static_cast<double>(i);
        const double truth =
            slope_at(ramps, t) + kLagS * (slope_at(ramps, t + 1.0) - slope_at(ramps, t));
        squares += std::pow(found.degc_per_s[i] - truth, 2);
      }
      EXPECT_LT(std::sqrt(squares / 5800.0), of_window)
          << of.noise_degc << ' ' << of.step_degc << ' ' << seed;
    }
  }
}

// A thermometer of coarse steps, without noise that would carry it over them: a ramp is one all the
// same, and what is quick enough for the steps not to matter stays as exact as it was.
TEST(TemperatureCourse, CoarseStepsAreNoBurstsOfHeat) {
  for (const double period_s : {2400.0, 3600.0, 7200.0}) {
    const Course cycle = [period_s](double t) {
      return 25.0 + 20.0 * std::sin(2.0 * std::numbers::pi * t / period_s);
    };
    const double largest = 20.0 * 2.0 * std::numbers::pi / period_s;
    for (const double step : {0.25, 0.5, 1.0, 2.0}) {
      for (const double noise : {0.0, 0.02}) {
        const Errors e =
            errors_of(cycle, 8000, {.noise_degc = noise, .step_degc = step}, 300, 7700);
        EXPECT_LT(e.chosen, e.one_window) << period_s << ' ' << step << ' ' << noise;
        EXPECT_LT(e.chosen, (0.01 + 0.07 * step) * largest)
            << period_s << ' ' << step << ' ' << noise;
      }
    }
  }
}

// Where the temperature comes to rest and leaves it again a coarse reading stays the same for long:
// its course is smooth all the same. A ramp between them is as straight as many steps tell.
TEST(TemperatureCourse, CoarseStepsLeaveASoakSmooth) {
  constexpr double kTauS = 300.0;
  const auto ramped = [](double since) {  // behind two equal lags
    if (since < 0.0) return 0.0;
    return since - 2.0 * kTauS + (2.0 * kTauS + since) * std::exp(-since / kTauS);
  };
  const Course soaks = [&](double t) {
    return 22.03 + kPerMinute * (ramped(t - 1000.0) - ramped(t - 3000.0) -
                                 0.7 * ramped(t - 6000.0) + 0.7 * ramped(t - 8000.0));
  };
  for (const double step : {0.3, 0.5}) {
    for (const double noise : {0.0, 0.02}) {
      const auto values = readings(soaks, 11000, {.noise_degc = noise, .step_degc = step});
      const TemperatureCourse found = temperature_course(values, 1.0, kHalfS);
      double squares = 0.0;
      for (std::size_t i = 100; i < 10900; ++i)
        squares += std::pow(found.degc_per_s[i] - slope_at(soaks, static_cast<double>(i)), 2);
      EXPECT_LT(std::sqrt(squares / 10800.0), 0.04 * step * kPerMinute) << step << ' ' << noise;
    }
  }
}

// A reading in ten seconds: what steps leave of errors on a ramp asks for a longer window.
TEST(TemperatureCourse, CoarseStepsOnARampAreAveraged) {
  constexpr double kIntervalS = 10.0;
  std::vector<double> values;
  constexpr double kStep = 0.3;
  for (int i = 0; i < 700; ++i)
    values.push_back(std::round((20.0 + 0.37 * kPerMinute * kIntervalS * i) / kStep) * kStep);
  const TemperatureCourse found = temperature_course(values, kIntervalS, kHalfS);
  double squares = 0.0;
  for (std::size_t i = 30; i < 670; ++i)
    squares += std::pow(found.degc_per_s[i] - 0.37 * kPerMinute, 2);
  EXPECT_LT(std::sqrt(squares / 640.0), 0.01 * kPerMinute);
}

// A readings' course keeps within their steps, whatever they do, and is theirs where they have
// none.
TEST(TemperatureCourse, WithoutStepsStaysWithinThem) {
  constexpr double kStep = 0.5;
  std::mt19937_64 random(5);
  std::uniform_int_distribution<int> stay(1, 60), way(-1, 1);
  std::vector<double> values;
  double level = 20.0;
  while (values.size() < 5000) {
    level += kStep * way(random);
    values.insert(values.end(), static_cast<std::size_t>(stay(random)), level);
    if (values.size() % 7 == 0) values.push_back(kNone);
  }
  const WithoutSteps found = without_steps(values, 11);
  ASSERT_EQ(found.degc.size(), values.size());
  ASSERT_EQ(found.variance_degc2.size(), values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    ASSERT_EQ(std::isnan(found.degc[i]), std::isnan(values[i])) << i;
    if (std::isnan(values[i])) continue;
    EXPECT_LE(std::abs(found.degc[i] - values[i]), 1.5 * kStep) << i;
    EXPECT_GE(found.variance_degc2[i], 0.0) << i;
    EXPECT_LE(found.variance_degc2[i], kStep * kStep) << i;
  }
  std::vector<double> fine;
  for (int i = 0; i < 200; ++i) fine.push_back(20.0 + 0.01 * i * i);
  EXPECT_EQ(without_steps(fine, 11).degc, fine);
  EXPECT_TRUE(without_steps({}, 11).degc.empty());
  std::vector<double> once(100, 20.0);
  std::fill(once.begin() + 60, once.end(), 20.5);
  const WithoutSteps risen = without_steps(once, 11);
  for (std::size_t i = 0; i < once.size(); ++i) {
    EXPECT_GE(risen.degc[i], i < 60 ? 20.0 : 20.25) << i;
    EXPECT_LE(risen.degc[i], i < 60 ? 20.25 : 20.5) << i;
  }
}

TEST(TemperatureCourse, ANaturalSplineGoesThroughItsKnotsAndIsStraightBeyond) {
  const std::vector<Knot> knots{{0.0, 1.0}, {1.0, 3.0}, {4.0, -2.0}, {9.0, 0.5}, {9.5, 0.0}};
  const NaturalSpline spline(knots);
  for (const Knot& knot : knots) EXPECT_NEAR(spline.at(knot.place), knot.value, 1e-12);
  const auto slope = [&](double x) { return (spline.at(x + 1e-4) - spline.at(x - 1e-4)) / 2e-4; };
  const auto bend = [&](double x) { return (slope(x + 1e-3) - slope(x - 1e-3)) / 2e-3; };
  for (const Knot& knot : knots) {
    EXPECT_NEAR(slope(knot.place - 2e-4), slope(knot.place + 2e-4), 1e-2) << knot.place;
    EXPECT_NEAR(bend(knot.place - 3e-3), bend(knot.place + 3e-3), 0.3) << knot.place;
  }
  EXPECT_NEAR(spline.at(-2.0) - spline.at(-1.0), spline.at(-1.0) - spline.at(0.0), 1e-12);
  EXPECT_NEAR(spline.at(12.0) - spline.at(11.0), spline.at(11.0) - spline.at(10.0), 1e-12);
  const NaturalSpline line({{1.0, 2.0}, {3.0, 6.0}});
  EXPECT_NEAR(line.at(-1.0), -2.0, 1e-12);
  EXPECT_NEAR(line.at(2.5), 5.0, 1e-12);
  EXPECT_NEAR(line.at(7.0), 14.0, 1e-12);
}

// Noise that carries the readings over the steps makes their mean better than any of them.
TEST(TemperatureCourse, ReadingsThatChangeByTheirNoiseAreAveraged) {
  const Course slow = [](double t) { return 20.0 + 3.0 * std::sin(t / 3000.0); };
  constexpr double kStep = 0.5;
  for (const double noise : {0.2, 0.3, 0.5}) {
    const auto values = readings(slow, 4000, {.noise_degc = noise, .step_degc = kStep});
    const TemperatureCourse found = temperature_course(values, 1.0, kHalfS);
    double squares = 0.0;
    for (std::size_t i = 100; i < 3900; ++i)
      squares += std::pow(found.degc[i] - slow(static_cast<double>(i)), 2);
    // Of a quadratic in the middle of its window.
    const double of_mean =
        1.5 / std::sqrt(2.0 * kHalfS + 1.0) * std::hypot(noise, kStep / std::sqrt(12.0));
    EXPECT_LT(std::sqrt(squares / 3800.0), 1.3 * of_mean) << noise;
  }
}

TEST(TemperatureCourse, HolesAreBridgedAndEndsHeld) {
  std::vector<double> values(600, kNone);
  for (std::size_t i = 100; i < 500; ++i) {
    if (i < 250 || i >= 350) values[i] = 20.0 + 0.01 * static_cast<double>(i);
  }
  const TemperatureCourse found = temperature_course(values, 1.0, kHalfS);
  ASSERT_EQ(found.degc.size(), values.size());
  EXPECT_NEAR(found.degc[0], 21.0, 1e-9);
  EXPECT_NEAR(found.degc[300], 23.0, 1e-9);
  EXPECT_NEAR(found.degc_per_s[300], 0.01, 1e-9);
  EXPECT_NEAR(found.degc[599], 24.99, 1e-9);
}

TEST(TemperatureCourse, OfAlmostNothingItSaysNoMoreThanThat) {
  EXPECT_TRUE(temperature_course(std::vector<double>(50, kNone), 1.0, kHalfS).degc.empty());
  std::vector<double> one(50, kNone);
  one[20] = 25.0;
  const TemperatureCourse found = temperature_course(one, 1.0, kHalfS);
  ASSERT_EQ(found.degc.size(), 50U);
  EXPECT_EQ(found.degc[0], 25.0);
  EXPECT_EQ(found.degc_per_s[49], 0.0);
}

// A first-order lag follows T as dy/dt = (T - y) / tau.
TEST(TemperatureCourse, AStatedLagIsTakenOff) {
  constexpr double kLagS = 5.0;
  const auto truth = [](double t) { return 20.0 + 10.0 * std::sin(t / 120.0); };
  MeasuredSeries series{.interval_s = 1.0};
  std::vector<double> lagged;
  double y = truth(0.0);
  for (int i = 0; i < 1200; ++i) {
    for (int k = 0; k < 100; ++k) y += 0.01 / kLagS * (truth(i - 1.0 + 0.01 * k) - y);
    lagged.push_back(y);
  }
  TemperatureCourse course = temperature_course(lagged, 1.0, kHalfS);
  series.probes.push_back({.name = "coil",
                           .temperature_degc = course.degc,
                           .rate_degc_per_s = course.degc_per_s,
                           .readings_degc = lagged,
                           .half_window_s = kHalfS});
  twin::Model model;
  model.probes.push_back({.name = "coil", .lag_s = kLagS});
  model.probes.push_back({.name = "board", .lag_s = 2.0});
  const MeasuredSeries found = without_lags(series, model);
  double as_read = 0.0, left = 0.0, rate_as_read = 0.0, rate_left = 0.0;
  for (std::size_t i = 100; i < 1100; ++i) {
    const auto t = static_cast<double>(i);
    as_read = std::max(as_read, std::abs(series.probes[0].temperature_degc[i] - truth(t)));
    left = std::max(left, std::abs(found.probes[0].temperature_degc[i] - truth(t)));
    const double rate = slope_at(truth, t);
    rate_as_read = std::max(rate_as_read, std::abs(series.probes[0].rate_degc_per_s[i] - rate));
    rate_left = std::max(rate_left, std::abs(found.probes[0].rate_degc_per_s[i] - rate));
  }
  EXPECT_GT(as_read, 0.35);
  EXPECT_LT(left, 0.1 * as_read);
  EXPECT_LT(rate_left, 0.4 * rate_as_read);
  model.probes.front().lag_s = 0.0;
  EXPECT_EQ(without_lags(series, model).probes[0].temperature_degc,
            series.probes[0].temperature_degc);
}

}  // namespace
}  // namespace zerodrift::diagnosis
