// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/options.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <utility>

#include "common/compensation/compensator.h"

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
      {"learning.label_interval_s", [](auto& o) { o.learning.label_interval_s = 0.0; }},
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
      {"temperature_delay_s", [=](auto& o) { o.temperature_delay_s = nan; }},
      {"temperature_stale_s", [](auto& o) { o.temperature_stale_s = 0.0; }},
      {"probe_stuck_s", [](auto& o) { o.probe_stuck_s = -5.0; }},
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

// Rule: names go out on the interface and differ from each other.
TEST(Mode, EveryModeReasonAndRungHasItsOwnName) {
  std::vector<std::string_view> names;
  for (std::uint8_t i = 0; i <= 4; ++i) names.push_back(name(static_cast<core::Mode>(i)));
  for (std::uint8_t i = 1; i <= 15; ++i) names.push_back(name(static_cast<core::Reason>(i)));
  for (std::uint8_t i = 1; i <= 3; ++i) names.push_back(name(static_cast<core::Rung>(i)));
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::adjacent_find(names.begin(), names.end()), names.end());
  EXPECT_EQ(std::find(names.begin(), names.end(), "unknown"), names.end());
}

}  // namespace
}  // namespace zerodrift::compensation
