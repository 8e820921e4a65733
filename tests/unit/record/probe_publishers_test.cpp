// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/unit/record/record_folder.h"
#include "tests/unit/record/recording.h"

namespace zerodrift::record {
namespace {

class ProbePublishers : public RecordFolder {};

// Before: a gyro's own thermometer and one of the computer with its name were one column of steps,
// without a word.
TEST_F(ProbePublishers, TwoOfAProbeAtOnceAreTold) {
  for (const bool is_second : {false, true}) {
    Recording recording;
    for (std::uint64_t k = 0; k < 100; ++k) {
      const double time_s = 1.0 + 0.1 * static_cast<double>(k);
      recording.add(1, rate_at(time_s, k));
      auto reading = reading_at(time_s, "case", 30.0);
      reading.sequence = k < 50 ? 20 + k : k - 50;  // its publisher is started again
      recording.add(1, reading);
      if (!is_second || k % 10 != 7) continue;
      reading = reading_at(time_s + 0.02, "case", 25.0);
      reading.sequence = 3 + k / 10;
      recording.add(1, reading);
    }
    RecordReader reader{recording.write_to(path("a.mcap"))};
    while (reader.next() != nullptr) {
    }
    ASSERT_EQ(reader.warnings().size(), is_second ? 1U : 0U);
    if (!is_second) continue;
    EXPECT_NE(reader.warnings()[0].find("two publishers gave temperatures of probe 'case'"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace zerodrift::record
