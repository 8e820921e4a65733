// SPDX-License-Identifier: Apache-2.0
#include "common/recording/disk_writer.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "common/dds/raw_reader.h"
#include "common/mcap/mcap_reader.h"
#include "common/service/monotonic_clock.h"
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
            [](std::uint64_t refused) {
              return mcap::Pairs{{"messages_lost", std::to_string(refused)}};
            }};
  }
};

TEST_F(DiskWriterLaws, WhatComesIsInTheFileInItsOrder) {
  DiskWriter disk(writer({.file = {.out = path("all.mcap")}}));
  for (std::int64_t s = 1; s <= 5; ++s) {
    MessageBatch batch = batch_at(s);
    disk.take(batch, s * kSecondNs);
    MessageBatch not_recorded = batch_at(s, MessageRole::kPacedOnly);
    disk.take(not_recorded, s * kSecondNs);
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
  EXPECT_EQ(disk.unwritten(), 4U) << "the one that was refused and all behind it";
}

// While it lives, a file of this process may not grow beyond so many bytes: a disk with no room.
class FullDisk {
 public:
  explicit FullDisk(std::uint64_t bytes) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    handler_ = ::signal(SIGXFSZ, SIG_IGN);
    const rlimit full{.rlim_cur = bytes, .rlim_max = before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &full);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    ::signal(SIGXFSZ, handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
  sighandler_t handler_ = nullptr;
};

// What a file says and what can be counted in it: messages are numbered by their seconds.
struct ReadBack {
  bool is_whole = false;
  std::vector<std::int64_t> seconds{};
  std::int64_t lost = 0;  // by its metadata
};

ReadBack read_back(const std::filesystem::path& file) {
  if (std::filesystem::file_size(file) == 0) return {};
  ReadBack read;
  const mcap::Reader reader(file);
  read.is_whole = reader.contents().ending == mcap::Ending::kWhole;
  for (const auto& metadata : reader.contents().metadata)
    read.lost = std::stoll(std::string(mcap::value_of(metadata.values, "messages_lost")));
  read.seconds = seconds_in(file);
  return read;
}

// A disk that has room at times only, and what was made of `count` messages on it.
class DiskWithoutRoom : public DiskWriterLaws {
 protected:
  struct Outcome {
    std::vector<ReadBack> files{};
    std::int64_t recorded = 0;
    std::int64_t lost = 0;
    bool ends_with_a_file = false;
  };
  int any_of(int from, int to) { return std::uniform_int_distribution<int>(from, to)(random_); }

  Outcome record(const std::string& name, bool is_split, std::int64_t count) {
    DiskWriter disk(
        writer({.file = {.out = path(name),
                         .writer = {.compression = mcap::Compression::kNone,
                                    .chunk_bytes = static_cast<std::size_t>(any_of(100, 60'000))},
                         .split_ns = is_split ? any_of(50, 1500) * kSecondNs : 0,
                         .is_numbered = is_split,
                         .opening = any_of(0, 1) == 0 ? Opening::kAtOnce
                                                      : Opening::kWithTheFirstMessage}}));
    std::optional<FullDisk> full;
    for (std::int64_t s = 1; s <= count; ++s) {
      // The IDL alone has some 20 kB.
      if (any_of(0, 150) == 0) full.emplace(any_of(0, 3) == 0 ? 0 : any_of(0, 200'000));
      if (any_of(0, 150) == 0) full.reset();
      MessageBatch batch = batch_at(s);
      disk.take(batch, s * kSecondNs);
      // Later than any retry.
      if (any_of(0, 40) == 0) disk.look_after_disk(service::monotonic_ns() + s * 10 * kSecondNs);
    }
    Outcome outcome{.ends_with_a_file = disk.file().is_open()};
    disk.finish();
    full.reset();
    for (const auto& file : disk.file().files()) {
      outcome.files.push_back(read_back(file));
      EXPECT_EQ(outcome.files.back().is_whole, file.extension() == ".mcap") << file;
    }
    outcome.recorded = static_cast<std::int64_t>(disk.messages());
    outcome.lost = static_cast<std::int64_t>(disk.unwritten());
    return outcome;
  }

  std::mt19937 random_{1};
};

// Law: what was taken is in a file or counted as lost, wherever in a file room ends, however often,
// and whether there is room again. Whole files tell of every hole in and before them; a file that
// was cut says so itself, and none behind it tells of its holes; one without holes tells of none.
TEST_F(DiskWithoutRoom, WhatItCostsIsCountedToTheMessage) {
  std::int64_t lost = 0;
  int runs_told = 0;
  int clean_behind_cut = 0;
  for (int run = 0; run < 60; ++run) {
    SCOPED_TRACE(run);
    const std::int64_t count = any_of(1, 3000);
    const Outcome outcome = record("run" + std::to_string(run) + ".mcap", run % 3 != 0, count);
    const auto& files = outcome.files;
    std::int64_t in_files = 0;
    std::int64_t told = 0;
    std::int64_t newest = 0;  // in the files before; one that was cut tells of what is behind it
    bool any_cut = false;
    for (std::size_t i = 0; i < files.size(); ++i) {
      const ReadBack& file = files[i];
      in_files += static_cast<std::int64_t>(file.seconds.size());
      told += file.lost;
      any_cut = any_cut || !file.is_whole;
      if (file.seconds.empty()) continue;
      const bool is_behind_cut = i > 0 && !files[i - 1].is_whole;
      if (is_behind_cut) newest = file.seconds.front() - 1;
      const std::int64_t holes =
          file.seconds.back() - newest - static_cast<std::int64_t>(file.seconds.size());
      newest = file.seconds.back();
      if (!file.is_whole) continue;
      if (is_behind_cut) {
        // More, where it began without room for a message.
        EXPECT_GE(file.lost, holes) << i;
        clean_behind_cut += file.lost == 0 ? 1 : 0;
        continue;
      }
      const bool is_followed =
          i + 1 == files.size()
              ? newest == count
              : !files[i + 1].seconds.empty() && files[i + 1].seconds.front() == newest + 1;
      if (holes == 0 && is_followed) {
        EXPECT_EQ(file.lost, 0) << i;
      }
    }
    EXPECT_EQ(in_files, outcome.recorded);
    EXPECT_EQ(in_files + outcome.lost, count);
    if (!any_cut && outcome.ends_with_a_file) {
      EXPECT_EQ(told, outcome.lost);
      runs_told += told > 0 ? 1 : 0;
    }
    lost += outcome.lost;
  }
  EXPECT_GT(lost, 1000) << "nothing was tried";
  EXPECT_GT(runs_told, 2);
  EXPECT_GT(clean_behind_cut, 0);
}

}  // namespace
}  // namespace zerodrift::recording
