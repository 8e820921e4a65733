// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/joint_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/diagnosis/find_missing.h"
#include "tests/unit/diagnosis/search_record.h"

namespace zerodrift::diagnosis {
namespace {

using test::Chamber;
using test::Series;

constexpr std::size_t kPoints = 2250;
constexpr double kIntervalS = 8.0;

struct Record {
  Chamber chamber{kPoints, kIntervalS, 7};
  Series series = test::coloured_noise(kPoints, kIntervalS, {1.0, 0.05, 4e-4}, 7);
  std::vector<std::uint8_t> valid = std::vector<std::uint8_t>(kPoints, 1);
  SearchProblem problem;

  Record() {
    Series hidden = chamber.field;
    const double factor = test::scale_for(hidden, 30.0, kIntervalS, {1.0, 0.05, 4e-4});
    for (std::size_t i = 0; i < kPoints; ++i) series[i] += factor * hidden[i];
    problem.series = series;
    problem.valid = valid;
    problem.interval_s = kIntervalS;
    problem.known.push_back({"ramp", chamber.time()});
    problem.groups = test::usual_groups(chamber);
  }
};

TEST(JointFitLaws, WhatASearchFoundComesOutTheSameWhenFittedAlone) {
  const Record record;
  const SearchReport report = find_missing(record.problem);
  ASSERT_EQ(report.effects.size(), 1U);
  const FoundEffect& found = report.effects.front();
  const std::vector<ChosenShape> chosen{{found.group, found.shape}};
  const auto joint = fit_jointly(record.problem, chosen, {});
  ASSERT_TRUE(joint.has_value());
  EXPECT_EQ(joint->effects.front().group, found.group);
  EXPECT_EQ(joint->effects.front().amplitudes, found.amplitudes);
  EXPECT_EQ(joint->effects.front().waveform, found.waveform);
  EXPECT_EQ(joint->noise_squares, report.noise_squares);
  EXPECT_EQ(joint->corrections.front().value, report.corrections.front().value);
}

TEST(JointFitLaws, NoiseBesideTheKnownColumnsTakesNoGroup) {
  const Record record;
  SearchProblem bare = record.problem;
  bare.groups.clear();
  const auto with_groups = fit_noise_beside(record.problem, {});
  const auto without = fit_noise_beside(bare, {});
  ASSERT_TRUE(with_groups.has_value() && without.has_value());
  EXPECT_TRUE(with_groups->effects.empty());
  EXPECT_EQ(with_groups->noise_squares, without->noise_squares);
}

TEST(JointFitAbuse, AGroupWithoutAColumnThatCountsHasNoJointFit) {
  Record record;
  record.problem.groups.front().columns = [](const std::vector<double>&) {
    return std::vector<Series>{Series(kPoints, 25.0)};
  };
  const CandidateGroup& group = record.problem.groups.front();
  const std::vector<ChosenShape> chosen{{group.id, group.variants.front().shape}};
  EXPECT_FALSE(fit_jointly(record.problem, chosen, {}).has_value());
}

TEST(JointFitAbuse, ASeriesThatSaysNothingHasNone) {
  Record record;
  std::fill(record.series.begin(), record.series.end(), 4.0);
  EXPECT_FALSE(fit_noise_beside(record.problem, {}).has_value());
  std::fill(record.valid.begin(), record.valid.end(), std::uint8_t{0});
  EXPECT_FALSE(fit_noise_beside(record.problem, {}).has_value());
}

}  // namespace
}  // namespace zerodrift::diagnosis
