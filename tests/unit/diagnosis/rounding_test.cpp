// SPDX-License-Identifier: Apache-2.0
// Records with too few digits, on the shipped model and profile, whose table is at rest or turns at
// rates of any size.
#include "common/diagnosis/rounding.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "common/core/units.h"
#include "common/diagnosis/diagnosis.h"
#include "common/diagnosis/record_faults.h"
#include "tests/unit/diagnosis/simulated_series.h"
#include "tests/unit/diagnosis/written_numbers.h"

namespace zerodrift::diagnosis {
namespace {

constexpr core::Axis kX = core::Axis::kX;

enum class Table : std::uint8_t { kAnyRate, kRoundRates, kRestOrFast };

// A table that rests, turns slowly or turns fast for one to six minutes each.
twin::Profile table_profile(std::uint64_t seed, Table table) {
  twin::Profile profile = test::chamber_profile();
  profile.turns.clear();
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (double start_s = 60.0; start_s + 400.0 < profile.duration_s;) {
    const double duration_s = 60.0 + std::floor(300.0 * uniform(random));
    const double kind = uniform(random);
    const double exponent =
        kind < 0.66 ? -1.3 + 2.9 * uniform(random) : 2.0 + 2.55 * uniform(random);
    double rate_deg_h = std::pow(10.0, exponent) * (uniform(random) < 0.5 ? -1.0 : 1.0);
    if (table == Table::kRoundRates) rate_deg_h = 3600.0 * std::round(rate_deg_h / 3600.0);
    const double at_rest = table == Table::kRestOrFast ? 0.66 : 0.33;
    if (kind > at_rest && rate_deg_h != 0.0) {
      profile.turns.push_back({.start_s = start_s,
                               .duration_s = duration_s,
                               .axis = kX,
                               .rate_radps = core::radps_from_deg_h(rate_deg_h)});
    }
    start_s += duration_s;
  }
  return profile;
}

constexpr test::Decimals kEnough{6};

// Each value of a column in deg/h as text and back.
template <typename Format>
void write(std::vector<double>& values, ReadingSteps& steps, Format format) {
  steps = ReadingSteps();
  for (double& value : values) {
    value = core::radps_from_deg_h(test::written(core::deg_h_from_radps(value), format));
    steps.add(value);
  }
}

template <typename RateFormat, typename ReferenceFormat>
MeasuredSeries record_of(std::uint64_t seed, RateFormat rate, ReferenceFormat reference,
                         Table table = Table::kAnyRate) {
  MeasuredSeries series = test::simulated(test::lab_model(), table_profile(seed, table), seed);
  write(series.rate_radps[0], series.rate_steps[0], rate);
  write(series.reference_radps[0], series.reference_steps[0], reference);
  return series;
}

const NamedEffect* rounding_in(const AxisDiagnosis& axis) {
  const auto found = std::find_if(axis.effects.begin(), axis.effects.end(),
                                  [](const auto& effect) { return effect.name == "rounding"; });
  return found == axis.effects.end() ? nullptr : &*found;
}

TEST(RoundingScenario, EnoughDigitsAreNoFault) {
  for (const std::uint64_t seed : {21U, 22U, 23U}) {
    const AxisDiagnosis axis =
        *diagnose(test::lab_model(), record_of(seed, kEnough, kEnough), {}, {}).axes[0];
    EXPECT_EQ(axis.verdict, Verdict::kConsistent) << axis.sentence;
  }
}

void expect_only_the_reference(const MeasuredSeries& record) {
  const AxisDiagnosis axis = *diagnose(test::lab_model(), record, {}, {}).axes[0];
  ASSERT_NE(rounding_in(axis), nullptr) << axis.sentence;
  EXPECT_TRUE(rounding_in(axis)->parameters.contains("reference_step_deg_h"));
  EXPECT_FALSE(rounding_in(axis)->parameters.contains("step_deg_h"));
  EXPECT_FALSE(axis.unknown.has_value()) << axis.sentence;
  EXPECT_EQ(axis.effects.size(), 1U) << axis.sentence;
}

// Before: an unknown effect of the rate.
TEST(RoundingScenario, AReferenceWithTooFewDigitsIsNamedAndNothingElseIs) {
  expect_only_the_reference(record_of(24, kEnough, test::Digits{5}));
  expect_only_the_reference(record_of(24, kEnough, test::Decimals{0}));
  expect_only_the_reference(record_of(24, kEnough, test::Decimals{1}));
}

TEST(RoundingScenario, ARateWithTooFewDigitsIsNamedAndNothingElseIs) {
  const AxisDiagnosis axis =
      *diagnose(test::lab_model(), record_of(25, test::Decimals{0}, kEnough), {}, {}).axes[0];
  ASSERT_NE(rounding_in(axis), nullptr) << axis.sentence;
  EXPECT_NEAR(rounding_in(axis)->parameters.at("step_deg_h"), 1.0, 1e-6);
  EXPECT_EQ(axis.effects.size(), 1U) << axis.sentence;
  EXPECT_FALSE(axis.unknown.has_value()) << axis.sentence;
}

// Before: spikes where the table sped up, and an unknown effect.
TEST(RoundingScenario, AReferenceInThousandthsOfADegreeASecondIsNamedAndNothingElseIs) {
  for (const std::uint64_t seed : {28U, 29U, 30U}) {
    MeasuredSeries record = record_of(seed, kEnough, kEnough, Table::kRestOrFast);
    record.reference_steps[0] = ReadingSteps();
    for (double& value : record.reference_radps[0]) {
      const double deg_h = 3.6 * std::round(core::deg_h_from_radps(value) / 3.6);
      value = core::radps_from_deg_h(test::written(deg_h, test::Decimals{1}));
      record.reference_steps[0].add(value);
    }
    expect_only_the_reference(record);
  }
}

// Before: a limit, at the fastest rate that the table held.
TEST(RoundingScenario, ACoarseRateThatIsHeldHasReachedNoLimit) {
  for (const std::uint64_t seed : {28U, 29U, 30U, 31U}) {
    const AxisDiagnosis axis =
        *diagnose(test::lab_model(),
                  record_of(seed, test::Decimals{0}, kEnough, Table::kRestOrFast), {}, {})
             .axes[0];
    EXPECT_TRUE(std::none_of(axis.effects.begin(), axis.effects.end(), [](const auto& effect) {
      return effect.name == "saturation";
    })) << axis.sentence;
  }
}

// A rate table that is told to turn at whole degrees a second does.
TEST(RoundingScenario, ExactRoundRatesAreNoFault) {
  const AxisDiagnosis axis =
      *diagnose(test::lab_model(), record_of(26, kEnough, test::Digits{6}, Table::kRoundRates), {},
                {})
           .axes[0];
  EXPECT_EQ(axis.verdict, Verdict::kConsistent) << axis.sentence;
}

TEST(RoundingScenario, AHiddenEffectOfTheRateIsStillFound) {
  twin::Model given = test::lab_model();
  MeasuredSeries series = record_of(27, kEnough, test::Digits{6});
  for (std::size_t i = 0; i < series.size; ++i)
    series.rate_radps[0][i] += 1e-5 * std::abs(series.reference_radps[0][i]);
  const AxisDiagnosis axis = *diagnose(given, series, {}, {}).axes[0];
  EXPECT_TRUE(std::any_of(axis.effects.begin(), axis.effects.end(), [](const auto& effect) {
    return effect.name == "scale_factor_asymmetry";
  })) << axis.sentence;
}

}  // namespace
}  // namespace zerodrift::diagnosis
