// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/options.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include "common/compensation/compensator.h"
#include "common/compensation/option_keys.h"
#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

// Rule: the defaults are usable, and need the coil's temperature.
TEST(CompensationOptions, DefaultsAreUsableAndNeedTheCoil) {
  const CompensationOptions options;
  EXPECT_EQ(options.validate(), std::nullopt);
  EXPECT_EQ(options.probes(), std::vector<std::string>{"coil"});
}

// Rule: a wrong value is refused at construction with one line that begins with its key.
TEST(CompensationOptions, AWrongValueIsRefusedByItsKey) {
  using Spoil = std::function<void(CompensationOptions&)>;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::pair<std::string, Spoil> cases[] = {
      {"learning.label_interval_s", [](auto& o) { o.learning.label_interval_s = -1.0; }},
      {"learning.handover_s", [=](auto& o) { o.learning.handover_s = nan; }},
      {"learning.confirm_s", [](auto& o) { o.learning.confirm_s = -1.0; }},
      {"svr.epsilon", [](auto& o) { o.model.epsilon = -0.1; }},
      {"svr.box_constraint", [=](auto& o) { o.model.box_constraint = nan; }},
      {"svr.gamma", [](auto& o) { o.model.kernel.gamma = 0.0; }},
      {"svr.degree",
       [](auto& o) {
         o.model.kernel = {regression::KernelKind::kPolynomial, 0.03, 0, 1.0};
       }},
      {"svr.offset",
       [=](auto& o) {
         o.model.kernel = {regression::KernelKind::kPolynomial, 0.03, 2, nan};
       }},
      {"svr.capacity", [](auto& o) { o.model.capacity = 3; }},
      {"learning.scale_factor: found with reference.truth: refuse",
       [](auto& o) {
         o.learning.scale_factor = true;
         o.reference.truth = ReferencePolicy::kRefuse;
       }},
      {"learning.scale_factor: found with reference.navigation_residual: accept",
       [](auto& o) {
         o.learning.scale_factor = true;
         o.reference.navigation_residual = ReferencePolicy::kAccept;
       }},
      {"temperature_delay_s", [=](auto& o) { o.temperature_delay_s = nan; }},
      {"temperature_stale_s", [](auto& o) { o.temperature_stale_s = 0.0; }},
      {"probe_stuck_s", [](auto& o) { o.probe_stuck_s = -5.0; }},
      {"probe_stuck_s: found 1e+06, expected at most 999940 where there is more than one probe",
       [](auto& o) {
         o.probe_stuck_s = 1e6;
         o.more_probes = {"case"};
       }},
  };
  for (const auto& [key, spoil] : cases) {
    CompensationOptions options;
    spoil(options);
    const auto line = options.validate();
    ASSERT_TRUE(line) << key;
    EXPECT_EQ(line->substr(0, key.size()), key);
    EXPECT_THROW(Compensator{options}, std::invalid_argument) << key;
  }
}

// Rule: one probe alone is compared with no other, so that no history has to reach back so far.
TEST(CompensationOptions, OfOneProbeAloneAnySpanWithoutAChangeIsTaken) {
  CompensationOptions options;
  options.probe_stuck_s = 1e6;
  EXPECT_EQ(options.validate(), std::nullopt);
  options.more_probes = {"case"};
  options.probe_stuck_s = 999940.0;
  EXPECT_EQ(options.validate(), std::nullopt);
  EXPECT_NO_THROW(TemperatureInputs(options, 0.0));
}

// Sets the number that it sees as its `index`-th to a value in SI.
class SetOneNumber : public OptionTextVisitor {
 public:
  SetOneNumber(std::size_t index, double value) : index_(index), value_(value) {}
  std::string key;  // of that number; empty where there are not so many

  void number(const OptionKey& own, double& value) override {
    if (is_it(own)) value = value_ * own.si_per_unit;
  }
  void number(const OptionKey& own, std::optional<double>& value) override {
    if (is_it(own)) value = value_ * own.si_per_unit;
  }
  void numbers(const OptionKey& own, std::vector<double>& values) override {
    if (own.only_if_given || !is_it(own)) return;
    values = {0.0, value_ * own.si_per_unit};
  }

 private:
  void see(const OptionKey&, const std::string&) override {}
  bool is_it(const OptionKey& own) {
    if (own.internal || own.refused || seen_++ != index_) return false;
    key = own.name;
    return true;
  }
  std::size_t index_;
  double value_;
  std::size_t seen_ = 0;
};

// Rule: what validate() takes, a compensator takes, and answers a sample with a number: so what
// `config show` shows is what the service starts with.
TEST(CompensationOptions, WhatIsValidMakesACompensatorThatAnswers) {
  const testing::Record record = testing::make_record({.rate_hz = 5.0, .duration_s = 60.0});
  std::size_t taken = 0;
  for (const double value :
       {-1e300, -1e9, -1.0, -1e-300, 0.0, 1e-300, 1e-9, 0.3, 1.0, 1e6, 1e9, 1e12, 1e300}) {
    for (std::size_t index = 0;; ++index) {
      CompensationOptions options;
      options.features.push_back({.kind = thermal::FeatureKind::kLaggedTemperature,
                                  .probe = "coil",
                                  .lag_s = 60.0,
                                  .scale = 10.0});
      SetOneNumber set(index, value);
      describe(options, set);
      if (set.key.empty()) break;
      if (options.validate()) continue;
      ++taken;
      SCOPED_TRACE(set.key + ": " + exact_text(value));
      std::optional<Compensator> compensator;
      ASSERT_NO_THROW(compensator.emplace(options));
      for (const auto& answer : testing::run(*compensator, record))
        ASSERT_TRUE(std::isfinite(answer.rate_radps[0])) << core::seconds(answer.raw.time);
    }
  }
  EXPECT_GT(taken, 100U);
}

// Rule: probes are named once, in order of first use, both sides of a difference included.
TEST(CompensationOptions, ProbesAreNamedOnceInOrderOfFirstUse) {
  CompensationOptions options;
  options.features = {
      {.kind = thermal::FeatureKind::kProbeDifference, .probe = "outer", .second_probe = "inner"},
      {.kind = thermal::FeatureKind::kPulseMean},
      {.kind = thermal::FeatureKind::kTemperature, .probe = "inner"},
      {.kind = thermal::FeatureKind::kTemperature, .probe = "case"}};
  EXPECT_EQ(options.probes(), (std::vector<std::string>{"outer", "inner", "case"}));
}

std::string all_values(const CompensationOptions& options) {
  std::string text;
  for (const Decides decides : {Decides::kModel, Decides::kAnswers}) {
    for (const auto& [key, value] : option_values(options, decides))
      text += key + '=' + value + '\n';
  }
  return text;
}

// Rule: for samples as near as a usual label, or an interval that is none, an open label interval
// is 5 s and nothing else changes.
TEST(CompensationOptions, ForFastSamplesOnlyTheOpenLabelIntervalGetsItsValue) {
  CompensationOptions usual;
  usual.learning.label_interval_s = 5.0;
  for (const double interval_s :
       {0.0, 0.005, 1.0, 5.0, -1.0, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
    const auto own = CompensationOptions{}.for_samples_every(interval_s);
    EXPECT_EQ(own.learning.label_interval_s, 5.0) << interval_s;
    EXPECT_EQ(all_values(own), all_values(usual)) << interval_s;
  }
}

// Rule: samples further apart than a usual label make labels of one sample each, and all that spans
// several samples spans so many of these.
TEST(CompensationOptions, ForSlowSamplesWhatSpansSeveralIsAsLongAsThatTakes) {
  const auto own = CompensationOptions{}.for_samples_every(60.0);
  EXPECT_GT(own.learning.label_interval_s, 30.0);
  EXPECT_LT(own.learning.label_interval_s, 60.0);
  EXPECT_GE(own.track.local_polynomial.window_s, 60.0 * 6);
  for (const double longest_s :
       {own.track.local_polynomial.max_gap_s, own.temperature_stale_s, own.track.history_max_gap_s})
    EXPECT_GE(longest_s, 2 * 60.0);
  EXPECT_EQ(own.validate(), std::nullopt);
}

// Rule: what is given holds, at any spacing; and asked twice, the answer is the same.
TEST(CompensationOptions, AGivenLabelIntervalHoldsAtAnySpacing) {
  CompensationOptions given;
  given.learning.label_interval_s = 7.0;
  for (const double interval_s : {0.01, 60.0, 1e3})
    EXPECT_EQ(given.for_samples_every(interval_s).learning.label_interval_s, 7.0);
  const auto once = CompensationOptions{}.for_samples_every(60.0);
  EXPECT_EQ(once.learning.label_interval_s,
            once.for_samples_every(0.005).learning.label_interval_s);
}

// Rule: names go out on the interface and differ from each other.
TEST(Mode, EveryModeReasonAndRungHasItsOwnName) {
  std::vector<std::string_view> names;
  for (std::uint8_t i = 0; i <= 4; ++i) names.push_back(name(static_cast<core::Mode>(i)));
  for (std::uint8_t i = 1; i < core::kReasons; ++i)
    names.push_back(name(static_cast<core::Reason>(i)));
  for (std::uint8_t i = 1; i <= 3; ++i) names.push_back(name(static_cast<core::Rung>(i)));
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::adjacent_find(names.begin(), names.end()), names.end());
  EXPECT_EQ(std::find(names.begin(), names.end(), "unknown"), names.end());
}

}  // namespace
}  // namespace zerodrift::compensation
