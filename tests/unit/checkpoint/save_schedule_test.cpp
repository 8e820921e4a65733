// SPDX-License-Identifier: Apache-2.0
#include "common/checkpoint/save_schedule.h"

#include <gtest/gtest.h>

#include <random>

namespace zerodrift::checkpoint {
namespace {

using namespace std::chrono_literals;
using Model = SaveSchedule::Model;
using News = SaveSchedule::News;

constexpr std::int64_t kSecond = 1000000000;

std::vector<std::uint32_t> ids(const std::vector<Model>& models) {
  std::vector<std::uint32_t> found;
  for (const Model& model : models) found.push_back(model.gyro_id);
  return found;
}

TEST(SaveSchedule, TakesEachChangedModelOnceAPeriod) {
  SaveSchedule schedule(60s);
  EXPECT_TRUE(schedule.take_due(std::vector<Model>{{1, 0}}, 100 * kSecond).empty());
  const std::vector<Model> first{{1, 5}, {2, 0}, {3, 7}};
  EXPECT_EQ(ids(schedule.take_due(first, 101 * kSecond)), (std::vector<std::uint32_t>{1, 3}));
  EXPECT_TRUE(schedule.take_due(first, 102 * kSecond).empty());  // they are being saved
  EXPECT_EQ(schedule.saved({1, 5}), News::kNone);
  EXPECT_EQ(schedule.saved({3, 7}), News::kNone);
  const std::vector<Model> second{{1, 6}, {2, 1}, {3, 7}};
  // 2 has learned for the first time; 1 was saved in this period.
  EXPECT_EQ(ids(schedule.take_due(second, 110 * kSecond)), (std::vector<std::uint32_t>{2}));
  schedule.saved({2, 1});
  EXPECT_EQ(ids(schedule.take_due(second, 160 * kSecond)), (std::vector<std::uint32_t>{1}));
}

// The fault: with the queue of requests full, a gyro counted as saved and never was.
TEST(SaveSchedule, WhatNobodyHadTimeForIsDueAtOnce) {
  SaveSchedule schedule(60s);
  const std::vector<Model> models{{1, 5}, {2, 5}};
  ASSERT_EQ(schedule.take_due(models, 100 * kSecond).size(), 2U);
  for (const Model& model : models) schedule.put_off(model);
  EXPECT_EQ(schedule.take_due(models, 100 * kSecond + 1).size(), 2U);
}

// The fault: a disk that was full when a model was saved last lost it until it changed again.
TEST(SaveSchedule, WhatFailedIsTriedAgainEachPeriodAndToldOnce) {
  SaveSchedule schedule(60s);
  const std::vector<Model> models{{1, 5}};
  ASSERT_EQ(schedule.take_due(models, 100 * kSecond).size(), 1U);
  EXPECT_EQ(schedule.failed({1, 5}), News::kFails);
  EXPECT_TRUE(schedule.take_due(models, 159 * kSecond).empty());
  ASSERT_EQ(schedule.take_due(models, 160 * kSecond).size(), 1U);
  EXPECT_EQ(schedule.failed({1, 5}), News::kNone);
  ASSERT_EQ(schedule.take_due(models, 220 * kSecond).size(), 1U);
  EXPECT_EQ(schedule.saved({1, 5}), News::kWorksAgain);
  EXPECT_TRUE(schedule.take_due(models, 280 * kSecond).empty());
}

// The fault: what was forgotten by command was there again after a process that ended within a
// minute.
TEST(SaveSchedule, WhatWasCommandedIsDueAtOnceThoughOfThisPeriodOneIsSavedOrBeingSaved) {
  for (const bool is_being_saved : {false, true}) {
    SaveSchedule schedule(60s);
    ASSERT_EQ(schedule.take_due(std::vector<Model>{{1, 5}}, 100 * kSecond).size(), 1U);
    if (!is_being_saved) schedule.saved({1, 5});
    schedule.commanded(1);
    if (is_being_saved) schedule.saved({1, 5});
    EXPECT_TRUE(schedule.take_due(std::vector<Model>{{1, 5}}, 101 * kSecond).empty());
    EXPECT_EQ(schedule.take_due(std::vector<Model>{{1, 6}}, 102 * kSecond).size(), 1U);
    schedule.saved({1, 6});
    EXPECT_TRUE(schedule.take_due(std::vector<Model>{{1, 7}}, 103 * kSecond).empty());
  }
}

TEST(SaveSchedule, WhatWasResumedFromIsNotSavedAgain) {
  SaveSchedule schedule(60s);
  schedule.resumed({1, 5});
  EXPECT_TRUE(schedule.take_due(std::vector<Model>{{1, 5}}, 100 * kSecond).empty());
  EXPECT_EQ(schedule.take_due(std::vector<Model>{{1, 6}}, 101 * kSecond).size(), 1U);
}

// Rule: whatever fails, is put off or changes meanwhile, once all works for two periods every model
// is saved as it is, and none is saved twice at a time.
TEST(SaveScheduleLaws, InTheEndEveryModelIsSaved) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    std::mt19937_64 random(seed);
    SaveSchedule schedule(10s);
    std::vector<Model> models;
    for (std::uint32_t id = 1; id <= 20; ++id) models.push_back({id, 0});
    std::vector<std::uint64_t> on_disk(21, 0);
    std::vector<Model> open;
    std::int64_t now = 100 * kSecond;
    for (int step = 0; step < 400; ++step, now += kSecond / 4) {
      const bool all_works = step >= 300;
      if (!all_works) models[random() % models.size()].epoch += random() % 3;
      for (const Model& model : schedule.take_due(models, now)) {
        for (const Model& other : open) ASSERT_NE(other.gyro_id, model.gyro_id) << seed;
        open.push_back(model);
      }
      while (!open.empty() && (all_works || random() % 2 == 0)) {
        const Model model = open.back();
        open.pop_back();
        const auto fate = all_works ? 0 : random() % 3;
        if (fate == 0) {
          on_disk[model.gyro_id] = model.epoch;
          schedule.saved(model);
        } else if (fate == 1) {
          schedule.failed(model);
        } else {
          schedule.put_off(model);
        }
      }
    }
    for (const Model& model : models)
      ASSERT_EQ(on_disk[model.gyro_id], model.epoch) << "seed " << seed;
  }
}

}  // namespace
}  // namespace zerodrift::checkpoint
