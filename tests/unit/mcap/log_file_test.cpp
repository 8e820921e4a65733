// SPDX-License-Identifier: Apache-2.0
#include "common/mcap/log_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

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
