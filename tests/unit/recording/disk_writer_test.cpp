// SPDX-License-Identifier: Apache-2.0
#include "common/recording/disk_writer.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "common/dds/raw_reader.h"
#include "common/mcap/mcap_reader.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::recording {
namespace {

constexpr std::int64_t kSecondNs = 1'000'000'000;

// A rate of one gyro that arrives at `second`, or a trigger then.
MessageBatch batch_at(std::int64_t second, MessageRole role = MessageRole::kPlain) {
  msg::AngularRate rate;
  rate.gyro_id(1);
  rate.validity(7);
  rate.sequence_number(static_cast<std::uint64_t>(second));
  rate.interval_s(0.01);
  rate.sensor_time_ns(second * kSecondNs);
  const std::string payload = dds::encode(rate);
  MessageBatch batch;
  batch.append({.topic = 0,
                .gyro_id = 1,
                .sequence = static_cast<std::uint64_t>(second),
                .log_ns = second * kSecondNs,
                .arrival_ns = second * kSecondNs,
                .publish_ns = second * kSecondNs,
                .role = role,
                .payload = payload});
  return batch;
}

std::vector<std::int64_t> seconds_in(const std::string& file) {
  mcap::Reader reader(file);
  mcap::Cursor cursor(reader);
  std::vector<std::int64_t> seconds;
  for (mcap::Message message; cursor.next(message);)
    seconds.push_back(static_cast<std::int64_t>(message.log_time_ns) / kSecondNs);
  return seconds;
}

struct DiskWriterLaws : ScratchFolder {
  std::vector<std::string> refusals;

  DiskWriter writer(const DiskWriterOptions& options) {
    return {options, [this](const std::string& line) { refusals.push_back(line); },
            [] { return mcap::Pairs{}; }};
  }
};

TEST_F(DiskWriterLaws, WhatComesIsInTheFileInItsOrder) {
  DiskWriter disk(writer({.file = {.out = path("all.mcap")}}));
  for (std::int64_t s = 1; s <= 5; ++s) {
    MessageBatch batch = batch_at(s);
    disk.take(batch, s * kSecondNs);
    disk.look_after_disk(s * kSecondNs);
  }
  disk.finish();
  EXPECT_EQ(seconds_in(path("all.mcap")), (std::vector<std::int64_t>{1, 2, 3, 4, 5}));
  EXPECT_EQ(disk.messages(), 5U);
  EXPECT_EQ(disk.unwritten(), 0U);
  EXPECT_FALSE(disk.has_failed());
}

// Law: of a pre-trigger recording the file begins the stated time before the trigger and ends the
// stated time after it; a second trigger makes a second file.
TEST_F(DiskWriterLaws, ATriggerTakesWhatWasBeforeAndWhatComesAfter) {
  DiskWriter disk(writer({.file = {.out = path("fault.mcap"),
                                   .is_numbered = true,
                                   .opening = Opening::kWithTheFirstMessage},
                          .pre_trigger_s = 3.0,
                          .post_trigger_s = 2.0}));
  for (std::int64_t s = 1; s <= 30; ++s) {
    if (s == 10 || s == 25) {
      MessageBatch trigger = batch_at(s, MessageRole::kTrigger);
      disk.take(trigger, s * kSecondNs);
    }
    MessageBatch batch = batch_at(s);
    disk.take(batch, s * kSecondNs);
  }
  disk.finish();
  EXPECT_EQ(seconds_in(path("fault_0001.mcap")), (std::vector<std::int64_t>{7, 8, 9, 10, 11, 12}));
  EXPECT_EQ(seconds_in(path("fault_0002.mcap")),
            (std::vector<std::int64_t>{22, 23, 24, 25, 26, 27}));
}

// A folder that can't be written to: told in a line, counted by message, and nothing is thrown.
TEST_F(DiskWriterLaws, ADiskThatRefusesIsToldAndWhatIsNotWrittenIsCounted) {
  DiskWriter disk(
      writer({.file = {.out = path("gone/all.mcap"), .opening = Opening::kWithTheFirstMessage}}));
  std::filesystem::remove_all(path("gone"));
  for (std::int64_t s = 1; s <= 4; ++s) {
    MessageBatch batch = batch_at(s);
    disk.take(batch, s * kSecondNs);
  }
  EXPECT_TRUE(disk.has_failed());
  ASSERT_EQ(refusals.size(), 1U) << "once, until it is tried again";
  EXPECT_NE(refusals.front().find("gone"), std::string::npos) << refusals.front();
  EXPECT_EQ(disk.unwritten(), 3U) << "all behind the one that was refused";
}

}  // namespace
}  // namespace zerodrift::recording
