// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/candidates.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "common/diagnosis/known_effects.h"
#include "common/diagnosis/lineup.h"
#include "common/diagnosis/shape_refinement.h"
#include "common/twin/effect_catalogue.h"
#include "tests/unit/diagnosis/simulated_series.h"

namespace zerodrift::diagnosis {
namespace {

class CandidatesTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    series_ = new MeasuredSeries(test::simulated(test::lab_model(), test::chamber_profile(), 1));
    playback_ = new Playback(*series_);
  }
  static void TearDownTestSuite() {
    delete playback_;
    delete series_;
  }
  static inline MeasuredSeries* series_ = nullptr;
  static inline Playback* playback_ = nullptr;
};

bool has(const std::vector<Candidate>& candidates, const std::string& kind) {
  return std::any_of(candidates.begin(), candidates.end(),
                     [&](const Candidate& c) { return c.definition->kind == kind; });
}

TEST_F(CandidatesTest, EveryRegressorOfTheCatalogueIsOneUnlessTheModelHasIt) {
  const twin::Model model = test::lab_model();
  const Candidates found = candidates(*series_, *playback_, model, core::Axis::kX, {});
  for (const auto& definition : twin::effect_catalogue()) {
    const bool known = std::any_of(model.effects.begin(), model.effects.end(),
                                   [&](const auto& e) { return e.kind == definition.kind; });
    const bool regressor = definition.family == twin::Family::kDeterministic;
    // Without a scan these five have nothing to try.
    const bool scanned = definition.kind == "line" || definition.kind == "duty_cycle" ||
                         definition.kind == "etalon_fringe" ||
                         definition.kind == "modulator_reset" || definition.kind == "bias_step";
    if (!regressor || known || scanned || definition.kind == "bias") continue;
    EXPECT_TRUE(has(found.testable, definition.kind)) << definition.kind;
  }
  EXPECT_FALSE(has(found.testable, "shupe"));
}

TEST_F(CandidatesTest, PriorsOfTheVariantsSumToOne) {
  const Candidates found = candidates(*series_, *playback_, test::lab_model(), core::Axis::kX, {});
  for (const Candidate& candidate : found.testable) {
    double sum = 0.0;
    for (const Variant& variant : candidate.variants) sum += std::exp(variant.log_prior);
    EXPECT_NEAR(sum, 1.0, 1e-9) << candidate.definition->kind;
  }
}

// Law: a late thermometer is the one that the bias is known against, and makes a Shupe effect late
// only if that reads it too.
TEST_F(CandidatesTest, ALateThermometerIsLateForAllThatReadsIt) {
  using P = twin::TemperaturePoint;
  const auto lag_in = [&](std::vector<std::string> bias_reads,
                          std::vector<std::string> shupe_reads) {
    twin::Model model = test::lab_model();
    for (twin::EffectSpec& spec : model.effects) {
      if (spec.kind == "bias_temperature") spec.inputs = bias_reads;
      if (spec.kind == "shupe") spec.inputs = shupe_reads;
    }
    Candidates found = candidates(*series_, *playback_, model, core::Axis::kX, {});
    const auto lag = std::find_if(found.testable.begin(), found.testable.end(),
                                  [](const auto& c) { return c.definition->kind == "sensor_lag"; });
    return lag == found.testable.end() ? Candidate{} : *lag;
  };
  constexpr auto kShupe = "coefficient_deg_h_min_per_degc";
  const Candidate apart = lag_in({"coil_outer"}, {"coil_inner"});
  ASSERT_FALSE(apart.variants.empty());
  for (const Variant& variant : apart.variants)
    EXPECT_EQ(variant.inputs, std::vector<P>{P::kCoilOuter});
  EXPECT_TRUE(apart.conventions.contains("c1_deg_h_per_degc"));
  EXPECT_FALSE(apart.conventions.contains(kShupe));
  const Candidate same = lag_in({"coil_outer"}, {"coil_outer"});
  ASSERT_TRUE(same.conventions.contains(kShupe));
  EXPECT_NE(same.conventions.at(kShupe), 0.0);
  EXPECT_EQ(lag_in({}, {"coil"}).conventions.at(kShupe), same.conventions.at(kShupe));
}

// Heat needs time from the faces, whose mean stands for a coil without a thermometer of its own.
TEST_F(CandidatesTest, TheInsideOfACoilMayBeLateOnlyWhereItsFacesAreMeasured) {
  const twin::Model model = test::without(test::lab_model(), "shupe");
  const auto latest_s = [&](const MeasuredSeries& series, twin::TemperaturePoint point) {
    const Candidates found = candidates(series, Playback(series), model, core::Axis::kX, {});
    double latest = -1.0;
    for (const Candidate& candidate : found.testable) {
      if (candidate.definition->kind != "shupe") continue;
      for (const Variant& variant : candidate.variants) {
        if (variant.inputs.front() == point)
          latest = std::max(latest, variant.shapes.at("diffusion_s"));
      }
    }
    return latest;
  };
  using P = twin::TemperaturePoint;
  EXPECT_GT(latest_s(*series_, P::kCoil), 100.0);
  EXPECT_EQ(latest_s(*series_, P::kCoilOuter), 0.0);
  MeasuredSeries measured = *series_;
  measured.probes.push_back(measured.probes.front());
  measured.probes.back().name = "coil";
  EXPECT_EQ(latest_s(measured, P::kCoil), 0.0);
}

// Before: loops of 18 and 27 °C half width over 17 and 28 °C stood in for a straight line.
TEST_F(CandidatesTest, LoopsAreNoWiderThanTheTemperatureGoesThrough) {
  MeasuredSeries narrow = *series_;
  for (ProbeSeries& probe : narrow.probes) {
    for (double& degc : probe.temperature_degc) degc = 20.0 + 0.2 * (degc - 20.0);
  }
  const twin::Model model = test::lab_model();
  for (const MeasuredSeries* series : {series_, &narrow}) {
    const Playback playback(*series);
    Lineup lineup;
    for (Candidate& candidate : candidates(*series, playback, model, core::Axis::kX, {}).testable) {
      if (candidate.definition->kind == "hysteresis") lineup.add(std::move(candidate));
    }
    ASSERT_EQ(lineup.named.size(), 1U);
    double widest = 0.0;
    for (const ProbeSeries& probe : series->probes)
      widest = std::max(widest, widest_loop_degc(probe.temperature_degc));
    const double least = 1.5;  // the grid's first
    for (const Variant& variant : lineup.named.front().variants)
      EXPECT_LE(variant.shapes.at("typical_threshold_degc"), std::max(least, widest));
    const auto ranges = lineup.groups(*series, playback).front().ranges;
    const auto names = names_of(*lineup.named.front().definition, twin::ParameterRole::kShape);
    const auto place = std::find(names.begin(), names.end(), "typical_threshold_degc");
    const auto& range = ranges.at(static_cast<std::size_t>(place - names.begin()) + 1);
    EXPECT_DOUBLE_EQ(range.highest, std::max(least, widest));
  }
}

// Before: a lag of 240 to 540 s, or of 660 to 1740, couldn't be found, since those listed were
// moved by a minute at most.
TEST_F(CandidatesTest, BetweenTwoValuesListedNoneIsOutOfReach) {
  const twin::Model model = test::lab_model();
  Lineup lineup;
  for (Candidate& candidate : candidates(*series_, *playback_, model, core::Axis::kX, {}).testable)
    lineup.add(std::move(candidate));
  const std::vector<CandidateGroup> groups = lineup.groups(*series_, *playback_);
  std::size_t lags = 0;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    std::size_t place = 0;
    for (const twin::ParameterDefinition& parameter : lineup.named[g].definition->parameters) {
      if (parameter.role != twin::ParameterRole::kShape) continue;
      const ShapeRange& range = groups[g].ranges.at(++place);
      if (range.scale == ShapeScale::kFixed || parameter.grid.size() < 2) continue;
      lags += parameter.rule == twin::SearchRule::kLag ? 1U : 0U;
      std::set<double> listed;
      for (const CandidateVariant& variant : groups[g].variants)
        listed.insert(variant.shape.at(place));
      for (auto above = listed.begin(); above != listed.end() && std::next(above) != listed.end();
           ++above) {
        EXPECT_GE(Reach(range, *above).high, Reach(range, *std::next(above)).low)
            << groups[g].name << ' ' << parameter.name << " from " << *above;
      }
    }
  }
  EXPECT_GT(lags, 0U);
}

TEST_F(CandidatesTest, GroupsOfTheSameIdentityMakeTheSameColumns) {
  const twin::Model model = test::lab_model();
  twin::Model elsewhere = model;
  for (twin::EffectSpec& spec : elsewhere.effects) {
    const auto reference = spec.parameters.find("reference_degc");
    if (reference != spec.parameters.end()) reference->second += 5.0;
  }
  const auto groups_of = [&](const twin::Model& of, Lineup& lineup) {
    for (Candidate& c : candidates(*series_, *playback_, of, core::Axis::kX, {}).testable)
      lineup.add(std::move(c));
    return lineup.groups(*series_, *playback_);
  };
  Lineup one;
  Lineup other;
  const std::vector<CandidateGroup> here = groups_of(model, one);
  const std::vector<CandidateGroup> there = groups_of(elsewhere, other);
  std::size_t differing = 0;
  ASSERT_EQ(here.size(), there.size());
  for (std::size_t g = 0; g < here.size(); ++g) {
    const std::vector<double>& shape = here[g].variants.front().shape;
    const bool same = here[g].columns(shape) == there[g].columns(shape);
    const bool alike = here[g].identity == there[g].identity;
    EXPECT_TRUE(same || !alike) << here[g].name;
    differing += alike ? 0U : 1U;
    for (std::size_t h = 0; h < g; ++h) EXPECT_NE(here[h].identity, here[g].identity);
  }
  EXPECT_GT(differing, 0U) << "some effect borrows a reference temperature";
}

TEST_F(CandidatesTest, EachCycleIsLookedAtOnce) {
  Scans scans;
  scans.lines.frequencies = {1e-3};
  scans.cycles = {{1e-3, 0.25, 0.5}, {1e-3, 0.4, 0.5}, {1e-3, 0.4, 0.75}};
  const Candidates found =
      candidates(*series_, *playback_, test::lab_model(), core::Axis::kX, scans);
  const auto cycle = std::find_if(
      found.testable.begin(), found.testable.end(),
      [](const Candidate& candidate) { return candidate.definition->kind == "duty_cycle"; });
  ASSERT_NE(cycle, found.testable.end());
  ASSERT_EQ(cycle->variants.size(), scans.cycles.size());
  for (std::size_t i = 0; i < cycle->variants.size(); ++i) {
    const twin::Parameters expected{{"frequency_hz", scans.cycles[i].frequency_hz},
                                    {"duty", scans.cycles[i].duty},
                                    {"phase_turns", scans.cycles[i].phase_turns}};
    EXPECT_EQ(cycle->variants[i].shapes, expected) << i;
  }
}

TEST_F(CandidatesTest, ColumnsAreTheEffectsThemselves) {
  const twin::EffectDefinition& definition = *twin::find_effect("magnetic");
  twin::EffectContext context = default_context(definition, core::Axis::kX, series_->interval_s);
  const auto columns = columns_of(*playback_, definition, context);
  const auto amplitudes = names_of(definition, twin::ParameterRole::kAmplitude);
  ASSERT_EQ(columns.size(), amplitudes.size());
  for (std::size_t a = 0; a < amplitudes.size(); ++a)
    context.parameters[amplitudes[a]] = 0.5 * (1.0 + static_cast<double>(a));
  const auto whole = playback_->run(definition, context);
  for (std::size_t i = 0; i < whole.size(); i += 97) {
    double sum = 0.0;
    for (std::size_t a = 0; a < columns.size(); ++a)
      sum += 0.5 * (1.0 + static_cast<double>(a)) * columns[a][i];
    EXPECT_NEAR(whole[i], sum, 1e-12 * std::abs(sum) + 1e-20);
  }
}

TEST(CandidatesAbuse, WhatARecordDoesNotExciteIsNotTestableAndSaysWhy) {
  MeasuredSeries series;
  series.interval_s = 1.0;
  series.size = 3000;
  series.rate_radps[0].assign(3000, 0.0);
  series.valid[0].assign(3000, 1);
  for (auto& reference : series.reference_radps) reference.assign(3000, 0.0);
  series.since_power_on_s.assign(3000, 1.0);
  series.magnetic_ut[0].assign(3000, 30.0);
  const Playback playback(series);
  const Candidates found = candidates(series, playback, test::lab_model(), core::Axis::kX, {});
  const auto why = [&](const std::string& kind) {
    for (const NotTestable& entry : found.not_testable) {
      if (entry.name == kind) return entry.why;
    }
    return std::string("testable");
  };
  EXPECT_EQ(why("hysteresis"), "no temperature in the record");
  EXPECT_EQ(why("gradient"), "needs two thermometers");
  EXPECT_EQ(why("misalignment"), "no reference rate in the record");
  EXPECT_EQ(why("magnetic"), "the magnetic field never changes");
  EXPECT_EQ(why("vibration_rectification"), "no vibration in the record");
  EXPECT_EQ(why("rate_ramp"), "needs an hour, the record has 50 min");
}

TEST_F(CandidatesTest, KnownParametersHaveTheColumnsOfTheirOwnChange) {
  twin::Model model =
      test::with(test::lab_model(), {.kind = "warm_up",
                                     .axis = core::Axis::kX,
                                     .parameters = {{"amplitude_deg_h", 0.5}, {"tau_s", 900.0}}});
  const auto known = known_parameters(model, core::Axis::kX, *playback_);
  const auto drift = playback_->drift(model, core::Axis::kX);
  for (const KnownParameter& parameter : known) {
    twin::Model changed = model;
    const double step = parameter.value != 0.0 ? 1e-3 * std::abs(parameter.value) : 1e-6;
    changed.effects[parameter.effect].parameters[parameter.parameter] += step;
    const auto moved = playback_->drift(changed, core::Axis::kX);
    double error = 0.0, size = 0.0;
    for (std::size_t i = 0; i < drift.size(); ++i) {
      const double change = (moved[i] - drift[i]) / step;
      error += std::pow(change - parameter.column.values[i], 2.0);
      size += change * change;
    }
    // Shapes: a difference over 4 % against one over 0.1 %.
    EXPECT_LT(std::sqrt(error), 5e-3 * std::sqrt(size)) << parameter.column.name;
    EXPECT_GT(size, 0.0) << parameter.column.name;
  }
  EXPECT_TRUE(std::any_of(known.begin(), known.end(),
                          [](const auto& k) { return k.column.name == "warm_up.tau_s"; }));
}

TEST(KnownEffects, ABiasIsShiftedOrAdded) {
  twin::Model model = test::lab_model();
  const double to = shift_bias(model, core::Axis::kX, core::radps_from_deg_h(0.1)).to;
  EXPECT_NEAR(to, 0.45, 1e-12);
  model = test::without(model, "bias");
  EXPECT_NEAR(shift_bias(model, core::Axis::kX, core::radps_from_deg_h(0.1)).to, 0.1, 1e-12);
  EXPECT_EQ(model.effects.back().kind, "bias");
}

}  // namespace
}  // namespace zerodrift::diagnosis
