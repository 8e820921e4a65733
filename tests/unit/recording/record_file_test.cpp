// SPDX-License-Identifier: Apache-2.0
#include "common/recording/record_file.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "common/dds/raw_reader.h"
#include "common/mcap/mcap_reader.h"
#include "common/record/record_reader.h"
#include "common/recording/record_export.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::recording {
namespace {

// A flood of made-up ids must neither end a recording (an MCAP file holds 65535 channels at most)
// nor hide what came.
using RecordFileLaws = ScratchFolder;

TEST_F(RecordFileLaws, OfMoreGyrosThanChannelsEveryMessageIsKeptAndFound) {
  constexpr std::uint32_t kGyros = 70'000;
  RecordFile file({.out = path("flood.mcap")});
  for (std::uint32_t id = 1; id <= kGyros; ++id) {
    msg::AngularRate rate;
    rate.gyro_id(id);
    rate.validity(7);
    rate.sequence_number(id);
    rate.interval_s(0.01);
    rate.sensor_time_ns(1'000'000LL * id);
    const std::string payload = dds::encode(rate);
    file.write({.topic = 0,
                .gyro_id = id,
                .sequence = id,
                .log_ns = 1'000'000LL * id,
                .arrival_ns = 1'000'000LL * id,
                .publish_ns = 1'000'000LL * id,
                .payload = payload});
  }
  file.finish({});

  mcap::Reader reader(path("flood.mcap"));
  EXPECT_LT(reader.contents().channels.size(), 5000U);
  mcap::Cursor cursor(reader);
  std::uint32_t messages = 0;
  for (mcap::Message message; cursor.next(message);) ++messages;
  EXPECT_EQ(messages, kGyros);
  for (const std::uint32_t id : {1U, 4096U, 69'999U}) {
    record::RecordOptions options;
    options.gyro_id = id;
    record::RecordReader rows(path("flood.mcap"), options);
    const record::RecordRow* row = rows.next();
    ASSERT_NE(row, nullptr);
    EXPECT_EQ(row->time.count(), 1'000'000LL * id) << "gyro " << id;
  }
}

// Two recorders with one name: the second is refused, and where files have numbers and the first
// one's are there already, each has its own.
TEST_F(RecordFileLaws, OfTwoWithOneNameTheSecondIsRefusedOrHasNumbersOfItsOwn) {
  const RecordFile first({.out = path("run.mcap")});
  EXPECT_THROW(RecordFile({.out = path("run.mcap")}), mcap::FileInUse);
  const RecordFile split({.out = path("split.mcap"), .is_numbered = true});
  EXPECT_THROW(RecordFile({.out = path("split.mcap"), .is_numbered = true}), mcap::FileInUse);

  RecordFileOptions at_an_event{
      .out = path("event.mcap"), .is_numbered = true, .opening = Opening::kWithTheFirstMessage};
  RecordFile one(at_an_event);
  RecordFile other(at_an_event);
  for (RecordFile* file : {&one, &other}) file->write({.payload = "payload"});
  for (RecordFile* file : {&one, &other}) file->finish({});
  EXPECT_EQ(one.files().front(), path("event_0001.mcap"));
  EXPECT_EQ(other.files().front(), path("event_0002.mcap"));
  EXPECT_EQ(other.moved_aside(), "");
}

// What another is writing stays also where a record is made from something else.
TEST_F(RecordFileLaws, AnExportTakesNothingFromARecordingUnderWay) {
  write("rates.csv", "time_s,rate_x_deg_h\n0,1\n1,2\n");
  RecordFile recording({.out = path("run.mcap")});
  EXPECT_THROW(
      static_cast<void>(import_record({.from = {.file = path("rates.csv")}, .to = path("run.mcap")},
                                      [](double, std::uint64_t) {})),
      mcap::FileInUse);
  recording.write({.payload = "payload"});
  recording.finish({});
  EXPECT_EQ(mcap::Reader(path("run.mcap")).contents().ending, mcap::Ending::kWhole);
}

}  // namespace
}  // namespace zerodrift::recording
