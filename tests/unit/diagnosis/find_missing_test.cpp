// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/find_missing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/core/require.h"
#include "common/diagnosis/known_effects.h"
#include "tests/unit/diagnosis/search_record.h"

namespace zerodrift::diagnosis {
namespace {

using test::Chamber;
using test::NoiseLevels;
using test::Series;

// Five hours at one point in 8 s: everything the search does, at an eighth of the points.
constexpr std::size_t kPoints = 2250;
constexpr double kIntervalS = 8.0;
constexpr NoiseLevels kNoise{1.0, 0.05, 4e-4};

class Record {
 public:
  explicit Record(std::uint64_t seed, NoiseLevels levels = kNoise)
      : chamber_(kPoints, kIntervalS, seed),
        levels_(levels),
        series(test::coloured_noise(kPoints, kIntervalS, levels, seed)),
        valid(kPoints, 1),
        groups(test::usual_groups(chamber_)) {}

  const CandidateGroup& group(const std::string& name) const {
    return *std::find_if(groups.begin(), groups.end(),
                         [&](const CandidateGroup& g) { return g.name == name; });
  }

  // Hides an effect of separation d; returns the waveform.
  Series hide(const std::string& name, const std::vector<double>& shape, double d) {
    return hide(group(name).columns(shape).front(), d);
  }
  Series hide(Series waveform, double d) {
    const double factor = test::scale_for(waveform, d, kIntervalS, levels_);
    for (std::size_t i = 0; i < kPoints; ++i) {
      waveform[i] *= factor;
      series[i] += waveform[i];
    }
    return waveform;
  }

  [[nodiscard]] SearchProblem problem() const {
    SearchProblem p;
    p.series = series;
    p.valid = valid;
    p.interval_s = kIntervalS;
    p.groups = groups;
    return p;
  }

 private:
  Chamber chamber_;
  NoiseLevels levels_;

 public:
  const Chamber& chamber() const { return chamber_; }
  Series series;
  std::vector<std::uint8_t> valid;
  std::vector<CandidateGroup> groups;
};

// The usual groups are the same in every record, each at the place of its id.
std::string name_of(GroupId id) {
  static const Record record(1);
  return record.groups.at(static_cast<std::size_t>(id)).name;
}

std::string names(const SearchReport& report) {
  std::string all(name(report.outcome));
  for (const FoundEffect& e : report.effects) all += ' ' + name_of(e.group);
  if (report.unknown) all += " unknown: " + name_of(report.unknown->group);
  return all;
}

bool is_in_set(const FoundEffect& effect, const std::string& name) {
  return std::any_of(effect.credible_set.begin(), effect.credible_set.end(),
                     [&](const RankedGroup& r) { return name_of(r.group) == name; });
}

TEST(SearchScenario, NoiseAloneGetsNoName) {
  constexpr int kRecords = 10;
  int false_names = 0;
  int false_corrections = 0;
  for (std::uint64_t seed = 0; seed < kRecords; ++seed) {
    // Flicker and random walk from a third to ten times the usual.
    const double loudness = std::pow(10.0, -0.5 + 0.15 * static_cast<double>(seed));
    Record record(100 + seed, {1.0, 0.05 * loudness, 4e-4 * loudness});
    SearchProblem problem = record.problem();
    problem.known.push_back({"known", record.chamber().temperature(3)});
    const SearchReport report = find_missing(problem);
    EXPECT_EQ(report.noise_status, NoiseFitStatus::kConverged);
    false_names += report.outcome != SearchOutcome::kNothingMissing ? 1 : 0;
    false_corrections += report.corrections.at(0).significant ? 1 : 0;
  }
  std::printf("%d of %d records of noise got a name, %d a correction\n", false_names, kRecords,
              false_corrections);
  // At 2 % a record, two or more in ten have a chance of 1.6 %.
  EXPECT_LE(false_names, 1);
  EXPECT_LE(false_corrections, 1);
}

// All that a report says of groups and effects, to the bit.
std::vector<double> figures(const SearchReport& report) {
  std::vector<double> all{report.threshold_nats};
  for (const GroupFinding& group : report.groups)
    all.insert(all.end(), {group.log_evidence, group.separation, group.rms, group.smallest_rms});
  for (const FoundEffect& effect : report.effects) {
    all.insert(all.end(), effect.waveform.begin(), effect.waveform.end());
    all.insert(all.end(), effect.shape.begin(), effect.shape.end());
    all.push_back(effect.probability);
  }
  return all;
}

TEST(SearchLaws, WhatASearchBeforeHasMadeIsNotMadeAgainAndChangesNothing) {
  Record record(260);
  record.hide("magnetic", {}, 15.0);
  record.hide("shupe_temperature", {1.0, 90.0}, 12.0);
  SearchProblem problem = record.problem();
  std::size_t made = 0;
  std::size_t variants = 0;
  for (CandidateGroup& group : problem.groups) {
    group.identity = group.name;
    variants += group.variants.size();
    group.columns = [&made, columns = group.columns](const std::vector<double>& shape) {
      ++made;
      return columns(shape);
    };
  }
  ColumnMemory memory;
  const SearchReport first = find_missing(problem, {}, &memory);
  const std::size_t alone = std::exchange(made, 0);
  const SearchReport second = find_missing(problem, {}, &memory);
  EXPECT_EQ(made, alone - variants);
  EXPECT_EQ(names(first), names(second));
  EXPECT_EQ(figures(first), figures(second));
  EXPECT_EQ(figures(first), figures(find_missing(problem)));

  // Where other samples count, a column is another one.
  std::fill(record.valid.begin() + 700, record.valid.begin() + 1100, std::uint8_t{0});
  problem.valid = record.valid;
  made = 0;
  const SearchReport gap = find_missing(problem, {}, &memory);
  EXPECT_GE(made, variants);
  EXPECT_EQ(figures(gap), figures(find_missing(problem)));
}

TEST(ColumnMemory, KeepsWhatTheLastSearchAskedForAndNothingWithoutAnIdentity) {
  const std::vector<std::uint8_t> valid(10, 1);
  const auto columns = std::make_shared<const ShapeColumns>();
  ColumnMemory memory;
  memory.begin(valid, 5);
  memory.keep("lag of 60 s", {60.0}, columns);
  memory.keep("", {60.0}, columns);
  memory.end();
  memory.begin(valid, 5);
  EXPECT_EQ(memory.find("lag of 60 s", {60.0}), columns);
  EXPECT_EQ(memory.find("lag of 60 s", {61.0}), nullptr);
  EXPECT_EQ(memory.find("", {60.0}), nullptr);
  memory.end();
  memory.begin(valid, 5);
  EXPECT_EQ(memory.find("lag of 60 s", {60.0}), columns) << "asked for by the search before";
  memory.end();
  memory.begin(valid, 5);
  memory.end();  // asks for nothing
  memory.begin(valid, 5);
  EXPECT_EQ(memory.find("lag of 60 s", {60.0}), nullptr);
  memory.keep("lag of 60 s", {60.0}, columns);
  memory.end();
  memory.begin(valid, 6);
  EXPECT_EQ(memory.find("lag of 60 s", {60.0}), nullptr) << "other bands";
  memory.keep("lag of 60 s", {60.0}, columns);
  memory.begin(valid, 7);  // the search before came to no end
  memory.end();
  memory.begin(valid, 7);
  EXPECT_EQ(memory.find("lag of 60 s", {60.0}), nullptr) << "of other bands, and never ended";
}

TEST(SearchScenario, AHiddenEffectIsFoundWithItsSizeAmongAllOthers) {
  struct Case {
    std::string name;
    std::vector<double> shape;
  };
  const double span = kPoints * kIntervalS;
  const std::vector<Case> cases{{"shupe_temperature", {1.0, span / 200.0}},
                                {"scale_factor_asymmetry", {}},
                                {"etalon_fringe", {1.0, 7.0}},
                                {"magnetic", {}},
                                {"temperature_step", {0.0, 20.0}}};
  for (std::size_t i = 0; i < cases.size(); ++i) {
    Record record(200 + i);
    const Series truth = record.hide(cases[i].name, cases[i].shape, 15.0);
    const SearchReport report = find_missing(record.problem());
    ASSERT_EQ(report.outcome, SearchOutcome::kNamed) << cases[i].name << ": " << names(report);
    ASSERT_EQ(report.effects.size(), 1u) << cases[i].name << ": " << names(report);
    const FoundEffect& found = report.effects.front();
    EXPECT_EQ(name_of(found.group), cases[i].name);
    EXPECT_TRUE(is_in_set(found, cases[i].name));
    EXPECT_GT(found.log_evidence, report.threshold_nats);
    const Series standard = test::standardised(truth);
    double projection = 0.0;
    double size = 0.0;
    for (std::size_t j = 0; j < kPoints; ++j) {
      projection += standard[j] * found.waveform[j];
      size += standard[j] * truth[j];
    }
    // 5 sigma of an amplitude known to 1/15, and a grid of shapes.
    EXPECT_NEAR(projection / size, 1.0, 0.4) << cases[i].name;
  }
}

TEST(SearchScenario, TwoEffectsOfDifferentInputsAreBothFound) {
  Record record(301);
  record.hide("scale_factor", {}, 15.0);
  record.hide("shupe", {0.0}, 20.0);
  const SearchReport report = find_missing(record.problem());
  EXPECT_EQ(report.outcome, SearchOutcome::kNamed) << names(report);
  ASSERT_EQ(report.effects.size(), 2u) << names(report);
  bool scale_factor = false;
  bool shupe = false;
  for (const FoundEffect& e : report.effects) {
    scale_factor = scale_factor || is_in_set(e, "scale_factor");
    shupe = shupe || is_in_set(e, "shupe");
  }
  EXPECT_TRUE(scale_factor) << names(report);
  EXPECT_TRUE(shupe) << names(report);
}

// A form's mismatch acts where the form does: turns about another axis have none of a turn's.
// Before, whatever explained less than 15 % of a stronger effect of its family was lost.
TEST(SearchScenario, AWeakEffectThatActsElsewhereIsNoMismatchOfAStrongOne) {
  Record record(302);
  record.hide("misalignment", {}, 100.0);
  record.hide("scale_factor", {}, 20.0);
  const SearchReport report = find_missing(record.problem());
  EXPECT_EQ(names(report), "named misalignment scale_factor");
}

TEST(SearchScenario, WhatAFormThatDiffersLeavesIsNoEffectOfItsOwn) {
  Record record(303);
  Series turns = record.chamber().rate;
  const Series temperature = record.chamber().temperature(0);
  for (std::size_t i = 0; i < turns.size(); ++i)
    turns[i] *= 1.0 + 0.2 * (temperature[i] - 25.0) / 30.0;
  record.hide(turns, 60.0);
  const SearchReport report = find_missing(record.problem());
  EXPECT_EQ(names(report), "named scale_factor");
}

TEST(SearchScenario, ABumpThatTheCatalogueLacksIsUnknownAndNamesItsInput) {
  Record record(401);
  Series bump = record.chamber().temperature(1);
  for (double& t : bump) t = std::exp(-0.5 * std::pow((t - 24.0) / 5.0, 2));
  record.hide(bump, 30.0);
  const SearchReport report = find_missing(record.problem());
  ASSERT_EQ(report.outcome, SearchOutcome::kUnknown) << names(report);
  ASSERT_TRUE(report.unknown.has_value());
  EXPECT_EQ(name_of(report.unknown->group).substr(0, 11), "spline of T") << names(report);
  EXPECT_FALSE(report.reason.empty());
}

TEST(SearchScenario, AKnownEffectOfAnotherSizeIsACorrectionAndNoNewEffect) {
  Record record(501);
  const Series known = record.hide("scale_factor", {}, 20.0);
  SearchProblem problem = record.problem();
  problem.known.push_back({"scale_factor", known, 5.0});  // the truth is a correction of 1
  const SearchReport report = find_missing(problem);
  EXPECT_EQ(report.outcome, SearchOutcome::kNothingMissing) << names(report);
  ASSERT_EQ(report.corrections.size(), 1u);
  EXPECT_TRUE(report.corrections[0].significant);
  // 5 sigma, and the standard error is 1/d.
  EXPECT_NEAR(report.corrections[0].value, 1.0, 0.25);
  EXPECT_NEAR(report.corrections[0].standard_error, 0.05, 0.015);
  const auto group =
      std::find_if(report.groups.begin(), report.groups.end(),
                   [](const GroupFinding& g) { return name_of(g.group) == "scale_factor"; });
  EXPECT_EQ(group->testability, Testability::kCollinear);
  EXPECT_EQ(group->collinear_with, "scale_factor");
}

TEST(SearchScenario, KnownNoiseKeepsAnEffectFromBeingTakenForNoise) {
  Record record(601);
  record.hide("rate_ramp", {0.0}, 12.0);
  SearchProblem problem = record.problem();
  const double freely = find_missing(problem).groups.at(10).log_evidence;
  problem.noise.known = {
      {{NoiseKind::kWhite, 0.0}, 1.0, 0.1},
      {{NoiseKind::kFlicker, 0.0}, kNoise.flicker * kNoise.flicker, 0.3},
      {{NoiseKind::kRandomWalk, 0.0}, kNoise.random_walk * kNoise.random_walk, 0.3}};
  problem.noise.unlisted = UnlistedNoise::kExcluded;
  const SearchReport report = find_missing(problem);
  EXPECT_EQ(name_of(report.groups.at(10).group), "rate_ramp");
  EXPECT_GT(report.groups.at(10).log_evidence, freely);
}

TEST(SearchScenario, DroppedSamplesAndAnOutageNeitherFeignNorHideAnEffect) {
  for (const bool effect : {false, true}) {
    Record record(701);
    if (effect) record.hide("scale_factor_asymmetry", {}, 15.0);
    for (std::size_t i = 0; i < kPoints; i += 97) record.valid[i] = 0;  // 1 %
    for (std::size_t i = 1000; i < 1075; ++i) record.valid[i] = 0;      // 10 min
    for (std::size_t i = 0; i < kPoints; ++i) {
      if (record.valid[i] == 0) record.series[i] = std::numeric_limits<double>::quiet_NaN();
    }
    const SearchReport report = find_missing(record.problem());
    EXPECT_NEAR(report.missing_share, 0.043, 0.001);
    if (!effect) {
      EXPECT_EQ(report.outcome, SearchOutcome::kNothingMissing) << names(report);
      continue;
    }
    ASSERT_EQ(report.effects.size(), 1u) << names(report);
    EXPECT_EQ(name_of(report.effects[0].group), "scale_factor_asymmetry");
    EXPECT_NEAR(report.effects[0].separation, 15.0, 4.0);  // 3 sigma of a unit normal, and 4 %
  }
}

TEST(SearchLaws, TheSmallestVisibleAmplitudeHasTheSeparationItPromises) {
  Record record(801);
  const SearchReport before = find_missing(record.problem());
  const auto of = [](const SearchReport& report) {
    return *std::find_if(report.groups.begin(), report.groups.end(),
                         [](const GroupFinding& g) { return name_of(g.group) == "magnetic"; });
  };
  const double amplitude = of(before).smallest_amplitude.value();
  const Series& field = record.chamber().field;
  for (std::size_t i = 0; i < kPoints; ++i) record.series[i] += 3.0 * amplitude * field[i];
  const SearchReport report = find_missing(record.problem());
  ASSERT_EQ(report.effects.size(), 1u) << names(report);
  // d = 24 with the same noise: 5 sigma of a unit normal.
  EXPECT_NEAR(report.effects[0].separation, 24.0, 5.0);
  EXPECT_NEAR(report.effects[0].amplitudes.at(0), 3.0 * amplitude, 5.0 / 24.0 * 3.0 * amplitude);
}

TEST(SearchLaws, ScalingTheSeriesChangesNoEvidence) {
  Record record(901);
  record.hide("magnetic", {}, 12.0);
  const SearchReport once = find_missing(record.problem());
  for (double& v : record.series) v *= 1e-7;
  const SearchReport scaled = find_missing(record.problem());
  EXPECT_EQ(names(once), names(scaled));
  for (std::size_t g = 0; g < once.groups.size(); ++g) {
    // Fits end when a quadratic model promises less than 1e-4 nats of the next step.
    EXPECT_NEAR(once.groups[g].log_evidence, scaled.groups[g].log_evidence, 0.05);
  }
}

SearchProblem tiny(const Series& series, const std::vector<std::uint8_t>& valid,
                   std::vector<Series> columns) {
  SearchProblem p;
  p.series = series;
  p.valid = valid;
  CandidateGroup g;
  g.name = "group";
  g.variants = {{}};
  g.columns = [columns = std::move(columns)](const std::vector<double>&) { return columns; };
  p.groups.push_back(std::move(g));
  return p;
}

TEST(SearchLaws, TheBestOfManyCountsForWhatShareOfThemItIs) {
  Record record(31);
  record.hide("magnetic", {}, 15.0);
  SearchProblem problem = record.problem();
  const auto at = std::find_if(problem.groups.begin(), problem.groups.end(),
                               [](const CandidateGroup& g) { return g.name == "magnetic"; });
  ASSERT_EQ(at->variants.size(), 1U);
  const auto place = static_cast<std::size_t>(at - problem.groups.begin());
  const double alone = find_missing(problem).groups[place].log_evidence;
  at->variants.front().log_prior = -std::log(1000.0);
  EXPECT_NEAR(find_missing(problem).groups[place].log_evidence, alone - std::log(1000.0), 1e-9);
  // Twice the same at half the prior is the same.
  at->variants.front().log_prior = -std::log(2.0);
  at->variants.push_back(at->variants.front());
  EXPECT_NEAR(find_missing(problem).groups[place].log_evidence, alone, 1e-9);
}

TEST(SearchAbuse, ARecordThatSaysNothingIsRefusedWithAReason) {
  const std::vector<std::uint8_t> all(200, 1);
  const std::vector<std::uint8_t> none(200, 0);
  const Series flat(200, 4.0);
  const Series noise = test::coloured_noise(200, 1.0, kNoise, 1);
  Series ramp(200);
  for (std::size_t i = 0; i < 200; ++i) ramp[i] = static_cast<double>(i);
  Series broken = noise;
  broken[17] = std::numeric_limits<double>::infinity();
  for (const SearchReport& report :
       {find_missing(tiny(flat, all, {ramp})), find_missing(tiny(noise, none, {ramp})),
        find_missing(tiny(broken, all, {ramp})),
        find_missing(tiny(Series(10, 1.0), std::vector<std::uint8_t>(10, 1), {Series(10, 2.0)}))}) {
    EXPECT_EQ(report.outcome, SearchOutcome::kRefused);
    EXPECT_FALSE(report.reason.empty());
    EXPECT_TRUE(report.effects.empty());
  }
}

TEST(SearchAbuse, ColumnsThatCanNotAnswerAreNotTestable) {
  const std::vector<std::uint8_t> all(200, 1);
  const Series noise = test::coloured_noise(200, 1.0, kNoise, 1);
  Series nan(200, 1.0);
  nan[3] = std::numeric_limits<double>::quiet_NaN();
  const auto verdict = [&](std::vector<Series> columns) {
    const SearchReport report = find_missing(tiny(noise, all, std::move(columns)));
    EXPECT_EQ(report.outcome, SearchOutcome::kNothingMissing);
    return report.groups.at(0).testability;
  };
  EXPECT_EQ(verdict({nan}), Testability::kUnusable);
  EXPECT_EQ(verdict({}), Testability::kUnusable);
  EXPECT_EQ(verdict({Series(7, 1.0)}), Testability::kUnusable);
  EXPECT_EQ(verdict({Series(200, 25.0)}), Testability::kNotExcited);
}

TEST(SearchAbuse, MoreColumnsThanDataNameNothing) {
  constexpr std::size_t kN = 20;
  const Series noise = test::coloured_noise(kN, 1.0, kNoise, 1);
  const std::vector<std::uint8_t> all(kN, 1);
  std::vector<Series> many;
  for (std::uint64_t i = 0; i < 30; ++i) {
    many.push_back(test::coloured_noise(kN, 1.0, kNoise, 100 + i));
  }
  EXPECT_NE(find_missing(tiny(noise, all, many)).outcome, SearchOutcome::kNamed);
  SearchProblem problem = tiny(noise, all, {many[0]});
  for (std::size_t i = 1; i < many.size(); ++i) problem.known.push_back({"known", many[i]});
  const SearchReport report = find_missing(problem);
  EXPECT_NE(report.outcome, SearchOutcome::kNamed);
  EXPECT_TRUE(report.outcome == SearchOutcome::kRefused ||
              report.corrections.size() == problem.known.size());
}

// Before: whoever corrected a model by a search whose joint fit failed read beside the corrections.
TEST(SearchAbuse, KnownColumnsThatAreTheSameGetACorrectionEach) {
  Record record(502);
  const Series known = record.hide("scale_factor", {}, 20.0);
  for (const std::size_t copies : {1U, 2U, 3U}) {
    SearchProblem problem = record.problem();
    problem.groups.clear();
    for (std::size_t i = 0; i < copies; ++i)
      problem.known.push_back({"copy", known, std::numeric_limits<double>::infinity()});
    const SearchReport report = find_missing(problem);
    EXPECT_NE(report.outcome, SearchOutcome::kRefused);
    EXPECT_EQ(report.corrections.size(), copies);
  }
}

TEST(SearchAbuse, CorrectionsThatBelongToOtherParametersAreRefusedInEveryBuild) {
  twin::Model model;
  EXPECT_THROW(static_cast<void>(recalibrate(model, std::vector<KnownParameter>(1), {})),
               core::BrokenPromise);
}

TEST(SearchAbuse, ContradictionsAndWrongOptionsAreNamed) {
  const std::vector<std::uint8_t> short_mask(5, 1);
  const Series noise = test::coloured_noise(50, 1.0, kNoise, 1);
  EXPECT_THROW((void)find_missing(tiny(noise, short_mask, {noise})), std::invalid_argument);
  const std::vector<std::uint8_t> all(50, 1);
  SearchProblem problem = tiny(noise, all, {noise});
  problem.groups[0].columns = nullptr;
  EXPECT_THROW((void)find_missing(problem), std::invalid_argument);
  SearchOptions options;
  options.false_alarm = 0.0;
  ASSERT_TRUE(options.validate().has_value());
  EXPECT_NE(options.validate()->find("false_alarm"), std::string::npos);
  options = {};
  options.evidence.largest_scale = 0.5;
  EXPECT_NE(options.validate()->find("evidence: largest_scale"), std::string::npos);
}

// Before: a thermometer that runs 859 s ahead had .89, where a gradient's rate was there.
TEST(FindMissing, AnAmplitudeThatCanNotBeIsNotFound) {
  Record record(31);
  const Series waveform = record.hide("shupe", record.group("shupe").variants.front().shape, 20.0);
  SearchProblem problem = record.problem();
  std::erase_if(problem.groups, [](const CandidateGroup& g) { return g.name != "shupe"; });
  CandidateGroup& group = problem.groups.front();
  const Series column = group.columns(group.variants.front().shape).front();
  const double amplitude = waveform[1000] / column[1000];
  ASSERT_GT(std::abs(amplitude), 0.0);
  const auto effects = [&](double least, double greatest) {
    group.least_amplitude = least;
    group.greatest_amplitude = greatest;
    return find_missing(problem, {}).effects.size();
  };
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(effects(-kInfinity, kInfinity), 1U);
  EXPECT_EQ(effects(std::min(0.0, 2.0 * amplitude), std::max(0.0, 2.0 * amplitude)), 1U);
  EXPECT_EQ(effects(std::min(-amplitude, 0.0), std::max(-amplitude, 0.0)), 0U);
}

}  // namespace
}  // namespace zerodrift::diagnosis
