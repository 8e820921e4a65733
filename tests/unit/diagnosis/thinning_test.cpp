// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/thinning.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "common/diagnosis/cosine_transform.h"
#include "common/diagnosis/noise_weight.h"
#include "common/twin/effect_catalogue.h"
#include "tests/unit/diagnosis/simulated_series.h"

namespace zerodrift::diagnosis {
namespace {

using Place = std::pair<std::vector<twin::TemperaturePoint>, double>;

const twin::EffectDefinition& relay() {
  return *twin::find_effect("temperature_step");
}

Place place_of(const Variant& variant) {
  return {variant.inputs, variant.shapes.at("threshold_degc")};
}

class ThinningTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    series_ = new MeasuredSeries(test::simulated(test::lab_model(), test::chamber_profile(), 1));
    playback_ = new Playback(*series_);
    candidates_ = new std::vector<Candidate>(
        candidates(*series_, *playback_, test::lab_model(), core::Axis::kX, {}).testable);
  }
  static void TearDownTestSuite() {
    delete candidates_;
    delete playback_;
    delete series_;
  }

  static const Candidate& of_relay(const std::vector<Candidate>& among) {
    return *std::find_if(among.begin(), among.end(),
                         [](const Candidate& c) { return c.definition.get() == &relay(); });
  }

  // White noise of 1e-7 rad/s beside an effect of `deg_h` at this variant.
  static std::vector<Candidate> thinned(const Variant& truth, double deg_h, std::uint64_t seed) {
    constexpr double kSigma = 1e-7;
    const std::size_t quick = smooth_length_up_to(series_->size);
    std::mt19937_64 random(seed);
    std::normal_distribution<double> noise(0.0, kSigma);
    auto residual = columns_of(*playback_, relay(),
                               context_of(of_relay(*candidates_), truth, series_->interval_s))
                        .front();
    for (double& value : residual) value = deg_h * value + noise(random);
    const std::vector<double> variances(quick, kSigma * kSigma);
    auto weighted = divided_by_noise(std::span(residual).first(quick), variances);
    weighted.resize(residual.size(), 0.0);
    std::vector<Candidate> found = *candidates_;
    thin_out(found, *playback_, weighted, variances);
    return found;
  }

  static inline MeasuredSeries* series_ = nullptr;
  static inline Playback* playback_ = nullptr;
  static inline std::vector<Candidate>* candidates_ = nullptr;
};

TEST_F(ThinningTest, ThreeVariantsStayOfEachInputAndThreshold) {
  const Candidate& all = of_relay(*candidates_);
  const auto found = thinned(all.variants.front(), 0.0, 1);
  const Candidate& fewer = of_relay(found);
  std::map<Place, int> before, after;
  for (const Variant& variant : all.variants) ++before[place_of(variant)];
  double sum = 0.0;
  for (const Variant& variant : fewer.variants) {
    ++after[place_of(variant)];
    sum += std::exp(variant.log_prior);
  }
  EXPECT_EQ(after.size(), before.size());
  for (const auto& [place, count] : after) EXPECT_EQ(count, 3);
  ASSERT_LT(2 * fewer.variants.size(), all.variants.size());
  // Of noise alone they explain as much, or nearly: what is kept has nearly all of the prior.
  EXPECT_LE(sum, 1.0 + 1e-9);
  EXPECT_GT(sum, 0.5);
}

TEST_F(ThinningTest, WhatHasNoThresholdStaysAsItIs) {
  const auto found = thinned(of_relay(*candidates_).variants.front(), 1.0, 2);
  ASSERT_EQ(found.size(), candidates_->size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i].definition.get() == &relay()) continue;
    ASSERT_EQ(found[i].variants.size(), (*candidates_)[i].variants.size());
    for (std::size_t v = 0; v < found[i].variants.size(); ++v) {
      EXPECT_EQ(found[i].variants[v].shapes, (*candidates_)[i].variants[v].shapes);
      EXPECT_EQ(found[i].variants[v].log_prior, (*candidates_)[i].variants[v].log_prior);
    }
  }
}

// 20 of the grid's own variants, each as large as a search can name.
TEST_F(ThinningTest, TheOneThatIsThereStays) {
  const Candidate& all = of_relay(*candidates_);
  std::size_t tried = 0;
  for (std::size_t i = 7; i < all.variants.size(); i += all.variants.size() / 20) {
    const Variant& truth = all.variants[i];
    const auto column =
        columns_of(*playback_, relay(), context_of(all, truth, series_->interval_s)).front();
    if (std::all_of(column.begin(), column.end(), [&](double x) { return x == column.front(); }))
      continue;  // never switches
    const auto found = thinned(truth, 1.0, i);
    const Candidate& fewer = of_relay(found);
    // The likeliest is first. Others that switch at the same times are as good.
    const auto kept =
        std::find_if(fewer.variants.begin(), fewer.variants.end(),
                     [&](const Variant& v) { return place_of(v) == place_of(truth); });
    ASSERT_NE(kept, fewer.variants.end());
    const auto other =
        columns_of(*playback_, relay(), context_of(all, *kept, series_->interval_s)).front();
    std::size_t differ = 0;
    for (std::size_t k = 0; k < column.size(); ++k) differ += column[k] != other[k] ? 1U : 0U;
    EXPECT_LT(differ, column.size() / 500) << i;
    ++tried;
  }
  EXPECT_GT(tried, 10U);
}

TEST_F(ThinningTest, OfNoResidualNothingIsTaken) {
  std::vector<Candidate> found = *candidates_;
  thin_out(found, *playback_, {}, {});
  EXPECT_EQ(of_relay(found).variants.size(), of_relay(*candidates_).variants.size());
}

}  // namespace
}  // namespace zerodrift::diagnosis
