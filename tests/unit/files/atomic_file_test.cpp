// SPDX-License-Identifier: Apache-2.0
#include "common/files/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <csignal>
#include <functional>
#include <string>
#include <thread>

#include "common/files/file_error.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::files {
namespace {

class AtomicWriting : public ScratchFolder {};

TEST_F(AtomicWriting, AppearsWholeAtCommitAndNotBefore) {
  write("a.txt", "old");
  AtomicFile file{path("a.txt")};
  file.append("new ");
  file.append("text");
  EXPECT_EQ(content(path("a.txt")), "old");
  file.commit();
  EXPECT_EQ(content(path("a.txt")), "new text");
  EXPECT_EQ(file_count(), 1U);
}

TEST_F(AtomicWriting, WithoutCommitNothingIsLeftBehind) {
  { AtomicFile{path("a.txt")}.append("text"); }
  EXPECT_EQ(file_count(), 0U);
}

std::string refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

TEST_F(AtomicWriting, TargetThatIsAFolderIsOneErrorLineAndNoFile) {
  std::filesystem::create_directory(path("a.txt"));
  EXPECT_EQ(refusal([&] { AtomicFile{path("a.txt")}; }),
            path("a.txt").string() + ": is a folder, a disk or a socket, expected a file to write");
  EXPECT_EQ(file_count(), 1U);
}

// As root a rename would put a file in a device's place.
TEST_F(AtomicWriting, ADeviceIsWrittenStraightAndStaysADevice) {
  // Of the test's own where it could destroy the computer's.
  const bool is_root = ::mknod(path("null").c_str(), S_IFCHR | 0600, makedev(1, 3)) == 0 &&
                       ::mknod(path("full").c_str(), S_IFCHR | 0600, makedev(1, 7)) == 0;
  for (const std::string name : {"null", "full"}) {
    const std::string device = is_root ? path(name).string() : "/dev/" + name;
    AtomicFile file{device};
    file.append("text");
    EXPECT_EQ(refusal([&] { file.commit(); }),
              name == "null" ? "" : device + ": writing fails: No space left on device");
    require_writable(device);
    EXPECT_TRUE(std::filesystem::is_character_file(device)) << device;
  }
}

TEST_F(AtomicWriting, APipeIsWrittenStraight) {
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  std::string read;
  std::thread reader([&] { read = content(path("pipe")); });
  {
    AtomicFile file{path("pipe")};
    file.append("text");
    file.commit();
  }
  reader.join();
  EXPECT_EQ(read, "text");
  EXPECT_TRUE(std::filesystem::is_fifo(path("pipe")));
}

TEST_F(AtomicWriting, ALinkIsFollowedAndStaysALink) {
  write("real.txt", "old");
  std::filesystem::create_symlink("real.txt", path("link.txt"));
  AtomicFile file{path("link.txt")};
  file.append("new");
  file.commit();
  EXPECT_EQ(content(path("real.txt")), "new");
  EXPECT_TRUE(std::filesystem::is_symlink(path("link.txt")));
  EXPECT_EQ(file_count(), 2U);
}

TEST_F(AtomicWriting, BesideIsAnotherNameInTheSameFolder) {
  for (const char* target : {"a.csv", "/a", "/x/y.csv", "../y", "x/", "./.hidden", ""}) {
    std::filesystem::path expected(target);
    expected.replace_filename("b.c");
    EXPECT_EQ(beside(target, "b.c").native(), expected.native()) << target;
  }
}

TEST_F(AtomicWriting, WhatIsKeptHasANameAndReplacesNothing) {
  write("a.cut1.csv", "of an earlier one");
  AtomicFile file{path("a.csv")};
  file.append("half");
  EXPECT_EQ(file.keep(), path("a.cut2.csv"));
  EXPECT_EQ(content(path("a.cut2.csv")), "half");
  EXPECT_EQ(content(path("a.cut1.csv")), "of an earlier one");
}

TEST_F(AtomicWriting, AnEndInMidWorkLeavesNothingHalf) {
  write("a.txt", "old");
  const auto end_in_mid_work = [&] {
    AtomicFile a{path("a.txt")};
    AtomicFile b{path("b.txt")};
    a.append("half");
    end_without_unfinished_files(143);
  };
  EXPECT_EXIT(end_in_mid_work(), testing::ExitedWithCode(143), "");
  EXPECT_EQ(content(path("a.txt")), "old");
  EXPECT_EQ(file_count(), 1U);
}

// Whatever way leads to a file: outputs replace what is there.
TEST_F(AtomicWriting, AnOutputThatIsAnInputIsRefusedByWhateverName) {
  write("record.csv", "measured");
  std::filesystem::create_directory(path("folder"));
  std::filesystem::create_symlink(path("record.csv"), path("link.csv"));
  std::filesystem::create_symlink(path("folder"), path("other"));
  std::filesystem::create_hard_link(path("record.csv"), path("hard.csv"));
  const std::string record = path("record.csv");
  for (const std::filesystem::path& out :
       {path("record.csv"), path("link.csv"), path("hard.csv"), path("folder") / "../record.csv",
        path("other") / ".." / "record.csv"}) {
    EXPECT_EQ(refusal([&] {
                check_outputs({{"--config", ""}, {"--record", record}}, {{"--out", out}});
              }),
              "--out: found '" + out.string() + "', which is also --record; expected another file");
  }
  EXPECT_EQ(content(record), "measured");
  check_outputs({{"--record", record}},
                {{"--out", path("new.csv")}, {"--json", "/dev/null"}, {"--html", "/dev/null"}});
  EXPECT_FALSE(std::filesystem::exists(path("new.csv")));
}

TEST_F(AtomicWriting, TwoOutputsThatAreOneFileAreRefused) {
  std::filesystem::create_directory(path("folder"));
  EXPECT_NE(
      refusal([&] {
        check_outputs({}, {{"--json", path("new.txt")}, {"--html", path("folder") / "../new.txt"}});
      }),
      "");
}

// A file-size limit stands for the full disk: write() then fails with EFBIG.
TEST_F(AtomicWriting, FirstFailureIsRememberedUntilItIsAskedFor) {
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  {
    AtomicFile file{path("a.txt")};
    const rlimit small{1000, before.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
    file.append(std::string(2000, 'x'));
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
    file.append("would fit");
    EXPECT_THROW(file.check(), FileError);
    EXPECT_THROW(file.commit(), FileError);
  }
  std::signal(SIGXFSZ, old_handler);
  EXPECT_EQ(file_count(), 0U);
}

}  // namespace
}  // namespace zerodrift::files
