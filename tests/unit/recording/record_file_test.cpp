// SPDX-License-Identifier: Apache-2.0
#include "common/recording/record_file.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "common/dds/raw_reader.h"
#include "common/mcap/mcap_reader.h"
#include "common/record/record_reader.h"
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

}  // namespace
}  // namespace zerodrift::recording
