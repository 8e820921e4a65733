// SPDX-License-Identifier: Apache-2.0
#include "common/mcap/log_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <thread>
#include <vector>

#include "common/mcap/mcap_error.h"

namespace zerodrift::mcap {
namespace {

namespace fs = std::filesystem;

class LogFileLaws : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  static std::string content(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }
  fs::path folder_ =
      fs::temp_directory_path() / ("zerodrift-log-file-" + std::to_string(::getpid()));
};

TEST_F(LogFileLaws, HasItsNameOnlyWhenItIsWhole) {
  const fs::path target = folder_ / "run.mcap";
  LogFile file(target);
  file.append("one");
  EXPECT_FALSE(fs::exists(target));
  EXPECT_EQ(content(folder_ / "run.mcap.active"), "one");
  file.append("two");
  file.commit();
  EXPECT_EQ(content(target), "onetwo");
  EXPECT_FALSE(fs::exists(folder_ / "run.mcap.active"));
}

TEST_F(LogFileLaws, WhatAnUnfinishedOneLeftIsMovedAsideAndNeverLost) {
  const fs::path target = folder_ / "run.mcap";
  { LogFile(target).append("first"); }
  {
    LogFile second(target);
    EXPECT_EQ(second.moved_aside(), folder_ / "run.cut1.mcap");
    second.append("second");
  }
  LogFile third(target);
  EXPECT_EQ(third.moved_aside(), folder_ / "run.cut2.mcap");
  EXPECT_EQ(content(folder_ / "run.cut1.mcap"), "first");
  EXPECT_EQ(content(folder_ / "run.cut2.mcap"), "second");
}

// Law: a file that is being written is nobody else's, whatever is in it so far; the one that came
// second changes nothing.
TEST_F(LogFileLaws, OneThatIsBeingWrittenIsRefusedToAnother) {
  const fs::path target = folder_ / "run.mcap";
  LogFile first(target);
  for (const char* so_far : {"", "one"}) {
    first.append(so_far);
    try {
      LogFile second(target);
      ADD_FAILURE() << "taken with '" << so_far << "' in it";
    } catch (const McapError& error) {
      EXPECT_NE(std::string(error.what()).find("run.mcap.active: another process is writing it"),
                std::string::npos)
          << error.what();
    }
    EXPECT_EQ(content(folder_ / "run.mcap.active"), so_far);
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
  first.commit();
  EXPECT_EQ(content(target), "one");
  LogFile(target).append("of the next");
}

// Many threads, one name: each file has what one of them wrote, and none is lost or moved aside.
TEST_F(LogFileLaws, OfManyThatWantANameAtOnceEachHasItAlone) {
  const fs::path target = folder_ / "run.mcap";
  std::atomic<int> written{0};
  std::vector<std::thread> writers;
  for (int writer = 0; writer < 4; ++writer) {
    writers.emplace_back([&] {
      for (int round = 0; round < 200; ++round) {
        try {
          LogFile file(target);
          EXPECT_EQ(file.moved_aside(), "");
          file.append("one");
          EXPECT_EQ(content(folder_ / "run.mcap.active"), "one");
          file.commit();
          ++written;
        } catch (const FileInUse&) {
        }
      }
    });
  }
  for (auto& writer : writers) writer.join();
  EXPECT_GT(written, 0);
  EXPECT_EQ(content(target), "one");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

// Law: only what was written here takes the name.
TEST_F(LogFileLaws, AFileThatWasExchangedDoesNotTakeTheName) {
  const fs::path target = folder_ / "run.mcap";
  LogFile file(target);
  file.append("mine");
  fs::rename(folder_ / "run.mcap.active", folder_ / "elsewhere");
  EXPECT_THROW(file.commit(), McapError);
  std::ofstream(folder_ / "run.mcap.active") << "another's";
  EXPECT_THROW(file.commit(), McapError);
  EXPECT_FALSE(fs::exists(target));
  EXPECT_EQ(content(folder_ / "run.mcap.active"), "another's");
  EXPECT_EQ(content(folder_ / "elsewhere"), "mine");
}

TEST_F(LogFileLaws, WhatIsNoFileUnderTheActiveNameIsMovedAside) {
  const fs::path target = folder_ / "run.mcap";
  fs::create_directory(folder_ / "run.mcap.active");
  EXPECT_EQ(LogFile(target).moved_aside(), folder_ / "run.cut1.mcap");
  fs::remove(folder_ / "run.mcap.active");
  fs::create_symlink("nowhere", folder_ / "run.mcap.active");
  EXPECT_EQ(LogFile(target).moved_aside(), folder_ / "run.cut2.mcap");
  EXPECT_TRUE(fs::is_symlink(folder_ / "run.cut2.mcap"));
  EXPECT_FALSE(fs::exists(folder_ / "nowhere"));
  fs::remove(folder_ / "run.mcap.active");
  ASSERT_EQ(::mkfifo((folder_ / "run.mcap.active").c_str(), 0600), 0);
  EXPECT_EQ(LogFile(target).moved_aside(), folder_ / "run.cut3.mcap");
}

TEST_F(LogFileLaws, AFolderThatIsNotThereIsOneLine) {
  try {
    LogFile file(folder_ / "none" / "run.mcap");
    FAIL();
  } catch (const McapError& error) {
    EXPECT_NE(std::string(error.what()).find("cannot create a file in its folder"),
              std::string::npos);
  }
}

TEST_F(LogFileLaws, AFullDiskIsToldByName) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  fs::create_symlink("/dev/full", folder_ / "full");
  // The device takes the .active name's place: opening it anew fails, as O_EXCL wants.
  EXPECT_THROW(LogFile(folder_ / "full"), McapError);
}

}  // namespace
}  // namespace zerodrift::mcap
