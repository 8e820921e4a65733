// SPDX-License-Identifier: Apache-2.0
#include "common/record/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <string>

#include "common/record/record_error.h"
#include "tests/unit/record/scratch_folder.h"

namespace zerodrift::record {
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

TEST_F(AtomicWriting, TargetThatIsAFolderIsOneErrorLineAndNoFile) {
  std::filesystem::create_directory(path("a.txt"));
  std::string line;
  try {
    AtomicFile file{path("a.txt")};
    file.commit();
  } catch (const RecordError& error) {
    line = error.what();
  }
  EXPECT_EQ(line, path("a.txt").string() + ": cannot take this name: Is a directory");
  EXPECT_EQ(file_count(), 1U);
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
    EXPECT_THROW(file.check(), RecordError);
    EXPECT_THROW(file.commit(), RecordError);
  }
  std::signal(SIGXFSZ, old_handler);
  EXPECT_EQ(file_count(), 0U);
}

}  // namespace
}  // namespace zerodrift::record
