// SPDX-License-Identifier: Apache-2.0
// What is said of a shape that nobody knows.
#include "common/diagnosis/unknown_effect.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

namespace zerodrift::diagnosis {
namespace {

// Of a function of a temperature that goes from 0 to 48 °C, about its mean.
std::string words_of(const std::function<double(double)>& shape) {
  constexpr std::size_t kPoints = 4801;
  InputChannel channel{.name = "temperature_coil", .unit = "°C"};
  std::vector<double> waveform;
  double mean = 0.0;
  for (std::size_t i = 0; i < kPoints; ++i) {
    channel.values.push_back(0.01 * static_cast<double>(i));
    waveform.push_back(shape(channel.values.back()));
    mean += waveform.back() / static_cast<double>(kPoints);
  }
  for (double& value : waveform) value -= mean;
  return dependence_in_words({channel.name}, waveform, {channel});
}

double bump(double x, double at) {
  return std::exp(-0.25 * (x - at) * (x - at));
}

// The means are of 24 bins, 2 °C wide: a bump at the middle of one is told by it.
TEST(UnknownEffectScenario, ACurveIsToldByItsBendsOrTheEndThatItGrowsTo) {
  EXPECT_EQ(words_of([](double x) { return bump(x, 11.0); }), "bump at 11 °C in temperature_coil");
  EXPECT_EQ(words_of([](double x) { return bump(x, 11.0) - 0.8 * bump(x, 37.0); }),
            "bumps at 11 and 37 °C in temperature_coil");
  EXPECT_EQ(words_of([](double x) { return bump(x, 11.0) + 0.2 * bump(x, 37.0); }),
            "bump at 11 °C in temperature_coil");
  EXPECT_EQ(words_of([](double x) { return -bump(x, 11.0) + bump(x, 25.0) - bump(x, 41.0); }),
            "bumps at 11, 25 and 41 °C in temperature_coil");
  EXPECT_EQ(words_of([](double x) { return x * x; }), "grows towards 47 °C in temperature_coil");
  EXPECT_EQ(words_of([](double x) { return -x; }).substr(0, 14), "grows towards ");
}

TEST(UnknownEffectScenario, WhatSeveralInputsMakeIsToldByTheirNames) {
  EXPECT_EQ(dependence_in_words({"rate", "supply"}, {}, {}),
            "something that depends on rate, supply");
}

TEST(UnknownEffectAbuse, AShapeThatIsNothingIsStillASentence) {
  EXPECT_EQ(words_of([](double) { return 1.0; }).substr(0, 1), "g");
}

}  // namespace
}  // namespace zerodrift::diagnosis
