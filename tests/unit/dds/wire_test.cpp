// SPDX-License-Identifier: Apache-2.0
// What other vendors and recorded files rely on: the layout of the plain types and every number
// that stands for a name. A change here is a change of the interface.
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "common/core/mode.h"
#include "common/core/samples.h"
#include "common/dds/topics.h"

namespace zerodrift::dds {
namespace {

template <typename Message>
class PlainType : public testing::Test {};
using PlainTypes = testing::Types<msg::AngularRate, msg::RateReference, msg::CompensatedRate>;
TYPED_TEST_SUITE(PlainType, PlainTypes);

// Fast DDS takes a type for plain even where the compiler pads it, and then sends wrong fields.
TYPED_TEST(PlainType, HasNoPadding) {
  EXPECT_EQ(sizeof(TypeParam), TypeParam::getMaxCdrSerializedSize());
}

TYPED_TEST(PlainType, IsOnTheWireWhatItIsInMemory) {
  std::array<unsigned char, sizeof(TypeParam)> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<unsigned char>(i * 7 + 1);
  TypeParam message;
  std::memcpy(static_cast<void*>(&message), bytes.data(), bytes.size());

  typename TopicOf<TypeParam>::TypeSupport type;
  constexpr std::size_t kEncapsulation = 4;
  eprosima::fastrtps::rtps::SerializedPayload_t payload(
      static_cast<std::uint32_t>(sizeof(TypeParam) + kEncapsulation));
  ASSERT_TRUE(type.serialize(&message, &payload));
  ASSERT_EQ(payload.length, sizeof(TypeParam) + kEncapsulation);
  EXPECT_EQ(std::memcmp(payload.data + kEncapsulation, &message, sizeof(TypeParam)), 0);
}

template <typename Enum>
using Numbered = std::vector<std::pair<Enum, std::uint32_t>>;

template <typename Enum>
void expect_numbers(const Numbered<Enum>& pinned) {
  for (const auto& [value, number] : pinned) EXPECT_EQ(static_cast<std::uint32_t>(value), number);
}

// Number and name of each, and that no number lies beyond.
template <typename Enum>
void expect_names(const std::vector<std::string>& names) {
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(core::name(static_cast<Enum>(i)), names[i]);
  }
  EXPECT_EQ(core::name(static_cast<Enum>(names.size())), "unknown");
}

TEST(WireNumbers, OfModesArePinned) {
  using core::Mode;
  expect_numbers<Mode>({{Mode::kPassthrough, 0},
                        {Mode::kLearning, 1},
                        {Mode::kFrozen, 2},
                        {Mode::kFallback, 3},
                        {Mode::kOutOfDomain, 4},
                        {Mode::kHolding, 5}});
  expect_names<Mode>({"passthrough", "learning", "frozen", "fallback", "out_of_domain", "holding"});
}

TEST(WireNumbers, OfReasonsArePinned) {
  using core::Reason;
  expect_numbers<Reason>({{Reason::kNone, 0},
                          {Reason::kNoEstimateYet, 1},
                          {Reason::kInitialSet, 2},
                          {Reason::kMotion, 3},
                          {Reason::kEarthRateUnknown, 4},
                          {Reason::kLevelImplausible, 5},
                          {Reason::kCommanded, 6},
                          {Reason::kTemperatureMissing, 7},
                          {Reason::kTemperatureStale, 8},
                          {Reason::kProbeStuck, 9},
                          {Reason::kRateNotReady, 10},
                          {Reason::kModelWorseThanBias, 11},
                          {Reason::kOutsideLearned, 12},
                          {Reason::kInvalidInput, 13},
                          {Reason::kSchemeNone, 14},
                          {Reason::kSettling, 15},
                          {Reason::kPolarityReversed, 16}});
  expect_names<Reason>({"none", "no_estimate_yet", "initial_set", "motion", "earth_rate_unknown",
                        "level_implausible", "commanded", "temperature_missing",
                        "temperature_stale", "probe_stuck", "temperature_rate_not_ready",
                        "model_worse_than_bias", "outside_learned", "invalid_input", "scheme_none",
                        "settling", "polarity_reversed"});
}

TEST(WireNumbers, OfRungsArePinned) {
  using core::Rung;
  expect_numbers<Rung>({{Rung::kNone, 0},
                        {Rung::kFactoryPolynomial, 1},
                        {Rung::kStationaryBias, 2},
                        {Rung::kOnlineSvr, 3},
                        {Rung::kPrior, 4},
                        {Rung::kStack, 5}});
  expect_names<Rung>(
      {"none", "factory_polynomial", "stationary_bias", "online_svr", "prior", "stack"});
}

TEST(WireNumbers, OfClocksAndReferencesArePinned) {
  using core::ClockSource;
  using core::ReferenceKind;
  expect_numbers<ClockSource>({{ClockSource::kUnknown, 0},
                               {ClockSource::kHardware, 1},
                               {ClockSource::kHost, 2},
                               {ClockSource::kReplay, 3},
                               {ClockSource::kSimulation, 4}});
  expect_numbers<ReferenceKind>({{ReferenceKind::kNone, 0},
                                 {ReferenceKind::kRest, 1},
                                 {ReferenceKind::kRateTable, 2},
                                 {ReferenceKind::kRecord, 3},
                                 {ReferenceKind::kNavigationResidual, 4}});
}

}  // namespace
}  // namespace zerodrift::dds
